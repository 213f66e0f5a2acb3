"""Initial state: consistent positions and velocities at the start, and the coordinates of the motion.

The start is the assembled reference configuration, or the end of an earlier result. Absolute or joint coordinates are
chosen by estimated cost. For coordinate partitioning the first independent coordinates are chosen here.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from ..assembly.assemble import assemble
from ..assembly.assembled_state import Assembly
from ..assembly.compiled_mechanism import CompiledMechanism, compile_mechanism
from ..engine.entry_point import MOTION
from ..engine.kinematics import turned_angles
from ..errors import AnalysisError, ModelError
from ..mobility.mobility import mobility
from ..model.event import Set
from ..model.model import Model
from ..results.diagnostics import undetermined_event_forces, undetermined_loads
from ..results.equilibrium import Equilibrium
from ..results.events import MotionStart, energies_at_end
from ..results.motion_record import extra_turns
from ..results.result import Result
from ..tables.constraint_rows import declared_switches
from ..tables.coordinate_choice import (
    cut_joints_text,
    least_cost,
    require_rotor_coordinates,
    right_hand_side_cost,
    rotors,
    spanning_joints,
)
from ..tables.element_numbers import shape_files
from ..tables.law_inputs import forces_in_events, nonsmooth_elements
from ..tables.reference_configuration import BodyState
from ..tables.structure import is_outdated
from ..tables.structure_definition import Structure, velocity_names
from ..tables.table_definitions import COUPLED, POINT
from ..tables.values import values_of
from .integration_intervals import Segment, whole_motion
from .solver_switching import CodeSelection, StiffnessMonitor

COORDINATES = ("auto", "absolute", "joint")
THIN_INERTIA = 1e-7  # negligible inertia of a coordinate, relative to total mass times the mechanism's length squared
SINGULAR_MASS = 1e-13  # smallest eigenvalue of the mass matrix scaled to a unit diagonal; smaller ones are rounding
MOST_AVOIDED = 8  # joints that are removed from the spanning forest, one after the other, before giving up


def choose_coordinates(a: Assembly, wish: str, parameters: Mapping[str, float] | None) -> tuple[Assembly, str]:
    """Choose the coordinates. Returns the assembled start in them, and a description with the reason.

    Parameters
    ----------
    a : Assembly
        In absolute coordinates.
    wish : str
        One of `COORDINATES`.
    parameters : mapping, optional
        As for assembly.

    Raises
    ------
    ModelError
        For an unknown wish, or if the inertia of a rotor is not along a velocity.
    AnalysisError
        If joint coordinates are requested but friction or an event depends on reactions that redundancy leaves
        undetermined. In joint coordinates the tree joint would carry everything; in absolute coordinates the load is
        distributed among redundant joints by least squares.
    """
    refuse_unknown_coordinates(wish)
    if wish == "absolute":
        require_rotor_coordinates(a.compiled.structure)
        return a, "absolute: as requested"
    needed = bool(rotors(a.compiled.structure.model))
    if why := _indeterminate_loads(a):
        if wish == "joint" or needed:
            raise AnalysisError(
                f"{a.compiled.structure.model.name!r} has no motion of its own in joint coordinates: {why}"
            )
        return a, f"absolute: {why}"
    here = _evaluation_cost(a.compiled.structure)
    c, why = _sound_forest(a, parameters, here if wish == "auto" and not needed else np.inf)
    if c is None:
        require_rotor_coordinates(a.compiled.structure)
        return a, f"absolute: {why}"
    require_rotor_coordinates(c.structure)
    if needed:
        why = "the inertia of a rotor is along a joint's coordinate"
    elif wish == "auto":
        there = _evaluation_cost(c.structure)
        if here <= there:
            return (
                a,
                f"absolute: {_size_in_words(a.compiled)} (joint coordinates need {_size_in_words(c)}, and more time)",
            )
        why = f"{_size_in_words(c)} (absolute coordinates need {_size_in_words(a.compiled)}, and more time)"
    else:
        why = "as requested"
    q, v = c.take(a.compiled, a.t, a.q, a.v)
    cut = cut_joints_text(c.structure.model, c.structure.tree_joints)
    return replace(a, compiled=c, q=q, v=v), f"joint: {why}{cut}"


def _evaluation_cost(s: Structure) -> float:
    return s.cache.get("cost", None, 1, partial(right_hand_side_cost, s))


def _indeterminate_loads(a: Assembly) -> str:
    """Return why friction, or an event on a joint's reaction, needs absolute coordinates; empty if it does not."""
    s = a.compiled.structure
    if not s.loads and not forces_in_events(s.model):
        return ""
    m = mobility(s.model, a)
    found = [f.title for f, _ in undetermined_loads(s.loads, m.undetermined)]
    found += [f"an event on {name!r}" for name, _ in undetermined_event_forces(s.model, m.undetermined)]
    if not found:
        return ""
    titles = ", ".join(found)
    names = ", ".join(m.redundant[:8])
    return (
        f"{titles} follow{'s' if len(found) == 1 else ''} reactions that the redundant constraints of {names} leave "
        "undetermined; the reactions of least norm are used, which are defined in absolute coordinates"
    )


def refuse_unknown_coordinates(wish: str) -> None:
    """Refuse an unknown choice of coordinates."""
    if wish not in COORDINATES:
        raise ModelError(f"unknown coordinates {wish!r}; choose one of {', '.join(COORDINATES)}")


def _size_in_words(c: CompiledMechanism) -> str:
    return f"{c.structure.nv} velocities and {len(c.structure.rows)} constraint equations"


def _sound_forest(
    a: Assembly, parameters: Mapping[str, float] | None, most: float = np.inf
) -> tuple[CompiledMechanism | None, str]:
    """Return a mechanism in joint coordinates that is regular at the start and may cost less than ``most``.

    If there is none, return None and the reason.
    """
    model = a.compiled.structure.model
    avoided: list[str] = []
    for _ in range(MOST_AVOIDED):
        tree = spanning_joints(model, avoided)
        if not tree:
            what = " that has inertia along its coordinates" if avoided else ""
            return None, f"no joint{what} can be a tree joint"
        if model.cache.get("least", tree, MOST_AVOIDED, partial(least_cost, model, tree)) > most:
            return None, f"{_size_in_words(a.compiled)} (in joint coordinates the mass matrix alone needs more time)"
        c = compile_mechanism(model, parameters=parameters, tree=tree)
        bad = _massless_tree_joint(c, a)
        if bad is None:
            return c, ""
        if bad not in c.structure.tree_joints:
            return None, (
                f"{bad} has no inertia, or less than {THIN_INERTIA:g} of that of the whole mass at the "
                "mechanism's length, "
                f"and no joint that could be a tree joint"
            )
        avoided.append(bad)
    return None, f"along {', '.join(avoided)} hardly any inertia moves"


def _massless_tree_joint(c: CompiledMechanism, a: Assembly) -> str | None:
    """Return a tree joint whose coordinates move hardly any inertia, or a body without joint and without inertia.

    Each joint alone may move inertia while several together move none. An example is a body without inertia that turns
    about its mass centre while its neighbour stays in place. The factorization then divides by rounding errors or by
    zero.
    """
    s, S = c.structure, c.values.system
    if S.scales.semidefinite == 0.0 or S.sizes.solver != COUPLED or not s.nv:
        return None
    q, v = c.take(a.compiled, a.t, a.q, a.v)
    c.at(a.t, q, v, MOTION)
    names = [*s.tree_joints, *s.place]
    roots = [(b,) if b >= 0 and S.tree.joint[b] <= POINT else () for b in s.place.values()]
    of = np.full(s.nv, -1)
    for k, links in enumerate([*(t.links for t in s.tree_joints.values()), *roots]):
        for b in links:
            of[S.tree.v[b] : S.tree.v[b] + S.tree.nv[b]] = k
    row, column, _ = S.mass_entries
    own = of[row] == of[column]
    M: dict[int, dict[tuple[int, int], float]] = {}
    for i, j, x in zip(
        row[own].tolist(),
        column[own].tolist(),
        (c.work.M[own] * c.sizes[row[own]] * c.sizes[column[own]]).tolist(),
        strict=True,
    ):
        M.setdefault(int(of[i]), {})[i, j] = x
    size = S.bodies.mass.sum() * c.values.length**2
    for k in sorted(M):
        first = min(i for i, _ in M[k])
        block = np.zeros((max(i for i, _ in M[k]) - first + 1,) * 2)
        for (i, j), x in M[k].items():
            block[i - first, j - first] = block[j - first, i - first] = x
        if np.linalg.eigvalsh(block)[0] < THIN_INERTIA * size:
            return names[k]
    whole = np.zeros((s.nv, s.nv))
    whole[row, column] = whole[column, row] = c.work.M
    scale = 1.0 / np.sqrt(whole.diagonal())
    least, moves = np.linalg.eigh(scale[:, None] * whole * scale)
    return names[of[np.argmax(np.abs(moves[:, 0]))]] if least[0] < SINGULAR_MASS else None


MOST_STARTS = 4  # initial states that are cached for one set of parameter values


@dataclass
class InitialState:
    """A consistent initial state in the coordinates of the motion."""

    base: Assembly  # in absolute coordinates
    assembly: Assembly
    y: np.ndarray
    coordinates: str  # the chosen coordinates, and why
    wound: dict[str, float]  # body -> whole turns in its coordinates beyond its angle (`Result.wound`)
    engine: CodeSelection | None = None  # None: general engine
    before: Result | None = None  # the earlier result that the motion continues
    pace: StiffnessMonitor | None = None  # None: the method does not change
    since: float = 0.0  # start of the call, by `time.perf_counter`
    part: Segment = field(default_factory=whole_motion)  # segment of the motion

    def again(self, part: Segment) -> InitialState:
        """Return a copy with its own arrays and workspace, for a motion that continues no earlier one."""
        base = self.base.again()
        a = base if self.assembly is self.base else self.assembly.again()
        return InitialState(base, a, self.y.copy(), self.coordinates, dict(self.wound), part=part)

    @property
    def earlier_data(self) -> Mapping[str, Any]:
        """Data from the segment before this one; empty if there is none."""
        return self.before.carried if self.part.later and self.before is not None else {}


def start_of_motion(start: Result | Equilibrium | None) -> Result | None:
    """Return the result whose end is the start of a motion; of an equilibrium its result, which has one time.

    Raises
    ------
    ModelError
        If the equilibrium has preloads, which the motion would lack.
    """
    if not isinstance(start, Equilibrium):
        return start
    if start.preload:
        raise ModelError(
            f"the equilibrium needs the preload of {', '.join(start.preload)}, which the motion would lack; add "
            f"x.preload to the laws, and compute the equilibrium without preload="
        )
    return start.result


def start_time(t_start: float | None, before: Result | None) -> float:
    """Return the start time of a motion [s].

    Raises
    ------
    ModelError
        If both a time and an earlier result are given, or ``before`` is not a result.
    """
    if before is None:
        return 0.0 if t_start is None else t_start
    if not isinstance(before, Result):
        raise ModelError(f"start is a result of simulate or an equilibrium, not {type(before).__name__}")
    if t_start is not None:
        raise ModelError("a continued motion starts where the result ended: leave out t_start, or start")
    return before.final[0]


def find_initial_state(
    model: Model,
    t: float,
    parameters: Mapping[str, float] | None,
    before: Result | None,
    coordinates: str,
    *,
    switches: bool = False,
    part: Segment | None = None,
) -> InitialState:
    """Assemble the mechanism, or continue an earlier result, and choose the coordinates.

    With ``switches`` the tables contain rows for all switches (stops, stick friction, locks), all inactive. Without
    them none exist, and friction follows the sign of the rate. ``part`` is the segment of the motion: a later segment
    has the coordinates and parameters of the one before it.

    Raises
    ------
    AssemblyError
        If the start cannot be made consistent.
    ModelError
        If a body can move without inertia, or the earlier result is of another mechanism.
    """
    part = part or whole_motion()
    if before is not None or parameters or not model.frozen:
        return _computed_state(model, t, parameters, before, coordinates, switches, part)
    key = float(t).hex(), coordinates, switches
    known: InitialState | None = model.cache.known("begun", key)
    if known is not None and is_outdated(known.base.compiled.structure):
        model.cache.drop("begun", key)
        known = None
    if known is None:
        found = _computed_state(model, t, None, None, coordinates, switches, part)
        if _reproducible(found.base.compiled.structure):
            model.cache.get("begun", key, MOST_STARTS, lambda: found.again(whole_motion()))
        return found
    return known.again(part)


def _computed_state(
    model: Model,
    t: float,
    parameters: Mapping[str, float] | None,
    before: Result | None,
    coordinates: str,
    switches: bool,
    part: Segment,
) -> InitialState:
    """Compute the initial state without the cache."""
    if before is not None and before.phases is not None:
        set_by_events = _set_by_events(model, before)
        parameters = {**(parameters or {}), **set_by_events} if part.later else {**set_by_events, **(parameters or {})}
    base = _absolute_state(model, t, parameters, before)
    if part.later and before is not None:
        return replace(_in_same_coordinates(base, parameters, before, switches), part=part)
    if base.compiled.values.system.scales.semidefinite > 0.0:
        mobility(model, base, inertia=True)
    return replace(initial_state_at(base, parameters, coordinates, before, switches=switches), part=part)


def _reproducible(s: Structure) -> bool:
    """Return whether a cached state stays valid: the model reads no file and calls no Python function."""
    return not s.functions and not shape_files(s.model)


def _in_same_coordinates(
    base: Assembly, parameters: Mapping[str, float] | None, before: Result, switches: bool
) -> InitialState:
    """Continue in the coordinates of the earlier segment."""
    model, tree = base.compiled.structure.model, before.values.structure.tree
    c = compile_mechanism(model, parameters=parameters, tree=tree) if tree else base.compiled.again()
    nq, nv = c.structure.nq, c.structure.nv
    y = before.final[1]
    a = Assembly(c, base.t, y[:nq].copy(), y[nq : nq + nv].copy())
    if switches:
        a = add_switches(a, parameters)
    y = _final_state(before, a)
    _restore_modes(before, a)
    return InitialState(base, a, y, before.health.coordinates, _whole_turns(base, a, y), before=before)


def _set_by_events(model: Model, before: Result) -> dict[str, float]:
    """Return the final values of parameters that events set in an earlier motion, or in one that it continued.

    Controller states that events set are part of the final state instead.
    """
    assert before.phases is not None
    names = {a.parameter for e in model.events for a in e.do if isinstance(a, Set)} & model.parameters.keys()
    if not names:
        return {}
    env, last = compile_mechanism(model).values.env, before.phases.all[-1].values.env
    return {k: float(last[k]) for k in sorted(names) if last.get(k, env[k]) != env[k]}


def initial_state_at(
    base: Assembly,
    parameters: Mapping[str, float] | None,
    coordinates: str,
    before: Result | None = None,
    *,
    switches: bool = False,
) -> InitialState:
    """Return the initial state for an assembled mechanism; choose the coordinates."""
    refuse_unknown_coordinates(coordinates)
    x = base.compiled.values
    key = coordinates, float(base.t).hex(), base.y.tobytes(), switches
    found = x.unforced.cache.get(
        "begun", key, MOST_STARTS, lambda: _initial_state_of(base, coordinates, parameters, switches)
    )
    if found.assembly.compiled.values is found.base.compiled.values:
        a = base
    elif found.base.compiled.values is x:
        a = found.assembly.again()
    else:
        c = found.assembly.compiled
        own = CompiledMechanism(values_of(c.structure, x.given), c.z, dict(parameters or {}))
        a = replace(found.assembly.again(), compiled=own.again())
    if before is None:
        return InitialState(base, a, a.y, found.coordinates, dict(found.wound))
    y = _final_state(before, a)
    _restore_modes(before, a)
    return InitialState(base, a, y, found.coordinates, _whole_turns(base, a, y), before=before)


def _initial_state_of(
    base: Assembly, wish: str, parameters: Mapping[str, float] | None, switches: bool
) -> InitialState:
    a, why = choose_coordinates(base, wish, parameters)
    if switches:
        a = add_switches(a, parameters)
    found = InitialState(base, a, a.y, why, _whole_turns(base, a, a.y))
    return replace(found, base=base.again(), assembly=a.again())  # without the workspace


def _restore_modes(before: Result, a: Assembly) -> None:
    """Restore the modes with which an earlier result ended."""
    s, W = a.compiled.structure, a.compiled.work
    old = before.values.structure
    if before.phases is None or [x.element.name for x in s.switches] != [x.element.name for x in old.switches]:
        return
    last = before.phases.all[-1]
    W.modes.mode[:], W.modes.hold[:] = last.modes.mode, last.modes.hold
    W.sensed.value[W.sensed.shape[1] - len(s.switches) :] = last.sigma if last.sigma.ndim == 1 else last.sigma[:, -1]


def add_switches(a: Assembly, parameters: Mapping[str, float] | None) -> Assembly:
    """Return the assembly with rows for all switches, all inactive, if the model has any."""
    s = a.compiled.structure
    if not declared_switches(s.model) and not s.model.events and not nonsmooth_elements(s.model):
        return a
    c = compile_mechanism(s.model, parameters=parameters, tree=s.tree, switches=True)
    c.follow(a.compiled.hints)
    return replace(a, compiled=c)


def _whole_turns(base: Assembly, a: Assembly, y: np.ndarray) -> dict[str, float]:
    s = a.compiled.structure
    if (
        not s.tree
        or not s.model.planar
        or (base.compiled.is_reference_configuration(base.q) and a.compiled.is_reference_configuration(y[: s.nq]))
    ):
        return {}
    q, c = y[: s.nq], a.compiled
    c.at(a.t, q, np.zeros(s.nv))
    base.compiled.at(base.t, base.q, base.v)
    angles = turned_angles(base.compiled.values, base.compiled.work, base.q)
    return extra_turns(turned_angles(c.values, c.work, q), angles)


def _absolute_state(model: Model, t: float, parameters: Mapping[str, float] | None, before: Result | None) -> Assembly:
    """Return the start in absolute coordinates: assembled as described, or where an earlier result ended."""
    if before is None:
        return assemble(model, t=t, parameters=parameters)
    old = before.values.structure
    c = compile_mechanism(model, parameters=parameters, tree=old.tree, switches=before.phases is not None)
    same = list(old.slices) == list(c.structure.slices) and old.states == c.structure.states
    if not before.health.simulated and not same:
        return _state_at_equilibrium(model, t, parameters, before)
    y = before.state_at_end(c)
    nq, nv = c.structure.nq, c.structure.nv
    q, v, c.z = y[:nq], y[nq : nq + nv], y[nq + nv :].copy()
    refuse_jump(before, c, t, q, v)
    c.at(t, q, v)
    if not c.structure.tree and before.phases is None:
        return Assembly(c, t, q.copy(), v.copy())
    plain = compile_mechanism(model, parameters=parameters)
    q, v = plain.take(c, t, q, v)
    for name, more in before.wound.items():
        q[plain.values.system.tree.q[plain.structure.place[name]] + 2] -= more
    return Assembly(plain, t, q, v)


def _state_at_equilibrium(model: Model, t: float, parameters: Mapping[str, float] | None, rest: Result) -> Assembly:
    """Return the state of an equilibrium in whose model constraints stand for the stops and contacts that hold."""
    c = compile_mechanism(model, parameters=parameters)
    old = rest.values.structure
    joints, known = ({j.name for j in m.joints} for m in (model, rest.model))
    if list(old.place) != list(c.structure.place) or not joints <= known:
        raise ModelError(f"the equilibrium of {rest.model.name!r} is of a mechanism with other bodies or joints")
    q, v, z = np.split(rest.final[1], [old.nq, old.nq + old.nv])
    return Assembly(c, t, *c.take(CompiledMechanism(rest.values, z.copy()), t, q, v))


def start_record(start: InitialState) -> MotionStart:
    """Return the record of the motion's start; a later segment has no energies from earlier ones."""
    return MotionStart(
        start.y.copy(), energies_at_end(start.before) if start.before is not None and not start.part.later else {}
    )


def _final_state(before: Result, a: Assembly) -> np.ndarray:
    """Return the final state of an earlier result, unchanged to the last bit in its own coordinates."""
    s, old = a.compiled.structure, before.values.structure
    y = before.final[1].copy()
    if s.tree == old.tree and s.states == old.states:
        a.compiled.z = y[s.nq + s.nv :].copy()
        return y
    states = dict(zip(old.states, y[old.nq + old.nv :].tolist(), strict=True))
    z = [states.get(name, known) for name, known in a.compiled.hints.items()]
    return np.r_[a.q, a.v, z]


# Check that a motion may continue an earlier result: edits since then must not change positions or velocities.


POSITION_CHANGE = 1e-6  # allowed change of position, relative to the mechanism's length, or [rad]
VELOCITY_CHANGE_SHARE = 1e-4  # allowed change of velocity (lengths: the mechanism's), relative to the largest
VELOCITY_CHANGE = 1e-5  # the same, relative to the characteristic rate: violation of the velocity constraints


def refuse_jump(before: Result, c: CompiledMechanism, t: float, q: np.ndarray, v: np.ndarray) -> None:
    """Refuse a state that violates constraints, or that joint coordinates would move.

    Raises
    ------
    ModelError
        Naming the body or constraint and the difference.
    """
    if c.values is before.values:
        return
    now = _body_states(c, t, q, v)
    size = c.values.length
    titles, unit = _row_titles(c), c.row_units
    off = dict(zip(titles, np.abs(c.work.rows.value) / unit, strict=True))
    fast = dict(zip(titles, np.abs(c.jacobian() @ v - c.work.rows.nu) / unit, strict=True))
    most = max(np.abs(v / c.sizes).max(initial=0.0), np.abs(c.work.rows.nu / unit).max(initial=0.0))
    if c.structure.tree:
        then = _body_states(CompiledMechanism(before.values, before.final[1][len(q) + len(v) :].copy()), t, q, v)
        off |= {
            f"body {k!r}": max(_largest_size(x.p - then[k].p) / size, _largest_size(x.R - then[k].R))
            for k, x in now.items()
        }
        fast |= {
            f"body {k!r}": max(_largest_size(x.v - then[k].v) / size, _largest_size(x.w - then[k].w))
            for k, x in now.items()
        }
        most = max([most, *(_largest_size(np.r_[x.v / size, x.w]) for x in (*now.values(), *then.values()))])
    _refuse_difference(before, c, off, POSITION_CHANGE, "", size)
    allowed = max(VELOCITY_CHANGE * float(c.work.options.rate), VELOCITY_CHANGE_SHARE * most)
    _refuse_difference(before, c, fast, allowed, " in velocity", size)


def _body_states(c: CompiledMechanism, t: float, q: np.ndarray, v: np.ndarray) -> dict[str, BodyState]:
    """Return pose and velocity of every body, with prescribed coordinates at their prescribed values."""
    c.at(t, q, v, MOTION)
    K = c.work.bodies.copy()
    return {
        name: BodyState(K.position[b], K.rotation[b], K.velocity[b], K.angular_velocity[b])
        for name, b in c.structure.place.items()
        if b >= 0
    }


def _row_titles(c: CompiledMechanism) -> list[str]:
    return [f"{r.element.title} ({r.label}, row {k})" for k, r in enumerate(c.structure.rows)]


def _largest_size(x: np.ndarray) -> float:
    return float(np.abs(x).max(initial=0.0))


def _refuse_difference(
    before: Result, c: CompiledMechanism, off: dict[str, float], most: float, what: str, size: float
) -> None:
    if not off:
        return
    worst = max(off, key=lambda name: off[name] if off[name] == off[name] else np.inf)
    if not off[worst] <= most:
        raise ModelError(
            f"the result of {before.model.name!r} cannot be continued: {worst} of {c.structure.model.name!r} is "
            f"{off[worst] * size:.3g}{what} from where the result ended. Parameters or parts may have changed: a "
            "change must keep the position and velocity of every body"
        )


def choose_independent(model: Model, start: InitialState) -> None:
    """Choose the dependent coordinates for coordinate partitioning, and set the coordinate scales.

    Their number is the rank of the constraint Jacobian at the start. QR with column pivoting selects them first;
    lengths are scaled by the mechanism's length and rows normalized to unit vectors (Businger and Golub 1965).
    """
    from scipy.linalg import qr

    a = start.assembly
    c = a.compiled
    c.at(a.t, a.q, a.v)
    size = start.assembly.compiled.sizes
    tree = c.structure.tables["tree"]
    given = tree.v[tree.law >= 0]
    size[given] = 0.0
    G = c.jacobian() * size
    length = np.sqrt((G * G).sum(axis=1))
    G = G[length > 0.0] / length[length > 0.0, None]
    order = qr(G, mode="r", pivoting=True)[1] if len(G) else np.arange(len(size))
    dependent = order[: len(size) - len(given) - mobility(model, start.base).freedoms]
    c.work.velocities.partition[:] = -size
    c.work.velocities.partition[dependent] *= -1.0


def independent_names(start: InitialState) -> tuple[str, ...]:
    """Return the names of the coordinates that are independent now."""
    c = start.assembly.compiled
    return tuple(
        n.name for n, p in zip(velocity_names(c.structure), c.work.velocities.partition, strict=True) if p < 0.0
    )
