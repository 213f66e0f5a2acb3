"""The operating point of a linearisation: a state of expressions or numbers, and whether it is an equilibrium.

Equations can be linearised about an equilibrium, or about a motion with constant velocities that looks the same at all
times (in joint coordinates, for example a governor at constant speed).

The multipliers balance the forces at the point. The remaining forces must vanish by themselves: these are conditions
on the parameters. A motion with constant rates must look the same at later times.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...assembly.compiled_mechanism import compile_mechanism
from ...derivatives.equation_derivatives import usual_states
from ...derivatives.linearized_equations import gap_lengths, lost_constraints, product
from ...errors import AnalysisError, ModelError
from ...expression_graph.graph import (
    ADD,
    CALL,
    DIVIDE,
    MULTIPLY,
    NUMBER,
    OPERATIONS,
    SYMBOL,
    Node,
    evaluate,
    jacobian,
    nodes_in_order,
    substitute,
    symbols_of,
    zero_objects,
)
from ...model.body import Initial
from ...model.expressions import number as number_of
from ...model.messages import listing, suggest
from ...numerics.rank import RANK_TOLERANCE, null_space, rank
from ...tables.forest import tree_joint_steps
from ...tables.law_inputs import initial_controller_states
from ..explicit.linear_systems import DependentEquations, is_zero, nominal_value, nominal_values, solve_equations
from .state_matrices import Derivatives, Freedoms, Perturbed, TracedMechanism, reduce_linear, scaled_rows

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


# Largest residual at an equilibrium, relative to the cancelling terms and to the largest force.
BALANCE_TOLERANCE = 1e-6
# Position error allowed at an equilibrium [rad, or relative to the mechanism's length].
ZERO_FORCE_TOLERANCE = 1e-9


def balancing_multipliers(m: TracedMechanism, point: OperatingPoint, f: Freedoms) -> np.ndarray:
    """Multipliers (rows,) with r = 0; those of dependent rows are 0.

    Raises
    ------
    ModelError
        If friction depends on them: the equations are then nonlinear.
    """
    lam = zero_objects(len(m.multipliers))
    if not len(f.rows_v):
        return lam
    r, R = _forces(m, point)
    if any(x in m.multipliers for x in nodes_in_order(list(R.ravel()))):
        names = ", ".join(repr(e.name) for e in m.model.forces if hasattr(e, "load"))
        raise ModelError(
            f"friction of {names} follows the reactions, which at this point are no solution of linear equations; "
            f"linearize takes it, in numbers"
        )
    others = np.setdiff1d(np.arange(len(r)), np.r_[f.chosen_v, f.held])
    lam[f.rows_v] = solve_equations(R[np.ix_(others, f.rows_v)], -r[others, None])[:, 0]
    return lam


def _forces(m: TracedMechanism, point: OperatingPoint) -> tuple[np.ndarray, np.ndarray]:
    """Residual r without multipliers, and its derivatives by them."""
    by = jacobian(list(m.r), m.multipliers)
    flat = substitute([*m.r, *by.ravel()], point.replacing(m))
    nv = len(m.r)
    r = zero_objects(nv)
    r[:] = substitute(flat[:nv], [(s, 0.0) for s in m.multipliers])
    R = zero_objects(*by.shape)
    R.ravel()[:] = flat[nv:]
    return r, R


def equilibrium_conditions(m: TracedMechanism, point: OperatingPoint, lam: np.ndarray, f: Freedoms) -> list[Node]:
    """Forces along the free coordinates, and rates of controller states, which vanish at an equilibrium.

    Identically zero ones are left out.
    """
    r = zero_objects(len(m.r), 1)
    left = substitute([*m.r, *m.s], [*point.replacing(m), *zip(m.multipliers, lam, strict=True)])
    r[:, 0] = left[: len(r)]
    found = substitute([*product(f.Zv.T, r)[:, 0], *left[len(r) :]], [(s, 0.0) for s in m.added])
    return not_identically_zero(found)


def not_identically_zero(nodes: Sequence[Any]) -> list[Node]:
    """Expressions that do not vanish identically; constants are rounding, or refused."""
    told = [x for x, none in zip(nodes, identically_zero(nodes), strict=True) if isinstance(x, Node) and not none]
    return [x for x in told if not x.known]


ROUNDING_TOLERANCE = 1e-12  # values below this part of the terms are rounding
RANDOM_DRAWS = 3


def values_and_sizes(nodes: Sequence[Any], values: Mapping[str, float] | None = None) -> list[tuple[float, float]]:
    """(value, sum of the absolute values of all terms) of expressions, with the parameters' own or other values."""
    told = values or {}
    found: dict[int, tuple[float, float]] = {}
    for x in nodes_in_order(nodes):
        a = [found[k.index] for k in x.args]
        own = [v for v, _ in a]
        if x.op == NUMBER:
            value = x.value
        elif x.op == SYMBOL:
            value = told.get(x.data.name, x.value)
        else:
            value = float(x.data.python(*own) if x.op == CALL else OPERATIONS[x.op](*own))
        if x.op in (ADD, MULTIPLY):
            size = float(OPERATIONS[x.op](*(s for _, s in a)))
        elif x.op == DIVIDE:
            size = a[0][1] / abs(own[1]) if own[1] else float("inf")
        else:
            size = 1.0 if x.op in ("sin", "cos") else abs(value)
        found[x.index] = (value, size)
    return [found[x.index] if isinstance(x, Node) else (float(x), abs(float(x))) for x in nodes]


def identically_zero(nodes: Sequence[Any]) -> list[bool]:
    """Which expressions are identically zero, tested with random parameter values near their own."""
    rng = np.random.default_rng(0)
    out = np.ones(len(nodes), bool)
    for _ in range(RANDOM_DRAWS):
        told = {s.data.name: (s.value or 0.1) * float(rng.uniform(0.7, 1.3)) for s in symbols_of(nodes)}
        out &= np.array([abs(x) <= ROUNDING_TOLERANCE * size for x, size in values_and_sizes(nodes, told)], bool)
    return [bool(x) for x in out]


def refuse_unbalanced(m: TracedMechanism, f: Freedoms, p: Perturbed, at: dict[str, float]) -> None:
    """Refuse a point that is no equilibrium with the parameters' own values.

    Parameters
    ----------
    m : TracedMechanism
    f : Freedoms
    p : Perturbed
        Derivatives there.
    at : dict
        Values at the point of all symbols that are no parameters with their own values.

    Raises
    ------
    AnalysisError
        If the velocities are not constant.
    ModelError
        With the residual forces.
    """
    moving = any(at[s.data.name] for s in m.x.v)
    if moving and m.x.lam:
        terms = np.array(values_and_sizes(list(m.x.gamma), at))
        if (np.abs(terms[:, 0]) > BALANCE_TOLERANCE * (terms[:, 1] + terms[:, 1].max())).any():
            raise unsteady_error(m)
    r = np.array(values_and_sizes(list(m.r), at)) * m.scale[:, None]
    Z = nominal_values(f.Zv) / m.scale[:, None] * m.scale[f.chosen_v]
    left, terms = Z.T @ r[:, 0], np.abs(Z).T @ r[:, 1]
    near = np.abs(nominal_values(p.by["rx"]) * m.scale * m.scale[:, None]).sum(axis=1) * m.values.length
    for d, x, own in zip(f.chosen_v, left, terms, strict=True):
        if abs(x) > BALANCE_TOLERANCE * (own + 1e-3 * r[:, 1].max()) + ZERO_FORCE_TOLERANCE * near[d]:
            name = m.names[d]
            unit = "N" if name.unit == "m" else "N m"
            raise _unbalanced_error(m, f"{x / m.scale[d]:.6g} {unit} are left along {name.name}", moving)
    moved = np.abs(nominal_values(p.by["sx"]) * m.scale * m.values.length).sum(axis=1)
    between = np.abs(nominal_values(p.by["sz"]))
    decay = np.diag(between)
    z = np.abs([at[s.data.name] for s in m.x.states])
    usual = usual_states(z, moved, between, np.where(decay > 0.0, decay, decay.max(initial=0.0) or 1.0))
    may = ZERO_FORCE_TOLERANCE * (moved + between @ usual)
    for name, (x, own), least in zip(m.controls, values_and_sizes(list(m.s), at), may, strict=True):
        if abs(x) > BALANCE_TOLERANCE * own + least:
            raise _unbalanced_error(m, f"{name!r} changes by {x:.3g} in a second", moving)


def _unbalanced_error(m: TracedMechanism, what: str, moving: bool) -> ModelError:
    others = "; other steady motions than of joints' coordinates linearize takes, in numbers" if moving else ""
    return ModelError(
        f"{m.model.name!r} is in no equilibrium there: {what}. Give another point, for instance at=m.equilibrium(), or "
        f"name a parameter{' or controller state' if m.controls else ''} that has the value which balances it: "
        f"balanced_by=[...]{others}"
    )


def unsteady_error(m: TracedMechanism) -> AnalysisError:
    """The error for a motion that is not steady."""
    return AnalysisError(
        f"{m.model.name!r} is in no steady state there: its velocities change, or its linear equations do. Symbolic "
        "linear equations are about equilibria, and about motions in which joint coordinates change uniformly while "
        "all others are constant (coordinates='joint'); linearize supports other steady motions, in numbers"
    )


def balancing_parameters(m: TracedMechanism, at: Sequence[Node], names: Sequence[str]) -> list[tuple[Node, Node]]:
    """Parameters solved from the conditions of equilibrium: (symbol, expression of the others).

    Parameters
    ----------
    m : TracedMechanism
    at : sequence of Node
        The conditions.
    names : sequence of str
        As many parameters or controller states, in which the conditions are linear.

    Raises
    ------
    ModelError
        If the conditions do not determine these parameters, or are not linear in them.
    """
    for name in names:
        if name not in m.given:
            raise ModelError(
                f"{m.model.name!r} has no parameter {name!r} with a value of its own to balance by; if an input "
                "balances it, use a parameter in that force or torque: torque='tau'"
            )
    if len(at) != len(names):
        raise ModelError(
            f"{len(at)} conditions of equilibrium determine {len(at)} parameters, not {len(names)} ({', '.join(names)})"
        )
    symbols = [m.given[k] for k in names]
    J = jacobian(at, symbols)
    if any(x.op == SYMBOL and x in symbols for x in nodes_in_order(list(J.ravel()))):
        raise ModelError(f"the conditions of equilibrium are not linear in {', '.join(names)}; take other parameters")
    rest = zero_objects(len(at), 1)
    rest[:, 0] = substitute(list(at), [(s, 0.0) for s in symbols])
    try:
        found = solve_equations(J, -rest)[:, 0]
    except DependentEquations:
        raise ModelError(f"equilibrium does not determine {', '.join(names)}: choose other parameters") from None
    return [(s, m.graph.node(x)) for s, x in zip(symbols, found, strict=True)]


CONSTRAINT_TOLERANCE = 1e-7  # residual of a constraint relative to its terms


@dataclass(frozen=True)
class Validity:
    """Conditions that must vanish at a point, as expressions of the parameters.

    Attributes
    ----------
    forces : sequence of Node
        Forces along the free coordinates.
    loops : sequence of Node
        Constraints.
    """

    forces: Sequence[Node] = ()
    loops: Sequence[Node] = ()

    def refuse(self, name: str, values: Mapping[str, float]) -> None:
        """Refuse values of parameters for which the conditions do not hold.

        Raises
        ------
        ModelError
            With the residuals.
        """
        told = ", ".join(f"{k} = {x:g}" for k, x in values.items())
        remedy = (
            "give all that belong to that point, or make the equations about the point that belongs to these: "
            "symbolic(parameters=...), linear(at=m.equilibrium(parameters=...))"
        )
        if _residuals(self.loops, values, CONSTRAINT_TOLERANCE) is not None:
            raise ModelError(
                f"with {told} the loops of {name!r} do not close at the point that these equations are about, whose "
                f"coordinates are numbers; {remedy}"
            )
        left = _residuals(self.forces, values, BALANCE_TOLERANCE)
        if left is not None:
            raise ModelError(
                f"with {told} {name!r} is in no equilibrium at the point that these equations are about: {left:.6g} N "
                f"or N m are left; {remedy}, or name a parameter that balances: balanced_by=[...]"
            )


def _residuals(nodes: Sequence[Node], values: Mapping[str, float], part: float) -> float | None:
    """Largest residual beyond rounding and beyond that with the parameters' own values; None if none."""
    if not values or not nodes:
        return None
    here, own = values_and_sizes(nodes, values), values_and_sizes(nodes)
    most = max(size for _, size in here)
    for (x, size), (before, _) in zip(here, own, strict=True):
        if not abs(x) <= part * (size + 1e-3 * most) + 2.0 * abs(before):
            return x
    return None


# Motion between the two times compared: angle [rad], or distance relative to the mechanism's length.
TEST_DURATION = 0.1
TEST_STEPS = 8
STEADY_TOLERANCE = 1e-7  # relative difference below which equations are equal
NEARBY_STEP = (
    # Distance [rad, or relative to the mechanism's length] of the nearby position whose rank is compared.
    1e-2
)
EQUILIBRIUM_ITERATIONS = 20
LOOP_CLOSURE_TOLERANCE = 1e-10  # relative to the mechanism's length


def refuse_unsteady(
    m: TracedMechanism, d: Derivatives, f: Freedoms, point: OperatingPoint, known: dict[str, float]
) -> None:
    """Refuse a motion whose linear equations change with time.

    ``known`` contains the multipliers, and parameters with other values than their own.

    Raises
    ------
    AnalysisError
        If they do.
    """
    v = np.array([nominal_value(x) for x in point.v])
    here = point.numbers(m) | known
    size = np.abs(v / np.array([m.values.length if n.unit == "m" else 1.0 for n in m.names])).max(initial=0.0)
    later = dict(here)
    if size > 0.0:
        for _ in range(TEST_STEPS):
            _moved(m, later, v, TEST_DURATION / size / TEST_STEPS)
    else:
        later[m.x.t.data.name] += 1.0 / np.sqrt(np.abs(_matrix(m, d, f, here)).max(initial=0.0) or 1.0)
    now, then = (_matrix(m, d, f, at) for at in (here, later))
    if np.abs(then - now).max(initial=0.0) > STEADY_TOLERANCE * np.abs(now).max(initial=0.0):
        if size > 0.0:
            raise unsteady_error(m)
        raise AnalysisError(
            f"the linear equations of {m.model.name!r} at this point change with time: laws change with time; "
            f"linearize takes this very instant with frozen=True, in numbers"
        )


def _matrix(m: TracedMechanism, d: Derivatives, f: Freedoms, at: dict[str, float]) -> np.ndarray:
    """Matrix A in numbers, in the same coordinates."""
    p = d.near(at)
    n = f.Z.shape[1] + f.Zv.shape[1]
    return nominal_values(reduce_linear(m, p, replace(f, G=p.by["nv"])).rate[:, :n])


def _moved(m: TracedMechanism, at: dict[str, float], v: np.ndarray, h: float) -> None:
    """Runge-Kutta step along constant velocities."""
    names = [s.data.name for s in m.x.q]
    q = np.array([at[k] for k in names])

    def rate(q: np.ndarray) -> np.ndarray:
        T = evaluate(list(m.x.T.ravel()), at | dict(zip(names, q.tolist(), strict=True)))
        return np.array(T, float).reshape(len(names), -1) @ v

    k1 = rate(q)
    k2 = rate(q + 0.5 * h * k1)
    k3 = rate(q + 0.5 * h * k2)
    k4 = rate(q + h * k3)
    at |= dict(zip(names, (q + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)).tolist(), strict=True))
    at[m.x.t.data.name] += h


def refuse_singular(m: TracedMechanism, G: list[Node], point: OperatingPoint) -> None:
    """Refuse a position where the constraints lose rank, because no linear model exists there.

    Raises
    ------
    ModelError
        With the names of the elements whose rows are dependent there and independent nearby.
    """
    which = np.flatnonzero(m.holonomic)
    here = point.numbers(m)
    if not len(which):
        return
    now = _rows(m, G, here)[which]
    s = m.values.structure
    of = [*(r.element.name for r in s.rows if r.holonomic), *s.prescribed]
    N = null_space(now)
    rng = np.random.default_rng(0)
    for _ in range(2 if N.shape[1] else 0):
        step = m.scale * (N @ rng.standard_normal(N.shape[1]))
        step *= NEARBY_STEP * m.values.length / np.abs(step / m.scale).max()
        there = _nearby(m, G, dict(here), step, which)
        if there is not None and rank(there) > rank(now):
            lost = ", ".join(lost_constraints(now, there, of))
            raise ModelError(
                f"{m.model.name!r} is in a singular position there: the constraints of {lost} "
                f"depend on each other at this point and not nearby, so that there are no linear equations; give "
                f"another point"
            )


def _rows(m: TracedMechanism, G: list[Node], at: dict[str, float]) -> np.ndarray:
    return scaled_rows(np.array(evaluate(G, at), object).reshape(len(m.n), -1), m.scale)


def _nearby(
    m: TracedMechanism, G: list[Node], at: dict[str, float], step: np.ndarray, which: np.ndarray
) -> np.ndarray | None:
    """Rows at the assembled position nearest to a step; None if assembly fails."""
    names = [s.data.name for s in m.x.q]
    for _ in range(EQUILIBRIUM_ITERATIONS):
        T = np.array(evaluate(list(m.x.T.ravel()), at), float).reshape(len(names), -1)
        for k, dq in zip(names, T @ step, strict=True):
            at[k] += float(dq)
        A = np.array(evaluate(G, at), float).reshape(len(m.n), -1)[which]
        g = gap_lengths(np.array(evaluate(list(m.g[which]), at), float), A, m.scale)
        if np.abs(g).max() < LOOP_CLOSURE_TOLERANCE * m.values.length:
            return _rows(m, G, at)[which]
        step = m.scale * np.linalg.lstsq(scaled_rows(A, m.scale), -g, rcond=RANK_TOLERANCE)[0]
    return None
