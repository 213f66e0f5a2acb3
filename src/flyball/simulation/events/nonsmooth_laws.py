"""Nonsmooth laws: the side of each corner (abs, max, sign), crossing it or sliding along it (Filippov).

The rates of all arguments u at their corners depend on the sides s: du/dt = d + B s. On s = 1 u must not fall, on
s = -1 not rise. Where both sides push towards u = 0, du/dt is zero, with s between -1 and 1 (Filippov, *Differential
Equations with Discontinuous Righthand Sides*, 1988, section 4).

With friction -sign(v) and a relay -sign(x) each pair of oscillations is shorter than the one before by the same ratio,
and after a finite time x and v are zero (the twisting algorithm: Levant, *International Journal of Control* 58, 1993).
Once the oscillations are below rounding, the rest of the series is taken at once.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...constraints.switches.switch_kind import G_CORNER, HELD, OFF, STEADY
from ...engine.calls import MOTION
from ...engine.guards import corner_value
from ...engine.mode_complementarity import RATE_ROUNDING, VELOCITY_ROUNDING
from ...engine.motion import corner_rates
from ...engine.rows import count_measured
from ...errors import SimulationError
from ...laws.bytecode import BY_MOTION, BY_TIME, SENSOR, evaluate_jet
from ...results.events import EventRecord
from .impacts import LOW_FLIGHT
from .instant_problem import RATE_TOLERANCE, InstantProblem

PASSAGES_OF_SERIES = 4  # passages through a corner that show whether oscillations get shorter
CONVERGING_RATIO = 0.999  # largest ratio of successive pairs of oscillations of a converging series


class CornerFunction(NamedTuple):
    """A function u on whose sign a law depends, at the state last evaluated.

    Attributes
    ----------
    row : ndarray (nv,)
        Derivatives of its rate by velocities.
    rates : bool
        Whether u depends on rates; then ``row`` has the derivatives of u itself, and du/dt depends on accelerations.
    size : float
        The mechanism's length, or a radian, in units of u; with rates times `instant_problem.reference_rate`.
    still : float
        Rounding of the quantity that ``row`` is the derivative of.
    grain : float
        Rounding of u.
    """

    row: np.ndarray
    rates: bool
    size: float
    still: float
    grain: float


def corner_derivatives(n: InstantProblem, s: int, seed: int) -> tuple[float, float, float]:
    """Return u of a corner and its derivatives along ``seed`` (`laws.bytecode.evaluate_jet`)."""
    law = int(n.S.switches.law[s])
    return evaluate_jet(n.S.code, n.S.const, law, n.W.stack, n.here.t, n.W.sensed, seed)


def measured_inputs(n: InstantProblem, s: int) -> list[int]:
    """Return the measured quantities (their rates behind them) that the argument of the corner of switch s reads."""
    code, at = n.S.code, int(n.S.switches.law[s])
    program = code[at + 2 : at + 2 + 2 * code[at]].reshape(-1, 2)
    read = np.unique(program[program[:, 0] == SENSOR, 1])
    return [int(m) for m in read[read < 2 * count_measured(n.S)]]


def corner_at(n: InstantProblem, s: int) -> CornerFunction:
    """Return the corner of switch s."""
    S, W, v = n.S, n.W, n.here.v
    nm, nr = count_measured(S), len(S.rows.law)
    terms, rows = n.here.structure.terms, len(n.here.structure.rows)
    measures = {x.row - rows: x.formula.measure for x in terms if x.measured}
    slopes = {m: corner_derivatives(n, s, m)[1] for m in measured_inputs(n, s)}
    rates = any(slope != 0.0 for m, slope in slopes.items() if m >= nm)
    row, size, still = np.zeros(n.here.structure.nv), 0.0, 0.0
    for m, slope in ((m - nm if rates else m, slope) for m, slope in slopes.items() if (m >= nm) == rates):
        unit = n.here.c.values.length if measures.get(m) == "m" else 1.0
        at = slice(S.row_start[nr + m], S.row_start[nr + m + 1])
        G = np.abs(W.G[at])
        row[S.column[at]] += slope * W.G[at]
        size += abs(slope) * unit
        rounding = RATE_ROUNDING * (G @ np.abs(v[S.column[at]])) + VELOCITY_ROUNDING * G.sum() * np.abs(v).max(
            initial=0.0
        )
        still += abs(slope) * (RATE_TOLERANCE * unit * n.pace + rounding)
    return CornerFunction(row, rates, size * n.pace if rates else size, still, still if rates else LOW_FLIGHT * size)


def note_passage(n: InstantProblem, s: int) -> None:
    """Store the present time as a passage through the corner of switch s."""
    past = n.here.corner_passages.setdefault(s, [])
    if not past or n.here.t > past[-1]:
        past.append(n.here.t)
        del past[:-PASSAGES_OF_SERIES]


def remaining_time(n: InstantProblem, s: int) -> float:
    """Return the total duration [s] of all oscillations to come, by the last ones; nan if they do not get shorter.

    Oscillations to one side and to the other are two series with the same ratio.
    """
    past = n.here.corner_passages.get(s, [])
    if len(past) < PASSAGES_OF_SERIES:
        return np.nan
    a, b, c = np.diff(past)
    ratio = c / a
    return float(ratio * (b + c) / (1.0 - ratio)) if ratio < CONVERGING_RATIO else np.nan


def below_rounding(n: InstantProblem, s: int, rate: float, acceleration: float) -> bool:
    """Return whether the height of the next oscillation, rate^2 / (2 acceleration), is rounding."""
    return rate * rate <= 2.0 * acceleration * LOW_FLIGHT * corner_at(n, s).size


def remove_rates(n: InstantProblem, rows: np.ndarray, misses: np.ndarray) -> None:
    """Subtract the excess ``misses`` of row v from the velocities, by the smallest change in the metric of the
    masses.
    """
    Y = np.column_stack([n.response(row)[0] for row in rows])
    n.here.v[:] -= Y @ np.linalg.lstsq(rows @ Y, misses, rcond=1e-9)[0]


def inverse_of_slopes(B: np.ndarray) -> np.ndarray:
    """Return the inverse of B (sides by rates); where B is singular, sides are weighted by their effects."""
    scale = 1.0 / np.maximum(np.abs(B).max(axis=1), 1e-300)
    N = scale[:, None] * B
    most = np.linalg.norm(N, axis=0)
    W = 1.0 / np.maximum(most, 1e-300)
    return np.asarray(W[:, None] * N.T @ np.linalg.pinv((N * W) @ N.T, rcond=1e-9) * scale)


CORNER_ROUNDING = 1e-12  # part of its terms below which u counts as zero
SIDE_REACHED = 1e-9  # distance of the side from 1 at which the motion leaves a corner
LEVEL_RATE = 1e-9  # part of the effect of sides on du/dt, or of du/dt on both sides, that counts as zero
RELAXATION_SWEEPS = 500
HISTORY_FACTOR = 1e3  # factor of rounding within which a motion held on a corner is still there
THROWN_FACTOR = 10.0  # factor of the residual of u beyond which a jump of velocities moved it off its corner
SAME_RATE = 1e-6  # part of u below which the removed rate was all of u
TIME_RESOLUTION = 1e-12  # relative accuracy of the time at which u crosses zero
LOOKAHEAD_SHARE = 1e-7  # largest lookahead, relative to the time span
LOOKAHEAD_STEP_SHARE = 1e-3  # largest lookahead, relative to the step width


class CornerProblem(NamedTuple):
    """Corners and the effects of their sides: du/dt = d + B sides (d^2u/dt^2 for those in ``second``); and the
    solution.

    ``held``: corners with a side between -1 and 1; ``left``: held corners whose side has reached its end.
    """

    which: list[int]
    second: list[int]
    d: np.ndarray
    B: np.ndarray
    size: np.ndarray
    sides: np.ndarray
    held: np.ndarray
    pending: np.ndarray


class Corners:
    """The corners of laws at an instant.

    Attributes
    ----------
    all : ndarray of int
        Switches that are corners, inner ones first.
    at : set of int
        Those whose u is zero here.
    """

    def __init__(self, n: InstantProblem) -> None:
        self.n = n
        self.all = np.flatnonzero(n.S.switches.law >= 0)
        self.at: set[int] = set()
        self.old = n.W.modes.mode.copy()
        self.sides = n.ways().copy()
        self.over = np.nan
        self.velocity_at_guard = n.here.v.copy()

    def begin(self) -> None:
        """Set the sides at the start of the motion."""
        self.n.run_engine(MOTION)
        for s in self.all.tolist():
            u, least = self.value(s)
            if self.n.W.modes.mode[s] != OFF and abs(u) <= HISTORY_FACTOR * max(least, corner_at(self.n, s).grain):
                self.at.add(s)  # it stays held
                continue
            self.n.ways()[s] = 1.0 if u >= 0.0 else -1.0
            if abs(u) <= self._rounding_of(s, u, least):
                self.at.add(s)
        self.n.run_engine(MOTION)

    def fired(self, guards: np.ndarray) -> None:
        """Note the guards that triggered, and the velocities at that time."""
        found = self.n.fired(guards, G_CORNER)
        astray = found & self.n.here.missed_crossings
        self.at |= found - astray - self._carried(found - astray)
        self.velocity_at_guard = self.n.here.v.copy()

    def _carried(self, found: set[int]) -> set[int]:
        """Return corners moved to the other side by a jump in time or a sampling: u has not crossed zero there."""
        n, real = self.n, self.n.here.clock.real
        if not found:
            return found
        n.run_engine(MOTION)
        now = {s: self.value(s) for s in sorted(found)}
        off = [s for s, (u, least) in now.items() if abs(u) > HISTORY_FACTOR * max(least, corner_at(n, s).grain)]
        if not off:
            return set()
        h = self._lookahead()
        fast = {s: abs(u - now[s][0]) / h for s, (u, _) in zip(off, self._predicted_values(off), strict=True)}
        n.run_engine(MOTION)
        late = THROWN_FACTOR * TIME_RESOLUTION * max(n.here.t, float(real.span))
        return {s for s in off if abs(now[s][0]) > late * fast[s]}

    def _lookahead(self) -> float:
        """Return the lookahead [s] for testing where the motion goes."""
        real = self.n.here.clock.real
        return min(LOOKAHEAD_SHARE * float(real.span), LOOKAHEAD_STEP_SHARE * float(real.h) or np.inf)

    def settle(self) -> bool:
        """Decide all sides. Returns whether forces jump as a result."""
        if not len(self.all):
            return False
        n, ways = self.n, self.n.ways()
        before, modes = ways[self.all].copy(), n.W.modes.mode[self.all].copy()
        self.at -= self._moved_off_by_jump()
        n.run_engine(MOTION)
        for s in self.all.tolist():
            if s in self.at:
                continue
            u, least = self.value(s)
            if n.W.modes.mode[s] != OFF:
                if abs(u) <= HISTORY_FACTOR * max(least, corner_at(n, s).grain):
                    self.at.add(s)
                    continue
                n.W.modes.mode[s] = OFF
            if abs(u) > self._rounding_of(s, u, least):
                ways[s] = np.sign(u)
            else:  # for example a rate that was held at zero: its sign is rounding, but its direction now is not
                self.at.add(s)
        jumps = self.decide() if self.at else False
        moved = bool((np.abs(ways[self.all] - before) > 1e-6).any())
        jumps = (moved and (jumps or self._not_at(before))) or (jumps and (n.W.modes.mode[self.all] != modes).any())
        n.here.fresh = n.here.fresh or jumps
        self._record_changes()
        return jumps

    def _not_at(self, before: np.ndarray) -> bool:
        """Return whether a side changed away from zero, by a jump of velocities."""
        return any(s not in self.at and w != self.n.ways()[s] for s, w in zip(self.all.tolist(), before, strict=True))

    def _moved_off_by_jump(self) -> set[int]:
        """Return the corners that a jump of velocities has moved off zero."""
        n, v = self.n, self.n.here.v.copy()
        if not self.at or (v == self.velocity_at_guard).all():
            return set()
        n.run_engine(MOTION)
        now = {s: self.value(s) for s in self.at}
        n.here.v[:] = self.velocity_at_guard
        n.run_engine(MOTION)
        then = {s: self.value(s)[0] for s in self.at}
        n.here.v[:] = v
        return {
            s
            for s, (u, least) in now.items()
            if abs(u - then[s]) > HISTORY_FACTOR * least + THROWN_FACTOR * abs(then[s])
        }

    def value(self, s: int) -> tuple[float, float]:
        """Return u of a corner at the state last evaluated, and its rounding."""
        S, W, t = self.n.S, self.n.W, self.n.here.t
        size = abs(t * corner_derivatives(self.n, s, BY_TIME)[1])
        for m in measured_inputs(self.n, s):
            size += abs(W.sensed.value[m] * corner_derivatives(self.n, s, m)[1])
        return float(corner_value(S, W, t, s)), CORNER_ROUNDING * float(size)

    def _rounding_of(self, s: int, u: float, least: float) -> float:
        """Return the size of u below which its sign is rounding, including that of rates that may be held."""
        if abs(u) <= least or not (found := corner_at(self.n, s)).rates:
            return least
        return max(least, found.still)

    def rates(self, which: list[int], signs: np.ndarray, second: list[int]) -> np.ndarray:
        """Return the rates of u of these corners for these sides; for those in ``second`` the second derivatives."""
        n = self.n
        n.ways()[which] = signs
        n.run_engine(MOTION)
        n.W.modes.mode[second] = STEADY
        corner_rates(n.S, n.W, n.here.t)
        n.W.modes.mode[second] = OFF
        return n.W.modes.drift[which].copy()

    def pushed(self, which: list[int], second: list[int]) -> CornerProblem:
        """Return the effects of the sides on these corners, and the sides that satisfy the conditions."""
        d = self.rates(which, np.zeros(len(which)), second)
        B = self._effects(which, d, second)
        size = np.abs(d) + np.abs(B).sum(axis=1)
        B[np.abs(B) <= np.maximum(LEVEL_RATE * size[:, None], self._rounding_part(which, second, B))] = 0.0
        old = self.sides[which]
        left = np.array([self.old[s] != OFF for s in which]) & (np.abs(np.abs(old) - 1.0) <= SIDE_REACHED)
        sides = _relaxed_branches(d, B, old)
        sides = np.where(left & (np.abs(sides) > 0.5), np.sign(old), sides)
        none = (np.abs(d + B @ sides) <= LEVEL_RATE * size) & (np.diag(B) < 0.0) & ~left
        if none.any():  # in proportion to their effects, where the equations are underdetermined
            even = sides.copy()
            even[none] = -inverse_of_slopes(B[np.ix_(none, none)]) @ (d[none] + B[np.ix_(none, ~none)] @ sides[~none])
            if (np.abs(even[none]) < 1.0).all() and (np.abs(B @ (even - sides))[none] <= LEVEL_RATE * size[none]).all():
                sides = even
        held = np.abs(sides) < 1.0
        return CornerProblem(which, second, d, B, size, sides, held, left)

    def _effects(self, which: list[int], d: np.ndarray, second: list[int]) -> np.ndarray:
        """Return the effect of each side on each rate, beyond d."""
        return np.column_stack([self.rates(which, e, second) - d for e in np.eye(len(which))])

    def _rounding_part(self, which: list[int], second: list[int], B: np.ndarray) -> np.ndarray:
        """Return the part of B caused by the residual of u: the side of abs(u) has no effect where u is zero."""
        n, out, v = self.n, np.zeros_like(B), self.n.here.v.copy()
        n.run_engine(MOTION)
        held = [(s, at) for s in which if (at := corner_at(n, s)).rates and abs(self.value(s)[0]) <= at.still]
        for _, at in held:
            n.here.v[:] = v
            n.run_engine(MOTION)
            remove_rates(n, at.row[None], np.array([-HISTORY_FACTOR * at.still]))
            other = self._effects(which, self.rates(which, np.zeros(len(which)), second), second)
            out += np.abs(other - B) / HISTORY_FACTOR
        n.here.v[:] = v
        return out

    def decide(self) -> bool:
        """Decide the sides of the corners that the motion is at. Returns whether forces depend on them."""
        n, W = self.n, self.n.W
        which = sorted(self.at)
        self.sides = n.ways().copy()
        W.modes.mode[which] = OFF
        found = self.ended(self.pushed(which, []))
        which, sides, held = found.which, found.sides, found.held
        n.ways()[which] = sides
        at = [corner_at(n, s) for s in which]
        slow = np.array([HISTORY_FACTOR * x.still * x.rates for x in at]) * n.pace
        flat = ~held & (np.abs(found.d + found.B @ sides) <= np.maximum(LEVEL_RATE * found.size, slow))
        if held.any():
            self._hold([s for s, h in zip(which, held, strict=True) if h], found)
        for k in np.flatnonzero(flat & ~found.pending):
            self._choose_side_by_trial(which, int(k), sides, self.sides[which])
        if len(which) > 1:
            self._refuse_unresolved([s for s, going in zip(which, ~held & ~found.pending, strict=True) if going], found)
        n.run_engine(MOTION)
        return bool(found.B.any())

    def ended(self, found: CornerProblem) -> CornerProblem:
        """Return the problem with the corners on which oscillations have ended: the motion may rest on these."""
        n, y, ways = self.n, self.n.here.y.copy(), self.n.ways().copy()
        n.ways()[found.which] = found.sides
        n.run_engine(MOTION)
        maybe = [
            (s, float(found.d[k]), at)
            for k, s in enumerate(found.which)
            if not found.B[k].any() and not (at := corner_at(n, s)).rates
        ]
        still = [s for s, rate, at in maybe if abs(rate) <= at.still]
        for s, _rate, _ in maybe:
            if s not in still and self.old[s] == OFF:
                note_passage(n, s)
        series = [s for s, _, _ in maybe if s not in still and remaining_time(n, s) >= 0.0]
        second = [*still, *series]
        if not second:
            return found
        rates = {s: rate for s, rate, _ in maybe}
        before = {s: self.value(s)[0] for s in self.all.tolist()}
        remove_rates(n, np.array([corner_at(n, s).row for s in second]), np.array([rates[s] for s in second]))
        n.run_engine(MOTION)
        also = [s for s in before if s not in self.at and abs(self.value(s)[0]) <= SAME_RATE * abs(before[s])]
        other = self.pushed(sorted({*found.which, *also}), second)
        ends = all(
            other.held[k] and below_rounding(n, s, rates[s], float(other.size[k]))
            for k, s in enumerate(other.which)
            if s in series
        )
        if ends:
            self.at |= set(also)
            self.over = n.here.t + max((remaining_time(n, s) for s in series), default=0.0)
            return other
        n.here.y[:] = y
        n.ways()[:] = ways
        return found if not still else self.pushed(found.which, still)

    def _hold(self, which: list[int], found: CornerProblem) -> None:
        """Hold the motion on these corners: u is set to zero by the smallest change, and the inverse slopes are
        stored.
        """
        n, W = self.n, self.n.W
        inverse = inverse_of_slopes(found.B[np.ix_(found.held, found.held)])
        n.run_engine(MOTION)
        rows = np.array([corner_at(n, s).row for s in which])
        misses = np.array(
            [corner_derivatives(n, s, BY_MOTION)[1] if s in found.second else self.value(s)[0] for s in which]
        )
        for i, s in enumerate(which):
            W.modes.mode[s] = STEADY if s in found.second else HELD
            W.modes.inverse_slopes[which, s] = inverse[:, i]
        n.run_engine(MOTION)
        remove_rates(n, rows, misses)

    def _choose_side_by_trial(self, which: list[int], k: int, signs: np.ndarray, old: np.ndarray) -> None:
        """Choose the side on which the motion continues by trial, where u does not change at first order."""
        n, s = self.n, which[k]
        fits = []
        for side in (1.0, -1.0):
            n.ways()[s] = side
            if side * self._predicted_values([s])[0][0] > 0.0:
                fits.append(side)
        n.ways()[s] = fits[0] if len(fits) == 1 else (np.sign(old[k]) or 1.0)

    def _predicted_values(self, which: list[int]) -> list[tuple[float, float]]:
        """Return the `value` of each of these corners a little later with the present sides, by the midpoint rule."""
        n = self.n
        t, y, real = n.here.t, n.here.y.copy(), n.here.clock.real
        h = self._lookahead()
        for part in (0.5, 1.0):
            n.run_engine(MOTION)
            real.t, n.here.y[:] = t + part * h, y + part * h * n.state.K[0]
        n.run_engine(MOTION)
        out = [self.value(s) for s in which]
        real.t, n.here.y[:] = t, y
        return out

    def _refuse_unresolved(self, which: list[int], found: CornerProblem) -> None:
        """Refuse a point where several corners meet and every choice of sides leads back at once."""
        n = self.n
        back = [
            s for s, (u, least) in zip(which, self._predicted_values(which), strict=True) if n.ways()[s] * u < -least
        ]
        if back:
            t = n.here.t
            higher = any(not found.B[found.which.index(s)].any() for s in back)
            why = "of which one is a rate of another" if higher else "none of whose sides the motion stays on"
            raise SimulationError(
                f"at t = {t:.9g} s corners of {' and '.join(dict.fromkeys(n.name(s) for s in back))} meet, and the "
                f"motion is attracted to them from all sides. Motion along several corners, {why}, is not supported; "
                "make one of them smooth: max(-1, min(1, x / width)) for sign(x), or let a Brake, Clutch or "
                "JointFriction be the friction",
                t=t,
            )

    def _record_changes(self) -> None:
        n = self.n
        for s in self.all.tolist():
            now = n.W.modes.mode[s]
            if now != self.old[s]:
                said = "stays on the corner of its law" if now != OFF else "leaves the corner of its law"
                y = n.here.y.copy()
                kind = "hold" if now != OFF else "leave"
                t = self.over if now != OFF and self.over > n.here.t else n.here.t
                n.here.records.append(EventRecord(t, n.name(s), kind, (said,), 0.0, {}, y, y))
                self.old[s] = now


def _relaxed_branches(d: np.ndarray, B: np.ndarray, old: np.ndarray) -> np.ndarray:
    """Return sides for which no u leaves the side of its law, by projected relaxation, row by row.

    Where both sides lead away from a corner, the motion crosses it.
    """
    out = np.where(np.abs(old) == 1.0, -np.sign(old), 0.0)
    for _ in range(RELAXATION_SWEEPS):
        last = out.copy()
        for k in range(len(d)):
            rest = d[k] + B[k] @ out - B[k, k] * out[k]
            if B[k, k] < 0.0:
                out[k] = np.clip(-rest / B[k, k], -1.0, 1.0)
            elif B[k, k] > 0.0 and abs(rest) <= B[k, k]:
                out[k] = out[k] if abs(out[k]) == 1.0 else 1.0
            elif rest != 0.0:
                out[k] = np.sign(rest)
        if np.abs(out - last).max() <= 1e-15:
            break
    return out
