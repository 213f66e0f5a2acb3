"""The operating point of a linearisation: a state of expressions or numbers.

Equations can be linearised about an equilibrium, or about a motion with constant velocities that looks the same at all
times (in joint coordinates, for example a governor at constant speed).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...assembly.compiled_mechanism import compile_mechanism
from ...derivatives.linear_reduction import product
from ...errors import ModelError
from ...expression_graph.evaluation import evaluate, jacobian, substitute
from ...expression_graph.graph import Node, zero_objects
from ...model.body import Initial
from ...model.expressions import number as number_of
from ...model.messages import listing, suggest
from ...numerics.rank import RANK_TOLERANCE
from ...tables.forest import tree_joint_steps
from ...tables.law_inputs import initial_controller_states
from ..explicit.linear_systems import is_zero, nominal_value, nominal_values, solve_equations
from .derivatives import TracedMechanism

CONSISTENCY_TOLERANCE = 1e-9  # relative difference below which velocities are equal


def joint_velocities(m: TracedMechanism, q: Sequence[tuple[Node, Any]]) -> list[Any]:
    """Velocities (nv,) that give the described velocities of bodies; zero where none are described.

    Parameters
    ----------
    m : TracedMechanism
        The mechanism in joint coordinates.
    q : sequence of (symbol, expression)
        The position.

    Raises
    ------
    ModelError
        If the tree joints do not allow them.
    """
    nv = len(m.names)
    wanted, has = [], []
    for name, b in m.values.structure.place.items():
        told = m.values.bodies[name]
        if b >= 0 and not all(is_zero(x) for x in (*told.v, *told.w)):
            wanted += [*told.w, *told.v]
            has += [*m.x.work.bodies.angular_velocity[b], *m.x.work.bodies.velocity[b]]
    if not wanted:
        return m.values.v.tolist()
    nodes = [m.graph.node(x) for x in has]
    J = jacobian(nodes, m.x.v)
    A = zero_objects(*J.shape)
    A.ravel()[:] = substitute(list(J.ravel()), q)
    right = zero_objects(len(wanted), 1)
    right[:, 0] = wanted
    rows, columns = _independent(nominal_values(A) * m.scale), _independent(nominal_values(A).T)
    v = zero_objects(nv, 1)
    v[columns] = solve_equations(A[np.ix_(rows, columns)], right[rows])
    missed = nominal_values(product(A, v)) - nominal_values(right)
    if np.abs(missed).max() > CONSISTENCY_TOLERANCE * np.abs(nominal_values(right)).max():
        raise ModelError(
            f"the joints of {m.model.name!r} do not allow the given velocities of its bodies; give "
            "at=m.equilibrium(turning=[...])"
        )
    return list(v[:, 0])


def completed_velocities(m: TracedMechanism, at: Sequence[tuple[Node, Any]], v: Sequence[Any]) -> list[Any]:
    """Velocities that fulfil the constraints: zero ones are solved for where the constraints require it.

    Parameters
    ----------
    m : TracedMechanism
    at : sequence of (symbol, expression)
        The position and the time.
    v : sequence
        Velocities; described ones are nonzero.
    """
    told = np.array([not is_zero(x) for x in v], bool)
    still = [(s, 0.0) for s in m.x.v]
    left = substitute(substitute(list(m.n), [(s, x) for s, x in zip(m.x.v, v, strict=True) if not is_zero(x)]), at)
    right = zero_objects(len(left), 1)
    right[:, 0] = substitute(left, still)
    if np.abs(nominal_values(right)).max(initial=0.0) == 0.0:
        return list(v)
    J = jacobian(list(m.n), [m.x.v[d] for d in np.flatnonzero(~told)])
    A = zero_objects(*J.shape)
    A.ravel()[:] = substitute(list(J.ravel()), at)
    columns = _independent((nominal_values(A) * m.scale[~told]).T)
    rows = _independent(nominal_values(A[:, columns]) * m.scale[~told][columns])
    out = list(v)
    for d, x in zip(
        np.flatnonzero(~told)[columns], -solve_equations(A[np.ix_(rows, columns)], right[rows]), strict=True
    ):
        out[d] = x[0]
    return out


def _independent(A: np.ndarray) -> np.ndarray:
    """Indices of a set of independent rows."""
    from scipy.linalg import qr

    if not A.any():
        return np.zeros(0, int)
    _, R, order = qr(A.T, mode="economic", pivoting=True)
    d = np.abs(np.diag(R))
    return np.sort(order[: int((d > RANK_TOLERANCE * d[0]).sum())])


# Gaps of a closed position, relative to the mechanism's length.
CLOSURE_TOLERANCE = 1e-9
MAX_ITERATIONS = 30
QUARTER = 0.5 * np.pi
# Change of a coordinate by Newton's method that counts as none, relative to the mechanism's length.
NEW_DIRECTION = 1e-10


@dataclass
class OperatingPoint:
    """The state of a linearisation.

    Attributes
    ----------
    q, v : list
        Coordinates and velocities: nodes or numbers.
    z : list
        Controller states; then turn counters of angles, curve parameters, as numbers.
    t : float [s]
    found : tuple of str
        Coordinates that were computed to close loops: numbers, independent of the parameters.
    """

    q: list[Any]
    v: list[Any]
    z: list[Any]
    t: float = 0.0
    found: tuple[str, ...] = ()

    def numbers(self, m: TracedMechanism) -> dict[str, float]:
        """Symbol's name -> value."""
        out = {m.x.t.data.name: self.t}
        for symbols, values in ((m.x.q, self.q), (m.x.v, self.v), (m.x.z, self.z)):
            out |= {s.data.name: nominal_value(x) for s, x in zip(symbols, values, strict=True)}
        return out | {s.data.name: 0.0 for s in m.vdot}

    def replacing(self, m: TracedMechanism) -> list[tuple[Node, Any]]:
        """Replacements for the symbols of the state, without the multipliers."""
        pairs = [(m.x.t, self.t)]
        for symbols, values in ((m.x.q, self.q), (m.x.v, self.v), (m.x.z, self.z)):
            pairs += zip(symbols, values, strict=True)
        pairs += self._quarters(m)
        return pairs + [(s, 0.0) for s in m.vdot]

    def _quarters(self, m: TracedMechanism) -> list[tuple[Node, Any]]:
        """Exact sines and cosines of multiples of a right angle."""
        out: list[tuple[Node, Any]] = []
        for s, x in zip(m.x.q, self.q, strict=True):
            if isinstance(x, int | float) or x.known:
                k = round(nominal_value(x) / QUARTER)
                if k and abs(nominal_value(x) - k * QUARTER) < 1e-14 * abs(k):
                    g = m.graph
                    out += [(g.function("sin", s), (0, 1, 0, -1)[k % 4]), (g.function("cos", s), (1, 0, -1, 0)[k % 4])]
        return out


def reference_point(m: TracedMechanism) -> OperatingPoint:
    """Reference configuration, with the described rates of tree joints and velocities of free bodies."""
    x, n = m.values, m.values.structure
    q, v = x.q.tolist(), x.v.tolist()
    z = compile_mechanism(m.model, tree=n.tree, coupled=bool(n.tree)).z.real.tolist()
    z[: len(m.s)] = initial_controller_states(n, x.numbers)
    if n.tree:
        v = joint_velocities(m, [*zip(m.x.q, q, strict=True), *zip(m.x.z, z, strict=True)])
    at, point = state_entries(m), OperatingPoint(q, v, z)
    for e in m.model.initial:
        for name, value in _initial_condition(m, e):
            if value is not None and name not in at:
                raise ModelError(
                    f"the initial condition of {e.name!r} is for a coordinate that these equations do not have; give "
                    "the position: at={...}, or at=m.equilibrium()"
                )
            if value is not None:
                at[name].set(point, value)
    for k, b in enumerate(n.prescribed.values(), len(n.rows)):
        at_q, at_v = int(m.x.system.tree.q[b]), int(m.x.system.tree.v[b])
        q[at_q], v[at_v] = substitute([-m.g[k], m.x.nu[k]], [(m.x.t, 0.0), (m.x.q[at_q], 0.0)])
    return point


def _initial_condition(m: TracedMechanism, e: Initial) -> list[tuple[str, Any]]:
    """(name, value) of a coordinate and of its rate in an initial condition; None if not given."""
    unit = m.model.unit(e.name, e)
    every = ((e.name, e.value, unit, "value"), (f"{e.name} rate", e.rate, f"{unit}/s", "rate"))
    env = m.values.env
    return [(name, x if x is None else number_of(x, env, of, f"{what} of {e.title}")) for name, x, of, what in every]


@dataclass(frozen=True)
class StateEntry:
    """Index of a named coordinate, rate or controller state in a part (q, v, z) of the state: value = x + offset."""

    part: str
    k: int
    offset: Any = 0.0

    def set(self, point: OperatingPoint, value: Any) -> None:
        """Set it in an operating point."""
        getattr(point, self.part)[self.k] = value - self.offset


def state_entries(m: TracedMechanism) -> dict[str, StateEntry]:
    """Names that may be given for a state: coordinates, as ``"A.angle rate"`` their rates, and controller states."""
    s, S = m.values.structure, m.x.system
    out: dict[str, StateEntry] = {}
    for t, row, step in tree_joint_steps(s):
        if step.coordinate in t.joint.coordinates:
            name = f"{t.joint.name}.{step.coordinate}"
            out[name] = StateEntry("q", int(S.tree.q[row]), S.bodies.offset[row])
            out[f"{name} rate"] = StateEntry("v", int(S.tree.v[row]))
    for d, own in enumerate(m.names):
        if own.name not in out:
            k = _coordinate_of_velocity(m, d)
            if k >= 0:
                out[own.name] = StateEntry("q", k)
            out[f"{own.name} rate"] = StateEntry("v", d)
    return out | {name: StateEntry("z", k) for k, name in enumerate(m.controls)}


def _coordinate_of_velocity(m: TracedMechanism, d: int) -> int:
    """Index of the coordinate whose rate a velocity is; -1 for angular velocities in space."""
    column = [k for k in range(len(m.x.q)) if m.x.T[k, d] != 0.0]
    return column[0] if len(column) == 1 and m.x.T[column[0], d] == 1.0 else -1


def given_point(m: TracedMechanism, at: Mapping[str, Any]) -> OperatingPoint:
    """Reference configuration with given coordinates and rates: numbers, texts with a unit, expressions of parameters.

    Raises
    ------
    ModelError
        If there is no such coordinate.
    """
    point = reference_point(m)
    known = state_entries(m)
    for name, text in at.items():
        if name not in known:
            raise ModelError(
                f"{m.model.name!r} has no coordinate {name!r} that can be given{suggest(name, list(known))}; "
                f"{listing(list(known))}"
            )
        p = known[name]
        unit = next((n.unit for n in m.names if name in (n.name, f"{n.name} rate")), None)
        p.set(point, number_of(text, m.env, f"{unit}/s" if p.part == "v" and unit else unit, f"at[{name!r}]"))
    return closed_point(m, point, tuple(p.k for k, p in known.items() if k in at and p.part == "q"), at)


def closed_point(
    m: TracedMechanism, point: OperatingPoint, fixed: Sequence[int], at: Mapping[str, Any]
) -> OperatingPoint:
    """Close the loops by Newton's method in the coordinates that were not given; likewise their rates.

    Raises
    ------
    ModelError
        If that is not possible.
    """
    which = np.flatnonzero(m.holonomic)
    length = m.values.length
    free = np.array([d for d in range(len(m.x.v)) if not _moves(m, d, fixed)], int)
    numbers = point.numbers(m)
    gaps = lambda: np.array(evaluate(list(m.g[which]), numbers), float)  # noqa: E731
    if not len(which) or np.abs(gaps()).max() <= CLOSURE_TOLERANCE * length:
        return _with_rates(m, point)
    G, T = _functions(m, which)
    for _ in range(MAX_ITERATIONS):
        g = gaps()
        if np.abs(g).max() <= 1e-14 * length:
            break
        step = np.zeros(len(m.x.v))
        scaled = np.array(evaluate(G, numbers), float).reshape(len(which), -1) * m.scale
        step[free] = (m.scale[free]) * np.linalg.lstsq(scaled[:, free], -g, rcond=1e-10)[0]
        dq = np.array(evaluate(T, numbers), float).reshape(len(m.x.q), -1) @ step
        for s, d in zip(m.x.q, dq, strict=True):
            numbers[s.data.name] += float(d)
    if np.abs(gaps()).max() > CLOSURE_TOLERANCE * length:
        raise ModelError(
            f"{m.model.name!r} cannot be closed with "
            f"{', '.join(map(repr, at)) or 'the coordinates of the reference configuration'}: gaps of "
            f"{np.abs(gaps()).max():.3g} are left; give coordinates that can be, or at=m.equilibrium()"
        )
    moved = [k for k, (s, x) in enumerate(zip(m.x.q, point.q, strict=True))
             if abs(numbers[s.data.name] - nominal_value(x)) > NEW_DIRECTION * length]  # fmt: skip
    q = [numbers[m.x.q[k].data.name] if k in moved else x for k, x in enumerate(point.q)]
    names = tuple(k for k, p in state_entries(m).items() if p.part == "q" and p.k in moved)
    return _with_rates(m, OperatingPoint(q, point.v, point.z, point.t, names))


def _functions(m: TracedMechanism, which: np.ndarray) -> tuple[list[Any], list[Any]]:
    """Expressions of the position constraints' G, and of T."""
    return list(jacobian(list(m.n[which]), m.x.v).ravel()), list(m.x.T.ravel())


def _moves(m: TracedMechanism, d: int, fixed: Sequence[int]) -> bool:
    return any(m.x.T[k, d] != 0.0 for k in fixed)


def _with_rates(m: TracedMechanism, point: OperatingPoint) -> OperatingPoint:
    """Complete the rates so that they fulfil the constraints.

    Raises
    ------
    ModelError
        If the constraints allow none.
    """
    if not len(m.n):
        return point
    where = [pair for pair in point.replacing(m) if pair[0] not in m.x.v]
    v = completed_velocities(m, where, point.v)
    point = OperatingPoint(point.q, v, point.z, point.t, point.found)
    missed = np.abs(np.array(evaluate(list(m.n), point.numbers(m)), float)).max()
    if missed > CLOSURE_TOLERANCE * (max(abs(nominal_value(x)) for x in v) + 1.0) * max(m.values.length, 1.0):
        raise ModelError(
            f"the velocities of {m.model.name!r} there do not satisfy its constraints (by {missed:.3g}): give the "
            "rates of all coordinates that move, for instance at={'A.angle rate': 'omega'}, or "
            "at=m.equilibrium(turning=[...])"
        )
    return point
