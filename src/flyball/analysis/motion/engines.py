"""Which engine steps a motion: the table-driven one, or code made for its mechanism alone (``special/``).

They compute the same operations in the same order: results are the same to the last bit. A motion may change to the
other at the end of any step.

Left to choose (``auto``), a motion has the code that this process has for its mechanism from its beginning on: to know
that takes some microseconds. Else it begins by the tables. After some steps, code that is on disk is taken, if the rest
is worth looking for it, and other code is made where the rest, or what was computed of such mechanisms in this process,
takes longer than that. How long is estimated from counts (`Account`, `kind`).
"""

from __future__ import annotations

import hashlib
import math
import threading
from collections import OrderedDict
from typing import Any

from ... import special
from ...errors import ModelError
from ...numerics.integrators import clock as ex
from ...numerics.integrators.refusal import afresh
from ...tables.cost import cost
from ...tables.specs import Structure
from ...tables.system import arrays
from ...tables.values import Values
from ..compiled import Compiled

AUTO = "auto"
KEPT = "kept"  # code that this process has, if it serves a mechanism: of the runs of a study
FIRST, AGAIN = 8, 4  # steps after which auto chooses, and how many times more until it does again
GAIN = 3.0  # times faster
MARGIN = 1.25  # times what it takes to make or load code, that it must save
MANY = 3.0  # of what earlier motions took, the part that counts: each may have been the last
THERE = 1.5e5  # what code costs that is on disk [ns], as part of what it is loaded for: the next motion has it at once.
# (To load it takes a process 3 ms, and 10 to know what it looks for, once for all its motions)
LONGEST = 100_000  # steps in one call of the compiled loop
FAILED = (ex.STUCK, ex.NOT_FINITE, ex.UNREPORTED)
TABLES, MADE = "table-driven", "made for this mechanism"
SHORT = f"{TABLES}: too little is computed to make code for it"
MODES = "rows that hold at times and let go at others, and events, are for the tables"


MOST = 256  # kinds of mechanisms that are known


class Account:
    """Times [ns] by kind of mechanism."""

    def __init__(self) -> None:
        self._spent: OrderedDict[str, float] = OrderedDict()
        self._lock = threading.Lock()

    def add(self, key: str, more: float) -> None:
        """So much more."""
        with self._lock:
            self._spent[key] = self._spent.pop(key, 0.0) + more
            while len(self._spent) > MOST:
                self._spent.popitem(last=False)

    def of(self, key: str) -> float:
        """All of it."""
        with self._lock:
            return self._spent.get(key, 0.0)


SPENT = Account()
"""By the table-driven engine."""


EACH, PART = 150.0, 0.6  # an evaluation on average [ns], and part of the cost of a right-hand side


def kind(s: Structure) -> tuple[str, float]:
    """The same for mechanisms that differ in numbers only; what an evaluation of the table-driven engine takes [ns]."""
    return s.kept.get("kind", None, 1, lambda: (_hashed(s), EACH + PART * cost(s)))


def _hashed(s: Structure) -> str:
    digest = hashlib.blake2b(digest_size=16)
    for table, of in sorted(s.tables.items()):
        for name, x in arrays(of, table):
            digest.update(f"{name}{x.shape}".encode() + x.tobytes())
    return digest.hexdigest()


def check_specialize(value: Any) -> None:
    """Refuse what is not a choice of the engine.

    Raises
    ------
    ModelError
        If it is none of True, False and ``"auto"``.
    """
    if not isinstance(value, (bool, str)) or value not in (True, False, AUTO, KEPT):
        raise ModelError(f"specialize is True, False or {AUTO!r}, not {value!r}")


def has_code(x: Values, evaluations: int, runs: int) -> bool:
    """Have code made for so many motions, of which one took so many evaluations by the tables, if it pays; whether
    there is such code now.
    """
    plan = special.plan(x)
    if x.structure.guards or special.refusal(plan):
        return False
    computing = runs * evaluations * kind(x.structure)[1]
    if computing * (1.0 - 1.0 / GAIN) < MARGIN * special.price(plan, special.known(plan, x)):
        return False
    try:
        special.code(plan, x)
    except special.Refused:
        return False
    return True


class Engine:
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

    def __init__(self, c: Compiled, wish: bool | str, without: str = "") -> None:
        self.c, self.told, self.due = c, f"{TABLES}: asked for", math.inf
        self._first = math.nan  # time at which the motion begins
        self._counted = 0
        if wish is False:
            return
        if wish is True:
            self._wanted(without or (MODES if c.structure.guards else ""))
        elif why := without or (MODES if c.structure.guards else ""):
            self.told = f"{TABLES}: {why}"
        else:
            self.told = SHORT
            if wish == AUTO:
                self.due = FIRST
                self._kind, self._each = kind(c.structure)
            made = special.in_memory(special.plan(c.values), c.values) if special.ready() else None
            if made is not None:
                self._take(made, "kept in this process")

    def begin(self, clock: ex.Clock) -> None:
        """The motion begins there."""
        self._first = float(clock.real.t)
        if self.due < math.inf:
            self._counted = int(self.c.work.counts.evaluations)

    def choose_again(self, clock: ex.Clock) -> None:
        """Take made code for the rest of the motion, if it is time to decide and that pays."""
        steps = int(clock.count.accepted + clock.count.rejected)
        if steps < self.due:
            return
        self.due = AGAIN * steps
        t, end = clock.real.t, clock.real.t_end
        if t > self._first:
            self._choose(self._spent() * float((end - t) / (t - self._first)))

    def hands_over(self, clock: ex.Clock) -> bool:
        """Whether made code got stuck, and the engine for all mechanisms goes on from the last step: through, or it
        leaves in the scratch what the reason is told from.
        """
        if self.c.made is None or clock.count.status not in FAILED:
            return False
        self.told += f"; table-driven from t = {clock.real.t:.6g} s on, where it could not go on"
        self.c.run_on_tables()
        clock.count.status, clock.real.grow = ex.RUNNING, 1.0
        clock.real.h = max(clock.real.h, clock.real.wide)
        afresh(clock)
        return True

    def limited(self, clock: ex.Clock, steps: float) -> int:
        """So many steps as a call of the compiled loop should take, or as are left until it is time to choose."""
        done = int(clock.count.accepted + clock.count.rejected)
        return int(min(max(steps, 1.0), max(self.due - done, 1.0), LONGEST))

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

    def _wanted(self, without: str) -> None:
        try:
            if without:
                raise special.Refused(without)
            self._take(*special.code(special.plan(self.c.values), self.c.values))
        except special.Refused as error:
            raise ModelError(f"specialize=True: {error}; leave it out") from None

    def _choose(self, left: float) -> None:
        """Take made code where it pays; ``left``: what is still to be computed [ns]."""
        if not self._pays(left, THERE):
            return
        x = self.c.values
        plan = special.plan(x)
        try:
            if why := special.refusal(plan):
                raise special.Refused(why)
            there = special.known(plan, x)
            if there or self._pays(left + SPENT.of(self._kind) / MANY, special.price(plan, there)):
                self._take(*special.code(plan, x))
        except special.Refused as error:
            self.told, self.due = f"{TABLES}: {error}", math.inf

    def _pays(self, computing: float, price: float) -> bool:
        """Whether code is worth a price (both [ns])."""
        return computing * (1.0 - 1.0 / GAIN) >= MARGIN * price

    def _take(self, made: special.Made, how: str) -> None:
        self.c.run_on(made)
        self.told, self.due = f"{MADE}: {how}", math.inf
