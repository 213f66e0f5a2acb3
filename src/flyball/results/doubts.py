"""What a result says against itself: an energy balance that does not close, friction that crept, open reactions."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ..equations.loads import wide
from ..tables.reads import read
from ..tables.system import FORCE_F, MASS

if TYPE_CHECKING:
    from ..model.model import Model
    from .result import Result

UNBALANCED = 1e-4  # part of the energy moved above which the balance is worth a word, where no tolerance was asked for
FEW, EACH = (
    10.0,
    0.1,
)  # times rtol that the balance of a sound motion may be off: of a short one, and more with each step
FINE = 3e-2  # times the root of rtol, the same where rtol is so small that a digit more or less is no matter
MOST, ROUGH = 1e-2, 5.0  # part of the energy moved that no number of steps excuses, or so many times a rough rtol
PIECES, ROWS = 64, 4  # stretches that the balance is judged by at most, and rows of output in each at least
OPEN = 1e-6  # part of the mechanism's length above which violated constraints are
UNSOLVED = 1e-6  # part of the accelerations by which they may miss the constraints
AT_REST = 1e-7  # lengths of the mechanism a second that count as rest
CREPT = 1e-3  # part of the mechanism's length above which creep is


def warnings(result: Result) -> tuple[str, ...]:
    """Reasons to look at a result twice, each with what can be done; none for a sound one."""
    texts = [
        *result.health.remarks,
        *doubtful(result),
        _accelerations(result),
        *_open_loads(result),
        *_open_forces(result),
        *_creep(result),
    ]
    return tuple(text for text in texts if text)


def doubtful(result: Result) -> tuple[str, ...]:
    """Reasons to think that a motion is not what its tolerance asks for; none for a sound one."""
    return tuple(text for text in (_balance(result), _violation(result)) if text)


def balanced(result: Result) -> float:
    """Part of the energy moved by which the balance of a sound motion may be off.

    Errors of steps add up: a motion of few steps comes out to some units of its tolerance, one of ten thousand to a
    thousand. Of 1270 random motions, stiff ones among them, by three methods at tolerances from 1e-2 to 1e-7, that came
    out to ten times their tolerance, 1.6 in a hundred are off by more.
    """
    o = result.health.options
    rtol = o.get("rtol")
    if rtol is None or o.get("step"):
        return UNBALANCED
    expected = max(FINE * rtol**0.5, rtol * (FEW + EACH * result.health.steps))
    return min(expected, max(MOST, ROUGH * rtol))


def energy_moved(result: Result) -> float:
    """How much energy the motion shifted about [J]: what the balance is measured by.

    The largest kinetic energy, and the ranges of gravity's and the springs' energies and of every work.
    """
    return _moved(result, 0, len(result.t))


def _moved(result: Result, begin: int, end: int) -> float:
    """The same between two rows of output, the last not counted."""
    if end <= begin:
        return 0.0
    e = result.energy
    ranges = sum(np.ptp(x[begin:end]) for x in (e.gravity, e.elastic, *e.work.values()))
    return float(e.kinetic[begin:end].max() + ranges)


def _balance(result: Result) -> str:
    part, moved, least = balanced(result), energy_moved(result), _rest(result)
    drift = result.health.energy_drift
    if drift > part * moved + least:
        return _off(result, "", drift, moved, part * moved + least)
    for begin, end in _stretches(result):
        lost = float(np.ptp(result.energy.balance[begin:end]))
        if lost <= least or lost <= part * (moved * float(result.energy.kinetic[begin:end].max())) ** 0.5:
            continue
        # velocities v are as far off as those of what moves most, u: by m v du
        there = _moved(result, begin, end)
        allowed = part * (moved * there) ** 0.5 + least
        if lost > allowed:
            when = f" between t = {result.t[begin]:.6g} and {result.t[end - 1]:.6g} s"
            return _off(result, when, lost, there, allowed)
    return ""


def _off(result: Result, when: str, drift: float, moved: float, allowed: float) -> str:
    finer = "shorter step" if result.health.options.get("step") else "smaller rtol"
    return (
        f"the energy balance is off by {drift:.3g} J{when} where {moved:.3g} J were moved and {allowed:.1g} J are to "
        f"be expected; a {finer} may tell whether the motion can be trusted"
    )


def _stretches(result: Result) -> Iterable[tuple[int, int]]:
    """Halves, quarters and so on of the rows of a motion that was integrated: what something else dissipated before,
    or moves after, does not speak for what happens in one.
    """
    rows, pieces = len(result.t), 2
    while result.health.options.get("rtol") is not None and pieces <= PIECES and rows >= ROWS * pieces:
        edges = [k * (rows - 1) // pieces for k in range(pieces + 1)]
        yield from ((a, b + 1) for a, b in itertools.pairwise(edges))
        pieces *= 2


def _rest(result: Result) -> float:
    """Energy [J] below which nothing is said to move: rounding of the potential energy, and a creep of all bodies.

    Where works are done, some of it perhaps between two rows, also what moves all bodies in the time there is to where
    rows have them.
    """
    rounding = 1e-12 * float(np.abs(result.energy.potential).max(initial=0.0))
    S, r = result.values.system, result.records
    mass = S.body_x[:, MASS]
    least = rounding + float(mass.sum()) * (AT_REST * result.values.length) ** 2
    span = float(np.ptp(result.t)) if len(result.t) else 0.0
    if not result.energy.work or not span > 0.0:
        return least
    went = (mass[b] * sum(np.ptp(x) ** 2 for x in r.body(b)[0]) for b in range(len(mass)))
    return least + balanced(result) * float(sum(went)) / max(span, 1e-150) ** 2


def _violation(result: Result) -> str:
    worst, length = result.health.violation, result.values.length
    if not worst > OPEN * length:
        return ""
    return f"constraints are violated by up to {worst:.3g} (m or rad); stabilization='projection' keeps them"


def _accelerations(result: Result) -> str:
    worst = result.health.acceleration_violation
    if not worst > UNSOLVED:
        return ""
    return (
        f"accelerations miss the constraints by a part of {worst:.1e}: a position is all but singular, or masses "
        f"differ too much. Reactions are as uncertain there"
    )


def _open_loads(result: Result) -> list[str]:
    return [
        f"{f.title} follows the reaction of {f.joint!r}, which redundant constraints leave undetermined "
        f"({', '.join(what)}): its load is one choice of many. Replace a joint by one that holds less, as Spherical"
        for f, what in open_loads(_with_loads(result), result.health.undetermined)
    ]


def _open_forces(result: Result) -> list[str]:
    return [
        f"an event names {name!r}, which redundant constraints leave undetermined ({', '.join(what)}): it is one "
        f"choice of many. Replace a joint by one that holds less, as Spherical"
        for name, what in open_forces(result.model, result.health.undetermined)
    ]


def open_forces(model: Model, undetermined: Mapping[str, tuple[str, ...]]) -> list[tuple[str, tuple]]:
    """Forces and torques of joints that events name and that are undetermined, with what of these is.

    Parameters
    ----------
    model : Model
    undetermined : mapping
        Joint -> components, as of `Mobility`.
    """
    found = []
    for name, x in read(model).items():
        kind = "force" if name.partition(".")[2].startswith("f") else "torque"
        found.append((name, tuple(k for k in undetermined.get(x.element.name, ()) if k.startswith(kind))))
    return [(name, what) for name, what in found if what]


def open_loads(frictions: Iterable[Any], undetermined: Mapping[str, tuple[str, ...]]) -> list[tuple[Any, tuple]]:
    """Frictions whose load counts components of their joint's reaction that are undetermined, with these.

    Parameters
    ----------
    frictions : iterable of JointFriction
    undetermined : mapping
        Joint -> components, as of `Mobility`.
    """
    found = [(f, f.counted(undetermined.get(f.joint, ()))) for f in frictions]
    return [(f, what) for f, what in found if what]


def _creep(result: Result) -> list[str]:
    limit = CREPT * result.values.length
    return [
        f"{result.model[name].title} crept {distance:.3g} m, at up to {speed:.3g} m/s, while it should stick; a "
        f"smaller stick_speed makes it less"
        for name, (speed, distance) in result.health.creep.items()
        if distance > limit
    ]


def creep(result: Result) -> dict[str, tuple[float, float]]:
    """Joint friction -> (largest speed [m/s], distance [m]) of its surfaces while it should stick.

    Of the regularised law: it should stick while it slides at less than three times its stick speed, for two output
    times running or more; what passes through rest between two output times is no creep.
    """
    found = {}
    S, forces = result.values.system, result.values.structure.forces
    for f in _with_loads(result):
        if f.stick_speed is None:
            continue
        k = next(k for k, e in enumerate(forces) if e is f)
        arm, limit = f.sticking(wide(S.force_x, k))
        x, rate = result.measured.quantity(int(S.force_i[k, FORCE_F]))
        speed = np.abs(arm * rate)
        slow = speed < limit
        both = slow[1:] & slow[:-1]
        stuck = np.r_[both, False] | np.r_[False, both]
        distance = (arm * np.abs(np.diff(x)))[both].sum()
        found[f.name] = float(speed[stuck].max(initial=0.0)), float(distance)
    return found


def _with_loads(result: Result) -> list[Any]:
    """Forces that follow what a joint carries: friction."""
    return [e for e in result.values.structure.loads if hasattr(e, "load")]
