"""The force table: frames or measured quantities, laws, work states, loads of joints."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..compiler.kernels import CodeTable, code_table
from ..constraints.blocks import DISTANCE, turning
from ..errors import ModelError
from ..forces import BRANCHES, EFFORTS, INPUTS, SIGNATURES, WRENCHES
from ..forces.tyres.road_height import pack_curved, pack_straight
from ..model.contact_point import Touch
from ..model.controller import Controller, Sensor
from ..model.element import LawOf, fields_with, resolve
from ..model.event import Event
from ..model.force import CoordinateForce, Force
from ..model.names import curve_parts, is_curve
from ..model.quantities import Curve, measured_quantity, transmitted_force
from ..model.roads.road import Road
from .constraint_rows import coordinate_frames, coordinate_term, measured_term
from .forest import coordinate_row
from .structure_definition import Structure, frame_index
from .table_definitions import FORCE_BY_ADDRESS, SLIDING, Forces


def measure_quantities(s: Structure, names_in_use: Mapping[str, Event | Controller]) -> None:
    """Number every quantity that a force acts along or that a law names, and the slots in which laws read them.

    ``names_in_use``: names in expressions of events and controllers (including curves such as A.angle), and their
    elements.
    """
    for e in (*s.model.forces, *s.model.limits):
        # equations without switching elements lack the limit that measures a rope over pulleys
        if isinstance(e, CoordinateForce) and s.model.find(e.measured_with() or e.name) is not None:
            _acting_quantity(s, e)
    sensors = [x for x in s.model.sensors if isinstance(x, Sensor)]
    own = {x.name for x in s.controls}
    curves = sorted(
        name
        for name in names_in_use
        if is_curve(s.model, name) and name not in own and not transmitted_force(s.model, name)
    )
    if not sensors and not curves:
        return
    named = _names_in_laws(s) | set(names_in_use)
    found = {}
    for sensor in sensors:
        if sensor.name in named and (what := s.model.measured(sensor)) is not None:
            found[sensor.name] = _sensed_quantity(s, sensor, *what[:2]), what[2]
    for name in curves:
        if (what := measured_quantity(s.model, Curve(names_in_use[name].title, name))) is not None:
            found[name] = _sensed_quantity(s, names_in_use[name], *what[:2]), what[2]
    values = len(s.measured)
    s.slots = {name: m + (values if order else 0) for name, (m, order) in found.items()}


def _names_in_laws(s: Structure) -> set[str]:
    """Names that some law uses."""
    out: set[str] = set()
    for e in [*s.model.acting(), *s.model.drivers]:
        for field, of in _law_fields(e).items():
            value = getattr(e, field)
            for law in value if isinstance(value, tuple) else (value,):
                if law is not None and not isinstance(law, float):
                    out |= s.model.law(law, of, f"{field} of {e.title}").names
    return out


def _law_fields(e) -> dict[str, LawOf]:
    return {"law": LawOf(None)} if e.category == "drivers" else fields_with(e.__class__, LawOf)


def _acting_quantity(s: Structure, e: CoordinateForce) -> int:
    """Measured quantity that a force acts along."""
    if other := e.measured_with():
        for role in e.ends():  # for results
            frame_index(s, e, role)
        if isinstance(limit := s.model[other], CoordinateForce):  # at rest a constraint may replace it
            return _acting_quantity(s, limit)
        if isinstance(limit, Controller):  # it has no sum of its own
            return -1
    text = e.coordinate_text() or f"{e.name}:length"
    if text in s.measured:
        return s.measured[text]
    m = s.measured[text] = len(s.measured)
    for k, one in enumerate(e.along()):
        term = coordinate_term(s, one, e, m, measured=True)
        term.index, term.switch = k, None if e.coordinate_text() else ""
    for a, b, formula in e.path():
        measured_term(s, m, frame_index(s, e, a), frame_index(s, e, b), formula, 1.0, e)
    return m


def _sensed_quantity(s: Structure, e: Sensor | Event | Controller, kind: str, text: str) -> int:
    """Measured quantity of a sensor, or of a name in an event."""
    force = s.model[text] if kind == "force" else None
    if isinstance(force, CoordinateForce):
        return _acting_quantity(s, force)
    key = f"{text}:length" if force is not None else f"{text}:{kind}" if kind == "spin" else text
    if key in s.measured:
        return s.measured[key]
    m = s.measured[key] = len(s.measured)
    if force is not None:
        measured_term(s, m, frame_index(s, force, "F"), frame_index(s, force, "M"), DISTANCE, 1.0, force)
    elif kind == "spin":
        # about an axis of the world: the angle of ground seen from the body, reversed
        owner, axis = curve_parts(text)
        measured_term(s, m, frame_index(s, s.model[owner], "M"), 0, turning(axis), -1.0, e)
    else:
        coordinate_term(s, text, e, m, measured=True)
    return m


def fill_force_table(s: Structure) -> None:
    """Fill in the force table, sorted by kind."""
    acting = [(f, user_formulas(type(f))) for f in s.model.acting() if _acts(s, f)]
    acting.sort(key=lambda x: FORCE_BY_ADDRESS if x[1] is not None else x[0].kind)
    s.forces, s.force_code = [f for f, _ in acting], [x for _, x in acting]
    none = np.full(len(s.forces), -1, np.int64)
    table = Forces(none, none.copy(), np.full((len(s.forces), 3), -1, np.int64), *(none.copy() for _ in range(6)))
    for k, e in enumerate(s.forces):
        table.kind[k] = e.kind if s.force_code[k] is None else FORCE_BY_ADDRESS
        table.family[k] = isinstance(e, CoordinateForce)
        if isinstance(e, CoordinateForce):
            table.F[k] = _acting_quantity(s, e)
            if hasattr(e, "load"):
                table.M[k] = _axis_frame(s, e)
                table.load[k] = 2 * len(s.measured) + len(s.loads)
                s.loads.append(e)
        elif isinstance(e, Touch):
            slips = [s.measured[f"{e.name}:slip_{i + 1}"] for i in range(len(e.slips))]
            table.F[k], table.M[k] = [*slips, -1][:2]
            table.load[k] = 2 * len(s.measured) + len(s.loads)
            table.family[k] = SLIDING
            s.loads.append(e)
        else:
            table.F[k], table.M[k] = frame_index(s, e, "F") if "F" in e.ends() else 0, frame_index(s, e, "M")
        _compile_laws(s, e, table.laws[k])
        if states := e.states():
            table.state[k] = s.state(f"{e.name}.{states[0]}")
        if not e.conservative():
            table.work[k] = s.state(f"{e.name}.work")
    s.tables["forces"] = table


def fill_surfaces(s: Structure) -> None:
    """Fill in the surfaces of the roads on which forces act."""
    parts, roads = list[np.ndarray](), dict.fromkeys(e.ends()["F"] for e in s.forces if e.states())
    for road in (r for name in roads if isinstance(r := s.model.find(name), Road)):
        grid = road.grid(resolve(road, s.model.environment()))
        if grid is not None:
            s.surface_at[road.name] = sum(map(len, parts))
            hold = road.beyond == "hold"
            if grid.line is None:
                parts.append(pack_straight(grid.heights, grid.along, grid.across, hold))
            else:
                parts.append(pack_curved(grid.heights, grid.along, grid.across, grid.line, hold))
    s.surfaces = np.concatenate(parts) if parts else np.zeros(1)


def place_rotors(s: Structure) -> None:
    """Find the velocities to which elements add inertia."""
    for e in s.forces:
        if isinstance(e, CoordinateForce) and e.adds_inertia:
            joint, what = s.model.coordinate(e.coordinate_text(), e)
            row = coordinate_row(s, joint.name, what)
            if row is None:
                s.rotors_without_velocity.append(e)
            else:
                s.rotors.append((e, int(s.tables["tree"].v[row])))


def user_formulas(cls: type[Force]) -> CodeTable | None:
    """Code table of a user-defined class; None where it inherits the formulas of a built-in element.

    Raises
    ------
    ModelError
        If the class lacks a formula.
    """
    known = zip(SIGNATURES, (INPUTS, WRENCHES, EFFORTS, BRANCHES), strict=True)
    kind = getattr(cls, "kind", -1)
    own = kind < 0 or any(getattr(cls, signature.name, None) is not of.get(kind) for signature, of in known)
    if cls.__module__.startswith("flyball.") or not own:
        return None
    _refuse_names(cls)
    return code_table(cls, SIGNATURES, SIGNATURES[2:3] if issubclass(cls, CoordinateForce) else SIGNATURES[:2])


def _refuse_names(cls: type[Force]) -> None:
    """Refuse fields whose names are reserved for declarations of forces."""
    for c in cls.__mro__:
        if c.__module__.partition(".")[0] == "flyball":
            continue
        taken = {
            name for name in vars(c).get("__annotations__", ()) if name in getattr(cls, "__dataclass_fields__", ())
        }
        taken &= {*dir(CoordinateForce), "load"} - set(CoordinateForce.__dataclass_fields__)
        if taken or "load" in vars(c):
            raise ModelError(
                f"{c.__name__}: {', '.join(sorted(taken or {'load'}))} is reserved for every force; give the field "
                "another name"
            )


def _acts(s: Structure, e: Force) -> bool:
    """Whether a force exists: that of a contact point only if it has modes here, and friction."""
    return not isinstance(e, Touch) or (bool(s.switches) and e.acts())


def _axis_frame(s: Structure, e: CoordinateForce) -> int:
    """Frame whose z axis is the axis of the coordinate that a force acts along."""
    joint, what = s.model.coordinate(e.along()[0], e)
    return coordinate_frames(s, joint, what)[0]


def _compile_laws(s: Structure, e: Force, places: np.ndarray) -> None:
    if len(e.laws()) > len(places):
        raise ModelError(f"{e.title}: laws() gives {len(e.laws())} laws; a force has up to {len(places)}")
    for name, of in fields_with(e.__class__, LawOf).items():
        for slot, law in enumerate(e.laws()):
            if law is not None:
                places[slot] = s.law(s.model.law(law, of, f"{name} of {e.title}"), of.inputs, e)
