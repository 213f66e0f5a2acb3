"""Corners of laws where the state decides: one switch each, which says on which side of the corner the law is.

What decides is a law of its own, of time and measured quantities, whose zeros are watched. Laws read the side as if a
sensor measured it, in the columns of the switches' ways, which are known only when all is numbered: until then the
places stand in the code as negative numbers.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from ..constraints.blocks import DISTANCE
from ..constraints.modes import BRANCH
from ..laws.intervals.steps import bent
from ..laws.opcodes import SENSOR
from ..laws.program import bends, calls, compile_side
from ..laws.sides import Corners, may_be_steep, meaning
from ..math.spline import packed
from ..model.element import Element, LawOf, fields_with
from ..model.expressions import Expression
from ..model.force import CoordinateForce, TwoPointForce
from ..model.grammar import Node
from ..model.model import Model
from ..model.switch import Switch
from ..model.wiring import wired
from .controllers import CONTROLS
from .reads import READS, width
from .specs import Structure, frame
from .switches import SwitchSpec
from .terms import measured_term


def laws(model: Model) -> Iterator[tuple[Element, Expression, tuple[str, ...]]]:
    """The laws of forces, controllers and drivers: whose, and of which inputs besides time."""
    for x in wired(model):
        if not x.controller.sampled:
            yield x.controller, x.law, ()
    for e in model.forces:
        for name, of in fields_with(e.__class__, LawOf).items():
            value = getattr(e, name)
            for law in value if isinstance(value, tuple) else (value,):
                if law is not None and not isinstance(law, float):
                    yield e, model.law(law, of, f"{name} of {e.title}"), of.inputs
    for driver in model.drivers:
        law = LawOf(model.unit(driver.coordinate, driver))
        yield driver, model.law(driver.law, law, f"law of {driver.title}", driver=True), ()


def bent_laws(model: Model) -> list[Element]:
    """Elements whose laws have corners where the state decides."""
    return model.kept.get("bent laws", None, 1, lambda: _bent_laws(model)) if model.frozen else _bent_laws(model)


def _bent_laws(model: Model) -> list[Element]:
    sensors = {x.name for x in model.sensors}
    out = []
    for e, law, inputs in laws(model):
        moving = {name for name in law.names if name in sensors or "." in name}
        if bends(law, ("t", *inputs), moving) and _counts(model, law):
            out.append(e)
    return out


def steep_laws(model: Model) -> list[str]:
    """The laws whose slope may be infinite somewhere, as messages name them."""
    still = {"t", *model.parameters}
    return [law.where for _, law, _ in laws(model) if not calls(law) and may_be_steep(law.tree, still)]


def _counts(model: Model, law: Expression) -> bool:
    """Tables without corners are no reason to watch a law."""
    smooth = {x.name for x in model.tables if not len(bent(np.array(x.data()), 0))}
    if not law.tables or any(n.kind in _DECIDES for n in law.tree.walk()):
        return True
    return bool(law.tables - smooth)


_DECIDES = frozenset({"where", "abs", "sign", "min", "max", "step", "step5"})


class Branches:
    """The corners of one structure."""

    def __init__(self, s: Structure) -> None:
        self.s = s
        self.known: dict[Any, int] = {}

    def quantities(self) -> None:
        """Number the lengths and rates that bent laws of forces between frames depend on."""
        for e in bent_laws(self.s.model):
            if not isinstance(e, TwoPointForce) or self.key(e) in self.s.measured:
                continue
            m = self.s.measured[self.key(e)] = len(self.s.measured)
            measured_term(self.s, m, frame(self.s, e, "F"), frame(self.s, e, "M"), DISTANCE, 1.0, e)

    def key(self, e: Any) -> str:
        """Name of the quantity that a force's laws depend on."""
        return (e.coordinate_text() if isinstance(e, CoordinateForce) else "") or f"{e.name}:length"

    def of(self, e: Any, law: Expression, inputs: tuple[str, ...]) -> Corners | None:
        """Where the sides of a law's corners are found; None for what has none."""
        if calls(law):
            return None
        s = self.s
        slots = {name: s.slots[name] for name in law.names if name in s.slots}
        if inputs and self.key(e) in s.measured:
            m = s.measured[self.key(e)]
            slots |= {inputs[0]: m, inputs[1]: len(s.measured) + m}

        def corner(u: Node) -> tuple[int, float]:
            data = self.zigzag(u.value) if u.kind == "table" else []
            if data is None:
                return 0, 1.0
            key = _named(u, slots)
            if key not in self.known:
                tables = dict(s.table_at)
                if u.kind == "table":
                    tables[u.value] = len(s.const)
                    s.const += data
                at, depth = compile_side(law, u, list(s.model.parameters), s.code, s.const, slots, tables)
                s.depth = max(s.depth, depth)
                s.laws[at] = law.where
                self.known[key] = len(s.switches)
                s.switches.append(SwitchSpec(e, Switch(BRANCH, label=law.where), law=at))
            return -1 - self.known[key], 1.0

        return corner

    def zigzag(self, name: str) -> list[float] | None:
        """A curve that passes zero at each corner of a table, and only there; None where there are none."""
        table = next(x for x in self.s.model.tables if x.name == name)
        data = np.array(table.data())
        x = bent(data, 0)
        if not len(x):
            return None
        repeat = table.beyond == "repeat"
        if repeat:
            x = np.r_[x, x + data[0]] if len(x) % 2 == 1 else x  # of an odd number the sign is back after two periods
            x = np.r_[x, x[0] + data[0] * np.ceil((x[-1] - x[0]) / data[0] + 1e-12)]
        middle = 0.5 * (x[:-1] + x[1:])
        height = 0.5 * np.diff(x) * (-1.0) ** np.arange(len(middle))
        at = np.sort(np.r_[x, middle])
        value = np.zeros(len(at))
        value[1::2] = height
        if len(at) == 1:
            at, value = np.r_[at, at + 1.0], np.r_[0.0, 1.0]
        straight = np.column_stack([value[:-1], np.diff(value) / np.diff(at), *np.zeros((2, len(at) - 1))])
        return packed(at, value, straight, "repeat" if repeat else "line").tolist()


def _named(u: Node, slots: dict[str, int]) -> tuple[Any, ...]:
    """What a node means, with the places of what is measured for names."""
    kind, value, *args = meaning(u)
    if kind == "name" and value in slots:
        return ("slot", slots[value])
    return (kind, value, *(_named(arg, slots) for arg in u.args))


def settle(s: Structure) -> None:
    """Write the columns of ways, and of controllers' states, into the code, when all that is measured is numbered."""
    read = 2 * len(s.measured) + len(s.loads)
    first = read + width(s)

    def column(place: int) -> int:
        if place >= 0:
            return place
        if place <= READS:
            return read + READS - place
        return first + CONTROLS - place if place <= CONTROLS else first + len(s.controls) - 1 - place

    for at in s.laws:
        for i in range(at + 2, at + 2 + 2 * s.code[at], 2):
            if s.code[i] == SENSOR:
                s.code[i + 1] = column(s.code[i + 1])
    s.slots = {name: column(place) for name, place in s.slots.items()}
