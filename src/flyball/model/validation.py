"""Checks of a part as it is added: its name, its numbers, the parts it refers to, the names its laws use."""

from __future__ import annotations

import dataclasses
import math
import unicodedata
from collections.abc import Iterable, Mapping
from numbers import Real
from typing import TYPE_CHECKING, Any

from ..errors import ExpressionError, ModelError, ModelWarning, warn_user
from . import controller_signals
from .body import GROUND, Bodies, Body, Driver, Frame, Ground, Initial
from .contact import Contact, MaterialPair, check_touching
from .controller import IMU, Controller, Sensor
from .element import Element, LawOf, Vector, checked_size, fields_with, python_data, si_numbers
from .event import Event
from .event_validation import check_event
from .expression_parser import CONSTANTS, FUNCTIONS, function_name
from .expressions import Expression, check_dimension, fold_constants, law_expression
from .force import BodyForce, CoordinateForce, Force, TwoFrameForce, TwoPointForce, Unilateral
from .geometry import vector
from .inertia import checked_shapes, mass_properties
from .joint import Coupling, Joint
from .names import groups_of, is_curve, is_plain
from .quantities import Curve, measured_quantity, transmitted_force
from .table import Table
from .table_2d import Table2D, separate_tables

if TYPE_CHECKING:
    from .model import Model


RESERVED = (GROUND, "energy", "gravity", "t", "time")


def check_name(model: Model, e: Element) -> None:
    """Refuse a name that is taken, or that results or laws could not use.

    Laws refer to sensors, tables and controllers by their bare names; a sensor whose name is not a plain word, such as
    ``"front wheel"``, exists in results only. Other parts are followed by a dot in laws, so they cannot be confused
    with constants.
    """
    if isinstance(e, Initial):
        if any(i.name == e.name for i in model.initial):
            raise ModelError(f"{e.title}: there is an initial condition for {e.name!r} already")
        return
    if not all(word and word == word.strip() for word in e.name.split(".")):
        raise ModelError(
            f"{type(e).__name__}: {e.name!r} is no good name; it must not be empty; what precedes a '.' is a group, "
            f"as in 'left.arm'"
        )
    for name in (*groups_of(e.name), e.name):
        if name in RESERVED:
            raise ModelError(f"{e.title}: the name {name!r} is reserved")
    if isinstance(e, (Sensor, Controller)):
        _check_read(e)
    if isinstance(e, (Sensor, Table, Table2D, Controller)) and e.name in model.parameters:
        raise ModelError(f"{e.title}: the name {e.name!r} is a parameter's, and laws use both; rename one of them")
    for name in [g for g in groups_of(e.name) if g in model.by_name] + [e.name] * (e.name in model.groups):
        raise ModelError(f"{e.title}: {name!r} would be the name of a part and of a group of parts; rename one of them")
    if e.name in model.by_name:
        raise ModelError(f"{e.title}: the name is taken by {model.by_name[e.name].title}; names must be unique")


def _check_read(e: Element) -> None:
    """Refuse names that laws would read as something else, or, for a controller, could not read at all."""
    other = f"{type(e).__name__.lower()}_{e.name}"
    if e.name in FUNCTIONS or e.name in CONSTANTS:
        what = f"the function {e.name}" if e.name in FUNCTIONS else f"the number {CONSTANTS[e.name]:.6g}"
        raise ModelError(f"{e.title}: laws read {e.name!r} as {what}; rename it, {other!r} for instance")
    if not isinstance(e, Controller):
        return
    if not is_plain(e.name):
        raise ModelError(f"{e.title}: laws name a controller by its name; use letters, digits and _, no digit first")
    read = unicodedata.normalize("NFKC", e.name)
    if read != e.name:
        raise ModelError(f"{e.title}: laws read {e.name!r} as {read!r}, another letter; call it {read!r}")


def check_vectors(e: Element, n: Any, planar: bool) -> None:
    """Every vector has two components (in the plane) or three."""
    for name in fields_with(e.__class__, Vector):
        value = getattr(n, name)
        for v in value if isinstance(value, tuple) and any(isinstance(x, tuple) for x in value) else (value,):
            if v is not None and len(v) != 3 and not (planar and len(v) == 2):
                wanted = 2 if planar else 3
                raise ModelError(f"{name} of {e.title}: expected {wanted} components, got {len(v)}: {v}")


def check_kind(model: Model, e: Element, n: Any, env: dict[str, float]) -> None:
    """Check the requirements of each kind of part."""
    if isinstance(e, Body):
        check_body(model, e, n, env)
    elif isinstance(e, (Bodies, Ground)):
        check_unmoved(model, e, n, env)
    elif isinstance(e, Frame):
        check_frame(model, e, n)
    elif isinstance(e, Joint):
        check_joint(model, e, n)
    elif isinstance(e, Unilateral):
        e.check_range(n, model.unit(e.along()[0], e))
    elif isinstance(e, Force):
        if hasattr(e, "load") and not model.planar:
            _refuse_friction_on_curve(model, e)
        placed = e.placed(n, model.planar)
        if placed is None and getattr(n, "at", None) is not None and not isinstance(e, BodyForce):
            raise ModelError(
                f"{e.title}: 'at' is given, and {type(e).__name__} has no placed(n, planar) for its frames"
            )
        if isinstance(e, TwoFrameForce) and n.at is None and not e.on_bodies:
            check_by_frames(model, e)
    elif isinstance(e, Initial):
        unit = model.unit(e.name, e)
        resolved_fields(e, env, {"value": unit, "rate": f"{unit}/s"})
        if unit == "rad" and isinstance(e.value, Real) and _like_degrees(float(e.value)):
            turns = f"{e.value / (2 * math.pi):.1f} turns"
            warn_user(f"{e.title}: value {e.value:g} is in rad, {turns}; write '{e.value:g} deg' for degrees, or "
                      f"'{e.value:g} rad'", ModelWarning)  # fmt: skip


def _refuse_friction_on_curve(model: Model, e: Any) -> None:
    """Refuse friction along a curve in space: the load of a joint is computed for one axis."""
    for text in e.along() if isinstance(e, CoordinateForce) else ():
        joint, what = model.coordinate(text, e)
        if joint.coordinates[what].row.of_kind.place:
            raise ModelError(
                f"{e.title}: friction along a curve in space is not available, since the load on the curve has no "
                f"fixed axis; give Actuator(..., {text!r}, force='-c*rate'), or describe the mechanism in the plane"
            )


FEW_TURNS = 2.0


def _like_degrees(angle: float) -> bool:
    """Return whether an angle is a whole number and more than a few turns: degrees without their unit."""
    return angle == round(angle) and abs(angle) > FEW_TURNS * 2 * math.pi


def resolved_fields(e: Element, env: Mapping[str, float], units: Mapping[str, str]) -> list[Any]:
    """Return SI numbers of fields whose units depend on the element's coordinate."""
    return [si_numbers(getattr(e, k), env, unit, f"{k} of {e.title}") for k, unit in units.items()]


def check_frame(model: Model, e: Any, n: Any) -> None:
    """Check the field for a body's or a frame's axes: an angle in the plane, an orientation in space."""
    if model.planar and n.orientation is not None:
        raise ModelError(f"{e.title}: in a planar mechanism give angle=, not orientation=")
    if not model.planar and n.angle != 0.0:
        raise ModelError(f"{e.title}: in a spatial mechanism give orientation=, not angle=")
    e.rotation(n)


def check_body(model: Model, e: Body, n: Any, env: dict[str, float]) -> None:
    """Check mass properties, pose and velocities of a body."""
    mass_properties(e, n, env, model.planar)
    vector(n.position, model.planar, f"position of {e.title}")
    if n.velocity is not None:
        vector(n.velocity, model.planar, f"velocity of {e.title}")
    given = n.angular_velocity
    if given is not None and (isinstance(given, tuple) == model.planar or (not model.planar and len(given) != 3)):
        wanted = "one number" if model.planar else "three components"
        raise ModelError(f"{e.title}: angular_velocity must be {wanted}, got {given}")
    check_frame(model, e, n)


def check_unmoved(model: Model, e: Bodies | Ground, n: Any, env: dict[str, float]) -> None:
    """Check shapes, poses and velocities of a set of bodies, or of ground."""
    if isinstance(e, Bodies):
        e.weight(n, env, model.planar)
        e.start(model.planar)
        e.sizes()
    else:
        checked_shapes(e, env, model.planar)
        vector(n.position, model.planar, f"position of {e.title}")
        check_frame(model, e, n)


def check_joint(model: Model, e: Joint, n: Any) -> None:
    """Check that a joint is possible in the plane or in space, and that its frames can be created."""
    if model.planar and not e.planar_normal:
        raise ModelError(
            f"{e.title}: {type(e).__name__} has no meaning in a planar mechanism; use a joint of the plane, such as "
            f"Revolute, Translational, PinInSlot or Distance"
        )
    if not model.planar and not e.spatial:
        raise ModelError(f"{e.title}: {type(e).__name__} is for planar mechanisms; in space use {e.in_space}")
    if e.axisless and n.axis is not None:
        raise ModelError(f"{e.title}: axis has no effect on a {type(e).__name__}; leave it out")
    if n.at is None:
        check_by_frames(model, e)
        return
    F, M = e.world_frames(n, model.planar)
    for row in e.rows(model.planar):
        e.row_parameters(n, row, F, M)


def check_by_frames(model: Model, e: Joint | TwoFrameForce) -> None:
    """Require frames for an element without ``at``."""
    if all(name == GROUND or isinstance(model[name], Body) for name in (e.body_i, e.body_j)):
        raise ModelError(f"{e.title}: give its position: at=... in world coordinates, or name frames of the bodies")


def refuse_ambiguous_names(
    names: Iterable[str], inputs: Iterable[str], sensors: Iterable[str], parameters: Iterable
) -> None:
    """Refuse a law that uses a name with two meanings."""
    for name in sorted(names):
        meant = [
            what
            for known, what in ((inputs, "an input of this law"), (sensors, "a sensor"), (parameters, "a parameter"))
            if name in known
        ]
        if len(meant) > 1:
            raise ExpressionError(f"{name!r} is {' and also '.join(meant)}; rename the {meant[-1].split(' ', 1)[1]}")


def gravity_as_written(model: Model, value: Any) -> tuple | list:
    """A vector of numbers and texts, not yet in SI units, owned by the model: a list if it may be changed in place."""
    try:
        found = python_data(value)
    except (ValueError, TypeError, AttributeError) as error:
        raise ModelError(f"gravity of {model.name!r}: {error}") from None
    if not isinstance(found, (tuple, list)):
        example = "(0, -9.81)" if model.planar else "(0, 0, -9.81)"
        raise ModelError(f"gravity of {model.name!r} is a vector, for instance {example}, not {value!r}")
    return found if isinstance(value, tuple) else list(found)


def check_references(model: Model, e: Element) -> None:
    """Refuse references to unknown parts, or twice to the same one."""
    if isinstance(e, (Body, Bodies, Ground, Contact, MaterialPair)):
        check_touching(model, e)
    if isinstance(e, (Joint, TwoPointForce, TwoFrameForce)):
        carriers = [model.carrier(name, e) for name in (e.body_i, e.body_j)]
        if carriers[0] == carriers[1]:
            raise ModelError(f"{e.title}: both its ends are on {carriers[0]!r}; it must join two different bodies")
    elif isinstance(e, Frame):
        if e.body != GROUND:
            model.body(e.body, e)
    elif isinstance(e, BodyForce):
        if model.carrier(e.body, e) == GROUND:
            raise ModelError(f"{e.title}: a force on ground moves nothing; name a body")
    elif isinstance(e, CoordinateForce):
        e.examine(model)
        _check_path(model, e)
    elif isinstance(e, Coupling):
        for text in e.coupled():
            model.coordinate(text, e)
        e.examine(model)
    elif isinstance(e, Sensor):
        model.measured(e)
    elif isinstance(e, Event):
        check_event(model, e)
    elif isinstance(e, IMU):
        if model.carrier(e.frame, e) == GROUND:
            raise ModelError(f"{e.title}: it is fixed on ground, which never moves; name a body or a frame on one")
    elif isinstance(e, (Driver, Initial)):
        model.coordinate(e.name if isinstance(e, Initial) else e.coordinate, e)


def _check_path(model: Model, e: CoordinateForce) -> None:
    """Require that the coordinate along which it acts exists and can move."""
    own = getattr(e, "coordinate", None)
    for text in e.along() or ((own,) if isinstance(own, str) else ()):
        model.coordinate(text, e)
    carriers = [model.carrier(name, e) for name in e.ends().values()]
    if len(carriers) > 1 and len(set(carriers)) == 1:
        raise ModelError(
            f"{e.title}: all its points are on {carriers[0]!r}, so that it never changes its length; name another body"
        )


def checked_law(
    model: Model, value: Any, of: LawOf, where: str, driver: bool = False, whole: bool = True
) -> Expression | None:
    """Return a law as an expression of t, its inputs, sensors, tables and parameters; refuse other names.

    If ``whole``, signals of controllers are replaced by their formulas.
    """
    if value is None:
        return None
    if driver and callable(value):
        raise ExpressionError(
            f"{where} is the Python function '{function_name(value)}', which gives no derivatives, and a driver needs "
            "two; give an expression, or a Table that is called in one"
        )
    tables = {x.name: x for x in model.tables}
    names = model.names_in_laws(of)
    try:
        signals = controller_signals.signal_names(model)
        expression = law_expression(value, of.dimension, where, tables, names, of.curves or bool(signals))
        if not of.curves and any(is_curve(model, k) and k not in signals for k in expression.names - set(names)):
            controller_signals.refuse_unknown(model, expression)
            law_expression(value, of.dimension, where, tables, names)  # parsing refuses curves of other parts
        tree = separate_tables(expression.tree, tables) if expression.tables else expression.tree
        expression = dataclasses.replace(expression, tree=tree, where=where)
        if expression.tree.kind == "name":
            check_dimension(expression.tree.value, model.environment(), of.dimension, f"{where}: ")
        if expression.tree.kind == "number":
            checked_size(expression.tree.value, of.dimension, where)
        sensors = {k: x for k in expression.names if isinstance(x := model.find(k), Sensor)}
        if signals:
            controller_signals.refuse_unknown(model, expression)
        curves = {k for k in expression.names if is_curve(model, k) and k not in signals} if of.curves else set()
        expression.require({*names, *curves})
        fold_constants(expression.tree, expression.text)
        refuse_ambiguous_names(
            expression.names, of.inputs, {*sensors, *(k for k in signals if not is_curve(model, k))}, model.parameters
        )
    except ExpressionError as error:
        text = str(error)
        raise ExpressionError(text if text.startswith(where) else f"{where}: {text}") from None
    for name in sorted(sensors):
        _check_sensed(model, sensors[name], where, driver)
    for name in sorted(curves):
        _check_curve(model, name, where, of)
    if not signals:
        return expression
    if driver:
        controller_signals.refuse_in_driver(model, expression, where)
    try:
        return controller_signals.substitute_signals(model, expression, of) if whole else expression
    except ExpressionError as error:
        raise ExpressionError(f"{where}: {error}") from None


def _check_sensed(model: Model, e: Sensor, where: str, driver: bool) -> None:
    """Refuse sensors that the law may not use."""
    found = model.measured(e)
    if found is None:
        raise ModelError(
            f"{where}: sensor {e.name!r} measures {e.of!r}, which is known only after the accelerations are; laws "
            f"can use positions, angles, lengths and their rates"
        )
    if driver and found[2] > 0:
        raise ModelError(
            f"{where}: sensor {e.name!r} measures {e.of!r}, a rate; a driver follows positions and angles only. "
            f"For a controller use an Actuator or a Motor"
        )


def _check_curve(model: Model, name: str, where: str, of: LawOf) -> None:
    """Require that a curve is one of positions or velocities, or, for an event, a force of a part."""
    if of.forces and transmitted_force(model, name):
        return
    if measured_quantity(model, Curve(where, name)) is None:
        raise ModelError(
            f"{where}: {name!r} is known only after the accelerations are; use positions, angles, lengths and their "
            f"rates" + (", or what joints, drivers and forces along coordinates carry" if of.forces else "")
        )
