"""Which rows of the tables are filled in again, where other values of the parameters have filled them in before."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from ..model.body import Frame
from ..model.coupling import Coupling
from ..model.element import Element
from ..model.force import Force
from ..model.joint import Joint
from ..model.model import Model
from .numbers import Numbers
from .specs import Structure
from .system import changed

if TYPE_CHECKING:
    from .values import Values


T = TypeVar("T")


@dataclass(frozen=True)
class Afresh:
    """Rows of elements with other numbers than those in ``base``, or that stand on such an element; else all rows.

    The others are taken over: they would be the same to the bit.
    """

    base: Values | None = None
    names: Collection[str] = frozenset()
    only_acts: bool = False  # whether these are forces and controllers alone

    @classmethod
    def since(cls, base: Values | None, given: Numbers, model: Model) -> Afresh:
        """What is different from tables of the same structure."""
        if base is None or base.given.since is not given.since:
            return cls()
        stand_on = model.kept.get("stand on", None, 1, lambda: _stand_on(model))
        other = given.changed | base.given.changed
        acting = model.kept.get("acting", None, 1, lambda: {e.name for e in (*model.forces, *model.controllers)})
        return cls(base, other.union(*(stand_on.get(name, ()) for name in other)), other <= acting)

    def table(self, name: str, new: T, dtype: Any) -> T:
        """A table of `System` to be filled in: with what is known, or the ``new`` one."""
        if self.base is None:
            return new
        return changed(lambda _, x: x.astype(dtype), getattr(self.base.system, name))  # type: ignore[no-any-return]

    def state(self, name: str, n: int, dtype: Any) -> np.ndarray:
        """The same of the drawn coordinates, "q", or velocities, "v"."""
        return np.zeros(n, dtype) if self.base is None else getattr(self.base, name).astype(dtype)

    def rows(self, s: Structure, table: str) -> Iterable[int]:
        """Numbers of the rows of a table ("frames", "terms" or "forces") that are filled in again."""
        if self.base is None:
            return range(len(getattr(s, table)))
        of = s.kept.get("rows of elements", table, 3, lambda: _rows(getattr(s, table)))
        return sorted({k for name in self.names for k in of.get(name, ())})

    def asks(self, *elements: Any) -> bool:
        """Whether rows of one of these elements (None: of the world) are filled in again."""
        return self.base is None or any(e is not None and e.name in self.names for e in elements)


def _rows(specs: Sequence[Any]) -> Mapping[str, list[int]]:
    """Element -> the rows that depend on it."""
    out: dict[str, list[int]] = {}
    for k, x in enumerate(specs):
        elements = (x,) if isinstance(x, Element) else (x.element, getattr(x, "owner", None))
        for name in {e.name for e in elements if e is not None}:
            out.setdefault(name, []).append(k)
    return out


def _stand_on(model: Model) -> Mapping[str, set[str]]:
    """Element -> elements whose drawn frames its numbers move."""
    out: dict[str, set[str]] = {}
    for e in model.elements():
        for name in _ground_of(model, e):
            out.setdefault(name, set()).add(e.name)
    return out


def _ground_of(model: Model, e: Any) -> set[str]:
    """Names of all that an element's frames stand on."""
    if isinstance(e, Coupling):
        owners = [model.coordinate(text, e)[0] for text in e.coupled()]
        return {owner.name for owner in owners}.union(*(_ground_of(model, owner) for owner in owners))
    ends: Collection[str] = ()
    if isinstance(e, (Joint, Force)):
        ends = e.ends().values()
    elif isinstance(e, Frame):
        ends = (e.body,)
    return {*ends, *(model.carrier(name, e) for name in ends)}
