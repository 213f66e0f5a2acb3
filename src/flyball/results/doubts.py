"""What a result says against itself: an energy balance that does not close, friction that crept, open reactions."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ..equations.loads import wide
from ..tables.reads import read
from .energy import gained
from .lag import late
from .ledger import Ledger, apart, whole
from .one_sided import one_way, pulls
from .overturned import overturned
from .residue import missed

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
ROUGHEST = 2e-2  # part of the energy moved that no tolerance excuses
DISSIPATED = 0.1  # part of what impacts and friction dissipate, beside which a numerical loss changes a motion little
SLIGHT = 1e-6  # part of the energy that lifts all bodies by one's size, which the residuals of solves may take at rest
PIECES, ROWS = 64, 4  # stretches that the balance is judged by at most, and rows of output in each at least
SEEN = 0.1  # part of the energy that accelerations tell of; where less stands in rows they miss the motion
OPEN = 1e-6  # part of the mechanism's length above which violated constraints are
UNSOLVED = 1e-8  # part by which accelerations may miss the constraints: reactions miss by up to 1e4 times it
AT_REST = 1e-7  # lengths of the mechanism a second that count as rest
CREPT = 1e-3  # part of the mechanism's length above which creep is


def warnings(result: Result) -> tuple[str, ...]:
    """Reasons to look at a result twice, each with what can be done; none for a sound one."""
    _ = result.vdot  # finding accelerations adds to the remarks where there are none
    texts = [
        *result.health.remarks,
        *doubtful(result),
        _accelerations(result),
        *_open_loads(result),
        *_open_forces(result),
        *_creep(result),
        *one_way(result),
        *pulls(result),
    ]
    return tuple(text for text in texts if text)


def doubtful(result: Result) -> tuple[str, ...]:
    """Reasons to think that a motion is not what its tolerance asks for; none for a sound one."""
    ledger = whole(result)
    balance = _balance(ledger) or late(ledger)
    return tuple(text for text in (balance, overturned(result), missed(result), _violation(result)) if text)


def of_impulses(result: Result) -> tuple[str, ...]:
    """The same of a motion by impulse time stepping: what the method itself took or gave, and contacts that failed."""
    taken = result.energy.exchanged("numerical_loss")
    lost = float(np.max(np.abs(taken), initial=0.0))
    own = result.health.contact.doubts if result.health.contact else ()
    moved = max(energy_moved(result), lost)
    losses = result.energy.exchanged("friction_loss") + result.energy.exchanged("impact_loss")
    dissipated = float(np.max(losses, initial=0.0))
    if not lost > max(MOST * moved, DISSIPATED * dissipated, SLIGHT * _lifting(result)):
        return own
    what = "took" if taken[int(np.argmax(np.abs(taken)))] > 0.0 else "gave"
    text = (
        f"impulse time stepping itself {what} {lost:.2g} J (energy.numerical_loss), "
        f"{100.0 * lost / moved:.2g} per cent of the energy moved: take shorter steps, "
        f"method=fb.Stepping(step=...)"
    )
    return (text, *own)


def _lifting(result: Result) -> float:
    """Energy [J] that lifts all bodies by the size of the smallest that touches: no origin of coordinates counts."""
    if result.health.contact is None:
        return 0.0
    mass = float(sum(whole(result).mass)) + sum(float(b.mass.sum()) for b in result.bulk.values())
    return mass * float(np.linalg.norm(result.values.system.gravity)) * result.health.contact.size


def warnings_of_impulses(result: Result) -> tuple[str, ...]:
    """All that there is to say about a motion by impulse time stepping."""
    return (*result.health.remarks, *result.health.doubtful, *pulls(result))


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
    return float(min(expected, max(MOST, min(ROUGH * rtol, ROUGHEST))))


def energy_moved(result: Result) -> float:
    """How much energy the motion shifted about [J]: what the balance is measured by.

    The largest kinetic energy, and the ranges of gravity's and the springs' energies and of every work.
    """
    return float(whole(result).moved(0, len(result.t)))


def _balance(x: Ledger) -> str:
    """What is said of all of it; or else of the part whose balance is worst, of those that nothing connects."""
    found, result = _off(x), x.result
    if not found and result.health.options.get("rtol") is not None:
        found = max((_off(x) for piece in result.pieces or (result,) for x in apart(piece)), default=())
    return found[1] if found else ""


def _off(x: Ledger) -> tuple[float, str] | tuple[()]:
    """How many times more than expected a balance is off, and that in words; nothing where it is not.

    What moves together is as accurate as the energy of all of it, and what nothing connects with others as its own.
    """
    rows, t = len(x.result.t), x.result.t
    if all(lost <= allowed for _, _, lost, _, allowed in _excesses(x, rows, np.zeros(rows), 0.0)):
        return ()  # what stands in no row, and rounding, only allow for more
    for begin, end, lost, there, allowed in _excesses(x, rows, _unseen(x), _rest(x)):
        if lost > allowed and x.known(begin, end):
            when = "" if end - begin == rows else f" between t = {t[begin]:.6g} and {t[end - 1]:.6g} s"
            return _told(x, when, lost, there, allowed)
    return ()


def _excesses(x: Ledger, rows: int, unseen: np.ndarray, least: float) -> Iterator[tuple[int, int, float, float, float]]:
    """First row and last (not counted), what is lost there, moved and to be expected [J].

    ``unseen`` and ``least``: see `_unseen` and `_rest`. Of all rows, then of the stretches where more may be lost than
    that.
    """
    part, moved = balanced(x.result), x.moved(0, rows) + float(unseen.max(initial=0.0))
    yield 0, rows, float(np.abs(x.balance).max(initial=0.0)), moved, part * moved + least
    for begin, end in _suspects(x, rows, x.kinetic + unseen, (part, moved, least)):
        # velocities v are as far off as those of what moves most, u: by m v du
        lost = float(np.ptp(x.balance[begin:end]))
        there = x.moved(begin, end) + float(unseen[begin:end].max())
        yield begin, end, lost, there, part * (moved * there) ** 0.5 + least


def _suspects(
    x: Ledger, rows: int, kinetic: np.ndarray, known: tuple[float, float, float]
) -> Iterator[tuple[int, int]]:
    """Stretches in which more may be lost than is to be expected, by the kinetic energy there alone."""
    part, moved, least = known
    for edges in _stretches(x.result, rows):
        begins, ends = edges[:-1], edges[1:] + 1
        at = np.stack([begins, ends], axis=1).ravel()[:-1]  # each stretch, and what is between its end and the next
        high, low, most = (
            f.reduceat(a, at)[::2] for f, a in ((np.maximum, x.balance), (np.minimum, x.balance), (np.maximum, kinetic))
        )
        lost = high - low
        fine = (lost <= least) | (lost <= part * (moved * most) ** 0.5)
        for k in np.flatnonzero(~fine):
            yield int(begins[k]), int(ends[k])


def _told(x: Ledger, when: str, lost: float, moved: float, allowed: float) -> tuple[float, str]:
    finer = "shorter step" if x.result.health.options.get("step") else "smaller rtol"
    return lost / allowed if allowed > 0.0 else np.inf, (
        f"the energy balance{x.of} is off by {lost:.3g} J{when} where {moved:.3g} J were moved and {allowed:.1g} J "
        f"are to be expected; a {finer} may tell whether the motion can be trusted"
    )


def _stretches(result: Result, rows: int) -> Iterator[np.ndarray]:
    """Ends of the halves, quarters and so on of the rows of a motion that was integrated: what something else
    dissipated before, or moves after, does not speak for what happens in one.
    """
    pieces = 2
    while result.health.options.get("rtol") is not None and pieces <= PIECES and rows >= ROWS * pieces:
        yield np.arange(pieces + 1) * (rows - 1) // pieces
        pieces *= 2


def _unseen(x: Ledger) -> np.ndarray:
    """Kinetic energy [J] that is moved about every output time and stands in none: rows once a turn see bodies at rest.

    What accelerations make of them within a step, where steps outnumber rows and that is much more than rows have.
    """
    r = x.result
    none = np.zeros_like(x.kinetic)
    if not len(r.t) or r.health.steps <= len(r.t) or r.health.options.get("step"):
        return none
    found = gained(r, x.bodies.tolist(), float(np.ptp(r.t)) / r.health.steps)
    return found if SEEN * found.max(initial=0.0) > x.moved(0, len(r.t)) else none


def _rest(x: Ledger) -> float:
    """Energy [J] below which nothing is said to move: rounding of the potential energy, and a creep of all bodies.

    The potential energy is that stored and that of the weight at the mechanism's length: where it is counted from is
    arbitrary.

    Where works are done, some of it perhaps between two rows, also what moves all bodies in the time there is to where
    rows have them.
    """
    length, t = x.result.values.length, x.result.t
    rounding = 1e-11 * (float(np.abs(x.stored[0] + x.stored[1]).max(initial=0.0)) + x.weight * length)
    least = rounding + float(x.mass.sum()) * (AT_REST * length) ** 2
    span = float(np.ptp(t)) if len(t) else 0.0
    if not x.works or not span > 0.0:
        return least
    return least + balanced(x.result) * float(x.mass @ x.went) / max(span, 1e-150) ** 2


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
        f"differ too much. Reactions may miss by thousands of times that part; equilibrium() has those at rest"
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
        arm, limit = f.sticking(wide(S.force_parameters, k))
        x, rate = result.measured.quantity(int(S.forces.F[k]))
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
