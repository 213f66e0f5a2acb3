"""The assembled state: consistent positions and velocities near those described, or why there is none.

The error lists the elements whose constraints cannot be satisfied together, and the residuals.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..constraints import angle, rotation_component
from ..constraints.inclination import KIND_PITCH
from ..engine.kinematics import load_record
from ..engine.rows import row_parameters
from ..errors import AssemblyError
from ..model.body import Body, Driver, Frame
from ..model.element import LawOf
from ..model.expressions import Expression, number
from ..model.geometry import quaternion_to_matrix, rotation_about
from ..model.joint import Coupling, Joint
from ..model.model import Model
from ..results.health import InitialDeviation
from ..results.wording import tuple_text
from ..tables.reference_configuration import BodyState
from .compiled_mechanism import CompiledMechanism, compile_mechanism, initial_hints
from .positions_and_velocities import (
    CLOSED_TOLERANCE,
    FAR_CLOSED_TOLERANCE,
    close_from_far,
    consistent_velocities,
    contradictory_elements,
    fast_velocities,
    gauss_newton,
    largest_residual,
    position_rounding,
    velocity_departures,
)

ROW_PARTS = ("value", "force on M", "torque on M", "torque on F", "bias")  # the results of a row's formula
MAX_LISTED = 8  # elements that a message names
NEGLIGIBLE_GAP = 1e-9  # negligible gap, relative to the mechanism's length, or [rad]


def position_error(c: CompiledMechanism, best: Any) -> AssemblyError:
    """Return the error that names elements with inconsistent constraints, worst first; ``best``: the nearest state."""
    t = best.t
    c.at(t, best.q, best.v)
    g = c.work.rows.value
    name, length = c.structure.model.name, c.values.length
    lawless = [r.element for r, x in zip(c.structure.rows, g, strict=True) if r.law >= 0 and not np.isfinite(x)]
    if lawless:
        missed = c.structure.missed(c.work.stack)
        return AssemblyError(
            f"{name!r} cannot be assembled at t = {t:g} s: the law of {lawless[0].title} has no finite value there"
            f"{f': {missed.message}' if missed else ''}"
        )
    if text := undefined_row(c):
        return AssemblyError(f"{name!r} cannot be assembled at t = {t:g} s: {text}")
    gaps: dict[str, tuple[float, float]] = {}
    for element, rows in c.structure.slices.items():
        part, metric = g[rows], c.metric[rows]
        if len(part) and not np.abs(part / c.row_units[rows]).max() < NEGLIGIBLE_GAP:
            gaps[element] = float(np.linalg.norm(part[metric])), float(np.linalg.norm(part[~metric]))
    worst = sorted(gaps, key=lambda k: -max(gaps[k][0] / length, gaps[k][1]))
    shown = "; ".join(f"{k} {_gap_text(c, k, *gaps[k])}" for k in worst[:MAX_LISTED])
    return AssemblyError(
        f"{name!r} cannot be assembled at t = {t:g} s: no position fulfils all constraints. At the best position found "
        f"{shown or 'rows disagree'}. Check lengths and the points of these joints, the drivers, and initial values, "
        f"or give a better guess",
        gaps={k: gaps[k] for k in worst},
        best=best,
    )


def undefined_row(c: CompiledMechanism) -> str:
    """Return a message on a constraint row that is not finite at the present kinematics; empty if there is none.

    It is user-defined, or that of a coordinate at a singular position.
    """
    s, S, W = c.structure, c.values.system, c.work
    for k, t in enumerate(s.terms):
        if isinstance(t.owner, Joint):
            distance = float(np.linalg.norm(W.frames.position[t.M] - W.frames.position[t.F]))
            if text := t.owner.degenerate(c.values.numbers[t.owner.name], distance, AT_ONE_POINT * c.values.length):
                return text
        singular = t.owner is not None and t.owner.coordinates[t.what].singular
        if s.term_code[k] is None and not singular:
            continue
        par, F, M = row_parameters(S.term_parameters, k), load_record(W.frames, t.F), load_record(W.frames, t.M)
        with np.errstate(all="ignore"):
            row = t.formula.of_kind.row(par, F, M, 0.0, S.const)
        finite = np.isfinite(np.hstack(row)).all()
        if singular and (not finite or _angle_to_singular(t, F, M) < NEAR_SINGULAR):
            return f"{t.owner.name}.{t.what}, which {t.element.title} uses, is {singular}. {OTHER_COORDINATES}"
        if not finite:
            named = ", ".join(f"{name} {np.array(x)}" for name, x in zip(ROW_PARTS, row, strict=True))
            return (
                f"{type(t.formula).__name__}.row of {t.element.title} is not finite for par = {np.array(par[:6])} with "
                f"its frames at {np.array(F[0])} m and {np.array(M[0])} m: {named}"
            )
    return ""


AT_ONE_POINT = 1e-5  # relative to the mechanism's length: to this a fault at coinciding points is attributed
NEAR_SINGULAR = 0.02  # [rad] from a singular position: to this a fault there is attributed
OTHER_COORDINATES = (
    "Use another of its coordinates there, or frames whose axes are turned so that the motion keeps away from it"
)


def _angle_to_singular(t: Any, F: tuple, M: tuple) -> float:
    """Return the angle [rad] of a coordinate of a rotation from its singular positions, for small ones."""
    f, m = np.reshape(F[1], (3, 3)), np.reshape(M[1], (3, 3))
    if t.formula.kind == rotation_component.KIND:
        return float(np.pi - np.arccos(np.clip(0.5 * (np.sum(f * m) - 1.0), -1.0, 1.0)))
    if t.formula.kind == angle.KIND:
        return float(np.linalg.norm(f[:, :2].T @ m[:, 0]))
    if t.formula.kind == KIND_PITCH:
        return float(np.linalg.norm(np.cross(f[:, 2], m[:, 0])))
    return float(np.linalg.norm(np.cross(f[:, 2], m[:, 2]))) if isinstance(t.element, Driver) else np.inf


def _gap_text(c: CompiledMechanism, name: str, metres: float, radians: float) -> str:
    if isinstance(e := c.structure.model.find(name), Coupling) and e.equation(c.structure.model) is not None:
        return f"has the value {radians:.4g} in place of 0"
    parts = [
        f"{metres:.4g} m" if metres > NEGLIGIBLE_GAP * c.values.length else "",
        f"{np.degrees(radians):.4g} deg" if radians > NEGLIGIBLE_GAP else "",
    ]
    return f"is {' and '.join(x for x in parts if x)} from closed"


def undefined_rate_error(c: CompiledMechanism, t: float) -> AssemblyError | None:
    """Return the error for a driver's law without finite rate at t, by the rows last evaluated; None if there is
    none.
    """
    for r, x in zip(c.structure.rows, c.work.rows.nu, strict=True):
        if not np.isfinite(x):
            return AssemblyError(
                f"{c.structure.model.name!r} cannot be assembled at t = {t:g} s: the law of {r.element.title} has the "
                f"rate {x:g} there. Give a law that is smooth at the start, or start later"
            )
    return None


def velocity_error(c: CompiledMechanism, gaps: Mapping[str, float], best: Any, reason: str = "") -> AssemblyError:
    """Return the error for contradictory velocity constraints; ``gaps``: residuals at the nearest velocities [m/s or
    rad/s].
    """
    begin = f"{c.structure.model.name!r}: no velocities satisfy all constraints at t = {best.t:g} s"
    if reason:
        return AssemblyError(f"{begin}: {reason}", gaps=dict(gaps), best=best)
    listed = ", ".join(f"{k} by {x:.4g} {rate_unit(c, k)}" for k, x in list(gaps.items())[:MAX_LISTED])
    more = f" and {len(gaps) - MAX_LISTED} more" if len(gaps) > MAX_LISTED else ""
    return AssemblyError(
        (
            f"{begin}; the nearest velocities violate {listed}{more}. Check drivers, initial rates and bodies with "
            "as_drawn=True"
        ),
        gaps=dict(gaps),
        best=best,
    )


def rate_unit(c: CompiledMechanism, name: str) -> str:
    """Return the unit of the rates of an element's rows."""
    rows = c.structure.slices.get(name)
    metric = c.metric[rows] if rows is not None else np.ones(1, bool)
    return "m/s" if metric.all() else "rad/s" if not metric.any() else "m/s or rad/s"


MAX_CACHED_ASSEMBLIES = 4  # cached assemblies of one set of values


@dataclass(repr=False)
class Assembly:
    """A consistent start: the compiled mechanism, its state, and the deviations from the description."""

    compiled: CompiledMechanism
    t: float
    q: np.ndarray
    v: np.ndarray
    moved: dict[str, float] = field(default_factory=dict)  # body -> displacement of its mass centre [m]
    iterations: int = 0
    departures: tuple[
        InitialDeviation, ...
    ] = ()  # changed positions, given velocities that are inconsistent, other velocities that are very large

    def again(self) -> Assembly:
        """Return a copy with its own arrays and workspace."""
        c, q, v = self.compiled.again(), self.q.copy(), self.v.copy()
        return Assembly(c, self.t, q, v, dict(self.moved), self.iterations, self.departures)

    def of(self, c: CompiledMechanism) -> Assembly:
        """Return the assembly of a mechanism that differs in forces and controllers only, with its own controller
        states.
        """
        a, n = self.again(), len(c.structure.controls)
        z = np.concatenate([c.z[:n], a.compiled.z[n:]])
        a.compiled = CompiledMechanism(c.values, z, c.parameters)
        return a

    @property
    def y(self) -> np.ndarray:
        """State vector with work states zero."""
        return np.concatenate([self.q, self.v, self.compiled.z])

    def lines(self) -> list[tuple[str, str]]:
        """Return labelled lines of text: position and velocity of every mass centre, and deviations."""
        length = self.compiled.values.length
        out = [("assembled", f"{self.compiled.structure.model.name}, t = {self.t:g} s, {self.iterations} iterations")]
        bodies = self._bodies()
        fast, spin = (max(float(np.abs(x).max()) for x in (getattr(b, k) for b in bodies.values())) for k in "vw")
        for name, b in bodies.items():
            at, moves, spins = tuple_text(b.p, 6, length), tuple_text(b.v, 6, fast), tuple_text(b.w, 6, spin)
            out.append((name, f"mass centre {at} m, velocity {moves} m/s, turning {spins} rad/s"))
        out += [("moved", f"{name} by {way:.3g} m") for name, way in self.moved.items()]
        return [*out, *(("not kept", d.text) for d in self.departures)]

    def as_dict(self) -> dict[str, Any]:
        """Return the same as plain data, in world axes."""
        bodies = {
            name: {"mass_centre": b.p.tolist(), "velocity": b.v.tolist(), "angular_velocity": b.w.tolist()}
            for name, b in self._bodies().items()
        }
        gone = [d.as_dict() for d in self.departures]
        return {"t": self.t, "iterations": self.iterations, "bodies": bodies, "moved": self.moved, "departures": gone}

    def __repr__(self) -> str:
        """Return the lines as text."""
        return "\n".join(f"{label:<12} {text}" for label, text in self.lines())

    def _bodies(self) -> dict[str, BodyState]:
        return self.compiled.moving(self.t, self.q, self.v)


ContradictionExplainer = Callable[[CompiledMechanism, float, np.ndarray, np.ndarray, np.ndarray], str]
"""(mechanism, t, q, v, right-hand sides of its rows) -> why they are contradictory; "" if that is not known."""


def consistent_state(
    model: Model,
    *,
    t: float = 0.0,
    parameters: Mapping[str, float] | None = None,
    explain: ContradictionExplainer | None = None,
) -> Assembly:
    """Find positions and velocities that fulfil all constraints at time t, near those described.

    Raises
    ------
    AssemblyError
        If no closed position, or no consistent velocity, is found; the message names the joints that disagree and by
        how much.
    """
    plain = compile_mechanism(model, parameters=parameters)
    x = plain.values
    model, key = x.structure.model, float(t).hex()
    home = x if _poses_differ(plain) else x.unforced
    found = home.cache.get(
        "assembled", key, MAX_CACHED_ASSEMBLIES, lambda: _assemble_anew(model, plain, t, parameters, explain).again()
    )
    return found.again() if found.compiled.values is x else found.of(plain)


def _poses_differ(c: CompiledMechanism) -> bool:
    """Return whether reference angles and curve positions differ from those of values that differ in forces only."""
    x, n = c.values, len(c.structure.controls)
    if (other := x.alike) is None:
        return True
    return not np.array_equal(c.z[n:], other.cache.get("places", None, 1, lambda: initial_hints(other))[n:])


def _assemble_anew(
    model: Model,
    compiled_model: CompiledMechanism,
    t: float,
    parameters: Mapping[str, float] | None,
    explain: ContradictionExplainer | None,
) -> Assembly:
    env = compiled_model.values.env
    values, initial_rates = initial_conditions(model, env)
    known = dict(values) | driver_positions(model, t, env)
    turned = initial_turn_angles(compiled_model, known)
    compiled_model.follow(turned)
    drawn = compiled_model.values.q.copy()
    add_whole_turns(compiled_model, known, drawn)
    q, count = _closed_position(model, compiled_model, t, drawn, values, parameters)
    compiled_model.follow(turned)  # closing may have arrived from the other side: a whole turn away
    compiled_model.at(t, q, compiled_model.values.v)
    if error := undefined_rate_error(compiled_model, t):
        raise error
    v, wanted, c = consistent_velocities(model, compiled_model, parameters, t, q, initial_rates)
    if gaps := contradictory_elements(wanted, v):
        said = explain(c, t, q, v, wanted.nu) if explain is not None and not wanted.held else ""
        raise velocity_error(c, gaps, Assembly(compiled_model, t, q, v), said)
    compiled_model.at(t, q, v)
    near = position_rounding(compiled_model)
    rates = wanted.scale[: len(wanted.nu)] * wanted.nu
    departures = (
        *_pose_departures(compiled_model, drawn, q, near),
        *velocity_departures(compiled_model, q, v),
        *fast_velocities(compiled_model, q, v, rates),
    )
    return Assembly(compiled_model, t, q, v, _displacements(compiled_model, drawn, q, near), count, departures)


def _closed_position(
    model: Model,
    compiled_model: CompiledMechanism,
    t: float,
    reference: np.ndarray,
    values: Mapping[str, float],
    parameters: Mapping[str, float] | None,
) -> tuple[np.ndarray, int]:
    """Return a closed position near the reference configuration, and the number of iterations; angle states are
    updated.
    """
    q, v = reference.copy(), compiled_model.values.v
    holds = [i for i in model.initial if i.name in values]
    near = compiled_model
    if holds or not all(r.holonomic for r in compiled_model.structure.rows):
        near = compile_mechanism(model, parameters=parameters, positions=True, holds=holds, held=values)
        near.follow(compiled_model.hints)
    count = 0
    if largest_residual(near, t, q, v, 0.0) > CLOSED_TOLERANCE or _has_joints_by_frames(
        model
    ):  # also joints given by frames: close them to rounding, not only to the tolerance
        far = compile_mechanism(model, parameters=parameters, far=True, holds=holds, held=values)
        far.follow(compiled_model.hints)
        if largest_residual(far, t, q, v) > FAR_CLOSED_TOLERANCE:
            q, count = close_from_far(far, t, q, v)
            near.follow(far.hints)
        q, more = gauss_newton(near, t, q, v)
        count += more
        if largest_residual(near, t, q, v) > CLOSED_TOLERANCE or largest_residual(far, t, q, v) > FAR_CLOSED_TOLERANCE:
            compiled_model.follow(near.hints)
            raise position_error(far, Assembly(compiled_model, t, q, v))
    compiled_model.follow(near.hints)
    return q, count


def _has_joints_by_frames(model: Model) -> bool:
    """Return whether some joint is given by frames, so that the reference configuration may not be closed there."""
    return any(j.at is None for j in model.joints)


def _displacements(c: CompiledMechanism, before: np.ndarray, after: np.ndarray, uncertainty: float) -> dict[str, float]:
    """Return body -> displacement of its mass centre, where beyond rounding."""
    out: dict[str, float] = {}
    if np.array_equal(before, after):
        return out
    k = 2 if c.structure.model.planar else 3
    for name, b in c.structure.place.items():
        if b >= 0:
            at = slice(int(c.values.system.tree.q[b]), int(c.values.system.tree.q[b]) + k)
            d = float(np.linalg.norm(after[at] - before[at]))
            if d > 1e-12 * c.values.length + uncertainty:
                out[name] = d
    return out


def _pose_departures(
    c: CompiledMechanism, before: np.ndarray, after: np.ndarray, uncertainty: float
) -> list[InitialDeviation]:
    """Return the changes of poses of reference frames from the reference configuration, beyond rounding."""
    out: list[InitialDeviation] = []
    if np.array_equal(before, after):
        return out
    x = c.values
    k = 2 if x.structure.model.planar else 3
    small = 1e-12 * x.length + uncertainty
    for name, b in x.structure.place.items():
        if b < 0:
            continue
        at, n = int(x.system.tree.q[b]), int(x.system.tree.nq[b])
        was, now = before[at : at + n], after[at : at + n]
        p, o = (_frame_origin(z, x.bodies[name], k) for z in (was, now))
        what, unit = ("angle", "rad") if k == 2 else ("orientation", "1")
        turned = InitialDeviation(name, what, tuple(was[k:].tolist()), tuple(now[k:].tolist()), unit)
        if np.linalg.norm(o - p) > small:
            out.append(InitialDeviation(name, "position", tuple(p.tolist()), tuple(o.tolist()), "m"))
        if n > k and turned.distance > 1e-12:
            out.append(turned)
    return out


def _frame_origin(q: np.ndarray, reference: Any, k: int) -> np.ndarray:
    """Return the origin of a body's reference frame from its coordinates; a point mass keeps its reference
    orientation.
    """
    R = reference.R if len(q) == k else rotation_about(2, q[2]) if k == 2 else quaternion_to_matrix(q[3:7])
    return q[:k] - (R @ reference.com)[:k]


# Initial conditions that override the reference configuration: `Initial` elements and drivers.


def initial_turn_angles(c: CompiledMechanism, known: Mapping[str, float]) -> dict[str, float]:
    """Return starting values of angle states where the values of their coordinates are given."""
    out = {}
    for name in set(known) & set(c.structure.state_at):
        joint, what = c.structure.model.coordinate(name, c.structure.model.bodies[0])
        offset = joint.offset(c.values.numbers[joint.name], what) if isinstance(joint, Joint) else 0.0
        out[name] = joint.coordinates[what].sign * (known[name] - offset)
    return out


def add_whole_turns(c: CompiledMechanism, known: Mapping[str, float], q: np.ndarray) -> None:
    """Add whole turns to the angles of planar bodies whose angle is given."""
    s = c.structure
    for name, value in known.items():
        owner, what = s.model.coordinate(name, s.model.bodies[0])
        if what != "angle" or not isinstance(owner, (Body, Frame)):
            continue
        b = s.place[s.model.carrier(owner.name, owner)]
        if b >= 0:
            whole = np.round((value - c.values.poses.turned(owner)) / (2.0 * np.pi))
            q[s.tables["tree"].q[b] + 2] += 2.0 * np.pi * whole


def initial_conditions(model: Model, env: Mapping[str, float]) -> tuple[dict[str, float], dict[str, float]]:
    """Return the values and rates that initial conditions prescribe."""
    values, rates = {}, {}
    for i in model.initial:
        unit = model.unit(i.name, i)
        if i.value is not None:
            values[i.name] = number(i.value, env, unit, f"value of {i.title}")
        if i.rate is not None:
            rates[i.name] = number(i.rate, env, f"{unit}/s", f"rate of {i.title}")
    return values, rates


def _driver_law(model: Model, d: Driver) -> Expression:
    return model.law(d.law, LawOf(model.unit(d.coordinate, d)), f"law of {d.title}")


def driver_positions(model: Model, t: float, env: Mapping[str, float]) -> dict[str, float]:
    """Return the values that drivers' laws prescribe at time t, as far as they depend on time alone."""
    out = {}
    model = model.snapshot()
    tables = model.law_tables()
    laws = model.cache.get("laws of drivers", None, 1, lambda: {d.name: _driver_law(model, d) for d in model.drivers})
    for d in (x for x in model.drivers if not x.of_rate):
        law = laws[d.name]
        if law.names <= {"t", *env}:
            out[d.coordinate] = law.evaluate({**env, "t": t}, tables=tables)
    return out
