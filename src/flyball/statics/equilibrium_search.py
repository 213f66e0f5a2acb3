"""Searches for equilibria and steady motions: Newton's method and pseudo-transient continuation.

Newton's method solves r(q, lam) = -f - G^T lam = 0, g(q) = 0 with the exact stiffness K (reactions turn with the
bodies). Where it does not converge, pseudo-transient continuation follows: a motion without inertia and with uniform
damping, whose steps grow as it comes to rest (Kelley and Keyes 1998). It follows the forces, so it ends in stable
equilibria. Positions that are nonsingular only because of the closing tolerance (infinitesimal mechanisms) are refused.

In a steady motion some coordinates turn at constant speed and all others are constant. In joint coordinates only those
angles change: r(q, v, 0, lam) = 0 and g(q) = 0 with v zero except for the speeds. A speed that no torque determines (a
governor that turns freely) keeps its described value.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ..assembly.assembled_state import Assembly
from ..assembly.positions_and_velocities import row_scales
from ..derivatives.equation_derivatives import (
    EquationDerivatives,
    MechanismState,
    force_magnitudes,
    is_balanced,
    is_balanced_beyond_rounding,
    unbalanced_fraction,
)
from ..derivatives.linearized_equations import free_coordinates, prescribed_rows
from ..derivatives.nonsmooth_points import nonsmooth_points
from ..derivatives.output_derivatives import snapshot
from ..derivatives.steady_motion import rate_description
from ..engine.kinematics import retract
from ..errors import ModelError, NotConverged, SingularityError
from ..model.joint import Joint
from ..model.messages import listing, suggest
from ..model.names import curve_parts
from ..numerics.rank import clearly_independent
from ..results.diagnostics import rest_warnings
from ..results.equilibrium import Equilibrium, FreeStiffness
from ..simulation.initial_state import choose_coordinates
from ..tables.forest import coordinate_row
from ..tables.structure_definition import Structure, velocity_names
from .stability import RestState, stability

# Coordinates of the direction of lowest stiffness that are reported: how many, and the smallest component.
REPORTED_COORDINATES, REPORTED_COMPONENT = 6, 1e-3


def equilibrium_result(x: RestState, preload: dict[str, float], method: str) -> Equilibrium:
    """Result for an equilibrium, with its stability.

    Parameters
    ----------
    x : RestState
    preload : dict
        Preloads added to forces.
    method : str
        Name of the search method.
    """
    s = stability(x)
    x.c.at(x.t, x.q, np.zeros(len(x.scale)))
    result = snapshot(MechanismState.resting(x.c, x.t, x.q, x.lam))
    return Equilibrium(
        t=x.t,
        stability=s.kind,
        unbalanced=x.unbalanced(),
        method=method,
        parameters=dict(x.c.parameters),
        result=result,
        notes=rest_warnings(result),
        assembly=Assembly(x.c, x.t, x.q, np.zeros(len(x.scale))),
        preload=preload,
        kinks=s.kinks,
        free_stiffness=partial(_free_stiffness, x),
    )


def _free_stiffness(x: RestState) -> FreeStiffness:
    """Stiffness of the free motions at an equilibrium, and the largest components of its weakest direction."""
    s = stability(x).softest
    names = velocity_names(x.c.structure)
    large = np.argsort(-np.abs(s.direction))[:REPORTED_COORDINATES]
    weakest = {names[d].name: float(s.direction[d]) for d in large if abs(s.direction[d]) > REPORTED_COMPONENT}
    return FreeStiffness(tuple(s.free.labels), s.stiffness, weakest, s.least)


NEWTON_STEPS, DESCENT_STEPS = 40, 400  # largest numbers of steps
STAGNATION = 10  # limited steps of Newton's method that do not halve the residual, after which it has failed
# Travel [rad, or lengths of the mechanism] after which the search has failed.
MAX_TRAVEL = 15.0
LAST_STEP = 1e-7  # size of Newton's last step: the error after it is about its square
LONGEST_STEP = 0.3  # longest step [rad, or relative to the mechanism's length]
# A longer step is accepted if the residual falls below this part: the equations are then nearly linear.
NEARLY_LINEAR = 1e-3
PUSH_STEP = 1e-2  # in the same units
FORCE_TOLERANCE = 1e-9  # residual force relative to the applied forces
GAP_TOLERANCE = 1e-10  # residual gap relative to the mechanism's length
LEAST_DAMPING, FIRST_DAMPING, MAX_DAMPING = (
    1e-8,
    1.0,
    1e8,
)  # damping at which Newton's method takes over, at the start of descent, and at failure
# Where the residual after a step differs from the linear prediction by less than this part, damping falls fast.
WELL_PREDICTED, FAST_DECREASE = 0.2, 0.1


def newton_search(x: RestState) -> RestState | None:
    """Newton's method with steps of limited length; None if it does not converge.

    Raises
    ------
    SingularityError
        If no finite reactions carry the load at the position found.
    """
    return newton_search_to(x)[0]


def newton_search_to(x: RestState) -> tuple[RestState | None, RestState]:
    """Like `newton_search`; returns also the last state."""
    best_residual, stagnant = np.inf, 0
    for _ in range(NEWTON_STEPS):
        step, lam = x.step()
        longest = np.abs(step).max(initial=0.0)
        residual = x.residual_size()
        stagnant = stagnant + 1 if longest > LONGEST_STEP and residual > 0.5 * best_residual else 0
        best_residual = residual if stagnant == 0 else best_residual
        if not np.isfinite(longest) or stagnant >= STAGNATION:
            break
        x = _after_long_step(x, step, lam) or x.moved(step * min(1.0, LONGEST_STEP / max(longest, 1e-300)), lam)
        if longest < LAST_STEP and (best := equilibrium_there(x)):
            return best, x
    return None, x


def _after_long_step(x: RestState, step: np.ndarray, lam: np.ndarray) -> RestState | None:
    """State after a step beyond the limit, if rotations stay small and the residual nearly vanishes; else None."""
    size = np.abs(step)
    if not size.max(initial=0.0) > LONGEST_STEP or (size > LONGEST_STEP)[x.turns].any():
        return None
    there = x.moved(step, lam)
    return there if there.residual_size() < NEARLY_LINEAR * x.residual_size() else None


def equilibrium_there(x: RestState) -> RestState | None:
    """The state itself if its constraints are closed and all forces balance; None if not.

    Raises
    ------
    SingularityError
        If no finite reactions carry the load there.
    """
    if not x.open() <= GAP_TOLERANCE:
        return None
    best = x.balanced()  # smallest reactions: a self-stress would hide residuals
    if not best.settled(FORCE_TOLERANCE) or _is_balanced_by_jump(best):
        return None
    refuse_infinitesimal_mechanism(best)
    return best


def _is_balanced_by_jump(x: RestState) -> bool:
    """Whether forces balance only within rounding because a force jumps there."""
    return not is_balanced_beyond_rounding(x.equations, FORCE_TOLERANCE, len(x.z) > 0) and any(
        k.jump for k in nonsmooth_points(x.equations)
    )


def perturbed_along_softest(x: RestState, changed: RestState | None = None) -> RestState:
    """Move a small distance along the direction of lowest stiffness.

    If ``changed``, the state under later parameter values, is given, move it to the side that the forces push to. Just
    beyond a limit point the forces alone are too small to lead away from it.

    Raises
    ------
    NotConverged
        If the mechanism has no free motion.
    """
    direction = stability(x).softest.direction
    largest = np.abs(direction).max(initial=0.0)
    if not largest:
        raise search_failure(changed or x)
    side = 1.0
    if changed is not None:
        x = changed.closed()
        side = -1.0 if float(direction @ x.r) > 0.0 else 1.0
    return x.moved(PUSH_STEP * side * direction / largest, 0.0 * x.lam).closed()


def pseudo_transient_descent(x: RestState) -> RestState | None:
    """Pseudo-transient continuation along the constraints; None if it fails."""
    x = x.closed()
    damping, way = FIRST_DAMPING, 0.0
    for _ in range(DESCENT_STEPS):
        if damping < LEAST_DAMPING or _may_rest(x):
            return x
        step, lam = x.step(damping)
        longest = np.abs(step).max(initial=0.0)
        along = float(step @ -x.r)
        if not along > 0.0 or longest > LONGEST_STEP:  # against the forces, or too long
            damping *= min(max(2.0 * longest / LONGEST_STEP, 2.0), 10.0)
            if damping > MAX_DAMPING:
                return None
            continue
        way += longest
        if way > MAX_TRAVEL:
            return None
        before, predicted = np.abs(x.r).max(initial=0.0), -damping * x.size * step
        x = x.moved(step, lam).closed()
        left = np.abs(x.r).max(initial=0.0)
        if np.abs(x.r - predicted).max(initial=0.0) < WELL_PREDICTED * left:
            damping *= max(FAST_DECREASE, longest / LONGEST_STEP)
        else:
            damping *= float(np.clip(left / max(before, 1e-300), 0.3, 1.5)) * 0.7
    return None


def _may_rest(x: RestState) -> bool:
    """Whether all residuals are settled; rounding is computed only where the largest is small."""
    return x.residual_size() < NEARLY_LINEAR**2 and x.settled(FORCE_TOLERANCE)


def pseudo_transient_search(x: RestState) -> tuple[RestState | None, RestState]:
    """Pseudo-transient continuation without a potential, as for controllers: (state or None, last state).

    The implicit steps of a motion without inertia grow as the residual falls (switched evolution relaxation). Unlike in
    `pseudo_transient_descent`, steps against the forces are accepted.
    """
    x = x.closed()
    damping, left = FIRST_DAMPING, x.residual_size()
    for _ in range(DESCENT_STEPS):
        if damping < LEAST_DAMPING or _may_rest(x):
            return x, x
        step, lam = x.step(damping)
        longest = np.abs(step).max(initial=0.0)
        if not np.isfinite(longest):
            break
        if longest > LONGEST_STEP:
            damping *= 4.0
            if damping > MAX_DAMPING:
                break
            continue
        x = x.moved(step, lam).closed()
        before, left = left, x.residual_size()
        damping *= float(np.clip(left / max(before, 1e-300), 0.3, 1.5)) * 0.7
    return None, x


def search_failure(x: RestState) -> NotConverged:
    """The error for a failed search, with the residual forces and rates at its end."""
    best = x.balanced()
    names = velocity_names(x.c.structure)
    left = best.equations.block("r")
    residuals = {n.name: float(-value) for n, value in zip(names, left, strict=True)}
    states = x.c.structure.controls[: len(x.z)]
    residuals |= {k.name: float(rate) for k, rate in zip(states, best.equations.state_rates, strict=False)}
    unrest = np.abs(best.r)
    if states and unrest[len(names) :].max() >= unrest[: len(names)].max(initial=0.0):
        what = rate_description(best.equations, int(np.argmax(unrest[len(names) :])))
        return NotConverged(
            f"no equilibrium of {x.c.structure.model.name!r} was found: where the search ended, {what}, and nothing "
            f"brings that to rest. Give a better guess, or look whether the controller can change what it measures, "
            f"its limits considered",
            residuals,
        )
    if not free_coordinates(best.equations).Zv.shape[1]:
        what = "their forces do not balance it" if x.open() <= GAP_TOLERANCE else "they do not close any more"
        return NotConverged(
            f"no equilibrium of {x.c.structure.model.name!r} was found: joints and drivers leave nothing free, and "
            f"where the search ended {what}. Check lengths and drivers: it may be past a dead centre, or locked",
            residuals,
        )
    jumps = "; ".join(k.text for k in nonsmooth_points(best.equations) if k.jump)
    if jumps:
        return NotConverged(
            f"no equilibrium of {x.c.structure.model.name!r} was found: the search ended where {jumps}, and a jumping "
            "force is not balanced. Write a smooth law, for instance tanh(x/w) for sign(x)",
            residuals,
        )
    return NotConverged(
        f"no equilibrium of {x.c.structure.model.name!r} was found: where the search ended, {best.pushed()} and "
        "nothing balances this. Give a better guess, or add a part that balances it: a spring, a stop, a driver",
        residuals,
    )


# Infinitesimal mechanisms: positions at rest that are nonsingular only because of the closing tolerance.
#
# Where constraints lose rank without a finite motion, there is an infinitesimal motion w with G w = 0, along which the
# gaps grow as kappa s^2 / 2 with the displacement s. No finite reaction balances forces that do work along w. Newton's
# method ends beside the singular position, where G w = sigma u and the reaction is as large as s = sigma / kappa is
# small. Reactions at a displacement whose gaps are within the closing tolerance are an artefact of the tolerance.


DENSE_SIZE = 300  # up to so many rows or columns all singular values are computed
WEAK_SINGULAR_VALUE, ZERO_SINGULAR_VALUE = (
    1e-3,
    1e-11,
)  # range of singular values of unit rows that are examined; smaller ones carry no load
PROBE_STEP = 1e-3  # displacement [rad, or relative to the mechanism's length] for the change of a singular value
# Work of the forces along the infinitesimal motion, relative to its possible maximum, that counts as none.
LOADED_FRACTION = 1e-4
PARTICIPATION = 1e-3  # elements with a smaller part in a dependency do not count


def refuse_infinitesimal_mechanism(x: RestState) -> None:
    """Refuse a position at rest whose reactions exist only because of the closing tolerance.

    Raises
    ------
    SingularityError
        With the names of the elements with dependent constraints, and of the coordinates that can move.
    """
    if not len(x.g):
        return
    if min(x.G.shape) > DENSE_SIZE and clearly_independent(x.G):  # others change their Jacobian too fast along w
        return
    U, d, Vt = np.linalg.svd(x.G.toarray(), full_matrices=False)
    force = replace(x, lam=0.0 * x.lam).r
    for u, sigma, w in zip(U.T, d, Vt, strict=True):
        if not ZERO_SINGULAR_VALUE * d[0] < sigma < WEAK_SINGULAR_VALUE * d[0]:
            continue
        there, back = (u @ x.moved(s * PROBE_STEP * w, 0.0 * x.lam).G @ w for s in (1.0, -1.0))
        bends = abs(there - back) / (2.0 * PROBE_STEP)
        if sigma**2 < 2.0 * GAP_TOLERANCE * bends and abs(w @ force) > LOADED_FRACTION * (np.abs(w) @ np.abs(force)):
            raise _infinitesimal_mechanism_error(x, u, w)


def _infinitesimal_mechanism_error(x: RestState, u: np.ndarray, w: np.ndarray) -> SingularityError:
    """The error that describes an infinitesimal mechanism."""
    rows = x.c.structure.rows
    names = tuple(dict.fromkeys(r.element.name for r, part in zip(rows, u, strict=True) if abs(part) > PARTICIPATION))
    shakes = velocity_names(x.c.structure)[int(np.argmax(np.abs(w)))].name
    return SingularityError(
        f"{x.c.structure.model.name!r} has no equilibrium at t = {x.t:.6g} s: the constraints of {', '.join(names)} "
        f"are dependent there, so that it can shake along {shakes}, and no finite reaction carries the load along it. "
        "Move them out of this position, take one of them out, or give what yields: a spring, a bushing",
        x.t,
        names,
    )


STEADY_ITERATIONS = 60
STEADY_LONGEST_STEP = 0.2  # longest step [rad, or relative to the mechanism's length or a speed]
STEADY_TOLERANCE = 1e-9  # residual of an equation of motion relative to its forces
STEADY_LAST_STEP = 1e-7  # Newton's last step
STEADY_SINGULAR_VALUE = 1e-11  # singular values below this part of the largest count as zero


@dataclass
class SteadyMotion:
    """A steady motion: its state in joint coordinates, and the speeds by name [rad/s or m/s]."""

    state: MechanismState
    speeds: dict[str, float]
    unbalanced: float  # the largest force left, of those that act in its equation


def find_steady_motion(
    a: Assembly, described: Assembly, names: Sequence[str], parameters: Mapping[str, float] | None
) -> SteadyMotion:
    """Find the steady motion near an assembly in absolute coordinates, starting from the described speeds.

    Raises
    ------
    ModelError
        If a name is no coordinate of a joint, or of a joint that closes a loop.
    NotConverged
        If there is none nearby.
    """
    names = [names] if isinstance(names, str) else list(names)
    b, _ = choose_coordinates(a, "joint", parameters)
    at = [_velocity_of_coordinate(b, name) for name in names]
    c, s = b.compiled, b.compiled.structure
    v = np.zeros(c.structure.nv)
    v[at] = choose_coordinates(described, "joint", parameters)[0].v[at]
    start = MechanismState(c, b.t, b.q, v, c.z.copy(), 0.0 * v, np.zeros(len(c.structure.rows)), 0.0 * v)
    found, _ = _steady_newton(start, at, [])  # first with the speeds as described
    if found is None:
        found, start = _steady_newton(start, at, [d for d in at if s.tables["tree"].law[_body_of_velocity(s, d)] < 0])
    if found is None:
        raise _steady_failure(start, names)
    x = found
    c.at(x.t, x.q, x.v)
    speeds = {name: float(x.v[d]) for name, d in zip(names, at, strict=True)}
    return SteadyMotion(MechanismState.moving(c, x.t, x.q, x.v), speeds, unbalanced_fraction(EquationDerivatives(x)))


def _steady_newton(x: MechanismState, at: list[int], free: list[int]) -> tuple[MechanismState | None, MechanismState]:
    """Newton's method: (state or None if it does not converge, last state)."""
    for _ in range(STEADY_ITERATIONS):
        x, size = _steady_step(x, at, free)
        if size < STEADY_LAST_STEP and _is_steady(x):
            return x, x
    return None, x


def _is_steady(x: MechanismState) -> bool:
    """Whether positions, speeds and multipliers fulfil the equations with all accelerations zero."""
    e = EquationDerivatives(x)
    return max(_row_gaps(e).max(initial=0.0), _rate_errors(e).max(initial=0.0)) < STEADY_TOLERANCE and is_balanced(
        e, STEADY_TOLERANCE
    )


def _row_gaps(e: EquationDerivatives) -> np.ndarray:
    """Constraint gaps, relative to the mechanism's length or in radians."""
    return np.abs(row_scales(e.state.c) * e.block("g"))


def _rate_errors(e: EquationDerivatives) -> np.ndarray:
    """Errors of the constraint rates, relative to the fastest velocity or prescribed rate."""
    x, scale = e.state, row_scales(e.state.c)
    asked = scale * (e.block("n") - e.by_velocity[e.at["n"]] @ x.v)
    fastest = np.abs(x.v / x.c.sizes).max(initial=0.0) + np.abs(asked).max(initial=0.0)
    return np.abs(scale * e.block("n")) / (fastest or 1.0)


def _velocity_of_coordinate(b: Assembly, name: str) -> int:
    """Index of the velocity of a joint coordinate."""
    s = b.compiled.structure
    floating = {n.name: d for d, n in enumerate(velocity_names(s)) if n.unit == "m"}
    if name in floating:  # coordinate of a free body, such as a rolling vehicle
        return floating[name]
    owner, what = curve_parts(name)
    element = s.model.find(owner)
    if not isinstance(element, Joint) or what not in element.coordinates:
        known = [f"{j.name}.{c}" for j in s.model.joints for c in j.measured(s.model.planar)]
        hint = f"{suggest(str(name), known)}; {listing(known)}"
        raise ModelError(f"turning={name!r}: name a joint's coordinate, for instance 'A.angle'{hint}")
    if element.coordinates[what].singular:
        raise ModelError(f"turning={name!r}: a rotation about one axis needs a Revolute in place of {element.title}")
    row = coordinate_row(s, owner, what)
    if row is None:
        raise ModelError(
            f"turning={name!r}: {element.title} closes a loop of the mechanism; name a coordinate of a joint on the "
            f"tree from ground, one of {', '.join(n.name for n in velocity_names(s))}"
        )
    return int(s.tables["tree"].v[row])


def _steady_step(x: MechanismState, at: list[int], free: list[int]) -> tuple[MechanismState, float]:
    """One step of Newton's method: (state, size of the step)."""
    c, s = x.c, x.c.structure
    given = prescribed_rows(c)
    moving = np.array([d for d in range(s.nv) if d not in at and not given[:, d].any()], int)
    scale = c.sizes
    e = EquationDerivatives(x)
    A, left, size = _steady_equations(e, moving, np.array(free, int), given, scale)
    by_row = 1.0 / np.maximum(np.abs(A).max(axis=1, initial=0.0), 1e-300)
    by_column = 1.0 / np.maximum(np.abs(by_row[:, None] * A).max(axis=0, initial=0.0), 1e-300)
    step = by_column * np.linalg.lstsq(by_row[:, None] * A * by_column, -by_row * left, rcond=STEADY_SINGULAR_VALUE)[0]
    m, k, rows = len(moving), len(free), len(s.rows)
    longest = float(np.abs(step[: m + k]).max(initial=0.0))
    part = min(1.0, STEADY_LONGEST_STEP / max(longest, 1e-300))
    way = np.zeros(s.nv)
    way[moving] = scale[moving] * step[:m] * part
    q, v = x.q.copy(), x.v.copy()
    retract(c.values.system, q, way)
    v[free] += _speed_sizes(x, free) * step[m : m + k] * part
    c.at(x.t, q, v)
    lam, effort = x.lam + size * step[m + k : m + k + rows], x.effort + given.T @ (size * step[m + k + rows :])
    return replace(x, q=q, v=v, z=c.z.copy(), lam=lam, effort=effort), longest


def _steady_equations(
    e: EquationDerivatives, moving: np.ndarray, free: np.ndarray, given: np.ndarray, scale: np.ndarray
) -> tuple[np.ndarray, np.ndarray, float]:
    """Scaled linear equations for changes of positions, speeds, multipliers and efforts: (A, right side, energy)."""
    x, s = e.state, e.state.c.structure
    length = x.c.values.length
    r, n = e.at["r"], e.at["n"]
    K, V = e.by_position[r].toarray(), e.by_position[n].toarray()
    D, G = e.by_velocity[r].toarray(), e.by_velocity[n].toarray()
    which = np.array([row.holonomic for row in s.rows], bool)
    size = np.abs(K * np.outer(scale, scale)).max(initial=1e-300) + np.abs(scale * e.block("r")).max(initial=0.0)
    by_place, by_speed = scale[moving], _speed_sizes(x, free)
    width = len(moving) + len(free)
    A = np.zeros((s.nv + which.sum() + len(s.rows), width + len(s.rows) + len(given)))
    forces, gaps, rates = np.split(A, [s.nv, s.nv + which.sum()])
    forces[:, :width] = scale[:, None] * np.hstack([K[:, moving] * by_place, D[:, free] * by_speed]) / size
    forces[:, width:] = -scale[:, None] * np.vstack([G, given]).T
    if s.loads:
        forces[:, width : width + len(s.rows)] += scale[:, None] * e.by_reactions
    gaps[:, : len(moving)] = G[which][:, moving] * by_place / length
    rates[:, :width] = np.hstack([V[:, moving] * by_place, G[:, free] * by_speed])
    return A, np.r_[scale * e.block("r") / size, e.block("g")[which] / length, e.block("n")], float(size)


def _speed_sizes(x: MechanismState, free: list[int] | np.ndarray) -> np.ndarray:
    """Natural sizes of some velocities: themselves, and the mechanism's length (or a radian) times its rate."""
    return np.asarray(x.c.sizes[free] * x.c.work.options.rate + np.abs(x.v[free]))


def _body_of_velocity(s: Structure, d: int) -> int:
    """The row of the body table that a velocity belongs to."""
    return int(np.searchsorted(s.tables["tree"].v, d, side="right")) - 1


def _steady_failure(x: MechanismState, names: list[str]) -> NotConverged:
    """The error for a failed search: residual forces, or the constraints that are not fulfilled."""
    s, e = x.c.structure, EquationDerivatives(x)
    left, known = e.block("r"), velocity_names(s)
    who = ", ".join(names)
    begin = (
        f"no steady motion of {s.model.name!r} was found in which {who} turn uniformly and all other parts are at rest"
    )
    residuals = {n.name: float(-value) for n, value in zip(known, left, strict=True)}
    gaps, misses = _row_gaps(e), _rate_errors(e)
    if max(gaps.max(initial=0.0), misses.max(initial=0.0)) > STEADY_TOLERANCE:
        worse, unit = (
            (misses, "of its rate") if misses.max() > gaps.max() else (gaps, "of the mechanism's length, or rad")
        )
        k = int(np.argmax(worse))
        others = ", ".join(n.name for n in known)
        return NotConverged(
            f"{begin}: {s.rows[k].element.title} is not fulfilled ({worse[k]:.3g} {unit}). Something else has to move "
            f"with it: where a wheel rolls, name the coordinate that it rolls along, too (one of {others}), and its "
            f"speed by Initial or velocity=; or give a better guess of positions and speeds",
            residuals,
        )
    acts = force_magnitudes(e)
    part = np.abs(left) / np.where(acts > 0.0, acts, np.inf)
    d = int(np.argmax(part))
    return NotConverged(
        f"{begin}: {-left[d]:.3g} remain along {known[d].name}, {part[d]:.2g} of what acts there. Give a better guess "
        f"of positions and speeds",
        residuals,
    )
