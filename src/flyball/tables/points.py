"""Point masses: bodies without inertia whose turning means nothing. They have velocities and no angular velocity.

A body is one if its inertia is written as zero (a parameter may become something else) and all that acts on it acts at
its centre of mass and sees nothing but where that is: ends of `Distance`, springs and ropes, ball joints, forces.
What is attached elsewhere, or holds or drives its orientation, makes it a rigid body, which joints must keep from
turning. This is decided by the model's own numbers; `check_centred` refuses others that would decide otherwise.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from ..constraints.blocks import Row
from ..errors import FlyballError, ModelError
from ..math.products import product
from ..model.body import Body, Frame
from ..model.element import Element, si_numbers
from ..model.expressions import Expression, is_number_text
from ..model.force import BodyForce, CoordinateForce, Force
from ..model.geometry import vector
from ..model.joint import Joint
from ..model.model import Model
from .numbers import numbers

CENTRED = 1e-9  # part of the way to the world's origin by which an end may miss the centre


def points(model: Model) -> Mapping[str, str]:
    """Bodies without inertia -> why each is no point mass; "" for one that is."""
    model = model.snapshot()
    return model.kept.get("points", None, 1, lambda: _found(model))


def single(model: Model) -> frozenset[str]:
    """Names of the point masses. They are all that structures take from values of parameters."""
    model = model.snapshot()
    return model.kept.get("single", None, 1, lambda: frozenset(k for k, why in points(model).items() if not why))


def _found(model: Model) -> dict[str, str]:
    found = {
        b.name: "its angular velocity is given" if b.angular_velocity is not None else ""
        for b in model.bodies
        if weightless(b)
    }
    if not any(why == "" for why in found.values()):
        return found
    place = _Places(model)
    for name, role, e, blind in _ends(model, found):
        if not found[name]:
            if not blind:
                found[name] = f"{e.title} needs its orientation"
            elif not place.centred(name, role, e):
                found[name] = f"{e.title} is attached off its centre of mass"
    return found


def weightless(body: Body) -> bool:
    """Whether a body's inertia is written as zero."""
    return body.inertia is not None and body.inertia_about is None and _zero(body.inertia)


def _zero(value: Any) -> bool:
    if isinstance(value, tuple):
        return all(_zero(x) for x in value)
    if not isinstance(value, str):
        return bool(value == 0)
    try:
        if not is_number_text(value) and Expression.parse(value).names:
            return False  # said here: a message about unknown names asks for all the world's units
        return bool(si_numbers(value, {}, "kg*m^2", "inertia") == 0)
    except FlyballError:  # no number
        return False


def _ends(model: Model, among: Mapping[str, str]) -> Iterator[tuple[str, str, Element, bool]]:
    """(body, role, element, whether it sees no more than the end's place) of all that acts on some bodies."""
    for joint in model.joints:
        rows = joint.rows(model.planar)
        for role, end in joint.ends().items():
            if (name := model.carrier(end, joint)) in among:
                yield name, role, joint, all(sees_point(r, role) for r in rows)
    for force in model.forces:
        for role, end in force.ends().items():
            if (name := model.carrier(end, force)) in among:
                yield name, role, force, force.on_points()
    for text, e in _coordinates(model):
        owner, what = model.coordinate(text, e)
        if isinstance(owner, Joint):
            c = owner.coordinates[what]
            for k, role in enumerate(c.frames):
                if (name := model.carrier(owner.ends()[role], owner)) in among:
                    yield name, role, owner, sees_point(c.row, "FM"[k])
        elif (name := model.carrier(owner.name, e)) in among:
            yield name, "M", owner, what != "angle"


def sees_point(row: Row, role: str) -> bool:
    """Whether a row depends on the place of its frame F or M only, and makes no torque about it."""
    return role in row.of_kind.points


def _coordinates(model: Model) -> Iterator[tuple[str, Element]]:
    """Coordinates that something acts along, by name."""
    for coupling in model.couplings:
        yield from ((text, coupling) for text in coupling.coupled())
    yield from ((d.coordinate, d) for d in model.drivers)
    for f in (*model.forces, *model.limits):
        if isinstance(f, CoordinateForce):
            yield from ((text, f) for text in f.along())


class _Places:
    """Where ends and centres of mass are drawn, by the model's own numbers."""

    def __init__(self, model: Model) -> None:
        self.model, self.numbers = model, numbers(model)

    def centred(self, name: str, role: str, e: Element) -> bool:
        """Whether the end of an element on a body is its centre of mass."""
        body: Any = self.model[name]
        at = _written(e, role)
        if body.com is None and at is not None and at == body.position:
            return True
        centre = self.numbers.bodies[name].c
        return bool(np.abs(self._end(role, e, centre) - centre).max() <= CENTRED * np.abs(centre).max())

    def _end(self, role: str, e: Any, centre: np.ndarray) -> np.ndarray:
        n, planar = self.numbers.of[e.name], self.model.planar
        if not isinstance(e, (BodyForce, Body, Frame)) and n.at is not None:
            return e.placed(n, planar)[role][0]
        if isinstance(e, BodyForce) and isinstance(self.model[e.body], Body):
            at = getattr(n, "at", None)
            return centre if at is None else vector(at, planar, e.title)
        end: Any = self.model[e.ends()[role]]
        if not isinstance(end, Frame):
            return self.numbers.bodies[end.name].p
        b = self.numbers.bodies[end.body]
        return b.p + product(b.R, vector(self.numbers.of[end.name].position, planar, end.title))


def _written(e: Any, role: str) -> Any:
    """The place of an end in the world as it stands in the description, if it does."""
    at = getattr(e, "at", None)
    if at is None or not isinstance(at[0], tuple):
        return at
    return at[list(e.ends()).index(role)]


def check_centred(model: Model, name: str, element: Any, way: np.ndarray, length: Any) -> None:
    """Refuse numbers by which an element misses the centre of a point mass.

    Raises
    ------
    ModelError
        Naming both, and how far.
    """
    off = np.abs(way.real)
    if isinstance(element, (Joint, Force)) and (off > CENTRED * length.real).any():
        raise ModelError(
            f"{model[name].title} has no inertia and is a point mass as the model describes it, but with these "
            f"parameters {element.title} is attached {float(off.max()):.3g} m off its centre of mass. Place both by "
            f"the same expression, or give the body an inertia"
        )
