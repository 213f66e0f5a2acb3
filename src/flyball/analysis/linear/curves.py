"""Curves of a result at one state, and their derivatives along given directions of it: outputs by name.

The formulas of the results run on complex arrays as on real ones, every direction being one of the times.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from ...equations.tree import retract
from ...results.health import Health
from ...results.mobility import Mobility
from ...results.result import Result
from ...tables.system import G_VALUE, NU, V0
from ...tables.values import Values
from ..assembly.start import Assembly
from ..compiled import compiled
from ..mobility import mobility
from .derivatives import STEP, State
from .loads import derivative


def snapshot(x: State, values: Values | None = None) -> Result:
    """The state as a result with one time; one can go on from it."""
    result = _result(x, values or x.c.values, *(np.zeros((1, n)) for n in _sizes(x)))
    x.c.at(x.t, x.q, x.v)
    row = x.c.work.row
    health = result.health
    health.violation = float(np.abs(row[G_VALUE]).max(initial=0.0))
    health.velocity_violation = float(np.abs(x.c.sparse_jacobian() @ x.v - row[NU]).max(initial=0.0))
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
    body_i = values.structure.tables["body_i"]
    efforts = [x.effort[body_i[b, V0]] for b in values.structure.prescribed.values()]
    z = np.repeat(x.z[None], n, axis=0)
    lam = np.r_[x.lam, efforts] + dlam
    health = Health(True, "one state", 0.0, 0.0, 0, 0, 0, 0, 0.0)
    t = np.full(n, x.t)
    return Result(values.structure.model, values, t, np.ascontiguousarray(q.T), x.v + dv, z, x.vdot + da, lam, health)
