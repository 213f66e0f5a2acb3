"""Chains that stand out level from a wall with friction in their hinges, let go: who slides is decided along them.

What one hinge does to another falls by a factor of some four from link to link, by 1e-30 along fifty.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import lsq_linear

import flyball as fb

MASS, INERTIA, LENGTH, G = 0.2, 2e-4, 0.1, 9.81


def cantilever(n: int, mu: float, radius: float) -> fb.Mechanism:
    m = fb.Mechanism("cantilever", planar=True, gravity=(0, -G))
    before = "ground"
    for i in range(n):
        m.add(fb.Body(f"link{i}", mass=MASS, inertia=INERTIA, position=((i + 0.5) * LENGTH, 0)))
        m.add(fb.Revolute(f"hinge{i}", before, f"link{i}", at=(i * LENGTH, 0)))
        m.add(fb.JointFriction(f"rub{i}", f"hinge{i}", static=mu, radius=radius))
        before = f"link{i}"
    return m


def by_hand(n: int, mu: float, radius: float) -> np.ndarray:
    """Angular accelerations of a level chain at rest, by Gauss's principle: of all torques t within their bounds c,

    those with the least t A t / 2 + b t, A t + b being the relative accelerations. The bounds c = mu r |F| follow the
    forces F of the hinges; they are found by relaxed fixed-point iteration.
    """
    heights = LENGTH * (np.tril(np.ones((n, n)), -1) + 0.5 * np.eye(n))  # of the mass centres, by angles
    relative = np.eye(n) - np.eye(n, k=-1)
    M = MASS * heights.T @ heights + INERTIA * np.eye(n)
    weight = -MASS * G * heights.sum(axis=0)
    A, b = relative @ np.linalg.solve(M, relative.T), relative @ np.linalg.solve(M, weight)
    W, c = np.linalg.cholesky(A).T, np.zeros(n)
    for _ in range(2000):
        d = np.maximum(c, 1e-30)
        t = d * lsq_linear(W * d, -np.linalg.solve(W.T, b), (-1, 1), method="bvls", tol=1e-14).x
        alpha = np.linalg.solve(M, weight + relative.T @ t)
        new = mu * radius * np.abs(np.triu(np.ones((n, n))) @ (MASS * (heights @ alpha + G)))
        if np.abs(new - c).max() < 1e-12 * new.max():
            return alpha
        c += 0.3 * (new - c)
    raise AssertionError("no fixed point")


@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
@pytest.mark.parametrize(
    ("n", "mu", "radius"),
    [(5, 0.2, 0.02), (5, 0.5, 0.3), (8, 0.9, 0.3), (26, 0.2, 0.02), (26, 0.3, 0.05), (37, 0.1, 0.02), (50, 0.3, 0.02)],
)
def test_chain_begins_to_fall_as_by_hand(n, mu, radius, coordinates):
    r = cantilever(n, mu, radius).simulate(1e-9, outputs=2, coordinates=coordinates)
    alpha = [float(r[f"link{i}"].angular_acceleration[0]) for i in range(n)]
    np.testing.assert_allclose(alpha, by_hand(n, mu, radius), atol=1e-6 * G / LENGTH)


@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
@pytest.mark.parametrize("n", [5, 26, 50])
def test_chain_that_friction_holds_stays(n, coordinates):
    """What is beyond hinge k weighs W and acts at the arm (n - k) L / 2: mu r W holds it where mu r exceeds the arm."""
    r = cantilever(n, 0.5, 1.01 * n * LENGTH).simulate(0.1, outputs=3, coordinates=coordinates)
    assert max(np.abs(r[f"hinge{i}"].angle).max() for i in range(n)) < 1e-12


def test_what_is_not_found_is_not_said_not_to_be():
    """Accelerations exist here (`by_hand`); the search of the motion's loads may miss them, and must say no more."""
    by_hand(12, 0.5, 0.3)
    try:
        cantilever(12, 0.5, 0.3).simulate(1e-6, outputs=2)
    except fb.SimulationError as e:
        assert "or the iteration did not converge to them" in str(e)
