"""Curves of a result at one state, and their derivatives along given directions of it: outputs by name.

The formulas of the results run on complex arrays as on real ones, every direction being one of the times.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np

from ...equations.tree import retract
from ...results.health import Health
from ...results.mobility import Mobility
from ...results.result import Result
from ...tables.values import Values
from ..assembly.start import Assembly
from ..compiled import compiled
from ..mobility import mobility
from .derivatives import STEP, State
from .loads import derivative

GROUP = 400  # numbers up to which curves are differentiated by each of them at once
PARTS = 32  # that a group of them is split into
CHUNK = 64  # directions that are looked at together


def snapshot(x: State, values: Values | None = None) -> Result:
    """The state as a result with one time; one can go on from it."""
    result = _result(x, values or x.c.values, *(np.zeros((1, n)) for n in _sizes(x)))
    x.c.at(x.t, x.q, x.v)
    rows = x.c.work.rows
    health = result.health
    health.violation = float(np.abs(rows.value).max(initial=0.0))
    health.velocity_violation = float(np.abs(x.c.sparse_jacobian() @ x.v - rows.nu).max(initial=0.0))
    health.late = {"mobility": partial(_mobility, x)}
    result.final = (x.t, x.y)
    return result


def _mobility(x: State) -> Mobility:
    model = x.c.structure.model
    base = compiled(model, parameters=x.c.parameters)
    q, v = base.take(x.c, x.t, x.q, x.v)
    return mobility(model, Assembly(base, x.t, q, v))


def slopes(x: State, names: Sequence[str], d: Sequence[np.ndarray], values: Values | None = None) -> np.ndarray:
    """Derivatives of curves along directions, (directions, names).

    Parameters
    ----------
    x : State
    names : sequence of str
        Sensors, or curves of the result such as ``"slider.x"``.
    d : four arrays (directions, nv), (.., nv), (.., nv), (.., multipliers)
        Changes of positions along the velocities, of velocities, accelerations and multipliers.
    values : Values, optional
        The mechanism's numbers, already a complex step along a parameter (for one direction).
    """
    result = _result(x, values or x.c.values, *(1j * STEP * np.asarray(part) for part in d))
    return np.array([derivative(result.curve(name)[1]) for name in names]).T.reshape(len(d[0]), len(names))


def gradients(x: State, names: Sequence[str]) -> Any:
    """Derivatives of curves by everything, sparse (names, 3 nv + multipliers): positions, velocities, and so on.

    A curve depends on few of many numbers. They are looked for in groups, taken along random ways: groups that change
    nothing are left, others are parted.
    """
    import scipy.sparse as sp

    ends = np.cumsum(_sizes(x))
    random = np.random.default_rng(0).uniform(1.0, 2.0, ends[-1])
    groups = [np.arange(ends[-1])] if ends[-1] > GROUP else []
    single = np.arange(0 if groups else ends[-1])
    while groups:
        smaller = [part for g in groups for part in np.array_split(g, min(PARTS, len(g)))]
        felt = (_along(x, names, smaller, random) != 0.0).sum(axis=1).tolist()
        left = [g for g, some in zip(smaller, felt, strict=True) if some]
        single = np.r_[single, [g[0] for g in left if len(g) == 1]].astype(int)
        groups = [g for g in left if len(g) > 1]
    single = np.sort(single)
    found = _along(x, names, [single[k : k + 1] for k in range(len(single))], np.ones(ends[-1]))
    columns, of = np.nonzero(found)
    return sp.csr_matrix((found[columns, of], (of, single[columns])), shape=(len(names), ends[-1]))


def _along(x: State, names: Sequence[str], groups: Sequence[np.ndarray], weights: np.ndarray) -> np.ndarray:
    """Derivatives of curves along all numbers of each group together, (groups, names)."""
    ends = np.cumsum(_sizes(x))
    out = [np.zeros((0, len(names)))]
    for first in range(0, len(groups), CHUNK):
        some = groups[first : first + CHUNK]
        ways = np.zeros((len(some), ends[-1]))
        for k, g in enumerate(some):
            ways[k, g] = weights[g]
        out.append(slopes(x, names, np.split(ways, ends[:-1], axis=1)))
    return np.concatenate(out)


def over_time(
    motion: Result, names: Sequence[str], values: Values, d: tuple[np.ndarray, ...], z: np.ndarray
) -> np.ndarray:
    """Derivatives of curves of a motion by a parameter, (n, names).

    Parameters
    ----------
    motion : Result
    names : sequence of str
        Sensors, or curves of the result.
    values : Values
        The mechanism's numbers, a complex step along the parameter.
    d : four arrays (n, nv), (n, nv), (n, nv), (n, multipliers)
        Changes of positions along the velocities, of velocities, accelerations and multipliers.
    z : ndarray (n, states)
        Changes of works.
    """
    dq, dv, da, dlam = (1j * STEP * part for part in d)
    q = motion.q.T.astype(complex)
    retract(values.system, q, dq.T)
    now = (np.ascontiguousarray(q.T), motion.v + dv, motion.states + 1j * STEP * z)
    r = Result(motion.model, values, motion.t, *now, motion.vdot + da, motion.multipliers + dlam, motion.health)
    r.wound = motion.wound
    return derivative(np.array([r.curve(name)[1] for name in names])).T


def _sizes(x: State) -> tuple[int, int, int, int]:
    n = len(x.v)
    return n, n, n, len(x.lam) + len(x.c.structure.prescribed)


def _result(x: State, values: Values, dq: np.ndarray, dv: np.ndarray, da: np.ndarray, dlam: np.ndarray) -> Result:
    """A result whose times are the state with changes."""
    n = len(dq)
    q = np.repeat(x.q[:, None], n, axis=1).astype(dq.dtype)
    retract(values.system, q, dq.T)
    first = values.structure.tables["tree"].v
    efforts = [x.effort[first[b]] for b in values.structure.prescribed.values()]
    z = np.repeat(x.z[None], n, axis=0)
    lam = np.r_[x.lam, efforts] + dlam
    health = Health(True, "one state", 0.0, 0.0, 0, 0, 0, 0, 0.0)
    t = np.full(n, x.t)
    return Result(values.structure.model, values, t, np.ascontiguousarray(q.T), x.v + dv, z, x.vdot + da, lam, health)
