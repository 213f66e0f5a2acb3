"""Energies over time, their balance as a whole and of unconnected parts, and the phase error they cause.

`Energy` is the part of a result with the energies. `EnergyBudget` contains the terms of the balance for all bodies,
or for connected parts; `balance_warning` compares its imbalance with the one to be expected of the tolerance. Without
drives and damping the speed of a motion with one degree of freedom follows from its energy: if the kinetic energy T
is wrong by dE, the speed is wrong by the fraction dE / 2T, and its integral is the time by which the motion is early.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from ..engine.entry_point import characteristic_rate_within
from ..math.vec import dot, mtv, mv
from ..model.contact_point import Touch
from ..model.force import Force
from ..model.quantities import ENERGY, Quantity, quantities
from ..numerics.graphs import find_root, unite
from ..tables.table_definitions import BETWEEN, SLIDING, System
from .events import EVENT_WORK, stored_by_events, stored_reference
from .part_views.base import NamedQuantities

if TYPE_CHECKING:
    from .result import Result


EXCHANGE_SIGNS = {"friction_loss": -1.0, "impact_loss": -1.0, "surface_work": 1.0, "numerical_loss": -1.0}
"""Energies exchanged by contacts, with the sign of the bodies' share.

The last one is the energy error of impulse time stepping itself.
"""
CONTACT_ELASTIC = "contact_elastic"
"""Energy stored in compliant contacts, among the energies exchanged by contacts."""


def kinetic_energy(result: Result, bodies: Sequence[int] | np.ndarray) -> np.ndarray:
    """Sum of m v^2 / 2 + w . I w / 2 over rows of the body table, and of rotors that turn with their joints [J]."""
    _, R, w, v, _, _ = result.motions.bodies(bodies)
    table = result.values.system.bodies
    w_B, inertia = mtv(R, w), tuple(table.inertia[bodies].T[..., None])
    own = (0.5 * table.mass[bodies, None] * dot(v, v) + 0.5 * dot(w_B, mv(inertia, w_B))).sum(axis=0)
    s, S = result.values.structure, result.values.system
    moved = np.isin(np.repeat(np.arange(len(S.tree.nv)), S.tree.nv), bodies)
    for d in {d for _, d in s.rotors if moved[d]}:
        own = own + 0.5 * S.rotor_inertia[d] * result.v[:, d] * result.v[:, d]
    return own


def gravity_energy(result: Result, bodies: Sequence[int] | np.ndarray) -> np.ndarray:
    """Potential energy of gravity of rows of the body table [J]."""
    S = result.values.system
    return -(S.bodies.mass[bodies][:, None] * dot(tuple(S.gravity), result.motions.bodies(bodies)[0])).sum(axis=0)


class Energy(NamedQuantities):
    """Energies of a motion [J]: kinetic, potential (gravity and springs), and the work done from outside."""

    instead: ClassVar = {"work": "the work of each part is part.work; all of them are in result.energy.work"}

    def __init__(self, result: Result) -> None:
        self._result = result

    @property
    def title(self) -> str:
        """Title in messages."""
        return ENERGY

    @property
    def names(self) -> dict[str, Quantity]:
        """All its quantities by name."""
        return quantities(self._result.model, ENERGY)

    @property
    def _bodies(self) -> np.ndarray:
        """All rows of the body table."""
        return np.arange(len(self._result.values.system.tree.parent))

    @cached_property
    def kinetic(self) -> np.ndarray:
        """Sum of m v^2 / 2 + w . I w / 2 over the bodies."""
        if self._result.pieces:
            return self._concatenated("kinetic")
        return sum((b.kinetic for b in self._result.bulk.values()), kinetic_energy(self._result, self._bodies))

    @cached_property
    def gravity(self) -> np.ndarray:
        """Potential energy of gravity (its value at t = 0), zero where all mass centres lie in the world's origin."""
        if self._result.pieces:
            return self._concatenated("gravity")
        S = self._result.values.system
        total = gravity_energy(self._result, self._bodies)
        return sum((b.potential(S.gravity) for b in self._result.bulk.values()), total)

    @cached_property
    def elastic(self) -> np.ndarray:
        """Energy stored in springs, and in contacts that give way."""
        return sum((self._result[f.name].energy for f in self._result.model.acting()), self.exchanged(CONTACT_ELASTIC))

    @property
    def potential(self) -> np.ndarray:
        """Gravity and springs."""
        return self.gravity + self.elastic

    @property
    def total(self) -> np.ndarray:
        """Kinetic and potential."""
        return self.kinetic + self.potential

    @cached_property
    def work(self) -> dict[str, np.ndarray]:
        """Work done since the start by each damper, actuator, motor, given force and driver.

        Where gravity is a law of time, ``"gravity"`` is the work of its change since t = 0. It excludes energy
        stored in a spring of the same element, which is potential energy, and the energy of
        stiffness changes, which is done by events.
        """
        out = {}
        r = self._result
        for name in r.values.structure.states:
            if name == "gravity.work":
                out["gravity"] = r.states[:, r.values.structure.state_at[name]]
            elif name.endswith(".work"):
                element = r[name.removesuffix(".work")]
                own = element.element
                stores = isinstance(own, Force) and own.energy is not None
                out[own.name] = element.work + (element.energy - stored_reference(r, own.name) if stores else 0.0)
        return out

    def _concatenated(self, name: str) -> np.ndarray:
        """One of the energies, concatenated if parameters changed during the motion."""
        return np.concatenate([getattr(p.energy, name) for p in self._result.pieces])

    def exchanged(self, name: str) -> np.ndarray:
        """Energy since the start that contacts and events lost or gave, by its name; zeros if there are none."""
        found = self._result.exchanged.get(name)
        return self._result.motions.zeros() if found is None else found

    def _friction_loss(self) -> np.ndarray:
        """Energy lost in friction of contacts since the start; for contact points an integrated work."""
        r = self._result
        at = r.values.structure.state_at
        own = (at.get(f"{e.name}.work") for e in r.values.structure.model.forces if isinstance(e, Touch))
        return sum((-r.states[:, k] for k in own if k is not None), self.exchanged("friction_loss"))

    def _found(self, name: str) -> np.ndarray:
        return self._friction_loss() if name == "friction_loss" else self.exchanged(name)

    @cached_property
    def balance(self) -> np.ndarray:
        """Total energy less all work put in less the total at the start: zero for an exact motion."""
        if not len(self._result.t):
            return np.zeros(0)
        put_in = sum(self.work.values(), self._result.motions.zeros())
        put_in = sum((sign * self.exchanged(k) for k, sign in (*EXCHANGE_SIGNS.items(), (EVENT_WORK, 1.0))), put_in)
        residue = self.total - put_in
        return residue - residue[0]

    @property
    def drift(self) -> float:
        """Largest deviation from the balance [J]; nan if there are fewer than two output times."""
        return float(np.abs(self.balance).max()) if len(self._result.t) > 1 else float("nan")


@dataclass(frozen=True)
class EnergyBudget:
    """Energies [J] of some bodies at every recorded time.

    Attributes
    ----------
    result : Result
    bodies : ndarray of int
        Rows of the body table.
    kinetic, balance : ndarray (n,)
    stored : tuple of two ndarray (n,)
        Of gravity, and in springs.
    works : tuple of ndarray (n,)
    foreign : ndarray (n,)
        Energy exchanged by impacts, contacts and events that the balance does not include: the balance is valid while
        this is constant.
    """

    result: Result
    bodies: np.ndarray
    kinetic: np.ndarray
    balance: np.ndarray
    stored: tuple[np.ndarray, np.ndarray]
    works: tuple[np.ndarray, ...]
    foreign: np.ndarray

    @property
    def t(self) -> np.ndarray:
        """The recorded times [s]."""
        return self.result.t[self.result.record.rows]

    @property
    def mass(self) -> np.ndarray:
        """Of each of the bodies [kg]."""
        return self.result.values.system.bodies.mass[self.bodies]

    @property
    def weight(self) -> float:
        """Of all of the bodies [N]."""
        return float(self.mass.sum() * np.linalg.norm(self.result.values.system.gravity))

    @property
    def travel(self) -> np.ndarray:
        """Approximate travel of each body [m]."""
        p = self.result.record.figures.position[:, self.bodies]
        return np.sqrt(((p.max(axis=0) - p.min(axis=0)) ** 2).sum(axis=1))

    def known(self, begin: int, end: int) -> bool:
        """Return whether the balance is valid from row ``begin`` to the one before ``end``."""
        return not np.ptp(self.foreign[begin:end]) > 0.0

    @property
    def of(self) -> str:
        """Description of its bodies; empty for all."""
        if len(self.bodies) == len(self.result.values.system.tree.parent):
            return ""
        place = {b: name for name, b in self.result.values.structure.place.items()}
        names = [place[b] for b in self.bodies.tolist() if b in place]  # massless links have none
        name, more = names[0], len(names) - 1
        others = f" and the {more} bodies" if more > 1 else " and the body"
        return f" of {name!r}" + (f"{others} connected with it" if more else "")

    def moved(self, begin: int, end: int) -> float:
        """Return the energy moved between two rows, the last excluded [J].

        It is the sum of the largest kinetic energy and of the ranges of the gravity and spring energies and of every
        work.
        """
        if end <= begin:
            return 0.0
        every = np.stack([*self.stored, *self.works])[:, begin:end]
        return float(self.kinetic[begin:end].max() + (every.max(axis=1) - every.min(axis=1)).sum())


def total_budget(result: Result) -> EnergyBudget:
    """Return the budget of all bodies at the recorded times."""
    rows, figures, e = result.record.rows, result.record.figures, result.energy
    bodies = e._bodies
    kinetic, gravity = figures.kinetic[:, bodies].sum(axis=1), figures.gravity[:, bodies].sum(axis=1)
    for b in result.bulk.values():
        kinetic, gravity = kinetic + b.kinetic[rows], gravity + b.potential(result.values.system.gravity)[rows]
    elastic = figures.elastic.sum(axis=1)
    works = _recorded_works(result)
    residue = kinetic + gravity + elastic - sum(works.values(), np.zeros(len(rows)))
    for name, x in result.exchanged.items():
        if name == CONTACT_ELASTIC:
            elastic = elastic + x[rows]
        residue -= {CONTACT_ELASTIC: -1.0, EVENT_WORK: 1.0, **EXCHANGE_SIGNS}[name] * x[rows]
    every = np.arange(len(result.values.system.tree.parent))
    stored = gravity, elastic
    return EnergyBudget(
        result, every, kinetic, residue - residue[:1], stored, tuple(works.values()), np.zeros(len(rows))
    )


def _recorded_works(result: Result) -> dict[str, np.ndarray]:
    """Return `Energy.work` at the recorded times, but for constants."""
    s, (rows, figures) = result.values.structure, (result.record.rows, result.record.figures)
    index = {f.name: k for k, f in enumerate(s.forces) if f.energy is not None}
    out = {}
    for state, at in s.state_at.items():
        name = state.removesuffix(".work")
        if name != state:
            out[name] = result.states[rows, at]
            if name in index:
                out[name] = out[name] + figures.elastic[:, index[name]] - stored_by_events(result, name)[rows]
    return out


def budgets_by_part(result: Result) -> list[EnergyBudget]:
    """Return the budgets of parts that neither joints nor forces connect; none if everything is connected.

    Energies exchanged by impacts and events are not known by parts.
    """
    s, S = result.values.structure, result.values.system
    part = s.cache.get("connected", None, 1, partial(connected_parts, S))
    many = int(part.max(initial=0)) + 1
    if many < 2 or result.bulk or "gravity.work" in s.state_at or not len(result.t):
        return []
    rows, figures = result.record.rows, result.record.figures
    of_force = [_part_of(result, f, part) for f in s.forces]
    works = [(_part_of(result, s.model[name], part), work) for name, work in _recorded_works(result).items()]
    foreign = sum((np.abs(x) for k, x in result.exchanged.items() if k != CONTACT_ELASTIC), np.zeros(len(result.t)))[
        rows
    ]
    out = []
    for p in range(many):
        bodies = np.flatnonzero(part == p)
        moving, weight = figures.kinetic[:, bodies].sum(axis=1), figures.gravity[:, bodies].sum(axis=1)
        elastic = figures.elastic[:, [k for k, at in enumerate(of_force) if at == p]].sum(axis=1)
        own = tuple(work for at, work in works if at == p)
        residue = moving + weight + elastic - sum(own, np.zeros(len(rows)))
        out.append(EnergyBudget(result, bodies, moving, residue - residue[0], (weight, elastic), own, foreign))
    return out


def connected_parts(S: System) -> np.ndarray:
    """Return the number of the connected part of each row of the body table, (nb,).

    Bodies are connected by joints, couplings and forces.
    """
    first = list(range(len(S.tree.parent)))  # union-find parents: a body before it in the same part, or itself
    pairs = [(b, parent) for b, parent in enumerate(S.tree.parent.tolist()) if parent >= 0]
    some = [
        *(_bodies_of_row(S, k) for k in range(len(S.rows.law))),
        *(_bodies_of_force(S, k) for k in range(len(S.forces.F))),
    ]
    pairs += [(int(bodies[0]), int(b)) for bodies in some for b in bodies[1:]]
    for i, j in pairs:
        unite(first, i, j)
    return np.unique([find_root(first, b) for b in range(len(first))], return_inverse=True)[1]


def _bodies_of_row(S: System, k: int) -> np.ndarray:
    """Return the bodies of a row, or of a measured quantity (numbered after all rows)."""
    body = np.repeat(np.arange(len(S.tree.parent)), S.tree.nv)
    return np.unique(body[S.column[S.row_start[k] : S.row_start[k + 1]]])


def _bodies_of_force(S: System, k: int) -> np.ndarray:
    ends, family = np.array([S.forces.F[k], S.forces.M[k]]), S.forces.family[k]
    if family == BETWEEN:
        at = S.frame_body[ends[ends >= 0]]
        return np.unique(at[at >= 0])
    lines = ends[ends >= 0] if family == SLIDING else ends[:1]
    return np.unique(np.concatenate([_bodies_of_row(S, len(S.rows.law) + m) for m in lines]))


def _part_of(result: Result, e: Any, part: np.ndarray) -> int:
    """Return the part on which an element acts, or -1."""
    s, S = result.values.structure, result.values.system
    if e.name in s.prescribed:
        return int(part[s.prescribed[e.name]])
    k = next((k for k, f in enumerate(s.forces) if f is e or f.name == e.name), None)
    if k is not None:
        bodies = _bodies_of_force(S, k)
    else:
        rows = s.slices.get(e.name, slice(0, 0))
        bodies = np.concatenate([np.zeros(0, np.int64), *(_bodies_of_row(S, r) for r in range(rows.start, rows.stop))])
    return int(part[bodies[0]]) if len(bodies) else -1


MAX_LAG = 0.05  # position error relative to a body's travel
NEGLIGIBLE_TRAVEL = 1e-6  # relative to the mechanism's length: smaller travel is ignored
TURNING_POINT = 0.1  # relative to the largest kinetic energy: below it an oscillating motion is at a turning point


def lag_warning(x: EnergyBudget) -> str:
    """A warning on the phase error of a motion with one degree of freedom, from its energy error; nothing if small.

    It is not evaluated if there are more steps than recorded times, which may then miss slow phases.
    """
    r = x.result
    unknown = x.works or r.exchanged or r.bulk or r.pieces
    if unknown or not 1 < r.health.steps <= len(x.t) or not x.kinetic.max() > 0.0:
        return ""
    faster = _speed_excess(x)
    faster[_turning_points(x)] = 0.0
    lag = np.r_[0.0, np.cumsum(0.5 * (faster[1:] + faster[:-1]) * np.diff(x.t))]
    names = {b: name for name, b in r.values.structure.place.items() if b >= 0}
    bodies = list(names)
    by = (np.abs(lag)[:, None] * r.record.figures.speed[:, bodies]).max(axis=0)
    way = max(float(x.travel[bodies].max(initial=0.0)), NEGLIGIBLE_TRAVEL * r.values.length)
    if not by.max(initial=0.0) > MAX_LAG * way or r.health.freedoms != 1:
        return ""
    off, name = float(by.max()), names[bodies[int(np.argmax(by))]]
    finer = "shorter step" if r.health.options.get("step") else "smaller rtol"
    return (
        f"the energy is off by up to {np.abs(x.balance).max():.2g} J, and the kinetic energy falls to "
        f"{x.kinetic.min():.2g} J: this error alone makes the motion {np.abs(lag).max():.2g} s early or late, and the "
        f"position of {name!r} wrong by about {off:.2g} m. Compare with a motion with a {finer}"
    )


def _speed_excess(x: EnergyBudget) -> np.ndarray:
    """Return the relative speed error at every recorded time, dE / 2T, limited to 1/2."""
    return x.balance / (2.0 * (x.kinetic + np.abs(x.balance)) + 1e-300)


def _turning_points(x: EnergyBudget) -> np.ndarray:
    """Return rows around turning points: the speed error is large there, the time error is not."""
    slow, v = x.kinetic < TURNING_POINT * x.kinetic.max(), x.result.v[x.result.record.rows]
    edges = np.flatnonzero(np.diff(np.r_[False, slow, False]))
    out = np.zeros(len(slow), bool)
    for begin, end in edges.reshape(-1, 2):
        before, after = v[max(begin - 1, 0)], v[min(end, len(v) - 1)]
        out[begin:end] = begin == 0 or end == len(v) or float(before @ after) <= 0.0
    return out


DEFAULT_IMBALANCE = 1e-4  # relative to the energy moved: larger imbalances are reported if no tolerance was given
RTOL_FACTOR, RTOL_FACTOR_PER_STEP = (
    10.0,
    0.1,
)  # times rtol: accepted imbalance of a short motion; it grows with each step
FINE_RTOL_FACTOR = 3e-2  # times the root of rtol: the same for rtol so small that a digit more or less does not matter
MAX_IMBALANCE, ROUGH_RTOL_FACTOR = (
    1e-2,
    5.0,
)  # relative to the energy moved: limit for any number of steps; or so many times a large rtol
MAX_ROUGH_IMBALANCE = 2e-2  # relative to the energy moved: limit for any tolerance
MAX_INTERVALS, MIN_OUTPUTS_PER_INTERVAL = (
    64,
    4,
)  # largest number of intervals for the balance, and least number of output rows in each
SEEN_PART = 0.1  # part of the energy estimated from accelerations; if the rows show less, they miss the motion
MAX_ACCELERATION_VIOLATION = (
    1e-8  # relative acceleration error of constraints: reactions are wrong by up to 1e4 times it
)
REST_SPEED = 1e-7  # speed that counts as rest, relative to the mechanism's length times its characteristic rate


def expected_imbalance(result: Result) -> float:
    """Return the energy imbalance to be expected of a sound motion, relative to the energy moved.

    Errors of steps accumulate: a motion of few steps is accurate to a few times its tolerance, one of ten thousand
    steps to a thousand times. Of 1270 random motions, including stiff ones, by three methods at tolerances from 1e-2 to
    1e-7, all accurate to ten times their tolerance, 1.6 % exceed this value.
    """
    o = result.health.options
    rtol = o.get("rtol")
    if rtol is None or o.get("step"):
        return DEFAULT_IMBALANCE
    expected = max(FINE_RTOL_FACTOR * rtol**0.5, rtol * (RTOL_FACTOR + RTOL_FACTOR_PER_STEP * result.health.steps))
    return float(min(expected, max(MAX_IMBALANCE, min(ROUGH_RTOL_FACTOR * rtol, MAX_ROUGH_IMBALANCE))))


def energy_moved(result: Result) -> float:
    """Return the energy moved by the motion [J], the reference for its imbalance.

    It is the sum of the largest kinetic energy and of the ranges of the gravity and spring energies and of every work.
    """
    return result.budget.moved(0, len(result.record.rows))


def balance_warning(x: EnergyBudget) -> str:
    """Return the warning for the whole mechanism, or else for the unconnected part with the worst balance."""
    found, result = _worst_imbalance(x), x.result
    if not found and result.health.options.get("rtol") is not None:
        found = max((_worst_imbalance(x) for x in budgets_by_part(result)), default=())
    return found[1] if found else ""


def _worst_imbalance(x: EnergyBudget) -> tuple[float, str] | tuple[()]:
    """Return the ratio of the imbalance to the expected one, with a text; nothing if it is not exceeded.

    A connected part is judged by its own energy.
    """
    rows, t = len(x.t), x.t
    if all(lost <= allowed for _, _, lost, _, allowed in _imbalances(x, rows, np.zeros(rows), 0.0)):
        return ()  # energies between the rows, and rounding, only increase the accepted imbalance
    for begin, end, lost, there, allowed in _imbalances(x, rows, _kinetic_between_outputs(x), _rest_energy(x)):
        if lost > allowed and x.known(begin, end):
            when = "" if end - begin == rows else f" between t = {t[begin]:.6g} and {t[end - 1]:.6g} s"
            return _imbalance_text(x, when, lost, there, allowed)
    return ()


def _imbalances(
    x: EnergyBudget, rows: int, between_outputs: np.ndarray, least: float
) -> Iterator[tuple[int, int, float, float, float]]:
    """Yield the first row and the one after the last, and the energy lost, moved and expected to be lost there [J].

    ``between_outputs`` and ``least``: see `_kinetic_between_outputs` and `_rest_energy`. First for all rows, then for
    the intervals where the loss may be larger.
    """
    part, moved = expected_imbalance(x.result), x.moved(0, rows) + float(between_outputs.max(initial=0.0))
    yield 0, rows, float(np.abs(x.balance).max(initial=0.0)), moved, part * moved + least
    for begin, end in _suspect_intervals(x, rows, x.kinetic + between_outputs, (part, moved, least)):
        # velocities v have the absolute error du of the fastest body, and so an energy error m v du
        lost = float(np.ptp(x.balance[begin:end]))
        there = x.moved(begin, end) + float(between_outputs[begin:end].max())
        yield begin, end, lost, there, part * (moved * there) ** 0.5 + least


def _suspect_intervals(
    x: EnergyBudget, rows: int, kinetic: np.ndarray, known: tuple[float, float, float]
) -> Iterator[tuple[int, int]]:
    """Return intervals in which the loss may exceed the expected one, by the kinetic energy there alone."""
    part, moved, least = known
    for edges in _intervals(x.result, rows):
        begins, ends = edges[:-1], edges[1:] + 1
        at = np.stack([begins, ends], axis=1).ravel()[:-1]  # each interval, and the gap between its end and the next
        high, low, most = (
            f.reduceat(a, at)[::2] for f, a in ((np.maximum, x.balance), (np.minimum, x.balance), (np.maximum, kinetic))
        )
        lost = high - low
        fine = (lost <= least) | (lost <= part * (moved * most) ** 0.5)
        for k in np.flatnonzero(~fine):
            yield int(begins[k]), int(ends[k])


def _imbalance_text(x: EnergyBudget, when: str, lost: float, moved: float, allowed: float) -> tuple[float, str]:
    finer = "shorter step" if x.result.health.options.get("step") else "smaller rtol"
    return lost / allowed if allowed > 0.0 else np.inf, (
        f"the energy balance{x.of} is off by {lost:.3g} J{when} of {moved:.3g} J moved; {allowed:.1g} J are expected. "
        f"Compare with a motion with a {finer}"
    )


def _intervals(result: Result, rows: int) -> Iterator[np.ndarray]:
    """Return the ends of the halves, quarters and so on of the rows of an integrated motion.

    Energy dissipated before or moved after an interval must not hide losses within it.
    """
    pieces = 2
    while (
        result.health.options.get("rtol") is not None
        and pieces <= MAX_INTERVALS
        and rows >= MIN_OUTPUTS_PER_INTERVAL * pieces
    ):
        yield np.arange(pieces + 1) * (rows - 1) // pieces
        pieces *= 2


def _kinetic_between_outputs(x: EnergyBudget) -> np.ndarray:
    """Return the kinetic energy [J] between output times that no row shows: one row per turn may show bodies at rest.

    It is estimated from the accelerations over a step, if there are more steps than rows and the estimate is much
    larger.
    """
    r, none, figures = x.result, np.zeros_like(x.kinetic), x.result.record.figures
    gain = figures.gain[:, x.bodies].sum(axis=1)
    known = np.isfinite(gain) & ~(figures.violation > MAX_ACCELERATION_VIOLATION)  # wrong ones estimate nothing
    if not known.any() or r.health.steps <= len(r.t) or r.health.options.get("step"):
        return none
    found = (float(np.ptp(r.t)) / r.health.steps) ** 2 * np.interp(x.t, x.t[known], gain[known])
    return found if SEEN_PART * found.max() > x.moved(0, len(x.t)) else none


def _rest_energy(x: EnergyBudget) -> float:
    """The energy [J] below which bodies count as at rest: rounding of the potential energy, and creep of all bodies.

    The potential energy is that stored in springs and that of the weight at the mechanism's length, since its zero is
    arbitrary.

    If work is done, possibly between two rows, the energy that moves all bodies through their travel in the available
    time is added.
    """
    length, t = x.result.values.length, x.t
    rounding = 1e-11 * (float(np.abs(x.stored[0] + x.stored[1]).max(initial=0.0)) + x.weight * length)
    span = float(np.ptp(t)) if len(t) else 0.0
    slow = REST_SPEED * length * characteristic_rate_within(x.result.values.system, span)
    least = rounding + float(x.mass.sum()) * slow**2
    if not x.works or not span > 0.0:
        return least
    return least + expected_imbalance(x.result) * float(x.mass @ x.travel**2) / max(span, 1e-150) ** 2
