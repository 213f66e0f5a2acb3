"""Parameters that only forces, controllers and their laws see: structure, start and most tables are always the same."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from ...model.controller import Controller
from ...model.element import Element, resolve
from ...model.expressions import Expression, law_expression, number
from ...model.force import Force
from ...model.model import Model
from ...tables.numbers import words
from ...tables.values import Values
from ..compiled import Compiled
from .spread import Place, Spread, Together
from .track import Batch, Part

PLACES = ("at", "angle", "orientation", "axis")
"""Fields of forces that say where their frames are."""


def derived(model: Model, names: Sequence[str]) -> list[tuple[str, Expression]]:
    """Parameters that depend on some others, but not those themselves, in an order in which they can be found."""
    formulas = {}
    for name, text in model.parameters.items():
        if name not in names and isinstance(text, (str, Expression)) and set(words(text)) & model.parameters.keys():
            formulas[name] = law_expression(text, None, f"parameter '{name}'")
    out: dict[str, Expression] = {}
    reached = set(names)
    while more := {k: f for k, f in formulas.items() if k not in out and reached.intersection(f.names)}:
        reached |= more.keys()
        out |= more
    order: list[tuple[str, Expression]] = []
    while out:
        ready = {k: f for k, f in out.items() if not out.keys() & set(f.names)}
        order += ready.items()
        out = {k: f for k, f in out.items() if k not in ready}
    return order


def soft(model: Model, names: Sequence[str]) -> list[Element] | None:
    """The forces and controllers whose numbers change with these parameters; None if something else does."""
    reached = {*names, *(k for k, _ in derived(model, names))}
    if reached.intersection(words(model.gravity)):
        return None
    found = [e for e in model.elements() if reached.intersection(words(e))]
    return found if all(_only_acts(e, reached) for e in found) else None


def _only_acts(e: Element, reached: set[str]) -> bool:
    """Whether what changes of an element are numbers of its formula: neither frames nor rows have any of them."""
    if isinstance(e, Controller):
        laws = e.given()
        return not reached.intersection(words(tuple(x for name, x in vars(e).items() if name not in laws)))
    if not isinstance(e, Force) or hasattr(e, "total"):
        return False
    return not reached.intersection(words(tuple(getattr(e, name, None) for name in PLACES)))


@dataclass(frozen=True)
class Filling:
    """What fills the numbers of the forces that change into tables, as `tables.values` does."""

    tables: ClassVar[tuple[str, ...]] = ("force_x", "const")  # that it writes

    names: tuple[str, ...]
    derived: tuple[tuple[str, Expression], ...]
    slots: tuple[tuple[int, str], ...]  # of parameters in the table of constants
    rows: tuple[tuple[int, Any, float], ...]  # of forces: row of their table, force, drawn distance of its ends
    env: Mapping[str, float]
    spread: Spread | None = None  # of many runs at once

    @classmethod
    def of(cls, x: Values, names: Sequence[str], changed: Sequence[Element]) -> Filling:
        """From the values at any point."""
        s = x.structure
        later = derived(s.model, names)
        reached = {*names, *(k for k, _ in later)}
        slots = [(k, name) for k, name in enumerate(s.model.parameters) if name in reached]
        rows = [(k, e, x.poses.apart(e)) for k, e in enumerate(s.forces) if any(e is c for c in changed)]
        return cls(tuple(names), tuple(later), tuple(slots), tuple(rows), dict(x.env))

    def also(self, points: np.ndarray) -> None:
        """Points that are asked for next."""
        if self.spread is not None:
            self.spread.also(points)

    def desk(self, c: Compiled) -> Desk:
        """What fills in the numbers of runs for one thread."""
        return Desk(self, c)

    def fill(self, point: np.ndarray, own: Mapping[str, np.ndarray]) -> None:
        """Write them into ``own["force_x"]`` and ``own["const"]``.

        Raises
        ------
        ModelError
            If a number makes no sense.
        """
        env, force_x, const = dict(self.env), own["force_x"], own["const"]
        env.update(zip(self.names, point.tolist(), strict=True))
        for name, formula in self.derived:
            env[name] = number(formula, env, None, f"parameter '{name}'")
        for k, name in self.slots:
            const[k] = env[name]
        for k, e, apart in self.rows:
            par = e.parameters(resolve(e, env), apart)
            force_x[k], force_x[k, : len(par)] = 0.0, par


class Desk:
    """Tables of some runs. All start alike, and are of one length."""

    def __init__(self, of: Filling, c: Compiled) -> None:
        self.of, self._values = of, c.values

    def batches(self, points: np.ndarray) -> list[Batch]:
        """The runs at some points; those that are left out are for themselves."""
        groups, alone = self.of.spread.groups(points) if self.of.spread is not None else ([], range(len(points)))
        return [*map(self._together, groups), *(b for k in alone if (b := self._one(k, points[k])) is not None)]

    def _together(self, some: Together) -> Batch:
        (t,), lanes = some.group.tables, np.array(some.lanes)
        columns = {name: t.system[name] for name in self.of.tables}
        parts = [Part(name, x.at, x.x[lanes]) for name, x in columns.items()]
        base = {name: x.base for name, x in columns.items()}
        return self._batch(base, parts, some.runs, [(some.group, k) for k in some.lanes])

    def _one(self, k: int, point: np.ndarray) -> Batch | None:
        own = {name: getattr(self._values.system, name).copy() for name in self.of.tables}
        try:
            self.of.fill(point, own)
        except Exception:  # by itself it says why
            return None
        return self._batch(own, [], [k], [(None, 0)])

    def _batch(self, base: dict[str, np.ndarray], parts: list[Part], runs: list[int], places: list[Place]) -> Batch:
        return Batch(np.array(runs), base, parts, np.full(len(runs), self._values.length), places)
