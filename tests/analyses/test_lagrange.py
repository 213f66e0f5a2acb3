"""Lagrange's equations from the energies alone, by complex steps, beside the recursive Newton-Euler algorithm.

The energies are those of `total_momentum`, run on complex numbers. Local coordinates x of a position q0 are
displacements along the velocities: q0 (1, x / 2) for a quaternion, whose angular velocity is (x' - x x x' / 2) /
(1 + x.x / 4). At x = 0 the forces along x are those along the velocities.
"""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb
from flyball.engine.batch_dynamics import MOMENTUM, perform_at_state
from flyball.engine.entry_point import zero_work
from flyball.engine.recursive_dynamics import tree_dynamics
from flyball.kinematics.recursive_methods import _NO_FRAME, _batch_arrays
from flyball.math.vec import quaternion_product
from flyball.tables.table_definitions import FREE, TREE_NQ
from tests.contract.zoo import CASES, joined, two_bodies

H = 1e-30


class Energies:
    """Energies of a prepared mechanism in local coordinates about a position."""

    def __init__(self, p: fb.Prepared, q: np.ndarray) -> None:
        self.x, self.q = p._recursive, q
        s, S = self.x.structure, self.x.system
        self.work = zero_work(s, S, np.dtype(complex))
        self.tree = tree_dynamics(len(S.tree.parent), s.nq, s.nv, complex)
        self.turns = [(k, d + 3 * int(S.tree.joint[self.x.paths.body[d]] == FREE)) for k, d in self.x.quaternions]

    def state(self, x: np.ndarray, rate: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Coordinates and velocities of the mechanism."""
        q, v = self.q.astype(complex), np.array(rate, complex)
        plain = self.x.entries >= 0
        q[self.x.entries[plain]] += x[plain]
        for k, d in self.turns:
            a, b = x[d : d + 3], rate[d : d + 3]
            q[k : k + 4] = quaternion_product(q[k : k + 4], (1.0, *(a / 2)))
            v[d : d + 3] = (b - np.cross(a, b) / 2) / (1 + a @ a / 4)
        return q, v

    def lagrangian(self, x: np.ndarray, rate: np.ndarray) -> complex:
        """Kinetic less potential energy."""
        q, v = self.state(x, rate)
        batch = _batch_arrays([q[None], v[None]], [np.zeros((1, 1, 11), complex)], _NO_FRAME)
        perform_at_state(self.x.system, self.work, self.x.paths, self.tree, batch, 0, MOMENTUM)
        return batch.first[0, 0, 9] - batch.first[0, 0, 10]

    def forces(self, v: np.ndarray, a: np.ndarray) -> np.ndarray:
        """d/dt dL/dx' - dL/dx at x = 0, where x' = v and v' = a."""
        unit, zero = np.eye(len(v)), np.zeros(len(v))
        twice = a - self.state(1j * H * v, v)[1].imag / H  # x'' = a less the change of the map from x' to v

        def momentum(x: np.ndarray, rate: np.ndarray) -> np.ndarray:  # L is quadratic in x': exact
            return np.array([self.lagrangian(x, rate + e) - self.lagrangian(x, rate - e) for e in unit]) / 2

        changing = momentum(zero, twice) - momentum(zero, zero) + momentum(1j * H * v, v).imag / H
        return changing.real - np.array([self.lagrangian(1j * H * e, v).imag for e in unit]) / H


def check(p: fb.Prepared) -> None:
    rng = np.random.default_rng(4)
    q = p.step(p.q, rng.normal(size=len(p.v)))
    v, a = rng.normal(size=(2, len(p.v)))
    tau = p.rnea(q, v, a)
    np.testing.assert_allclose(Energies(p, q).forces(v, a), tau, atol=1e-11 * np.abs(tau).max(initial=1.0))


@pytest.mark.parametrize(("where", "name"), CASES)
def test_joints(where, name):
    """Every joint between two bodies of which one is free; joints that are no tree joints leave both free."""
    check(joined(where, name).prepare(coordinates="joint"))


def test_every_kind_of_tree_joint_occurs():
    prepared = [joined(where, name).prepare(coordinates="joint") for where, name in CASES]
    m = two_bodies("space")
    m.add(fb.Body("point", mass=2, inertia=0))
    prepared.append(m.prepare(coordinates="joint"))
    check(prepared[-1])
    assert {int(k) for p in prepared for k in p._recursive.system.tree.joint} == set(range(len(TREE_NQ)))
