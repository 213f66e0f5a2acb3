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
from ..constraints.registry import KINDS
from ..errors import FlyballError, ModelError
from ..model.body import GROUND, Body, Frame
from ..model.element import Element, resolve, si_numbers
from ..model.force import BodyForce, CoordinateForce, Force
from ..model.geometry import vector
from ..model.joint import Joint
from ..model.model import Model

CENTRED = 1e-9  # part of the way to the world's origin by which an end may miss the centre


def points(model: Model) -> dict[str, str]:
    """Bodies without inertia -> why each is no point mass; "" for one that is."""
    found = {b.name: "" for b in model.bodies if weightless(b)}
    if not found:
        return found
    place = _Places(model)
    for name, role, e, blind in _ends(model, found):
        if not found[name]:
            if not blind:
                found[name] = f"{e.title} needs its orientation"
            elif not place.centred(name, role, e):
                found[name] = f"{e.title} is attached off its centre of mass"
    for body in model.bodies:
        if found.get(body.name) == "" and body.angular_velocity is not None:
            found[body.name] = "its angular velocity is given"
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
        return bool(si_numbers(value, {}, "kg*m^2", "inertia") == 0)
    except FlyballError:  # it names parameters
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
    return role in KINDS[row.kind].points


def _coordinates(model: Model) -> Iterator[tuple[str, Element]]:
    """Coordinates that something acts along, by name."""
    for coupling in model.couplings:
        yield from ((text, coupling) for text in coupling.coupled())
    yield from ((d.coordinate, d) for d in model.drivers)
    yield from ((i.name, i) for i in model.initial)
    for f in model.forces:
        if isinstance(f, CoordinateForce) and f.coordinate_text():
            yield f.coordinate_text(), f


class _Places:
    """Where ends and centres of mass are drawn, by the model's own numbers."""

    def __init__(self, model: Model) -> None:
        self.model, self.env = model, model.environment()
        self._resolved: dict[str, Any] = {}

    def centred(self, name: str, role: str, e: Element) -> bool:
        """Whether the end of an element on a body is its centre of mass."""
        body: Any = self.model[name]
        at = _written(e, role)
        if body.com is None and at is not None and at == body.position:
            return True
        if isinstance(e, BodyForce) and at is None and isinstance(self.model[e.body], Body):
            return True
        b = self._numbers(body)
        centre = vector(b.position, self.model.planar, body.title) + body.rotation(b) @ self._vector(b.com, body)
        way = self._end(role, e) - centre
        return bool(np.abs(way).max() <= CENTRED * np.abs(centre).max())

    def _end(self, role: str, e: Any) -> np.ndarray:
        n = self._numbers(e)
        placed = e.placed(n, self.model.planar) if hasattr(e, "placed") else None
        if placed is not None:
            return placed[role][0]
        if getattr(n, "at", None) is not None:
            return self._vector(n.at, e)
        end: Any = self.model[e.ends()[role]]
        own = self._numbers(end)
        p = vector(own.position, self.model.planar, end.title)
        if not isinstance(end, Frame) or end.body == GROUND:
            return p
        body: Any = self.model[end.body]
        b = self._numbers(body)
        return vector(b.position, self.model.planar, body.title) + body.rotation(b) @ p

    def _vector(self, x: Any, e: Element) -> np.ndarray:
        return np.zeros(3) if x is None else vector(x, self.model.planar, e.title)

    def _numbers(self, e: Any) -> Any:
        if e.name not in self._resolved:
            self._resolved[e.name] = resolve(e, self.env)
        return self._resolved[e.name]


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
    off = float(np.abs(way.real).max(initial=0.0))
    if isinstance(element, (Joint, Force)) and off > CENTRED * length.real:
        raise ModelError(
            f"{model[name].title} has no inertia and is a point mass as the model describes it, but with these "
            f"parameters {element.title} is attached {off:.3g} m off its centre of mass. Place both by the same "
            f"expression, or give the body an inertia"
        )
