"""Whether an operating point is an equilibrium or a steady motion, and for which parameters.

The multipliers balance the forces at the point. The remaining forces must vanish by themselves: these are conditions on
the parameters. A motion with constant rates must look the same at later times.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...derivatives.force_balance import usual_states
from ...derivatives.linear_reduction import product
from ...derivatives.reduced_equations import gap_lengths, lost_constraints
from ...errors import AnalysisError, ModelError
from ...expression_graph.evaluation import evaluate, jacobian, nodes_in_order, substitute, symbols_of
from ...expression_graph.graph import ADD, CALL, DIVIDE, MULTIPLY, NUMBER, OPERATIONS, SYMBOL, Node, zero_objects
from ...numerics.rank import RANK_TOLERANCE, null_space, rank
from ..explicit.linear_systems import DependentEquations, nominal_value, nominal_values, solve_equations
from .derivatives import Derivatives, Perturbed, TracedMechanism
from .operating_point import OperatingPoint
from .reduction import Freedoms, reduce_linear, scaled_rows

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


CLOSURE_TOLERANCE = 1e-7  # residual of a constraint relative to its terms


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
        if _residuals(self.loops, values, CLOSURE_TOLERANCE) is not None:
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
MAX_ITERATIONS = 20
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
    for _ in range(MAX_ITERATIONS):
        T = np.array(evaluate(list(m.x.T.ravel()), at), float).reshape(len(names), -1)
        for k, dq in zip(names, T @ step, strict=True):
            at[k] += float(dq)
        A = np.array(evaluate(G, at), float).reshape(len(m.n), -1)[which]
        g = gap_lengths(np.array(evaluate(list(m.g[which]), at), float), A, m.scale)
        if np.abs(g).max() < LOOP_CLOSURE_TOLERANCE * m.values.length:
            return _rows(m, G, at)[which]
        step = m.scale * np.linalg.lstsq(scaled_rows(A, m.scale), -g, rcond=RANK_TOLERANCE)[0]
    return None
