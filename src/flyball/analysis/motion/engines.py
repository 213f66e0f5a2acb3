"""Which engine steps a motion: the table-driven one, or code made for its mechanism alone (``special/``).

Both do the same to the same state, which is all in `Clock` and `Work`, so that a motion goes over from one to the other
between two calls of the compiled loop. They round differently: results agree within the tolerance, not to the last bit.

Left to choose (``auto``), code that is there already is taken, and other code is made, where what is left of the motion,
or what was computed of its kind in this process, takes longer than that. How long is estimated from counts
(`tables/cost.py`), at counts of steps that are always the same: clocks have no say, so that the same call in the same
surroundings gives the same digits.
"""

from __future__ import annotations

import math
import threading
from collections import OrderedDict
from typing import Any

from ... import special
from ...errors import ModelError
from ...numerics.integrators import clock as ex
from ...tables.cost import cost
from ...tables.system import EVALUATIONS
from ..compiled import Compiled

AUTO = "auto"
FIRST, AGAIN = 50, 4  # steps after which auto chooses, and how many times more until it does again
GAIN = 3.0  # times faster
MARGIN = 1.5  # times what it takes to make or load code, that it must save
LONGEST = 100_000  # steps in one call of the compiled loop
MOST = 256  # kinds of mechanisms whose computing is added up
TABLES, MADE = "table-driven", "made for this mechanism"


def check_specialize(value: Any) -> None:
    """Refuse what is not a choice of the engine.

    Raises
    ------
    ModelError
        If it is none of True, False and ``"auto"``.
    """
    if not isinstance(value, bool) and value != AUTO:
        raise ModelError(f"specialize is True, False or {AUTO!r}, not {value!r}")


class Account:
    """What was computed of each kind of mechanism in this process by the table-driven engine [ns, estimated]."""

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


class Engine:
    """The engine of one motion.

    Parameters
    ----------
    c : Compiled
        In the coordinates of the motion, with the scratch that it is run on.
    wish : bool or "auto"
        What the user wants.
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
        self._plan: Any = None
        self._first, self._counted = 0.0, 0
        if wish is False:
            return
        if not without:
            self._plan = special.plan(c)
            without = self._plan.refused
        if without:
            if wish is True:
                raise ModelError(f"specialize=True: {without}; leave it out")
            self.told = f"{TABLES}: {without}"
        elif wish is True:
            self._take("")
        else:
            self.told, self.due = f"{TABLES}: too little is computed to make code for it", FIRST

    def begin(self, clock: ex.Clock) -> None:
        """The motion begins there."""
        self._first, self._counted = float(clock.real[ex.T]), int(self.c.work.info[EVALUATIONS])

    def after(self, clock: ex.Clock) -> None:
        """A part of the motion is done: choose again, if it is time."""
        steps = int(clock.count[ex.ACCEPTED] + clock.count[ex.REJECTED])
        if steps < self.due:
            return
        self.due = AGAIN * steps
        t, end = clock.real[ex.T], clock.real[ex.T_END]
        if not t > self._first:
            return
        left = self._estimate() * float((end - t) / (t - self._first))
        known = special.known(self._plan)
        price = special.price(self._plan, known)
        before = 0.0 if known else SPENT.of(self._plan.key)  # many short motions pay for it as one long one does
        if (left + before) * (1.0 - 1.0 / GAIN) > MARGIN * price:
            self.end()
            self._take(f", from step {steps + 1} on")

    def limited(self, clock: ex.Clock, steps: float) -> int:
        """So many steps as a call of the compiled loop should take, or as are left until it is time to choose."""
        done = int(clock.count[ex.ACCEPTED] + clock.count[ex.REJECTED])
        return int(min(max(steps, 1.0), max(self.due - done, 1.0), LONGEST))

    def end(self) -> None:
        """The motion is over: what was computed is added up."""
        if self.due < math.inf:
            SPENT.add(self._plan.key, self._estimate())
            self.due = math.inf

    def _estimate(self) -> float:
        """What was computed since it began [ns]."""
        return (int(self.c.work.info[EVALUATIONS]) - self._counted) * cost(self.c.structure)

    def _take(self, when: str) -> None:
        made, how = special.code(self._plan, self.c)
        self.c.run_on(made)
        self.told, self.due = f"{MADE}{when}: {how}", math.inf
