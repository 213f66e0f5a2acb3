"""Inputs of laws besides sensors: states of controllers, forces named by events, sides of nonsmooth points.

States of controllers are the first of all states, each with the law of its rate. Forces that events name have columns
after the loads of joints: a joint has eight (`quantities.WRENCH`), other elements two (the effort, and its negative).
`loads.update_readings` fills them in from the rows of `LoadTerms`. A nonsmooth point of a law where the state decides
(`abs`, `max`, `where`, a table's knot) is a switch, whose guard is a law of its own; the law reads the side like a
measured quantity.

Columns are known only when all quantities are numbered. Until then, the bytecode holds negative numbers in their place,
from `CONTROLLER_STATE_CODE` and `FORCE_READING_CODE` downwards; `resolve_columns` writes the final columns.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from ..constraints.blocks import DISTANCE
from ..constraints.switches.law_corner import CORNER
from ..laws.bytecode import SENSOR
from ..laws.compilation import CornerLookup, calls_python, compile_decision, has_corners, may_be_steep, node_key
from ..laws.interval_evaluation import table_corners
from ..math.spline import pack_spline
from ..model.body import Driver
from ..model.controller import Controller
from ..model.controller_signals import controller_states, input_law, signal_law
from ..model.element import Element, LawOf, fields_with
from ..model.expression_parser import SyntaxNode
from ..model.expressions import Expression
from ..model.force import CoordinateForce, Force, Switch, TwoPointForce
from ..model.joint import Joint
from ..model.model import Model
from ..model.names import is_curve
from ..model.quantities import EFFORTS, WRENCH, TransmittedForce, transmitted_force
from .constraint_rows import SwitchSpec, event_names, measured_term, term_from_side_M
from .structure_definition import Structure, frame_index

CONTROLLER_STATE_CODE = -1_000_000_000
"""Code of the first controller state until columns are known; below the codes of sides."""


def add_controller_states(s: Structure) -> None:
    """Number every state of a controller, before all other states."""
    s.controls = controller_states(s.model)
    for x in s.controls:
        s.state(x.name)


def controller_names(model: Model) -> dict[str, Controller]:
    """Names in laws and signals of controllers, each with a controller that uses it."""
    out: dict[str, Controller] = {}
    for e in model.controllers:
        laws = [x.law for x in controller_states(model) if x.controller is e] + [
            signal_law(model, e, name) for name in e.signals()
        ]
        laws += [input_law(model, e, name) for name in e.ordered() or ()]
        out |= dict.fromkeys((name for law in laws for name in law.names), e)
    return out


def add_controller_slots(s: Structure) -> None:
    """Add the slots in which laws read the states of controllers."""
    s.slots |= {x.name: CONTROLLER_STATE_CODE - k for k, x in enumerate(s.controls)}


def add_controller_laws(s: Structure) -> None:
    """Compile the laws of the rates of controller states."""
    laws, s.sampled, s.ordered = [], [], []
    for k, x in enumerate(s.controls):
        if isinstance(x.controller, Force):
            laws.append(-1)
            continue
        at = s.law(x.law, (), None if x.controller.sampled else x.controller)
        laws.append(-1 if x.controller.sampled else at)
        if x.controller.sampled:
            s.sampled.append((x.controller.name, k, at, not x.signal))
    s.tables["control_laws"] = np.array(laws, np.int64)
    for e in s.model.controllers:
        if ordered := e.ordered():
            s.ordered += [(e, ordered, [s.law(input_law(s.model, e, name), ()) for name in ordered])]


def add_gravity_laws(s: Structure) -> None:
    """Compile the components of gravity that are laws of time, and number the state of the work of their changes."""
    laws = [-1 if law is None else s.law(law, ()) for law in s.model.gravity_laws()]
    work = s.state("gravity.work") if max(laws) >= 0 and not s.far else -1
    s.tables["gravity_laws"] = np.array([*laws, work], np.int64)


def initial_controller_states(s: Structure, numbers: Mapping[str, Any]) -> list[Any]:
    """Initial values of the controller states; ``numbers`` are those of elements, by name."""
    found = {e.name: {x.name: x.initial for x in e.states(numbers[e.name])} for e in s.model.controllers}
    return [found.get(x.controller.name, {}).get(x.state, 0.0) for x in s.controls]


FORCE_READING_CODE = -2_000_000_000
"""Code of the first force column until it is known; below the codes of controller states."""


def forces_in_events(model: Model) -> dict[str, TransmittedForce]:
    """Names in expressions of events that denote a force, each with its meaning."""
    found = {name: transmitted_force(model, name) for name in event_names(model) if is_curve(model, name)}
    return {name: x for name, x in sorted(found.items()) if x is not None}


def number_force_readings(s: Structure) -> None:
    """Number the columns of forces that events name."""
    for name, x in forces_in_events(s.model).items():
        first = s.sensed_columns.setdefault(x.element.name, force_reading_count(s))
        s.slots[name] = FORCE_READING_CODE - first - x.column


def force_reading_count(s: Structure) -> int:
    """Number of columns of forces that events name."""
    return sum(len(WRENCH if isinstance(s.model[name], Joint) else EFFORTS) for name in s.sensed_columns)


def force_reading_entries(s: Structure) -> list[tuple[int, int]]:
    """Rows of `LoadTerms` for forces that events name: (column, term or code of another source)."""
    first = 2 * len(s.measured) + len(s.loads)
    return [(first + at, what) for name, at in s.sensed_columns.items() for what in _reading_terms(s, s.model[name])]


def _reading_terms(s: Structure, e: Element) -> list[int]:
    rows, forces = len(s.rows), len(s.forces)
    if isinstance(e, Joint):
        return [term_from_side_M(s, k) for k in s.terms_of.get(e.name, ())]
    if isinstance(e, Driver):
        if e.name in s.prescribed:
            return [-2 - rows - forces - int(s.tables["tree"].v[s.prescribed[e.name]])]
        return [-2 - s.slices[e.name].start]
    own = [-2 - x.row for x in s.switches if x.element is e and x.row >= 0]
    return own + [-2 - rows - k for k, f in enumerate(s.forces) if f is e]


def element_laws(model: Model) -> Iterator[tuple[Element, Expression, tuple[str, ...]]]:
    """Laws of forces, controllers, couplings and drivers: (element, law, its inputs besides time)."""
    for x in controller_states(model):
        if not x.controller.sampled:
            yield x.controller, x.law, ()
    for e in model.forces:
        for name, of in fields_with(e.__class__, LawOf).items():
            value = getattr(e, name)
            for law in value if isinstance(value, tuple) else (value,):
                if law is not None and not isinstance(law, float):
                    yield e, model.law(law, of, f"{name} of {e.title}"), of.inputs
    for coupling in model.couplings:
        if (equation := coupling.equation(model)) is not None:
            yield coupling, equation, ()
    for driver in model.drivers:
        law = LawOf(model.unit(driver.coordinate, driver))
        yield driver, model.law(driver.law, law, f"law of {driver.title}", driver=True), ()


def nonsmooth_elements(model: Model) -> list[Element]:
    """Elements whose laws have nonsmooth points where the state decides."""
    return (
        model.cache.get("bent laws", None, 1, lambda: _nonsmooth_elements(model))
        if model.frozen
        else _nonsmooth_elements(model)
    )


def _nonsmooth_elements(model: Model) -> list[Element]:
    sensors = {x.name for x in model.sensors}
    out = []
    for e, law, inputs in element_laws(model):
        moving = {name for name in law.names if name in sensors or is_curve(model, name)}
        if has_corners(law, ("t", *inputs), moving) and _is_nonsmooth(model, law):
            out.append(e)
    return out


def steep_law_names(model: Model) -> list[str]:
    """Names, for messages, of laws whose slope may be infinite somewhere."""
    still = {"t", *model.parameters}
    return [law.where for _, law, _ in element_laws(model) if not calls_python(law) and may_be_steep(law.tree, still)]


def _is_nonsmooth(model: Model, law: Expression) -> bool:
    """Whether a law has a nonsmooth point that needs a guard; tables with a smooth interpolation do not."""
    smooth = {x.name for x in model.law_tables().values() if not len(table_corners(np.array(x.data()), 0))}
    if not law.tables or any(n.kind in _NONSMOOTH for n in law.tree.walk()):
        return True
    return bool(law.tables - smooth)


_NONSMOOTH = frozenset({"where", "abs", "sign", "min", "max", "step", "step5", "trapezoid"})


class NonsmoothPoints:
    """Nonsmooth points of the laws of one structure."""

    def __init__(self, s: Structure) -> None:
        self.s = s
        self.known: dict[Any, int] = {}

    def quantities(self) -> None:
        """Number the lengths and rates that nonsmooth laws of forces between frames depend on."""
        for e in nonsmooth_elements(self.s.model):
            if not isinstance(e, TwoPointForce) or self.key(e) in self.s.measured:
                continue
            m = self.s.measured[self.key(e)] = len(self.s.measured)
            measured_term(self.s, m, frame_index(self.s, e, "F"), frame_index(self.s, e, "M"), DISTANCE, 1.0, e)

    def key(self, e: Any) -> str:
        """Name of the quantity that a force's laws depend on."""
        return (e.coordinate_text() if isinstance(e, CoordinateForce) else "") or f"{e.name}:length"

    def of(self, e: Any, law: Expression, inputs: tuple[str, ...]) -> CornerLookup | None:
        """Function that finds the slot of each side in a law; None for an element without nonsmooth points."""
        if calls_python(law):
            return None
        s = self.s
        slots = {name: s.slots[name] for name in law.names if name in s.slots}
        if inputs:
            if self.key(e) not in s.measured:  # inputs that only the force's own formula computes
                return None
            m = s.measured[self.key(e)]
            slots |= {inputs[0]: m, inputs[1]: len(s.measured) + m}

        def corner(u: SyntaxNode) -> tuple[int, float]:
            data = self.knot_guard_table(u.value) if u.kind == "table" else []
            if data is None:
                return 0, 1.0
            key = _resolved(u, slots)
            if key not in self.known:
                tables = dict(s.table_at)
                if u.kind == "table":
                    tables[u.value] = len(s.const)
                    s.const += data
                at, depth = compile_decision(law, u, list(s.model.parameters), s.code, s.const, slots, tables)
                s.depth = max(s.depth, depth)
                s.laws[at] = law.where
                self.known[key] = len(s.switches)
                s.switches.append(SwitchSpec(e, Switch(CORNER, label=law.where), law=at))
            return -1 - self.known[key], 1.0

        return corner

    def knot_guard_table(self, name: str) -> list[float] | None:
        """Table that is zero at each knot of another table, and only there; None if that has no such knots."""
        table = self.s.model.law_tables()[name]
        data = np.array(table.data())
        x = table_corners(data, 0)
        if not len(x):
            return None
        repeat = table.beyond == "repeat"
        if repeat:
            # with an odd number of knots, the sign repeats after two periods
            x = np.r_[x, x + data[0]] if len(x) % 2 == 1 else x
            x = np.r_[x, x[0] + data[0] * np.ceil((x[-1] - x[0]) / data[0] + 1e-12)]
        middle = 0.5 * (x[:-1] + x[1:])
        height = 0.5 * np.diff(x) * (-1.0) ** np.arange(len(middle))
        at = np.sort(np.r_[x, middle])
        value = np.zeros(len(at))
        value[1::2] = height
        if len(at) == 1:
            at, value = np.r_[at, at + 1.0], np.r_[0.0, 1.0]
        straight = np.column_stack([value[:-1], np.diff(value) / np.diff(at), *np.zeros((2, len(at) - 1))])
        return pack_spline(at, value, straight, "repeat" if repeat else "line").tolist()


def _resolved(u: SyntaxNode, slots: dict[str, int]) -> tuple[Any, ...]:
    """Key of a node, with slots of measured quantities in place of names."""
    kind, value, *args = node_key(u)
    if kind == "name" and value in slots:
        return ("slot", slots[value])
    return (kind, value, *(_resolved(arg, slots) for arg in u.args))


def resolve_columns(s: Structure) -> None:
    """Write the final columns of sides and controller states into the code, once all quantities are numbered."""
    read = 2 * len(s.measured) + len(s.loads)
    first = read + force_reading_count(s)

    def column(place: int) -> int:
        if place >= 0:
            return place
        if place <= FORCE_READING_CODE:
            return read + FORCE_READING_CODE - place
        return (
            first + CONTROLLER_STATE_CODE - place
            if place <= CONTROLLER_STATE_CODE
            else first + len(s.controls) - 1 - place
        )

    for at in s.laws:
        for i in range(at + 2, at + 2 + 2 * s.code[at], 2):
            if s.code[i] == SENSOR:
                s.code[i + 1] = column(s.code[i + 1])
    s.slots = {name: column(place) for name, place in s.slots.items()}
