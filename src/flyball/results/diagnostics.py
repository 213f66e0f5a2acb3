"""Diagnostics of a motion: acceleration defects, orientation errors, creep, pulling contacts.

Each check returns a text with a remedy, or nothing for a sound motion.

Orientation errors: a spatial rotation is integrated as a quaternion, q' = q w / 2. A method of order p has an error of
about (w h)^(p + 1) per step, which neither energy nor constraints show. The error of a steady rotation is known: for
explicit methods from u' = i w u / 2 with u normalised in every evaluation, for `radau` from d' = w (1 + d^2 / 4), d
being Cayley's step. Methods with error control bound it, and generalised-alpha and the variational method have none.

Acceleration defects: accelerations are solved for at every output time, from positions and velocities that are accurate
to the tolerance. A stiff spring turns a small length error into a large force. If output times are closer than steps,
the rate of the velocities between them is that of the method's polynomial; its difference from the accelerations is the
defect.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import lru_cache, partial
from typing import TYPE_CHECKING, Any

import numpy as np

from ..constraints.inclination import KIND_PITCH
from ..engine.kinematics import quaternion_at
from ..engine.loads import force_row
from ..math.vec import mm, transpose
from ..model.body import GROUND
from ..model.joint import Joint
from ..model.names import curve_parts
from ..numerics.integrators.butcher_tableaux import TABLEAUX, tableau
from ..numerics.integrators.radau_stages import RADAU_A as RADAU
from ..tables.law_inputs import forces_in_events
from ..tables.structure_definition import velocity_names
from .energy_balance import (
    MAX_ACCELERATION_VIOLATION,
    MAX_IMBALANCE,
    balance_warning,
    energy_moved,
    lag_warning,
)
from .motion_record import coordinate_records, measured_coordinate

if TYPE_CHECKING:
    from ..model.model import Model
    from .result import Result


PULL_TOLERANCE = 1e-5  # relative to the largest force of the motion: smaller pulling forces are integration errors


def pull_warnings(result: Result) -> list[str]:
    """Return a warning for each joint that represents a one-sided contact and pulls at some output time.

    Its normal force is the multiplier of its first row. If redundancy leaves it undetermined, its sign is not
    evaluated.
    """
    x, undetermined = result.values, result.health.undetermined
    s = x.structure
    found = []
    for joint in s.model.joints:
        if joint.one_sided and not any(k.startswith("force") for k in undetermined.get(joint.name, ())):
            sign = joint.pushing_sign(x.numbers[joint.name], *x.poses.ends(joint))
            if sign is not None:
                found.append((joint, sign, result.multipliers[:, s.slices[joint.name].start]))
    if not found:
        return []
    near = PULL_TOLERANCE * _largest_force(result)
    return [text for joint, sign, force in found if (text := _pull_warning(result, joint, sign, force, near))]


def _largest_force(result: Result) -> float:
    """Return the largest multiplier that is a force, or the weight [N]."""
    s, x = result.values.structure, result.values
    metric = sorted({t.row for t in s.terms if not t.measured and t.formula.measure == "m"})
    weight = float(np.linalg.norm(x.system.gravity) * x.system.bodies.mass.max(initial=0.0))
    return max(weight, float(np.abs(result.multipliers[:, metric]).max(initial=0.0)))


def _pull_warning(result: Result, joint: Joint, sign: float, force: np.ndarray, near: float) -> str:
    """Return the warning on one joint; ``sign`` is that of the force while it pushes, 0 if the side is unknown."""
    remedy = f"press it on more strongly, or model the contact by shapes and Contact(...){joint.both_sides}"
    if sign == 0.0:
        if not min(force.max(), -force.min()) > near:
            return ""
        return (
            f"{joint.title} pushes to both sides, with {force.min():.4g} N to {force.max():.4g} N: a real follower "
            f"would lift off; {remedy}"
        )
    k = int(np.argmin(sign * force))
    if not -sign * force[k] > near:
        return ""
    return (
        f"{joint.title} pulls with up to {-sign * force[k]:.4g} N (at t = {result.t[k]:.6g} s): a real contact would "
        f"separate there; {remedy}"
    )


# Friction along one coordinate of a joint's surface that also slips along others.


TRANSVERSE_SLIP = (
    0.1  # transverse slip relative to the slip along a friction's coordinate that matters: it reduces friction by 0.5 %
)
MIN_SLIP = 1e-3  # relative to the mechanism's length: smaller transverse slip is not reported
MIN_TURN = 1.0  # the same for an angle whose slip is unknown, since no radius is given [rad]


def transverse_slip_warnings(result: Result) -> list[str]:
    """Warnings on frictions on `Cylindrical`, `Planar` and `PointInPlane` joints that slip across their coordinate.

    A surface has one friction force, mu N against its total slip. Friction in a joint uses the slip along its own
    coordinate only: along it the friction is too large by the factor |v| / v, so that it may stick while the surface
    creeps; across it there is none.
    """
    if len(result.t) < 2:
        return []
    model, found = result.model, []
    frictions: list[Any] = result.values.structure.loads
    for f in frictions:
        if not (hasattr(f, "load") and model[f.joint].one_surface):
            continue
        own = f.coordinate_text()
        slips = {
            f"{f.joint}.{what}": _slip_distance(result, f, what) for what in model[f.joint].measured(result.planar)
        }
        along = slips[own][0]
        for text, (way, unit) in slips.items():
            least = max(TRANSVERSE_SLIP * along, MIN_SLIP * result.values.length) if unit == "m" else MIN_TURN
            if text != own and way > least:
                found.append(
                    f"{f.title} acts along {own!r} only, where the surface slips {along:.3g} {slips[own][1]}; along "
                    f"{text!r} it slips {way:.3g} {unit} without friction. One surface has one friction force, mu N "
                    f"against its total slip velocity: while it slips along {text!r}, a small force moves it along "
                    f"{own!r}. Give the bodies shapes and a Contact(friction=...) in place of the joint, or put a "
                    "body between them with a joint for each motion, if these are two surfaces"
                )
    return found


def _slip_distance(result: Result, f: Any, what: str) -> tuple[float, str]:
    """Return the slip distance along a coordinate of the joint [m]; for an angle without a radius [rad]."""
    angle, radius = what.startswith("angle"), result.values.numbers[f.name].radius
    arm = 1.0 if not angle or radius is None else float(radius)
    speed = np.abs(result[f.joint].quantity(f"{what}_rate")[1])
    return arm * float(0.5 * (speed[1:] + speed[:-1]) @ np.diff(result.t)), "rad" if angle and radius is None else "m"


MAX_ORIENTATION_ERROR = 0.02  # reported orientation error of a body [rad]
MAX_TURN, TURN_STEP = 12.0, 0.01  # [rad] per step: range and spacing of the table of errors
MAX_TURN_RADAU = 2.0 * np.arctan(3.0**0.5)  # the same for `radau`, which takes no larger steps
NEWTON_ITERATIONS = 20  # iterations of Newton's method


JUMP = 1.0  # [rad] by which a coordinate changes more than the bodies turn, from which on it is a jump


def singular_passage_warnings(result: Result) -> list[str]:
    """Warnings on coordinates of rotations in use that jump between two output times, at a singular position.

    Roll and yaw change by half a turn at a pitch of 90 deg, the components of a rotation vector their sign at half a
    turn. What acts along them, or depends on them, jumps as well, and no event is located there.
    """
    users = {(t.owner.name, t.what): t for t in result.values.structure.terms if t.owner is not None}
    found = []
    for (name, what), t in sorted(users.items()):
        if not t.owner.coordinates[what].singular or len(result.t) < 2:
            continue
        F, M, c = coordinate_records(result.motions, t.owner, what)
        R = np.stack([x + result.motions.zeros() for x in mm(transpose(F[1]), M[1])], axis=-1).reshape(-1, 3, 3)
        traces = np.einsum("nij,nij->n", R[1:], R[:-1]).real
        turned = np.arccos(np.clip(0.5 * (traces - 1.0), -1.0, 1.0))
        value, _, _ = measured_coordinate(result.motions, t.owner, what)
        change = np.diff(np.real(value))
        jumps = np.flatnonzero((np.abs(change) > turned + JUMP) & (t.formula.kind != KIND_PITCH))
        if len(jumps):
            k = int(jumps[0])
            by, by_bodies = np.degrees(change[k]), np.degrees(turned[k])
            found.append(
                f"{name}.{what}, which {t.element.title} uses, changes by {by:.4g} deg between t = {result.t[k]:.6g} s "
                f"and {result.t[k + 1]:.6g} s, where the bodies turn by {by_bodies:.4g} deg: it passes its singular "
                f"position, {c.singular}. Use another coordinate there"
            )
    return found


def tyre_warnings(result: Result) -> list[str]:
    """Return warnings on tyres beyond the ranges of their files."""
    forces: list[Any] = result.values.structure.forces
    found = []
    for e in (x for x in forces if hasattr(x, "model")):
        curves = result[e.name]
        load = curves.load
        for what, (low, high) in e.model.limits(result.values.numbers[e.name].tyre).items():
            x = np.where(load > 0.0, getattr(curves, what), 0.5 * (low + high))  # in the air nothing matters
            beyond = np.maximum(low - x, x - high)
            k = int(np.argmax(beyond))
            if beyond[k] > 0.0:
                found.append(
                    f"{e.title}: {what} is {x[k]:.4g} at t = {result.t[k]:.6g} s, beyond the range {low:g} to {high:g} "
                    f"for which {e.model.title} was measured: its forces are extrapolated there"
                )
    return found


def lifted_wheel_warnings(result: Result) -> list[str]:
    """Return a warning for each tyre without load at some output times: when, and how far it is from its road."""
    found = []
    forces: list[Any] = result.values.structure.forces
    for e in (x for x in forces if hasattr(x, "model")):
        curves = result[e.name]
        lifted = curves.load <= 0.0
        if not lifted.any():
            continue
        edges = np.flatnonzero(np.diff(np.r_[False, lifted, False]))
        times = [f"t = {result.t[a]:.4g} to {result.t[b - 1]:.4g} s" for a, b in edges.reshape(-1, 2).tolist()]
        more = f" and {len(times) - MOST_LIFTS} more times" if len(times) > MOST_LIFTS else ""
        found.append(
            f"{e.title}: wheel {e.body_j!r} is in the air from {', '.join(times[:MOST_LIFTS])}{more}, up to "
            f"{-float(curves.deflection[lifted].min()):.3g} m above the road"
        )
    return found


MOST_LIFTS = 3  # intervals in the air that a warning lists


def unwrapped_rope_warnings(result: Result) -> list[str]:
    """Return a warning for each pulley that a rope has left: it would have to push there, which no rope can."""
    found = []
    ropes: list[Any] = result.model.forces
    for e in (x for x in ropes if getattr(x, "radii", None)):
        for k, (wrap, r) in enumerate(zip(result[e.name].wraps, result.values.numbers[e.name].radii, strict=True)):
            apart = wrap < -LEFT_PULLEY
            if r != 0.0 and apart.any():
                found.append(
                    f"{e.title}: it has left the pulley on {e.bodies[k]!r} (point {k + 1}) at t = "
                    f"{result.t[int(np.argmax(apart))]:.4g} s, where its wrap is below zero; there the result is "
                    "wrong, because the pulley pulls it. Give the rope more turns, or end the motion before"
                )
    return found


LEFT_PULLEY = 1e-6  # [rad] of negative wrap that is rounding

APPROACH_GROWTH = 2.0  # growth of the fastest velocity over the times that are examined
APPROACH_FIT = 0.05  # allowed deviation of 1 / v^2 from a line, relative to its first value
APPROACH_OUTPUTS = 5  # least number of output times among them


def lock_up_warning(result: Result) -> str:
    """Return a warning if velocities grow at the end as they do before a position where drivers lock the mechanism.

    There a driver has a largest or least value, which the motion reaches at a time T with a finite rate: positions
    change with the root of T - t, and velocities v as (T - t)^(-1/2), so that 1 / v^2 falls linearly to zero. The times
    examined are the last, in which the fastest velocity has doubled: a steady or exponential growth is no line.
    """
    if not result.model.drivers or len(result.t) <= APPROACH_OUTPUTS or not result.v.shape[1]:
        return ""
    names = velocity_names(result.values.structure)
    sizes = np.array([result.values.length if n.unit == "m" else 1.0 for n in names])
    k = int(np.argmax(np.abs(result.v[-1]) / sizes))
    v = np.abs(result.v[:, k])
    slower = np.flatnonzero(v * APPROACH_GROWTH <= v[-1])
    first = int(slower[-1]) if len(slower) else len(v)
    t, w = result.t[first:], v[first:]
    if len(t) < APPROACH_OUTPUTS or not w[0] > 0.0 or not t[-1] > t[0]:
        return ""
    share = (w[0] / w) ** 2
    line = 1.0 + (share[-1] - 1.0) * (t - t[0]) / (t[-1] - t[0])
    if not np.abs(share - line).max() < APPROACH_FIT:
        return ""
    end = t[-1] + share[-1] * (t[-1] - t[0]) / (1.0 - share[-1])
    return (
        f"velocities grow as they do before a position that locks: that of {names[k].name!r} from {w[0]:.3g} to "
        f"{w[-1]:.3g} {names[k].unit}/s since t = {t[0]:.6g} s, and without bound near t = {end:.6g} s. A driver "
        "prescribes more there than the links allow; m.singularities() shows the limits of its travel"
    )


def orientation_error_warning(result: Result) -> str:
    """Return a warning if steps rotate a body too far for the method's order; nothing otherwise."""
    if not _has_fixed_step(result):
        return ""
    off, name, turn = 0.0, "", 0.0
    for body, b in result.values.structure.place.items():
        i = quaternion_at(result.values.system, b)[1] if b >= 0 else -1
        if i < 0:
            continue
        pieces = result.pieces or (result,)
        size = sum(_orientation_error(x, i) for x in pieces)
        fastest = max(float(np.linalg.norm(x.v[:, i : i + 3], axis=1).max(initial=0.0)) for x in pieces)
        off, name, turn = max((off, name, turn), (size, body, fastest * result.health.options["step"]))
    if not off > MAX_ORIENTATION_ERROR:
        return ""
    return (
        f"{name!r} turns by up to {turn:.2g} rad per step. The error of method={result.health.options['method']!r} in "
        f"rotations that large makes its angle wrong by about {off:.2g} rad, which the energy balance does not show; "
        "give a shorter step"
    )


def _has_fixed_step(result: Result) -> bool:
    o = result.health.options
    return bool(o.get("step")) and (o.get("method") in TABLEAUX or o.get("method") == "radau") and len(result.t) > 1


def _orientation_error(result: Result, i: int) -> float:
    """Return the largest orientation error [rad] of a body; i: index of its first angular velocity."""
    o, w = result.health.options, result.v[:, i : i + 3]
    h = o["step"]
    turn, error = _turn_errors(o["method"])
    size = np.linalg.norm(w, axis=1)
    rate = w * (np.interp(size * h, turn, error) / (h * np.maximum(size, 1e-300)))[:, None]
    ways = 0.5 * (rate[1:] + rate[:-1]) * np.diff(result.t)[:, None]
    return float(np.linalg.norm(np.cumsum(ways, axis=0), axis=1).max(initial=0.0))


@lru_cache
def _turn_errors(method: str) -> tuple[np.ndarray, np.ndarray]:
    """Return rotations per step [rad], and the error of each."""
    x = np.arange(0.0, MAX_TURN_RADAU if method == "radau" else MAX_TURN, TURN_STEP)
    return x, (_radau_turns(x) if method == "radau" else _explicit_turns(method, x)) - x


def _explicit_turns(method: str, x: np.ndarray) -> np.ndarray:
    R = tableau(method)
    stages = int(R.order_i[1])
    K: list[np.ndarray] = []
    for i in range(stages + 1):
        u = 1.0 + sum((a * k for a, k in zip(R.A[i], K, strict=False)), np.zeros(len(x), complex))
        if i < stages:
            K.append(0.5j * x * u / np.abs(u))
    return 2.0 * np.unwrap(np.angle(u))


def _radau_turns(x: np.ndarray) -> np.ndarray:
    A, d, out = np.array(RADAU), np.zeros(3), np.zeros(len(x))
    for n, turn in enumerate(x.tolist()):
        for _ in range(NEWTON_ITERATIONS):
            d = d - np.linalg.solve(np.eye(3) - turn * A * (0.5 * d), d - turn * A @ (1.0 + 0.25 * d * d))
        out[n] = 2.0 * np.arctan(0.5 * d[2])
    return out


DEFECT_PART = 0.1  # defect relative to the largest acceleration of a velocity
DEFECT_SHARE = 0.1  # part of the output times at which larger defects are accepted: jumps and short transients
OUTPUTS_PER_STEP = (
    2  # least average number of outputs per step: else the velocities between outputs are not on one polynomial
)
REFERENCE_PART = (
    0.1  # relative to the fastest body's acceleration, and gravity: reference for bodies with smaller accelerations
)
MIN_OUTPUTS = 16  # least number of output times


def acceleration_defect_warning(result: Result) -> str:
    """Return a warning on accelerations that are not the rates of the velocities; nothing otherwise.

    It compares accelerations with the slopes of neighbouring velocities: at recorded times, or at all where they are
    known. Of 1100 random motions,
    stiff ones among them, at tolerances from 0.1 to 1e-7, there was no false warning; and no warning at all at 1e-4
    and less.
    """
    steps, names = result.health.steps, velocity_names(result.values.structure)
    if (
        not 0 < OUTPUTS_PER_STEP * steps <= len(result.t)
        or len(result.t) < MIN_OUTPUTS
        or result.health.contact is not None
        or not names
    ):
        return ""
    metric = np.array([n.unit == "m" for n in names])
    often, worst = _worst_defect(result, metric)
    k = int(np.argmax(often))
    if not often[k] > DEFECT_SHARE:
        return ""
    finer = "shorter step" if result.health.options.get("step") else "smaller rtol"
    unit = "m/s^2" if metric[k] else "rad/s^2"
    off, own = (f"{x[k]:.2g} {unit}" for x in worst)
    return (
        f"accelerations are inaccurate, and so are forces and reactions: that of {names[k].name!r} differs from the "
        f"rate of its velocity by up to {off}, and its largest value is {own}. Give a {finer}"
    )


def _worst_defect(r: Result, metric: np.ndarray) -> tuple[np.ndarray, tuple[np.ndarray, np.ndarray]]:
    """Return the part of the recorded times with a defect of each velocity, and its largest defect and acceleration."""
    S, length, n = r.values.system, r.values.length, len(r.t)
    rows, vdot = (r.record.rows, r.record.figures.vdot) if r.record.deferred else (np.arange(n), r.vdot)
    ascends = np.diff(r.t) > 0.0
    regular = np.zeros(n, bool)  # no two times are equal there and at the two rows before and after
    regular[2:-2] = ascends[:-3] & ascends[1:-2] & ascends[2:-1] & ascends[3:]
    inner = np.isfinite(vdot).all(axis=1) & regular[rows]
    none = np.zeros(len(metric))
    if not inner.any():
        return none, (none, none)
    rows, vdot = rows[inner], vdot[inner]
    near, wide = (_parabola_rate(r.t, r.v, rows, k) for k in (1, 2))
    off = np.abs(vdot - near) - 2.0 * np.abs(near - wide)
    largest = np.abs(near).max(axis=0)
    least = float(np.linalg.norm(S.gravity)) + length / float(np.ptp(r.t)) ** 2
    fastest = [np.max(largest[kind], initial=0.0) for kind in (~metric, metric)]
    reference = REFERENCE_PART * np.where(metric, max(least, fastest[1]), max(least / length, fastest[0]))
    return (off > DEFECT_PART * np.maximum(largest, reference)).mean(axis=0), (off.max(axis=0), largest)


def _parabola_rate(t: np.ndarray, v: np.ndarray, rows: np.ndarray, k: int) -> np.ndarray:
    """Return at some rows the derivative of the parabola through the values there and k rows before and after."""
    before, after = (t[rows] - t[rows - k])[:, None], (t[rows + k] - t[rows])[:, None]
    slopes = (v[rows] - v[rows - k]) / before, (v[rows + k] - v[rows]) / after
    return (slopes[0] * after + slopes[1] * before) / (before + after)


DISSIPATED_PART = (
    0.1  # relative to the dissipation of impacts and friction: smaller numerical losses hardly change a motion
)
LIFTING_PART = 1e-6  # relative to the energy that lifts all bodies by one's size: possible residuals of solves at rest
MAX_VIOLATION = 1e-6  # relative to the mechanism's length: larger constraint violations are reported
MIN_CREEP = 1e-3  # relative to the mechanism's length: larger creep is reported


def impulse_judgements(result: Result, mobility: Callable[[], Any]) -> dict[str, Callable[[], Any]]:
    """Return the figures of `Health.late` of impulse time stepping, whose accelerations are means."""
    return {
        "mobility": mobility,
        "energy_drift": partial(energy_drift, result),
        "warnings": partial(impulse_stepping_warnings, result),
        "doubtful": partial(impulse_stepping_doubts, result),
    }


def acceleration_violation(result: Result) -> float:
    """Return the largest |G vdot - gamma| at recorded times, relative to its terms."""
    return result.record.violation


def energy_drift(result: Result) -> float:
    """Return the largest deviation from the energy balance [J] at recorded times; nan if there are fewer than two."""
    return float(np.abs(result.budget.balance).max()) if len(result.t) > 1 else float("nan")


def rest_warnings(result: Result) -> tuple[str, ...]:
    """Return warnings on one-sided parts that pull at an equilibrium, and on tyres beyond the ranges of their files."""
    return (*pull_warnings(result), *unwrapped_rope_warnings(result), *tyre_warnings(result))


def motion_warnings(result: Result) -> tuple[str, ...]:
    """Return reasons to check a result, each with a remedy; none for a sound result."""
    texts = [
        *result.health.remarks,
        *result.health.doubtful,
        _acceleration_warning(result),
        *_undetermined_load_warnings(result),
        *_undetermined_force_warnings(result),
        *_creep_warnings(result),
        *transverse_slip_warnings(result),
        *tyre_warnings(result),
        *lifted_wheel_warnings(result),
        *unwrapped_rope_warnings(result),
        *singular_passage_warnings(result),
        lock_up_warning(result),
        *pull_warnings(result),
    ]
    return tuple(text for text in texts if text)


def doubt_messages(result: Result) -> tuple[str, ...]:
    """Return reasons why a motion may not satisfy its tolerance; none for a sound motion."""
    balance = balance_warning(result.budget) or lag_warning(result.budget)
    return tuple(
        text
        for text in (
            balance,
            orientation_error_warning(result),
            acceleration_defect_warning(result),
            _violation_warning(result),
        )
        if text
    )


def impulse_stepping_doubts(result: Result) -> tuple[str, ...]:
    """Return the same for impulse time stepping: energy errors of the method, and unconverged contacts."""
    taken = result.energy.exchanged("numerical_loss")
    lost = float(np.max(np.abs(taken), initial=0.0))
    own = result.health.contact.doubts if result.health.contact else ()
    moved = max(energy_moved(result), lost)
    losses = result.energy.exchanged("friction_loss") + result.energy.exchanged("impact_loss")
    dissipated = float(np.max(losses, initial=0.0))
    if not lost > max(MAX_IMBALANCE * moved, DISSIPATED_PART * dissipated, LIFTING_PART * _lifting_energy(result)):
        return own
    what = "took" if taken[int(np.argmax(np.abs(taken)))] > 0.0 else "gave"
    text = (
        f"impulse time stepping itself {what} {lost:.2g} J (energy.numerical_loss), "
        f"{100.0 * lost / moved:.3g} per cent of the energy moved: take shorter steps, "
        f"method=fb.Stepping(step=...)"
    )
    return (text, *own)


def _lifting_energy(result: Result) -> float:
    """The energy [J] that lifts all bodies by the size of the smallest body in contact, independent of the origin."""
    if result.health.contact is None:
        return 0.0
    mass = float(sum(result.budget.mass)) + sum(float(b.mass.sum()) for b in result.bulk.values())
    return mass * float(np.linalg.norm(result.values.system.gravity)) * result.health.contact.size


def impulse_stepping_warnings(result: Result) -> tuple[str, ...]:
    """Return all warnings on a motion by impulse time stepping."""
    return (*result.health.remarks, *result.health.doubtful, *_rotation_per_step(result), *pull_warnings(result))


MAX_ROTATION = 0.3  # [rad] in a step: a joint then turns too slowly by 0.3**2 / 48, or 0.2 per cent


def _rotation_per_step(result: Result) -> tuple[str, ...]:
    """Return a warning where a body on a joint turns so far in a step that closing the joint costs rotation.

    A step of width h moves the bodies with their velocities at its middle, and the joints are closed afterwards. A
    hinge with the rate w then turns too little by up to (w h)^2 / 48: that is with the mass centre on its axis.
    """
    contact, model = result.health.contact, result.model
    if contact is None or model.planar:
        return ()
    step = min(contact.step, float(np.diff(result.t).max(initial=0.0)))  # steps end at the output times
    jointed = {model.carrier(end, joint) for joint in model.joints for end in joint.ends().values()} - {GROUND}
    turns = {name: np.linalg.norm(result[name].angular_velocity, axis=1).max() * step for name in jointed}
    name = max(turns, key=lambda k: turns[k], default="")
    if not name or not turns[name] > MAX_ROTATION:
        return ()
    lost = 100.0 * turns[name] ** 2 / 48.0
    return (
        f"{name} turns by up to {turns[name]:.2g} rad in a step, and by up to {lost:.2g} per cent too little: "
        f"take shorter steps, method=fb.Stepping(step={step * MAX_ROTATION / turns[name]:.1g})",
    )


def _violation_warning(result: Result) -> str:
    worst, length = result.health.violation, result.values.length
    if not worst > MAX_VIOLATION * length:
        return ""
    return f"constraints are violated by up to {worst:.3g} (m or rad); stabilization='projection' satisfies them"


def _acceleration_warning(result: Result) -> str:
    worst = result.health.acceleration_violation
    if not worst > MAX_ACCELERATION_VIOLATION:
        return ""
    return (
        f"accelerations violate the constraints by {worst:.1e} of their terms: a position is nearly singular, or "
        "masses differ too much. The relative error of reactions may be a thousand times larger; for a mechanism at "
        "rest equilibrium() computes them accurately"
    )


def _undetermined_load_warnings(result: Result) -> list[str]:
    return [
        f"{f.title} follows the reaction of {f.joint!r}, which redundant constraints leave undetermined "
        f"({', '.join(what)}): its load is not unique. Replace a joint by one with fewer constraints, such as "
        "Spherical"
        for f, what in undetermined_loads(_frictions_with_load(result), result.health.undetermined)
    ]


def _undetermined_force_warnings(result: Result) -> list[str]:
    return [
        f"an event names {name!r}, which redundant constraints leave undetermined ({', '.join(what)}): it is not "
        "unique. Replace a joint by one with fewer constraints, such as Spherical"
        for name, what in undetermined_event_forces(result.model, result.health.undetermined)
    ]


def undetermined_event_forces(model: Model, undetermined: Mapping[str, tuple[str, ...]]) -> list[tuple[str, tuple]]:
    """Return the undetermined forces and torques of joints that events name, with their undetermined components.

    Parameters
    ----------
    model : Model
    undetermined : mapping
        Joint -> components, as of `Mobility`.
    """
    found = []
    for name, x in forces_in_events(model).items() if undetermined else ():
        kind = "force" if curve_parts(name)[1].startswith("f") else "torque"
        found.append((name, tuple(k for k in undetermined.get(x.element.name, ()) if k.startswith(kind))))
    return [(name, what) for name, what in found if what]


def undetermined_loads(
    frictions: Iterable[Any], undetermined: Mapping[str, tuple[str, ...]]
) -> list[tuple[Any, tuple]]:
    """Return frictions whose load depends on undetermined components of the joint's reaction, with these components.

    Parameters
    ----------
    frictions : iterable of JointFriction
    undetermined : mapping
        Joint -> components, as of `Mobility`.
    """
    found = [(f, f.loading_components(undetermined.get(f.joint, ()))) for f in frictions]
    return [(f, what) for f, what in found if what]


def _creep_warnings(result: Result) -> list[str]:
    limit = MIN_CREEP * result.values.length
    return [
        f"{result.model[name].title} crept {distance:.3g} m, at up to {speed:.3g} m/s, while it should stick; a "
        "smaller stick_speed reduces it"
        for name, (speed, distance) in result.health.creep.items()
        if distance > limit
    ]


def friction_creep(result: Result) -> dict[str, tuple[float, float]]:
    """Return joint friction -> (largest speed [m/s], distance [m]) of its surfaces while they should stick.

    It applies to the regularised law: surfaces should stick while they slide at less than three times the stick speed,
    for at least two consecutive output times; a reversal between two output times is not creep.
    """
    found = {}
    S, forces = result.values.system, result.values.structure.forces
    for f in _frictions_with_load(result):
        if f.stick_speed is None:
            continue
        k = next(k for k, e in enumerate(forces) if e is f)
        arm, limit = f.sticking(force_row(S.force_parameters, k))
        x, rate = result.measured.quantity(int(S.forces.F[k]))
        speed = np.abs(arm * rate)
        slow = speed < limit
        both = slow[1:] & slow[:-1]
        stuck = np.r_[both, False] | np.r_[False, both]
        distance = (arm * np.abs(np.diff(x)))[both].sum()
        found[f.name] = float(speed[stuck].max(initial=0.0)), float(distance)
    return found


def _frictions_with_load(result: Result) -> list[Any]:
    """Return the joint frictions, whose force depends on the joint's load."""
    return [e for e in result.values.structure.loads if hasattr(e, "load")]
