"""Switching during a motion: general engine or generated code; explicit or implicit (stiffness monitor).

Both codes compute the same operations in the same order, so results agree to the last bit. The choice follows from
estimated costs and counts of steps, never from a clock, so that the same call gives the same motion.

A motion is stiff where steps of an explicit method are as wide as it is stable and no wider: h rho is near the
edge of the region of stability, rho being the largest |eigenvalue| of the right-hand side (Hairer and Wanner 1996,
section IV.2); for dop853 the edge is at 6 to 6.8 in all directions. With tight tolerances steps do not get there,
since rounding of the fast modes is an error at each. A stiff motion is told from one that is merely fast by three
signs: steps are rejected, an oscillation would have been damped away since the last check, and there is none that
matters.
"""

from __future__ import annotations

import hashlib
import math
import threading
from collections import OrderedDict
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from .. import codegen
from ..assembly.compiled_mechanism import CompiledMechanism
from ..constraints.switch_kinds import BRANCH
from ..engine.entry_point import MOTION, evaluate_state
from ..errors import ModelError
from ..numerics.eigen import dominant_eigenvalue
from ..numerics.integrators import time_loop as ex
from ..numerics.integrators.explicit_runge_kutta import reset_rejections, scaled_norm
from ..tables.coordinate_choice import right_hand_side_cost
from ..tables.structure_definition import Structure
from ..tables.table_definitions import OFF, VALUE, assign, named_arrays
from ..tables.values import Values

AUTO_CODE = "auto"
IN_MEMORY_ONLY = "kept"  # code that this process has, if it serves a mechanism: of the runs of a study
FIRST_DECISION, DECISION_FACTOR = 8, 4  # steps after which auto chooses, and how many times more until it does again
GAIN = 3.0  # times faster
PRICE_MARGIN = 1.25  # times what it takes to make or load code, that it must save
HISTORY_WEIGHT = 3.0  # of what earlier motions took, the part that counts: each may have been the last
LOAD_COST = (
    1.5e5  # what code costs that is on disk [ns], as part of what it is loaded for: the next motion has it at once.
)
# (To load it takes a process 3 ms, and 10 to know what it looks for, once for all its motions)
MOST_STEPS_PER_CALL = 100_000  # steps in one call of the compiled loop
FAILED_STATUS = (ex.STEP_FAILED, ex.NOT_FINITE, ex.OUTPUT_FAILED)
GENERAL_ENGINE, GENERATED_CODE = "table-driven", "made for this mechanism"
TOO_SHORT = f"{GENERAL_ENGINE}: too little is computed to make code for it"
NO_MODES = "rows that hold at times and let go at others, and events, are for the tables"


MOST_KINDS = 256  # kinds of mechanisms that are known


class CostAccount:
    """Times [ns] by kind of mechanism."""

    def __init__(self) -> None:
        self._spent: OrderedDict[str, float] = OrderedDict()
        self._lock = threading.Lock()

    def add(self, key: str, more: float) -> None:
        """So much more."""
        with self._lock:
            self._spent[key] = self._spent.pop(key, 0.0) + more
            while len(self._spent) > MOST_KINDS:
                self._spent.popitem(last=False)

    def of(self, key: str) -> float:
        """All of it."""
        with self._lock:
            return self._spent.get(key, 0.0)


SPENT = CostAccount()
"""By the table-driven engine."""


EVALUATION_COST, COST_SHARE = 150.0, 0.6  # an evaluation on average [ns], and part of the cost of a right-hand side


def mechanism_kind(s: Structure) -> tuple[str, float]:
    """The same for mechanisms that differ in numbers only; what an evaluation of the table-driven engine takes [ns]."""
    return s.kept.get(
        "kind", None, 1, lambda: (_structure_hash(s), EVALUATION_COST + COST_SHARE * right_hand_side_cost(s))
    )


def _structure_hash(s: Structure) -> str:
    digest = hashlib.blake2b(digest_size=16)
    for table, of in sorted(s.tables.items()):
        for name, x in named_arrays(of, table):
            digest.update(f"{name}{x.shape}".encode() + x.tobytes())
    return digest.hexdigest()


def check_specialize(value: Any) -> None:
    """Refuse what is not a choice of the engine.

    Raises
    ------
    ModelError
        If it is none of True, False and ``"auto"``.
    """
    if not isinstance(value, (bool, str)) or value not in (True, False, AUTO_CODE, IN_MEMORY_ONLY):
        raise ModelError(f"specialize is True, False or {AUTO_CODE!r}, not {value!r}")


def prepare_generated_code(x: Values, evaluations: int, runs: int) -> bool:
    """Have code made for so many motions, of which one took so many evaluations by the tables, if it pays; whether
    there is such code now.
    """
    plan = codegen.plan(x)
    if x.structure.guards or codegen.refusal(plan):
        return False
    computing = runs * evaluations * mechanism_kind(x.structure)[1]
    if computing * (1.0 - 1.0 / GAIN) < PRICE_MARGIN * codegen.price(plan, codegen.known(plan, x)):
        return False
    try:
        codegen.code(plan, x)
    except codegen.Refused:
        return False
    return True


class CodeSelection:
    """The engine of one motion.

    Parameters
    ----------
    c : Compiled
        In the coordinates of the motion, with the scratch that it is run on.
    wish : bool, "auto" or "kept"
        What is wanted.
    without : str
        Why made code would do nothing here, if it would not.

    Attributes
    ----------
    told : str
        Which engine it is, and why.
    due : float
        Steps after which it is chosen again.

    Raises
    ------
    ModelError
        If code is wanted that cannot be made.
    """

    def __init__(self, c: CompiledMechanism, wish: bool | str, without: str = "") -> None:
        self.c, self.told, self.due = c, f"{GENERAL_ENGINE}: asked for", math.inf
        self._first = math.nan  # time at which the motion begins
        self._counted = 0
        if wish is False:
            return
        if wish is True:
            self._require_generated_code(without or (NO_MODES if c.structure.guards else ""))
        elif why := without or (NO_MODES if c.structure.guards else ""):
            self.told = f"{GENERAL_ENGINE}: {why}"
        else:
            self.told = TOO_SHORT
            if wish == AUTO_CODE:
                self.due = FIRST_DECISION
                self._kind, self._each = mechanism_kind(c.structure)
            made = codegen.in_memory(codegen.plan(c.values), c.values) if codegen.ready() else None
            if made is not None:
                self._take(made, "kept in this process")

    def begin(self, clock: ex.StepState) -> None:
        """The motion begins there."""
        self._first = float(clock.real.t)
        if self.due < math.inf:
            self._counted = int(self.c.work.counts.evaluations)

    def choose_again(self, clock: ex.StepState) -> None:
        """Take made code for the rest of the motion, if it is time to decide and that pays."""
        steps = int(clock.count.accepted + clock.count.rejected)
        if steps < self.due:
            return
        self.due = DECISION_FACTOR * steps
        t, end = clock.real.t, clock.real.t_end
        if t > self._first:
            self._choose(self._spent() * float((end - t) / (t - self._first)))

    def hands_over(self, clock: ex.StepState) -> bool:
        """Whether made code got stuck, and the engine for all mechanisms goes on from the last step: through, or it
        leaves in the scratch what the reason is told from.
        """
        if self.c.made is None or clock.count.status not in FAILED_STATUS:
            return False
        self.told += f"; table-driven from t = {clock.real.t:.6g} s on, where it could not go on"
        self.c.run_on_tables()
        clock.count.status, clock.real.max_growth = ex.RUNNING, 1.0
        clock.real.h = max(clock.real.h, clock.real.wide)
        reset_rejections(clock)
        return True

    def limited(self, clock: ex.StepState, steps: float) -> int:
        """So many steps as a call of the compiled loop should take, or as are left until it is time to choose."""
        done = int(clock.count.accepted + clock.count.rejected)
        return int(min(max(steps, 1.0), max(self.due - done, 1.0), MOST_STEPS_PER_CALL))

    def stop(self) -> None:
        """The motion goes on by another method, which goes through the tables."""
        self.end()
        self.due = math.inf
        if self.c.made is not None:
            self.c.run_on_tables()

    def end(self) -> None:
        """The motion is over: what was computed is added up."""
        if self.due < math.inf:
            SPENT.add(self._kind, self._spent())

    def _spent(self) -> float:
        """What was computed since it began [ns]."""
        return (int(self.c.work.counts.evaluations) - self._counted) * self._each

    def _require_generated_code(self, without: str) -> None:
        try:
            if without:
                raise codegen.Refused(without)
            self._take(*codegen.code(codegen.plan(self.c.values), self.c.values))
        except codegen.Refused as error:
            raise ModelError(f"specialize=True: {error}; leave it out") from None

    def _choose(self, remaining_cost: float) -> None:
        """Take made code where it pays; ``remaining_cost``: what is still to be computed [ns]."""
        if not self._pays(remaining_cost, LOAD_COST):
            return
        x = self.c.values
        plan = codegen.plan(x)
        try:
            if why := codegen.refusal(plan):
                raise codegen.Refused(why)
            there = codegen.known(plan, x)
            if there or self._pays(remaining_cost + SPENT.of(self._kind) / HISTORY_WEIGHT, codegen.price(plan, there)):
                self._take(*codegen.code(plan, x))
        except codegen.Refused as error:
            self.told, self.due = f"{GENERAL_ENGINE}: {error}", math.inf

    def _pays(self, computing: float, price: float) -> bool:
        """Whether code is worth a price (both [ns])."""
        return computing * (1.0 - 1.0 / GAIN) >= PRICE_MARGIN * price

    def _take(self, code: codegen.GeneratedCode, how: str) -> None:
        self.c.run_on(code)
        self.told, self.due = f"{GENERATED_CODE}: {how}", math.inf


AUTO_SWITCHING, EXPLICIT_METHOD, STIFF_METHOD = "auto", "dop853", "radau"
NEVER_AGAIN = 2**60  # steps
EXPLICIT_STAGES = 12  # of a step of the explicit method
CHECK_INTERVAL = 100  # steps of it between two looks
CHECK_COST, CHECK_SHARE = (
    8e5,
    0.01,
)  # what a look takes [ns], and part of the time that looks may take where they find nothing
IMPLICIT_CHECK_INTERVAL = 60  # steps of the implicit method
CHECKS_IN_A_ROW = 2  # looks that say the same
IMPLICIT_LOAD_COST = (
    4e8  # that the explicit method has left at least [ns], as estimated: what it takes to load the implicit one
)
LEAST_EVALUATION_COST = 270.0  # that an evaluation takes [ns], with the loop about it
STABILITY_EDGE = 3.5  # h rho of wide steps that are hardly stable any more
LARGE_AMPLITUDE = 0.3  # part of the state; what swings so far is the motion itself, at whatever tolerance
ROUNDING_STRETCH = 0.3  # h rho of steps that rounding may limit, with what is fast
NEGLIGIBLE_AMPLITUDE = (
    20.0  # tolerances; what swings less, by h rho = EDGE, limits no steps (by less: by the cube of that, or more)
)
AMPLITUDE_SHARE = 1e-3  # part of the state; the same where tolerances are loose
DECAY_EXPONENT = 3.0  # -ln of what is left of a swing since the last look, where none can have lasted
REJECTED_SHARE = 0.05  # part of steps that are refused where rounding limits them
EXPLICIT_STRETCH = 1.2  # h rho of implicit steps that the explicit method could take too
PATIENCE_FACTOR = 8  # times as long it takes to go back to the implicit method once more
BECAUSE_STIFF, BECAUSE_NOT_STIFF, BECAUSE_JUMPED = (
    "where it is stiff",
    "where it is not stiff any more",
    "as velocities jumped",
)
MOST_REPORTED = 5  # changes of the method that are told one by one


class RecentSteps(NamedTuple):
    """Steps since the last look."""

    width: float  # of those accepted, on average [s]
    refused: float  # part of them
    time: float  # [s]


class StiffnessMonitor:
    """How a motion gets on, and by what it should go on.

    Parameters
    ----------
    t_end : float
        Where it ends [s].
    method : str
        That is asked for; ``"auto"``: whichever suits.
    why_not : callable
        Says why it cannot go on by the implicit method, in words; empty: it can.

    Attributes
    ----------
    told : list of str
        By what it went from when on, in words.
    asked : str
        What it should go on by, and does not yet.
    back : str
        What it goes on by again as soon as that knows what is.
    now : str
        What it has gone over to.
    """

    def __init__(self, t_end: float, method: str, why_not: Callable[[], str]) -> None:
        self.t_end, self.mixed, self.why_not = t_end, method == AUTO_SWITCHING, why_not
        self.told: list[str] = []
        self.asked = self.back = self.now = ""
        self._goes_on = False
        self.every, self.often, self.row, self.rate = CHECK_INTERVAL, CHECK_INTERVAL, 0, 0.0
        self.last: tuple[int, int, float] | None = None

    def limited(self, clock: ex.StepState, steps: int) -> int:
        """So many steps as a call of the compiled loop should take, or as are left until it is looked at again."""
        if self.last is None or self._since(clock) < 0:  # it has begun anew
            self._mark(clock)
        return max(1, min(steps, self.every - self._since(clock))) if self.mixed else steps

    def turns(self, c: CompiledMechanism, clock: ex.StepState, now: str) -> str:
        """The method to go on by, where that is another one; if it is time to look."""
        if not self.mixed or self.last is None or self._since(clock) < self.every:
            return ""
        lately = self._recent_steps(clock)
        self._mark(clock)
        if not lately.width > 0.0 or not self._other_method_pays(c, clock, lately, now):
            self.row = 0
            if now == EXPLICIT_METHOD:
                self.every = max(
                    self.every,
                    min(2 * self.every, int(CHECK_COST / (CHECK_SHARE * EXPLICIT_STAGES * evaluation_time(c)))),
                )
            return ""
        self.row, self.every = self.row + 1, self.often
        if self.row < CHECKS_IN_A_ROW:
            return ""
        if now == EXPLICIT_METHOD and (why := self.why_not()):
            self.told = [f"{EXPLICIT_METHOD}, though it is stiff from t = {clock.real.t:.6g} s on: {why}"]
            self.every = NEVER_AGAIN
            return ""
        return STIFF_METHOD if now == EXPLICIT_METHOD else EXPLICIT_METHOD

    def velocity_jumped(self, now: str) -> None:
        """Velocities have jumped: wide implicit steps would damp away what that excites, explicit ones follow it."""
        if self.mixed and now == STIFF_METHOD:
            self.asked = EXPLICIT_METHOD

    @property
    def carried(self) -> str:
        """What a motion that goes on from here begins by, where that is not what others begin by."""
        return self.back or self.now if self.mixed else ""

    def goes_on(self, by: str) -> None:
        """It goes on from a part of the motion at whose end that was `carried`."""
        self.asked = by if self.mixed else ""
        self._goes_on = bool(self.asked)

    def words(self) -> str:
        """By what it went from when on."""
        if len(self.told) <= MOST_REPORTED + 1:
            return "; ".join(self.told)
        return "; ".join(
            [*self.told[:MOST_REPORTED], f"... {len(self.told) - MOST_REPORTED - 1} more times ...", self.told[-1]]
        )

    def turned(self, clock: ex.StepState, to: str, why: str) -> None:
        """It goes on by that from now on."""
        self.now = to
        if not self._goes_on:
            if not self.told:
                self.told.append(EXPLICIT_METHOD if to == STIFF_METHOD else STIFF_METHOD)
            self.told.append(f"{to} from t = {clock.real.t:.6g} s on, {why}")
        self._goes_on = False
        again = sum(x.endswith(BECAUSE_NOT_STIFF) for x in self.told)
        self.every = self.often = (
            IMPLICIT_CHECK_INTERVAL if to == STIFF_METHOD else CHECK_INTERVAL * PATIENCE_FACTOR ** min(again, 6)
        )
        self.row, self.asked = 0, ""
        self._mark(clock)

    def stays(self) -> None:
        """It goes on by what it goes on by now, to the end."""
        self.every = NEVER_AGAIN

    def _other_method_pays(self, c: CompiledMechanism, clock: ex.StepState, lately: RecentSteps, now: str) -> bool:
        if now == EXPLICIT_METHOD:
            left = EXPLICIT_STAGES * (self.t_end - float(clock.real.t)) / (lately.width * (1.0 - lately.refused))
            if left * evaluation_time(c) < IMPLICIT_LOAD_COST:
                return False
            fast = largest_eigenvalue(c, clock, 1.0 / lately.width)
            self.rate = abs(fast)
            return limits_step(fast, clock, lately)
        return lately.width * abs(largest_eigenvalue(c, clock, self.rate or 1.0 / lately.width)) <= EXPLICIT_STRETCH

    def _recent_steps(self, clock: ex.StepState) -> RecentSteps:
        assert self.last is not None
        tried, done = self._since(clock), int(clock.count.accepted) - self.last[1]
        time = float(clock.real.t) - self.last[2]
        return RecentSteps(time / max(done, 1), (tried - done) / max(tried, 1), time)

    def _since(self, clock: ex.StepState) -> int:
        assert self.last is not None
        return int(clock.count.accepted + clock.count.rejected) - self.last[0]

    def _mark(self, clock: ex.StepState) -> None:
        done = int(clock.count.accepted)
        self.last = done + int(clock.count.rejected), done, float(clock.real.t)


def evaluation_time(c: CompiledMechanism) -> float:
    """What an evaluation takes, as estimated [ns]."""
    return max(LEAST_EVALUATION_COST, mechanism_kind(c.structure)[1])


def limits_step(fast: complex, clock: ex.StepState, lately: RecentSteps) -> bool:
    """Whether that eigenvalue, by which nothing moves that matters, limits explicit steps.

    Either these are as wide as is stable, or they are refused though nothing swings that fast: rounding does.
    """
    stretch, rtol = lately.width * abs(fast), float(clock.real.rtol)
    if stretch < ROUNDING_STRETCH:
        return False
    swing = rate_change(clock) / abs(fast)
    if stretch >= STABILITY_EDGE:
        return swing * rtol < LARGE_AMPLITUDE
    gone = -fast.real * lately.time > DECAY_EXPONENT
    return (
        gone
        and lately.refused >= REJECTED_SHARE
        and swing < min(NEGLIGIBLE_AMPLITUDE * (STABILITY_EDGE / stretch) ** 3, AMPLITUDE_SHARE / rtol)
    )


def slides_on_corner(c: CompiledMechanism) -> bool:
    """Whether a law is held on its corner: its side follows from accelerations, which implicit steps do not find."""
    if not len(c.system.switches.row):
        return False
    kinds, modes = c.system.switches.kind, c.work.modes.mode
    return bool(((kinds == BRANCH) & (modes != OFF)).any())


# The fastest that a motion could do about its present state, and what of it it does.


LAST_STAGE = 12  # stage of dop853 that is at the end of the step, as is the one before
ARNOLDI_PRODUCTS = 6  # with derivatives
RANDOM_SHARE = 0.03  # part of the first vector that is in no direction
DIFFERENCE_STEP = 1e-7  # differences, as part of the state


def largest_eigenvalue(c: CompiledMechanism, clock: ex.StepState, pace: float) -> complex:
    """Largest eigenvalue of the derivatives of (q, v, x)' by these at the state of a motion [1/s].

    x are states of controllers; modes are what they are. Where steps are as wide as is stable their last two stages
    differ by what is fast, so that a few products find it. Nothing of the motion's own scratch is touched.

    Parameters
    ----------
    c : Compiled
    clock : Clock
        Where the motion is, with the stages of its last step.
    pace : float
        About how fast it could be [1/s]: by it velocities are compared with positions.
    """
    s, y = c.structure, clock.y[ex.CURRENT]
    n, parts = s.nq + s.nv + len(s.controls) - len(s.sampled), [slice(0, s.nq), slice(s.nq, s.nq + s.nv)]
    if n > s.nq + s.nv:
        parts.append(slice(s.nq + s.nv, n))
    unit, size = np.ones(n), np.maximum(np.abs(y[:n]), 1.0)
    unit[parts[1]] = pace
    rates = _rate_function(c, float(clock.real.t), n)
    here = rates(y)

    def product(x: np.ndarray) -> np.ndarray:
        way, out = x * unit, np.zeros(n)
        for part in parts:  # each by itself: by rates of 1e6/s and more one would be lost beside another
            most = np.max(np.abs(way[part]) / size[part], initial=0.0)
            if most > 0.0:
                moved = y.copy()
                moved[part] += DIFFERENCE_STEP / most * way[part]
                out += (rates(moved) - here) * (most / DIFFERENCE_STEP)
        return out / unit

    return dominant_eigenvalue(product, _starting_vector(clock, unit), ARNOLDI_PRODUCTS) if n else 0j


def rate_change(clock: ex.StepState) -> float:
    """By how much rates have changed over the last step, in units of the tolerance [1/s].

    Over the fastest rate: what swings as fast is about so large, or less.
    """
    y = clock.y
    return float(
        scaled_norm(clock, clock.K[0] - y[ex.PREVIOUS_RATE], np.abs(y[ex.CURRENT]), int(clock.count.controlled))
    )


def _rate_function(c: CompiledMechanism, t: float, n: int) -> Callable[[np.ndarray], np.ndarray]:
    other = c.again()
    assign(other.work.modes, c.work.modes)
    assign(other.work.options, c.work.options)
    other.work.sensed[VALUE] = c.work.sensed[VALUE]

    def rates(x: np.ndarray) -> np.ndarray:
        status, dy = evaluate_state(other.values.system, other.work, t, x.copy(), MOTION)
        return dy[:n].copy() if status == 0 else np.full(n, np.nan)

    return rates


def _starting_vector(clock: ex.StepState, unit: np.ndarray) -> np.ndarray:
    n = len(unit)
    other = np.random.default_rng(0).uniform(-1.0, 1.0, n)
    other /= np.linalg.norm(other)
    if len(clock.K) <= LAST_STAGE:
        return other
    way = (clock.K[LAST_STAGE] - clock.K[LAST_STAGE - 1])[:n] / unit
    size = np.linalg.norm(way)
    return way / size + RANDOM_SHARE * other if 0.0 < size < np.inf else other
