"""Which of many runs may have an energy balance that is off: of all at once, as single runs are judged."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ...results.doubts import OPEN, suspected
from ...results.ledger import whole
from ...results.result import Result
from ...tables.values import Values, values
from .spread import Group
from .stacked import AT_ONCE, of_rows, stacked

if TYPE_CHECKING:
    from .lean import Shared


@dataclass
class Ran:
    """Runs that are to be judged: points, rows of output (runs, times, ...), steps, and how open constraints got."""

    points: np.ndarray
    rows: np.ndarray
    steps: np.ndarray
    worst: np.ndarray

    def of(self, some: Sequence[int]) -> Ran:
        """Some of them."""
        return Ran(self.points[some], self.rows[some], self.steps[some], self.worst[some])


class Judge:
    """Judges the runs of a study. Of those that it suspects, the runs by themselves tell what is to be said."""

    def __init__(self, of: Shared) -> None:
        self.of = of
        self._sound: dict[int, tuple[Group, bool]] = {}  # groups whose energies can be read at once

    def suspected(self, ran: Ran) -> np.ndarray:
        """Which of them, (runs,)."""
        found = np.zeros(len(ran.points), bool)
        spread, groups = self.of.filling.spread, dict[int, list[int]]()
        places = [spread.of(point) if spread is not None else None for point in ran.points]
        for k, place in enumerate(places):
            groups.setdefault(id(place[0]) if place else 0, []).append(k)
        most = max(1, AT_ONCE // ran.rows.shape[1])
        for some in (g[k : k + most] for g in groups.values() for k in range(0, len(g), most)):
            first = places[some[0]]
            here = ran.of(some)
            told = None if first is None else self._at_once(first[0], [p[1] for k in some if (p := places[k])], here)
            if told is None:
                told = np.concatenate([self._one(here.of([k]))[0] for k in range(len(some))])
            found[some] = told
        return found

    def _at_once(self, group: Group, lanes: list[int], ran: Ran) -> np.ndarray | None:
        """Those of a group; none if they are to be judged one by one. The first of a group is compared."""
        known = self._sound.get(id(group))
        if known is not None and not known[1]:
            return None
        tables, at = group.tables[-1], np.array(lanes)
        try:
            x = replace(stacked(tables.values, at, ran.rows.shape[1]), length=tables.length[at])
            found, result = self._judged(x, ran)
        except Exception:  # something knows floats only
            self._sound[id(group)] = group, False
            return None
        if known is None:
            one, n = self._one(ran.of([0]))[1], ran.rows.shape[1]
            same = all(a[:n].tobytes() == b.tobytes() for a, b in zip(_energies(result), _energies(one), strict=True))
            self._sound[id(group)] = group, same
            return found if same else None
        return found

    def _one(self, ran: Ran) -> tuple[np.ndarray, Result]:
        q = self.of.question
        return self._judged(values(self.of.values.structure, q.at(ran.points[0]).parameters), ran)

    def _judged(self, x: Values, ran: Ran) -> tuple[np.ndarray, Result]:
        """Which of runs are suspected, and they as one result."""
        result = of_rows(self.of.question.model, x, ran.rows, self.of.begun.wound)
        result.health.options, result.health.steps = self.of.options.choices(), ran.steps  # type: ignore[assignment]
        return suspected(result, len(ran.points)) | (ran.worst > OPEN * x.length), result


def _energies(result: Result) -> tuple[np.ndarray, ...]:
    ledger = whole(result)
    return ledger.kinetic, *ledger.stored, *ledger.works
