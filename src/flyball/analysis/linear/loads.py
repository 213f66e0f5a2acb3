"""What multipliers do to the equations of motion besides G^T lam: joint friction follows the reactions of its joint.

In r = M vdot - f - G^T lam the forces f then depend on lam, so that dr/dlam = -G^T + F. F is found by a complex step of
each multiplier that presses on a joint with friction.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...equations.residual import residual_kernel
from ...equations.scratch import work
from ...errors import ModelError
from ...numerics.rank import parts
from ...tables.specs import Structure
from ...tables.system import System, Work, with_numbers
from ..compiled import Compiled

if TYPE_CHECKING:
    from .derivatives import State

STEP = 1e-40
FREE = 1e-8  # singular values of rows of unit size below this part of the largest are none
FELT = 1e-9  # part of its largest entry below which F leaves a self-stress alone


def derivative(x: np.ndarray) -> np.ndarray:
    """By what carries a complex step, of numbers that followed it.

    The third order leaves STEP^2 / 6 of the third derivative: of a law without a slope, such as a cube at 0, too.
    """
    found = np.imag(x) / STEP
    return np.where(np.abs(found) <= STEP, 0.0, found)


def pressing(s: Structure) -> np.ndarray:
    """The rows whose multipliers some friction depends on."""
    terms = s.tables["load_terms"].term if s.loads else np.zeros(0, int)
    return np.unique(s.tables["terms"].row[terms[terms >= 0] % len(s.terms)])


def as_complex(system: System) -> System:
    """The same tables in complex numbers."""
    return with_numbers(system, lambda _, x: x.astype(complex))


def complex_tables(c: Compiled) -> tuple[System, Work]:
    """Tables and scratch in complex numbers."""
    system = as_complex(c.values.system)
    return system, work(c.structure, system, complex)


def by_reactions(x: State, system: System, W: Work) -> np.ndarray:
    """F, what is added to -G^T in the derivatives of r by the multipliers, (nv, rows).

    Parameters
    ----------
    x : State
    system, W : System, Work
        Its tables and scratch in complex numbers.
    """
    s = x.c.structure
    nv, nr = s.nv, len(s.rows)
    out = np.zeros((nv, nr))
    width = nv + 3 * nr + 3 * len(s.measured)
    steps, found = np.zeros((1, 3 * nv + 1), complex), np.zeros((1, width), complex)
    y, vdot = x.y.astype(complex), x.vdot.astype(complex)
    rows = pressing(s)
    for k in rows.tolist():
        lam = x.lam.astype(complex)
        lam[k] += 1j * STEP
        residual_kernel(system, W, complex(x.t), y, vdot, lam, steps, found)
        out[:, k] = derivative(found[0, :nv])
    if len(rows):
        x.c.at(x.t, x.q, x.v)
        G = x.c.jacobian()
        out[:, rows] += G[rows].T
        out[:, np.abs(out).max(axis=0) <= FELT * np.abs(G).max(initial=0.0)] = 0.0
    return out


def feels(x: State, system: System, W: Work) -> bool:
    """Whether the equations of motion depend on the multipliers by more than -G^T; arguments as `by_reactions`."""
    s = x.c.structure
    nv, nr = s.nv, len(s.rows)
    random = np.random.default_rng(0).uniform(1.0, 2.0, nr)
    steps = np.zeros((1, 3 * nv + 1), complex)
    found = np.zeros((1, nv + 3 * nr + 3 * len(s.measured)), complex)
    y, vdot, lam = x.y.astype(complex), x.vdot.astype(complex), x.lam + 1j * STEP * random
    residual_kernel(system, W, complex(x.t), y, vdot, lam, steps, found)
    x.c.at(x.t, x.q, x.v)
    G = x.c.sparse_jacobian()
    left = derivative(found[0, :nv]) + G.T @ random
    return bool((np.abs(left) > FELT * (abs(G).T @ random)).any())


def refuse_undetermined(s: Structure, G: np.ndarray, F: np.ndarray) -> None:
    """Refuse friction under reactions that redundancy leaves open: what it does then depends on what nobody knows.

    Parameters
    ----------
    s : Structure
    G : ndarray (rows, nv)
        Constraint rows, turns counted in lengths.
    F : ndarray (nv, rows)

    Raises
    ------
    ModelError
        Naming the frictions.
    """
    size = np.maximum(np.sqrt((G * G).sum(axis=1)), 1e-300)
    free = parts(G / size[:, None], FREE).dependencies / size[:, None]
    if not free.size or not np.abs(F @ free).max(initial=0.0) > FREE * np.abs(F).max() * np.abs(free).max():
        return
    names = [e.name for e in s.loads if np.abs(free[s.slices[e.joint]]).max(initial=0.0) > FREE * np.abs(free).max()]  # type: ignore[attr-defined]
    raise ModelError(
        f"the friction of {', '.join(names)} depends on reactions that redundant constraints leave undetermined, so "
        f"there are no linear equations; take the redundancy out (m.mobility() names it)"
    )
