"""Looking up parts of a mechanism by what users call them."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from typing import Any

from ..errors import ModelError
from .body import GROUND, Body, Frame
from .element import Element
from .examine import but_is, carriers, curves
from .force import CoordinateForce, TwoPointForce
from .joint import Joint
from .sensor import Sensor


class Names:
    """Parts by name, coordinates and measured quantities by their texts."""

    name: str
    planar: bool
    bodies: list[Body]
    frames: list[Frame]
    joints: list[Joint]
    _names: dict[str, Element]

    def __getitem__(self, name: str) -> Any:
        """The part with that name."""
        if name not in self._names:
            raise ModelError(f"{self.name!r} has no part named {name!r}{suggest(name, self._names)}")
        return self._names[name]

    def body(self, name: str, e: Element) -> Body:
        """The body of that name, as asked for by e."""
        found = self._names.get(name)
        if not isinstance(found, Body):
            names = [b.name for b in self.bodies]
            raise ModelError(f"{e.title}: there is no body named {name!r}{suggest(name, names)}; {listing(names)}")
        return found

    def carrier(self, name: str, e: Element) -> str:
        """Name of the body (or ground) that carries what e attaches to."""
        found = self._names.get(name)
        if isinstance(found, Frame):
            return found.body
        if name != GROUND and not isinstance(found, Body):
            names = carriers(self)
            raise ModelError(
                f"{e.title}: there is no body or frame named {name!r}{but_is(self, name, 'body or frame')}"
                f"{suggest(name, names)}; {listing(names)}"
            )
        return name

    def joint(self, name: str, e: Element, coordinate: str) -> Joint:
        """The joint of that name, which must have the coordinate, as asked for by e."""
        found = self._names.get(name)
        if not isinstance(found, Joint):
            names = [j.name for j in self.joints]
            raise ModelError(
                f"{e.title}: there is no joint named {name!r}{but_is(self, name, 'joint')}{suggest(name, names)}; "
                f"{listing(names)}"
            )
        has = found.measured(self.planar)
        if coordinate not in has:
            raise ModelError(
                f"{e.title}: {found.title} has no coordinate {coordinate!r}{suggest(coordinate, has)}; it has "
                f"{', '.join(has) or 'none'}"
            )
        return found

    def coordinate(self, text: str, e: Element) -> tuple[Any, str]:
        """(joint, coordinate name) or (body or frame, axis) for ``"A.angle"`` or ``"slider.x"``."""
        owner, _, what = text.partition(".")
        found = self._names.get(owner)
        if isinstance(found, (Body, Frame)):
            axes = ("x", "y", "angle") if self.planar else ("x", "y", "z")
            if what not in axes:
                raise ModelError(f"{e.title}: {owner!r} has the coordinates {', '.join(axes)}, not {what!r}")
            return found, what
        if not what:
            raise ModelError(f"{e.title}: {text!r} is no coordinate; write joint.coordinate, for instance 'A.angle'")
        return self.joint(owner, e, what), what

    def measured(self, e: Sensor) -> tuple[str, str, int] | None:
        """What a sensor measures, as (kind, coordinate or name, order): order 0 the value, 1 its rate.

        The kind is ``"coordinate"``, ``"force"`` (the quantity that a force acts along), ``"spin"`` (angular velocity
        in space), or None for an output that laws cannot use.

        Raises
        ------
        ModelError
            If there is no such part, or it has no such curve.
        """
        owner, _, what = e.of.partition(".")
        found = self._names.get(owner)
        if found is None and owner != "energy":
            known = list(self._names)
            raise ModelError(
                f"{e.title}: {e.of!r} is no curve of a part; write part.curve, for instance 'A.angle'. There is no "
                f"part named {owner!r}{suggest(owner, known)}; {listing(known)}"
            )
        has = curves(self, owner)
        if what not in has:
            whose = "energy" if found is None else found.title
            raise ModelError(
                f"{e.title}: {e.of!r} is no curve; {whose} has {', '.join(f'{owner}.{c}' for c in has) or 'none'}"
                f"{suggest(what, has)}"
            )
        if found is None:
            return None
        if isinstance(found, (Body, Frame)):
            return self._measured_point(owner, what)
        if isinstance(found, Joint):
            return _measured_joint(found, what, found.measured(self.planar))
        if isinstance(found, (TwoPointForce, CoordinateForce)):
            order = list(found.outputs).index(what) if what in found.outputs else 2
            return ("force", owner, order) if order < 2 else None
        return None

    def _measured_point(self, owner: str, what: str) -> tuple[str, str, int] | None:
        axes = "xy" if self.planar else "xyz"
        if what in tuple(axes) or (self.planar and what == "angle"):
            return "coordinate", f"{owner}.{what}", 0
        if len(what) == 2 and what[0] == "v" and what[1] in axes:
            return "coordinate", f"{owner}.{what[1]}", 1
        if self.planar and what == "omega":
            return "coordinate", f"{owner}.angle", 1
        if not self.planar and what in ("omega_x", "omega_y", "omega_z"):
            return "spin", f"{owner}.{what[-1]}", 1
        return None

    def unit(self, text: str, e: Element) -> str:
        """Unit of a coordinate."""
        owner, what = self.coordinate(text, e)
        if isinstance(owner, Joint):
            return owner.coordinates[what].unit
        return "rad" if what == "angle" else "m"


def _measured_joint(joint: Joint, what: str, own: Mapping) -> tuple[str, str, int] | None:
    if what in own:
        return "coordinate", f"{joint.name}.{what}", 0
    name = next(iter(own)) if what == "rate" and len(own) == 1 else what.removesuffix("_rate")
    return ("coordinate", f"{joint.name}.{name}", 1) if name in own else None


def suggest(name: str, known: Any) -> str:
    """' (did you mean ...?)' where something close is known."""
    close = difflib.get_close_matches(name, list(known), 1)
    return f" (did you mean {close[0]!r}?)" if close else ""


def listing(names: list[str]) -> str:
    """What there is, for messages."""
    if not names:
        return "there is none yet; add it first"
    shown = ", ".join(names[:12]) + (", ..." if len(names) > 12 else "")
    return f"known: {shown}"
