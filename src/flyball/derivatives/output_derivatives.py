"""Output curves at one state, and their derivatives along given directions or by all state variables.

Outputs are named like the curves of a result. The formulas of the results accept complex arrays: each direction is
treated as one of the times. Outputs that redundant constraints leave undetermined (reactions that a self-stress
changes) are refused.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np

from ..assembly.assembled_state import Assembly
from ..assembly.compiled_mechanism import compile_mechanism
from ..engine.kinematics import retract
from ..errors import ModelError
from ..mobility.mobility import mobility
from ..mobility.null_spaces import CHANGE_TOLERANCE, scaled_jacobian
from ..numerics.rank import null_spaces
from ..results.health import Health
from ..results.mobility import Mobility
from ..results.result import Result
from ..tables.values import Values
from .equation_derivatives import COMPLEX_STEP, MechanismState, complex_step_derivative
from .linearized_equations import minimum_norm_solution, prescribed_rows

DIRECT_LIMIT = 400  # up to so many variables curves are differentiated by each of them
SUBGROUPS = 32  # number of parts that a group of variables is split into
DIRECTIONS_AT_ONCE = 64  # directions per evaluation


def snapshot(x: MechanismState, values: Values | None = None) -> Result:
    """Result with the state as its only time; a simulation can start from it."""
    result = _result_at_state(x, values or x.c.values, *(np.zeros((1, n)) for n in _block_sizes(x)))
    x.c.at(x.t, x.q, x.v)
    rows = x.c.work.rows
    health = result.health
    health.violation = float(np.abs(rows.value).max(initial=0.0))
    health.velocity_violation = float(np.abs(x.c.sparse_jacobian() @ x.v - rows.nu).max(initial=0.0))
    health.late = {"mobility": partial(_mobility, x)}
    result.final = (x.t, x.y)
    return result


def _mobility(x: MechanismState) -> Mobility:
    model = x.c.structure.model
    base = compile_mechanism(model, parameters=x.c.parameters)
    q, v = base.take(x.c, x.t, x.q, x.v)
    return mobility(model, Assembly(base, x.t, q, v))


def curve_derivatives(
    x: MechanismState, names: Sequence[str], d: Sequence[np.ndarray], values: Values | None = None
) -> np.ndarray:
    """Derivatives of curves along directions, (directions, names).

    Parameters
    ----------
    x : MechanismState
    names : sequence of str
        Sensors, or curves of the result such as ``"slider.x"``.
    d : arrays (directions, nv), (.., nv), (.., nv), (.., multipliers), (.., nz)
        Changes of positions along the velocities, of velocities, accelerations and multipliers, and, if given, of
        controller states.
    values : Values, optional
        The mechanism's values, already with a complex step of a parameter (for one direction).
    """
    result = _result_at_state(x, values or x.c.values, *(1j * COMPLEX_STEP * np.asarray(part) for part in d))
    return np.array([complex_step_derivative(result.curve(name)[1]) for name in names]).T.reshape(len(d[0]), len(names))


def curve_gradients(x: MechanismState, names: Sequence[str]) -> Any:
    """Derivatives of curves by all state variables, sparse (names, 3 nv + multipliers + nz).

    The columns are positions, velocities, accelerations, multipliers and efforts, and controller states. A curve
    depends on few of many variables. They are found by bisection: groups of variables are tested along random
    directions, groups without influence are dropped, the others are split.
    """
    import scipy.sparse as sp

    ends = np.cumsum(_block_sizes(x))
    random = np.random.default_rng(0).uniform(1.0, 2.0, ends[-1])
    groups = [np.arange(ends[-1])] if ends[-1] > DIRECT_LIMIT else []
    single = np.arange(0 if groups else ends[-1])
    while groups:
        smaller = [part for g in groups for part in np.array_split(g, min(SUBGROUPS, len(g)))]
        felt = (_group_derivatives(x, names, smaller, random) != 0.0).sum(axis=1).tolist()
        left = [g for g, some in zip(smaller, felt, strict=True) if some]
        single = np.r_[single, [g[0] for g in left if len(g) == 1]].astype(int)
        groups = [g for g in left if len(g) > 1]
    single = np.sort(single)
    found = _group_derivatives(x, names, [single[k : k + 1] for k in range(len(single))], np.ones(ends[-1]))
    columns, of = np.nonzero(found)
    return sp.csr_matrix((found[columns, of], (of, single[columns])), shape=(len(names), ends[-1]))


def _group_derivatives(
    x: MechanismState, names: Sequence[str], groups: Sequence[np.ndarray], weights: np.ndarray
) -> np.ndarray:
    """Derivatives of curves along one direction per group of variables, (groups, names)."""
    ends = np.cumsum(_block_sizes(x))
    out = [np.zeros((0, len(names)))]
    for first in range(0, len(groups), DIRECTIONS_AT_ONCE):
        some = groups[first : first + DIRECTIONS_AT_ONCE]
        ways = np.zeros((len(some), ends[-1]))
        for k, g in enumerate(some):
            ways[k, g] = weights[g]
        out.append(curve_derivatives(x, names, np.split(ways, ends[:-1], axis=1)))
    return np.concatenate(out)


def curve_derivatives_over_time(
    motion: Result, names: Sequence[str], values: Values, d: tuple[np.ndarray, ...], z: np.ndarray
) -> np.ndarray:
    """Derivatives of curves of a motion by a parameter, (n, names).

    Parameters
    ----------
    motion : Result
    names : sequence of str
        Sensors, or curves of the result.
    values : Values
        The mechanism's values with a complex step of the parameter.
    d : four arrays (n, nv), (n, nv), (n, nv), (n, multipliers)
        Changes of positions along the velocities, of velocities, accelerations and multipliers.
    z : ndarray (n, states)
        Changes of the works (integral states).
    """
    dq, dv, da, dlam = (1j * COMPLEX_STEP * part for part in d)
    q = motion.q.T.astype(complex)
    retract(values.system, q, dq.T)
    now = (np.ascontiguousarray(q.T), motion.v + dv, motion.states + 1j * COMPLEX_STEP * z)
    r = Result(motion.model, values, motion.t, *now, motion.vdot + da, motion.multipliers + dlam, motion.health)
    r.wound = motion.wound
    return complex_step_derivative(np.array([r.curve(name)[1] for name in names])).T


def _block_sizes(x: MechanismState) -> tuple[int, ...]:
    n = len(x.v)
    return n, n, n, len(x.lam) + len(x.c.structure.prescribed), len(x.c.structure.controls)


def _result_at_state(
    x: MechanismState,
    values: Values,
    dq: np.ndarray,
    dv: np.ndarray,
    da: np.ndarray,
    dlam: np.ndarray,
    dz: np.ndarray | None = None,
) -> Result:
    """Result whose times are copies of the state, each with one of the changes."""
    n = len(dq)
    q = np.repeat(x.q[:, None], n, axis=1).astype(dq.dtype)
    retract(values.system, q, dq.T)
    first = values.structure.tables["tree"].v
    efforts = [x.effort[first[b]] for b in values.structure.prescribed.values()]
    z = np.repeat(x.z[None], n, axis=0)
    if dz is not None and dz.shape[1]:
        z = z.astype(dz.dtype)
        z[:, : dz.shape[1]] += dz
    lam = np.r_[x.lam, efforts] + dlam
    health = Health(True, "one state", 0.0, 0.0, 0, 0, 0, 0, 0.0)
    t = np.full(n, x.t)
    return Result(values.structure.model, values, t, np.ascontiguousarray(q.T), x.v + dv, z, x.vdot + da, lam, health)


def depend_on_reactions(x: MechanismState, names: Sequence[str]) -> bool:
    """Whether any of the curves depends on reactions of joints or efforts of drivers."""
    n = len(x.lam) + len(x.c.structure.prescribed)
    still = np.zeros((n, x.c.structure.nv))
    return bool(np.any(curve_derivatives(x, names, (still, still, still, np.eye(n))))) if names and n else False


def refuse_undetermined_outputs(x: MechanismState, names: Sequence[str]) -> None:
    """Refuse curves that depend on multipliers which redundant constraints leave undetermined.

    Parameters
    ----------
    x : MechanismState
    names : sequence of str
        Sensors, or curves of the result.

    Raises
    ------
    ModelError
        With the name of the first such curve and of the redundant elements.
    """
    import scipy.sparse as sp

    s = x.c.structure
    if not names or not len(s.rows):
        return
    x.c.at(x.t, x.q, x.v)
    own, size, scale = scaled_jacobian(x.c)
    size = np.maximum(np.r_[size, scale[prescribed_rows(x.c).argmax(axis=1)]], 1e-300)
    G = sp.vstack([own, prescribed_rows(x.c)]).tocsr()
    free = (null_spaces(G)[1] / size[:, None]).T
    if not len(free):
        return
    still = np.zeros((len(free), s.nv))
    by = np.abs(curve_derivatives(x, names, (still, still, still, free))).max(axis=0)
    shot = snapshot(x)
    for name, effect in zip(names, by, strict=True):
        if effect > CHANGE_TOLERANCE * _force_effect(x, shot, name):
            raise _undetermined_error(x, name, np.abs(free * size).max(axis=0))


def refuse_undetermined_outputs_sparse(x: MechanismState, names: Sequence[str], C: Any) -> None:
    """Like `refuse_undetermined_outputs`, for a large mechanism.

    A curve is determined if its derivatives by the multipliers are G times some motion. ``C`` (names, 3 nv + rows) are
    the derivatives of the curves by all state variables.
    """
    x.c.at(x.t, x.q, x.v)
    G, size, _ = scaled_jacobian(x.c)
    for k, name in enumerate(names):
        by = C[[k], 3 * G.shape[1] :].toarray()[0] / np.maximum(size, 1e-300)
        left = np.abs(by - G @ minimum_norm_solution(G, by)) if by.any() else by
        most = left.max(initial=0.0)
        if most > CHANGE_TOLERANCE * min(1.0, x.c.values.length) and most > CHANGE_TOLERANCE * _force_effect(
            x, snapshot(x), name
        ):
            raise _undetermined_error(x, name, left / most)


def _force_effect(x: MechanismState, shot: Result, name: str) -> float:
    """Estimate of the largest change of a curve by one unit of force."""
    return x.c.values.length if "m" in shot.curve(name)[0] else 1.0


def _undetermined_error(x: MechanismState, name: str, part: np.ndarray) -> ModelError:
    """The error that names the elements whose constraints take part in the dependency."""
    of = [r.element.name for r in x.c.structure.rows] + list(x.c.structure.prescribed)
    among = dict.fromkeys(n for n, p in zip(of, part, strict=False) if p > CHANGE_TOLERANCE)
    return ModelError(
        f"{name!r} is not determined: redundant constraints ({', '.join(among)}) leave it undetermined: rigid-body "
        "mechanics does not determine how the load is shared. Choose other quantities, or remove the redundancy: "
        "m.mobility() names it"
    )
