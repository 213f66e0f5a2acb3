"""Whether the numbers of a body or joint make sense in the plane or in space."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

from ..errors import ExpressionError, ModelError
from .body import GROUND, Body, Frame, Initial
from .bulk import Bodies
from .element import Element, Vector, fields_with, plain, si_numbers
from .force import Force, TwoFrameForce
from .geometry import vector
from .ground import Ground
from .inertia import mass_properties
from .joint import Joint
from .limit import Unilateral
from .weighing import checked

if TYPE_CHECKING:
    from .model import Model


def check_vectors(e: Element, n: Any, planar: bool) -> None:
    """Every vector has two components (in the plane) or three."""
    for name in fields_with(e.__class__, Vector):
        value = getattr(n, name)
        for v in value if isinstance(value, tuple) and any(isinstance(x, tuple) for x in value) else (value,):
            if v is not None and len(v) != 3 and not (planar and len(v) == 2):
                wanted = 2 if planar else 3
                raise ModelError(f"{name} of {e.title}: expected {wanted} components, got {len(v)}: {v}")


def check_kind(model: Model, e: Element, n: Any, env: dict[str, float]) -> None:
    """What parts of its kind must fulfil."""
    if isinstance(e, Body):
        check_body(model, e, n, env)
    elif isinstance(e, (Bodies, Ground)):
        check_still(model, e, n, env)
    elif isinstance(e, Frame):
        check_frame(model, e, n)
    elif isinstance(e, Joint):
        check_joint(model, e, n)
    elif isinstance(e, Unilateral):
        e.check_sides(n, model.unit(e.along()[0], e))
    elif isinstance(e, Force):
        e.placed(n, model.planar)
        if isinstance(e, TwoFrameForce) and n.at is None:
            check_by_frames(model, e)
    elif isinstance(e, Initial):
        unit = model.unit(e.name, e)
        told(e, env, {"value": unit, "rate": f"{unit}/s"})


def told(e: Element, env: Mapping[str, float], units: Mapping[str, str]) -> list[Any]:
    """SI numbers of fields whose units depend on what the element is about."""
    return [si_numbers(getattr(e, k), env, unit, f"{k} of {e.title}") for k, unit in units.items()]


def check_frame(model: Model, e: Any, n: Any) -> None:
    """How a body's or a frame's axes are told: by an angle in the plane, by an orientation in space."""
    if model.planar and n.orientation is not None:
        raise ModelError(f"{e.title}: in a planar mechanism give angle=, not orientation=")
    if not model.planar and n.angle != 0.0:
        raise ModelError(f"{e.title}: in a spatial mechanism give orientation=, not angle=")
    e.rotation(n)


def check_body(model: Model, e: Body, n: Any, env: dict[str, float]) -> None:
    """Mass properties, pose and velocities of a body."""
    mass_properties(e, n, env, model.planar)
    vector(n.position, model.planar, f"position of {e.title}")
    if n.velocity is not None:
        vector(n.velocity, model.planar, f"velocity of {e.title}")
    given = n.angular_velocity
    if given is not None and (isinstance(given, tuple) == model.planar or (not model.planar and len(given) != 3)):
        wanted = "one number" if model.planar else "three components"
        raise ModelError(f"{e.title}: angular_velocity must be {wanted}, got {given}")
    check_frame(model, e, n)


def check_still(model: Model, e: Bodies | Ground, n: Any, env: dict[str, float]) -> None:
    """Many bodies, or what stands on ground: shapes, poses and velocities."""
    if isinstance(e, Bodies):
        e.weight(n, env, model.planar)
        e.start(model.planar)
        e.sizes()
    else:
        checked(e, env, model.planar)
        vector(n.position, model.planar, f"position of {e.title}")
        check_frame(model, e, n)


def check_joint(model: Model, e: Joint, n: Any) -> None:
    """A joint has a meaning here, and its frames can be made."""
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
    """What is not placed by ``at`` names frames."""
    if all(name == GROUND or isinstance(model[name], Body) for name in (e.body_i, e.body_j)):
        raise ModelError(f"{e.title}: say where it is: at=... in world coordinates, or name frames of the bodies")


def refuse_twins(names: Iterable[str], inputs: Iterable[str], sensors: Iterable[str], parameters: Iterable) -> None:
    """Refuse a law that uses a name with two meanings."""
    for name in sorted(names):
        meant = [
            what
            for known, what in ((inputs, "an input of this law"), (sensors, "a sensor"), (parameters, "a parameter"))
            if name in known
        ]
        if len(meant) > 1:
            raise ExpressionError(f"{name!r} is {' and also '.join(meant)}; rename the {meant[-1].split(' ', 1)[1]}")


def told_gravity(model: Model, value: Any) -> tuple | list:
    """A vector of numbers and texts, not yet in SI units, of the model's own: a list if it may be changed in place."""
    try:
        found = plain(value)
    except (ValueError, TypeError, AttributeError) as error:
        raise ModelError(f"gravity of {model.name!r}: {error}") from None
    if not isinstance(found, (tuple, list)):
        example = "(0, -9.81)" if model.planar else "(0, 0, -9.81)"
        raise ModelError(f"gravity of {model.name!r} is a vector, for instance {example}, not {value!r}")
    return found if isinstance(value, tuple) else list(found)
