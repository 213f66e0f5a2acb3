"""Switching during a motion: general engine or generated code; explicit or implicit (stiffness monitor).

Both codes compute the same operations in the same order, so results agree to the last bit. The choice follows from
estimated costs and counts of steps, never from measured time, so that the same call gives the same motion.

A motion is stiff where stability limits the steps of an explicit method: h rho is near the edge of the region of
stability, where rho is the largest |eigenvalue| of the right-hand side (Hairer and Wanner 1996, section IV.2). For
dop853 the edge is at 6 to 6.8 in all directions. With tight tolerances steps do not reach the edge, since rounding of
the fast modes is an error in each step. Three signs distinguish a stiff motion from one that is merely fast: steps are
rejected, an oscillation would have decayed since the last check, and no oscillation of relevant amplitude is present.
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
from ..constraints.switches.switch_kind import OFF
from ..engine.entry_point import MOTION, evaluate_state
from ..errors import ModelError
from ..numerics.eigen import dominant_eigenvalue
from ..numerics.integrators import time_loop as ex
from ..numerics.integrators.explicit_runge_kutta import reset_rejections, scaled_norm
from ..tables.coordinate_choice import right_hand_side_cost
from ..tables.structure_definition import Structure
from ..tables.table_definitions import assign, named_arrays
from ..tables.values import Values

AUTO_CODE = "auto"
IN_MEMORY_ONLY = "kept"  # use generated code only if this process already holds it: for the runs of a study
FIRST_DECISION, DECISION_FACTOR = 8, 4  # steps until auto decides first, and their factor until each next decision
GAIN = 3.0  # assumed speed-up by generated code
PRICE_MARGIN = 1.25  # generated code must save this many times the cost of generating or loading it
HISTORY_WEIGHT = 3.0  # divisor of the cost of earlier motions in the estimate of future use
LOAD_COST = 1.5e5  # cost of code on disk [ns] that one motion must save; later motions reuse the loaded code.
# (Loading takes 3 ms, and computing the key of the code 10 ms, once per process)
MOST_STEPS_PER_CALL = 100_000  # steps in one call of the compiled loop
FAILED_STATUS = (ex.STEP_FAILED, ex.NOT_FINITE, ex.OUTPUT_FAILED)
GENERAL_ENGINE, GENERATED_CODE = "general engine", "made for this mechanism"
TOO_SHORT = f"{GENERAL_ENGINE}: the motion is too short for code made for it"
NO_MODES = "code made for one mechanism does not support stops, stick friction or events"


MOST_KINDS = 256  # kinds of mechanisms in the account


class CostAccount:
    """Accumulated computing cost [ns] by kind of mechanism."""

    def __init__(self) -> None:
        self._spent: OrderedDict[str, float] = OrderedDict()
        self._lock = threading.Lock()

    def add(self, key: str, more: float) -> None:
        """Add a cost."""
        with self._lock:
            self._spent[key] = self._spent.pop(key, 0.0) + more
            while len(self._spent) > MOST_KINDS:
                self._spent.popitem(last=False)

    def of(self, key: str) -> float:
        """Return the accumulated cost."""
        with self._lock:
            return self._spent.get(key, 0.0)


SPENT = CostAccount()
"""Cost of the general engine."""


EVALUATION_COST, COST_SHARE = 150.0, 0.6  # of an evaluation: fixed cost [ns], factor of the right-hand side's
LAW_OPERATION_COST = 3.5  # of an operation of a law's bytecode [ns]


def mechanism_kind(s: Structure) -> tuple[str, float]:
    """Return a key shared by mechanisms that differ in numbers only, and the cost of an evaluation by the general
    engine [ns].
    """
    return s.cache.get("kind", None, 1, lambda: (_structure_hash(s), _evaluation_cost(s)))


def _evaluation_cost(s: Structure) -> float:
    """Return the cost of an evaluation by the general engine, its laws included [ns]."""
    laws = LAW_OPERATION_COST * sum(s.code[at] for at in s.laws)
    return EVALUATION_COST + COST_SHARE * right_hand_side_cost(s) + laws


def _structure_hash(s: Structure) -> str:
    digest = hashlib.blake2b(digest_size=16)
    for table, of in sorted(s.tables.items()):
        for name, x in named_arrays(of, table):
            digest.update(f"{name}{x.shape}".encode() + x.tobytes())
    return digest.hexdigest()


def check_specialize(value: Any) -> None:
    """Refuse an invalid value of ``specialize``.

    Raises
    ------
    ModelError
        If it is none of True, False and ``"auto"``.
    """
    if not isinstance(value, (bool, str)) or value not in (True, False, AUTO_CODE, IN_MEMORY_ONLY):
        raise ModelError(f"specialize is True, False or {AUTO_CODE!r}, not {value!r}")


def prepare_generated_code(x: Values, evaluations: int, runs: int) -> bool:
    """Generate code for ``runs`` motions of ``evaluations`` evaluations each, if it pays. Returns whether there is such
    code.
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
    """The choice between general engine and generated code in one motion.

    Parameters
    ----------
    c : CompiledMechanism
        In the coordinates of the motion, with the workspace that it is run on.
    wish : bool, "auto" or "kept"
        The value of ``specialize``, or ``"kept"`` (see `IN_MEMORY_ONLY`).
    without : str
        Why generated code would have no effect here; empty if it would have.

    Attributes
    ----------
    told : str
        Description of the choice and its reason.
    due : float
        Number of steps at which the choice is made again.

    Raises
    ------
    ModelError
        If generated code is required but cannot be generated.
    """

    def __init__(self, c: CompiledMechanism, wish: bool | str, without: str = "") -> None:
        self.c, self.description, self.due = c, f"{GENERAL_ENGINE}: as requested", math.inf
        self._first = math.nan  # start time of the motion
        self._counted = 0
        if wish is False:
            return
        if wish is True:
            self._require_generated_code(without or (NO_MODES if c.structure.guards else ""))
        elif why := without or (NO_MODES if c.structure.guards else ""):
            self.description = f"{GENERAL_ENGINE}: {why}"
        else:
            self.description = TOO_SHORT
            if wish == AUTO_CODE:
                self.due = FIRST_DECISION
                self._kind, self._each = mechanism_kind(c.structure)
            made = codegen.in_memory(codegen.plan(c.values), c.values) if codegen.ready() else None
            if made is not None:
                self._take(made, "kept in this process")

    def begin(self, clock: ex.StepState) -> None:
        """Note the start of the motion."""
        self._first = float(clock.real.t)
        if self.due < math.inf:
            self._counted = int(self.c.work.counts.evaluations)

    def choose_again(self, clock: ex.StepState) -> None:
        """Switch to generated code for the rest of the motion, if a decision is due and that pays."""
        steps = int(clock.count.accepted + clock.count.rejected)
        if steps < self.due:
            return
        self.due = DECISION_FACTOR * steps
        t, end = clock.real.t, clock.real.t_end
        if t > self._first:
            self._choose(self._spent() * float((end - t) / (t - self._first)))

    def falls_back(self, clock: ex.StepState) -> bool:
        """Return whether generated code failed and the general engine continues from the last step.

        The general engine either gets through, or leaves in the workspace the data for diagnosis.
        """
        if self.c.generated is None or clock.count.status not in FAILED_STATUS:
            return False
        self.description += f"; general engine from t = {clock.real.t:.6g} s, where it failed"
        self.c.run_on_tables()
        clock.count.status, clock.real.max_growth = ex.RUNNING, 1.0
        clock.real.h = max(clock.real.h, clock.real.wide)
        reset_rejections(clock)
        return True

    def limited(self, clock: ex.StepState, steps: float) -> int:
        """Return the number of steps of the next call of the compiled loop, at most those left until the next
        decision.
        """
        done = int(clock.count.accepted + clock.count.rejected)
        return int(min(max(steps, 1.0), max(self.due - done, 1.0), MOST_STEPS_PER_CALL))

    def stop(self) -> None:
        """End the use of generated code; the motion continues by a method that needs the general engine."""
        self.end()
        self.due = math.inf
        if self.c.generated is not None:
            self.c.run_on_tables()

    def end(self) -> None:
        """Add the cost of the motion to the account."""
        if self.due < math.inf:
            SPENT.add(self._kind, self._spent())

    def _spent(self) -> float:
        """Return the cost since the start of the motion [ns]."""
        return (int(self.c.work.counts.evaluations) - self._counted) * self._each

    def _require_generated_code(self, without: str) -> None:
        try:
            if without:
                raise codegen.Refused(without)
            self._take(*codegen.code(codegen.plan(self.c.values), self.c.values))
        except codegen.Refused as error:
            raise ModelError(f"specialize=True: {error}; leave it out") from None

    def _choose(self, remaining_cost: float) -> None:
        """Switch to generated code if it pays; ``remaining_cost`` is the cost still to come [ns]."""
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
            self.description, self.due = f"{GENERAL_ENGINE}: {error}", math.inf

    def _pays(self, computing: float, price: float) -> bool:
        """Return whether generated code is worth its price (both [ns])."""
        return computing * (1.0 - 1.0 / GAIN) >= PRICE_MARGIN * price

    def _take(self, code: codegen.GeneratedCode, how: str) -> None:
        self.c.run_on(code)
        self.description, self.due = f"{GENERATED_CODE}: {how}", math.inf


AUTO_SWITCHING, EXPLICIT_METHOD, STIFF_METHOD = "auto", "dop853", "radau"
NEVER_AGAIN = 2**60  # steps
EXPLICIT_STAGES = 12  # stages of the explicit method
CHECK_INTERVAL = 100  # explicit steps between two stiffness checks
CHECK_COST, CHECK_SHARE = (
    8e5,
    0.01,
)  # cost of a stiffness check [ns], and the part of the computing time that unsuccessful checks may take
IMPLICIT_CHECK_INTERVAL = 60  # implicit steps between two checks
CHECKS_IN_A_ROW = 2  # agreeing checks before the method changes
IMPLICIT_LOAD_COST = 4e8  # least remaining cost of the explicit method [ns] for which loading the implicit one pays
LEAST_EVALUATION_COST = 270.0  # least cost of an evaluation, loop included [ns]
STABILITY_EDGE = 3.5  # h rho from which on steps are near the limit of stability
LARGE_AMPLITUDE = 0.3  # amplitude relative to the state; larger oscillations belong to the motion at any tolerance
ROUNDING_STRETCH = 0.3  # h rho from which on rounding of fast modes may limit the steps
NEGLIGIBLE_AMPLITUDE = (
    20.0  # amplitude in tolerances below which an oscillation limits no steps at the edge; below it scaled by the cube
)
AMPLITUDE_SHARE = 1e-3  # the same limit relative to the state, for loose tolerances
DECAY_EXPONENT = 3.0  # -ln of the decay since the last check beyond which no oscillation can have lasted
REJECTED_SHARE = 0.05  # least part of rejected steps where rounding limits them
EXPLICIT_STRETCH = 1.2  # h rho of implicit steps up to which the explicit method could take them too
PATIENCE_FACTOR = 8  # factor of the check interval after each return to the explicit method
BECAUSE_STIFF, BECAUSE_NOT_STIFF, BECAUSE_JUMPED = (
    "where it is stiff",
    "where it is not stiff any more",
    "as velocities jumped",
)
MOST_REPORTED = 5  # changes of the method that are reported one by one


class RecentSteps(NamedTuple):
    """Statistics of the steps since the last check."""

    width: float  # mean width of accepted steps [s]
    refused: float  # part of steps that were rejected
    time: float  # time integrated [s]


class StiffnessMonitor:
    """Monitors the stiffness of a motion and decides by which method it continues.

    Parameters
    ----------
    t_end : float
        End time [s].
    method : str
        The requested method; ``"auto"``: the method may change.
    why_not : callable
        Returns why the motion cannot continue by the implicit method; empty if it can.

    Attributes
    ----------
    told : list of str
        Methods used so far, and from which time on.
    asked : str
        Method requested next; empty if there is none.
    back : str
        Implicit method to which the motion returns once no law is held on its corner.
    now : str
        Method to which the motion changed last.
    """

    def __init__(self, t_end: float, method: str, why_not: Callable[[], str]) -> None:
        self.t_end, self.mixed, self.why_not = t_end, method == AUTO_SWITCHING, why_not
        self.changes: list[str] = []
        self.asked = self.back = self.now = ""
        self._goes_on = False
        self.every, self.often, self.row, self.rate = CHECK_INTERVAL, CHECK_INTERVAL, 0, 0.0
        self.last: tuple[int, int, float] | None = None

    def limited(self, clock: ex.StepState, steps: int) -> int:
        """Return the number of steps of the next call of the compiled loop, at most those left until the next check."""
        if self.last is None or self._since(clock) < 0:  # the counts were reset
            self._mark(clock)
        return max(1, min(steps, self.every - self._since(clock))) if self.mixed else steps

    def turns(self, c: CompiledMechanism, clock: ex.StepState, now: str) -> str:
        """Return the method to continue by if a check is due and another method is better; else an empty string."""
        if not self.mixed or self.last is None or self._since(clock) < self.every:
            return ""
        lately = self._recent_steps(clock)
        self._mark(clock)
        if not lately.width > 0.0 or not self._other_method_pays(c, clock, lately, now):
            agreed, self.row = self.row, 0
            if now == EXPLICIT_METHOD and not agreed:  # few rejected steps by chance do not postpone the next check
                self.every = max(
                    self.every,
                    min(2 * self.every, int(CHECK_COST / (CHECK_SHARE * EXPLICIT_STAGES * evaluation_time(c)))),
                )
            return ""
        self.row, self.every = self.row + 1, self.often
        if self.row < CHECKS_IN_A_ROW:
            return ""
        if now == EXPLICIT_METHOD and (why := self.why_not()):
            self.changes = [f"{EXPLICIT_METHOD}, though it is stiff from t = {clock.real.t:.6g} s on: {why}"]
            self.every = NEVER_AGAIN
            return ""
        return STIFF_METHOD if now == EXPLICIT_METHOD else EXPLICIT_METHOD

    def velocity_jumped(self, now: str) -> None:
        """Request the explicit method after a jump of velocities: wide implicit steps would damp the excited
        oscillations.
        """
        if self.mixed and now == STIFF_METHOD:
            self.asked = EXPLICIT_METHOD

    @property
    def continuing_method(self) -> str:
        """Method with which a continued motion starts; empty for the default."""
        return self.back or self.now if self.mixed else ""

    def resume_with(self, by: str) -> None:
        """Continue a segment that ended with the method `carried`."""
        self.asked = by if self.mixed else ""
        self._goes_on = bool(self.asked)

    def words(self) -> str:
        """Describe which methods were used and from which time on."""
        if len(self.changes) <= MOST_REPORTED + 1:
            return "; ".join(self.changes)
        return "; ".join(
            [
                *self.changes[:MOST_REPORTED],
                f"... {len(self.changes) - MOST_REPORTED - 1} more times ...",
                self.changes[-1],
            ]
        )

    def turned(self, clock: ex.StepState, to: str, why: str) -> None:
        """Record the change to another method."""
        self.now = to
        if not self._goes_on:
            if not self.changes:
                self.changes.append(EXPLICIT_METHOD if to == STIFF_METHOD else STIFF_METHOD)
            self.changes.append(f"{to} from t = {clock.real.t:.6g} s on, {why}")
        self._goes_on = False
        again = sum(x.endswith(BECAUSE_NOT_STIFF) for x in self.changes)
        self.every = self.often = (
            IMPLICIT_CHECK_INTERVAL if to == STIFF_METHOD else CHECK_INTERVAL * PATIENCE_FACTOR ** min(again, 6)
        )
        self.row, self.asked = 0, ""
        self._mark(clock)

    def stays(self) -> None:
        """Keep the present method to the end of the motion."""
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
    """Return the estimated cost of an evaluation [ns]."""
    return max(LEAST_EVALUATION_COST, mechanism_kind(c.structure)[1])


def limits_step(fast: complex, clock: ex.StepState, lately: RecentSteps) -> bool:
    """Return whether this eigenvalue limits explicit steps though its mode does not contribute to the motion.

    Either the steps are as wide as stability allows, or they are rejected because of rounding though no oscillation of
    that frequency is present.
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
    """Return whether a law is held on its corner.

    Its side then follows from accelerations, which implicit steps do not determine.
    """
    if not len(c.system.switches.row):
        return False
    return bool(((c.system.switches.law >= 0) & (c.work.modes.mode != OFF)).any())


# The fastest mode about the present state, and its amplitude.


LAST_STAGE = 12  # stage of dop853 at the end of the step; the stage before is there too
ARNOLDI_PRODUCTS = 6  # Jacobian-vector products of the Arnoldi iteration
RANDOM_SHARE = 0.03  # random part of the starting vector
DIFFERENCE_STEP = 1e-7  # relative step of the finite differences


def largest_eigenvalue(c: CompiledMechanism, clock: ex.StepState, pace: float) -> complex:
    """Return the largest eigenvalue [1/s] of the Jacobian of (q, v, x)' at the present state of a motion.

    x are states of controllers; modes are held fixed. Where steps are as wide as stability allows, their last two
    stages differ by the fast modes, so that a few products find the eigenvalue. The workspace of the motion is not
    changed.

    Parameters
    ----------
    c : CompiledMechanism
    clock : StepState
        The present state of the motion, with the stages of its last step.
    pace : float
        Estimated rate [1/s], by which velocities are scaled to positions.
    """
    s, y = c.structure, clock.y.current
    n, parts = s.nq + s.nv + len(s.controls) - len(s.sampled), [slice(0, s.nq), slice(s.nq, s.nq + s.nv)]
    if n > s.nq + s.nv:
        parts.append(slice(s.nq + s.nv, n))
    unit = clock.y.unit[:n].copy()
    size = np.maximum(np.abs(y[:n]), unit)
    unit[parts[1]] *= pace / c.work.options.rate
    rates = _rate_function(c, float(clock.real.t), n)
    here = rates(y)

    def product(x: np.ndarray) -> np.ndarray:
        way, out = x * unit, np.zeros(n)
        for part in parts:  # separately: with rates of 1e6/s one would be lost in the rounding of another
            most = np.max(np.abs(way[part]) / size[part], initial=0.0)
            if most > 0.0:
                moved = y.copy()
                moved[part] += DIFFERENCE_STEP / most * way[part]
                out += (rates(moved) - here) * (most / DIFFERENCE_STEP)
        return out / unit

    return dominant_eigenvalue(product, _starting_vector(clock, unit), ARNOLDI_PRODUCTS) if n else 0j


def rate_change(clock: ex.StepState) -> float:
    """Return by how much the rates have changed over the last step, in units of the tolerance [1/s].

    Divided by the fastest rate this bounds the amplitude of an oscillation of that frequency.
    """
    y = clock.y
    return float(scaled_norm(clock, clock.K[0] - y.previous_rate, np.abs(y.current), int(clock.count.controlled)))


def _rate_function(c: CompiledMechanism, t: float, n: int) -> Callable[[np.ndarray], np.ndarray]:
    other = c.again()
    assign(other.work.modes, c.work.modes)
    assign(other.work.options, c.work.options)
    other.work.sensed.value = c.work.sensed.value

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
