"""Copies of a mechanism as parts of another: renamed, placed, turned and reflected.

Every part of the copy is an ordinary part of the mechanism, whose name begins with the copy's prefix. References, laws
and parameters are those of the copy. Vectors are transformed by their units and by what their elements declare
(`Element.local`, `Joint.axial`, `Element.reversed_factors`); what has no image is refused.
"""

from __future__ import annotations

import dataclasses
import typing
from collections.abc import Callable, Mapping
from functools import cache
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from ..errors import ModelError
from .body import ARRAYS, GROUND, Bodies, Body, Driver, Frame, Ground, Initial, shape_tuple
from .contact import Contact
from .controller import IMU, Controller, Sensor
from .element import Element, LawOf, Named, Unit, fields_with, resolve
from .event import Action, Event, Impulse, Set, comparison_sides
from .expression_parser import function_name, function_tree, replace_names
from .expressions import is_number_text
from .force import BodyForce, CoordinateForce, Force, TwoFrameForce, WeightedSumForce
from .geometry import matrix_to_quaternion
from .joint import Coupling, Joint
from .linked_files import paths_from
from .names import curve_parts
from .placement import Placement, product, rotation_of, scaled, total
from .quantities import ENERGY, quantities
from .quantity_images import Image, component_image, joint_image, located_image
from .roads.road import Road
from .snapshot import part_owners

if TYPE_CHECKING:
    from .model import Model

WORDS = ("name", "color", "text", "x_unit", "y_unit", "law", "outputs", "path")
"""Fields whose texts are no names of parts."""
SHIFTED = ("rest", "lower", "upper", "notch", "tooth", "middle", "value")
"""Fields that are values of the quantity along which an element acts."""
TURNED = "its value is along the world's axes, or along axes that the copy does not have"


@cache
def _kinds(cls: Any) -> dict[str, str]:
    """Return the fields with texts: name -> "names" of parts, or "formulas"."""
    hints = typing.get_type_hints(cls, include_extras=True)
    out = {}
    for f in dataclasses.fields(cls):
        types = set(_members(hints[f.name]))
        law = f.name == "law" and (issubclass(cls, Driver) or LawOf in map(type, typing.get_args(hints[f.name])[1:]))
        if law or f.name == "formulas":
            out[f.name] = "formulas"
        elif str in types and f.name not in WORDS:
            out[f.name] = "formulas" if float in types or "function" in types else "names"
    out |= dict.fromkeys(fields_with(cls, Named), "named formulas")
    return out


def _members(hint: Any) -> Any:
    if typing.get_origin(hint) is Literal:
        return
    if typing.get_origin(hint) is typing.get_origin(typing.Callable[..., Any]):
        yield "function"
        return
    inner = typing.get_args(hint)
    if typing.get_origin(hint) is typing.Annotated:
        inner = inner[:1]
    if not inner:
        yield hint
    for x in inner:
        yield from _members(x)


class Subassembly:
    """One copy of a mechanism ``part`` in the mechanism ``whole``; `add` adds it."""

    def __init__(
        self, whole: Model, part: Model, prefix: str, on: str, place: Placement, parameters: Mapping[str, Any]
    ) -> None:
        self.whole, self.part, self.prefix, self.on, self.place = whole, part, prefix, on, place
        self.given = parameters
        self.planar = part.planar
        self.images: dict[str, Image | None] = {}
        self.environment = part.environment()

    def add(self) -> list[Element]:
        """Add all parts; return them."""
        self._add_parameters()
        out: list[Element] = []
        waiting: list[Element] = []
        owned = part_owners(self.part)  # these come with their owners
        for e in (e for e in (*self.part.by_name.values(), *self.part.initial) if e.name not in owned):
            if isinstance(e, Controller):  # they may refer to one another
                waiting.append(e)
                continue
            out += self._added(waiting)
            out += self._added([e])
            waiting = []
        return out + self._added(waiting)

    def _added(self, parts: list[Element]) -> list[Element]:
        made = [self.copied(e) for e in parts]
        if made:
            self.whole.add(*made)
        return made

    def _add_parameters(self) -> None:
        own = {k: self.formula(x) for k, x in self.part.parameters.items()} | dict(self.given)
        for k, x in own.items():
            name = self.named(k)
            if name in self.whole.parameters:
                raise ModelError(f"{self.whole.name!r} has a parameter {name!r} already; choose another prefix")
            self.whole.parameters[name] = x
        self.whole.environment()

    def named(self, name: str) -> str:
        """Return the name of the copy of a part, parameter or curve."""
        return f"{self.prefix}.{name}"

    def refuse(self, e: Element, why: str) -> typing.NoReturn:
        """Refuse an element that has no copy."""
        how = "reflected" if self.place.mirror else "turned" if self.place.turned else "placed"
        raise ModelError(f"{e.title} of {self.part.name!r} cannot be {how} in {self.prefix!r}: {why}")

    # names and formulas

    def reference(self, text: str, e: Element) -> str:
        """Return the name of a part, or of a coordinate, in the copy; other texts as they are."""
        if text == GROUND:
            return GROUND if isinstance(e, Contact) else self.on
        if text in self.part:
            return self.named(text)
        owner, what = curve_parts(text)
        return self.image(text, e).name if what and owner in self.part else text

    def formula(self, text: Any, inputs: Mapping[str, str] | None = None) -> Any:
        """Return a number, a quantity, or a formula in the names of the copy."""
        if not isinstance(text, str) or is_number_text(text):
            return text
        return replace_names(text, lambda name: self._term(name, inputs or {}))

    def _term(self, name: str, inputs: Mapping[str, str]) -> str:
        if name in inputs:
            return inputs[name]
        owner, what = curve_parts(name, self.part)
        e = self.part.find(owner)
        if owner == ENERGY:
            raise ModelError(f"a law of {self.part.name!r} reads {name!r}, and its copy {self.prefix!r} has no energy")
        if name in self.part.parameters or isinstance(e, Controller) or (e is not None and e.category == "tables"):
            return self.named(name)
        if isinstance(e, Sensor):
            return self.image(name, e).original()
        return self.image(name, e).original() if e is not None and what else name

    def law(self, value: Any, e: Element, sign: float = 1.0, inputs: Mapping[str, str] | None = None) -> Any:
        """Return a law in the names of the copy, times a sign; ``inputs`` are formulas of its inputs."""
        if not callable(value):
            return scaled(sign, self.formula(value, inputs))
        _, tree = function_tree(value)
        for node in tree.args:
            name = (node if node.kind == "name" else node.args[0]).value
            known = name in self.part.parameters or name in self.part
            kept = inputs[name] == name if inputs and name in inputs else not known
            if sign != 1.0 or not kept:
                self.refuse(
                    e,
                    f"its law is the Python function {function_name(value)!r} of {name!r}, which has another name or "
                    "sign in the copy; write an expression",
                )
        return value

    # quantities of the copy

    def image(self, text: str, e: Element) -> Image:
        """Return the copy's quantity for one of the original, by name; refuse it for ``e`` if there is none."""
        if text not in self.images:
            self.images[text] = self._image(text)
        found = self.images[text]
        if found is None:
            self.refuse(e, f"{text!r} has no counterpart there: {TURNED}; name a joint's own coordinate, or frames")
        return found

    def _image(self, text: str) -> Image | None:
        owner, what = curve_parts(text, self.part)
        e = self.part.find(owner)
        if isinstance(e, Sensor):
            found = self._image(e.of)
            return found and found._replace(name=self.named(owner))
        table = quantities(self.part, owner) if owner != ENERGY else {}
        if what not in table or e is None:
            return None if owner == ENERGY else Image(self.named(text))
        found = self._quantity_image(e, what, table)
        return found and found._replace(name=f"{self.named(owner)}.{found.name}")

    def _quantity_image(self, e: Element, what: str, table: Any) -> Image | None:
        if isinstance(e, (Body, Frame)):
            return located_image(what, table, e, self.place, self.planar)
        of, component = table[what].of, table[what].component
        if isinstance(e, (Joint, BodyForce, TwoFrameForce)) and component is not None:
            names = {q.component: k for k, q in table.items() if q.of == of and q.component is not None}
            return component_image(names, component, self.place.axial if of == "torque" else self.place.polar)
        if isinstance(e, IMU):
            k = 2 if component is None else component
            local = self.place.local
            return Image(what, float((local.axial if of == "angular_velocity" else local.polar)[k, k]))
        if isinstance(e, Joint) and (what in e.measured(self.planar) or what.endswith(("rate", "acceleration"))):
            return joint_image(what, e, self._joint_frames(e), self.planar, self._rest(e))
        along = self._along(e)
        if along and what not in ("energy", "power", "work", "intact"):
            k = int(what[len("effort_") :]) - 1 if what.startswith("effort_") else 0
            found = self.image(along[k], e)
            if found.shift != 0.0 and what == next(iter(getattr(e, "outputs", ())), ""):
                return None
            return Image(what, 1.0 if isinstance(e, WeightedSumForce) else found.sign)
        if isinstance(e, Joint) and what in ("torque",) and self.planar:
            return Image(what, self.place.sign)
        return Image(what)

    def _along(self, e: Element) -> tuple[str, ...]:
        if isinstance(e, (Driver, Initial)):
            return (e.coordinate if isinstance(e, Driver) else e.name,)
        return e.along() if isinstance(e, CoordinateForce) else e.coupled() if isinstance(e, Coupling) else ()

    def _frames(self, model: Model, e: Any, env: Any) -> dict[str, Any] | None:
        return e.placed(resolve(e, env), self.planar)  # type: ignore[no-any-return]

    def _rest(self, e: Joint) -> np.ndarray:
        placed = self._frames(self.part, e, self.environment)
        if placed is None:
            return np.array(e.rest) if e.rest else np.eye(3)
        return np.real(placed["F"][1].T @ placed["M"][1])

    def _joint_frames(self, e: Joint, copy: Joint | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Return, for F and M, the matrix from components along the original to components along its image."""
        old = self._frames(self.part, e, self.environment)
        copy = self.whole[self.named(e.name)] if copy is None else copy
        new = self._frames(self.whole, copy, self.whole.environment())
        if old is None or new is None:
            return self.place.reflection, self.place.reflection
        f, m = (np.real(new[k][1].T @ self.place.polar @ old[k][1]) for k in "FM")
        return f, m

    # elements

    def copied(self, e: Element) -> Element:
        """Return the copy of a part."""
        if isinstance(e, Bodies):
            return self._bodies(e)
        new = {name: self._texts(e, getattr(e, name), kind) for name, kind in _kinds(type(e)).items()}
        new["name"] = self.image(e.name, e).name if isinstance(e, Initial) else self.named(e.name)
        by_kind: tuple[tuple[Any, Callable[..., None]], ...] = (
            (Body, self._body), (Frame, self._frame), (Ground, self._ground),
            (Joint, self._joint), (Force, self._force),
            ((Driver, Initial), self._prescribed), (Coupling, self._along_coordinates), (Controller, self._controller),
            (Sensor, self._sensor), (Event, self._event), (Contact, self._contact),
        )  # fmt: skip
        for cls, change in by_kind:
            if isinstance(e, cls):
                change(e, new)
        for name in e.local if not isinstance(e, Joint) else ():
            if new.get(name, getattr(e, name)) is not None:
                new[name] = self._local(name, new.get(name, getattr(e, name)))
        with paths_from(getattr(e, "_folder", None)):
            return dataclasses.replace(e, **{k: x for k, x in new.items() if x != getattr(e, k) or k == "name"})

    def _texts(self, e: Element, value: Any, kind: str) -> Any:
        if kind == "named formulas":
            return tuple((name, self.law(x, e)) for name, x in value)
        if isinstance(value, tuple):
            return tuple(self._texts(e, x, kind) for x in value)
        if kind == "formulas":
            return value if isinstance(e, (Force, Driver)) else self.law(value, e)
        return self.reference(value, e) if isinstance(value, str) else value

    def _local(self, name: str, value: Any) -> Any:
        local = self.place.local
        return local.orientation(value) if name in ("orientation", "inertia_axes") else local.points(value)

    def _value(self, e: Element, new: dict[str, Any], name: str) -> Any:
        return new.get(name, getattr(e, name))

    def _pose(self, e: Any, new: dict[str, Any]) -> None:
        """Transform position and orientation in the world."""
        new["position"] = self.place.points(self._value(e, new, "position"))
        if self.planar:
            new["angle"] = self.place.plane_angle(self._value(e, new, "angle"))
        else:
            new["orientation"] = self.place.orientation(self._value(e, new, "orientation"))

    def _body(self, e: Body, new: dict[str, Any]) -> None:
        self._pose(e, new)
        if (v := new["velocity"]) is not None:
            new["velocity"] = self.place.directions(v)
        if (w := new["angular_velocity"]) is not None:
            turned = isinstance(w, tuple)
            new["angular_velocity"] = self.place.directions(w, axial=True) if turned else scaled(self.place.sign, w)
        J = new["inertia"]
        if isinstance(J, tuple) and isinstance(J[0], tuple):
            s = np.diag(self.place.reflection).tolist()
            new["inertia"] = tuple(
                tuple(scaled(a * b, x) for b, x in zip(s, row, strict=True)) for a, row in zip(s, J, strict=True)
            )
        self._shapes(e, new)

    def _shapes(self, e: Any, new: dict[str, Any]) -> None:
        """Rename what shapes refer to, and reflect them."""
        made = []
        for shape in shape_tuple(e.shape):
            texts = {k: self._texts(e, getattr(shape, k), kind) for k, kind in _kinds(type(shape)).items()}
            shape = dataclasses.replace(shape, **{k: x for k, x in texts.items() if x != getattr(shape, k)})
            if self.place.mirror:
                try:
                    shape = shape.mirrored(self.place.mirror)
                except ModelError as error:
                    self.refuse(e, str(error))
            made.append(shape)
        new["shape"] = tuple(made) if isinstance(e.shape, tuple) else made[0] if made else None

    def _frame(self, e: Frame, new: dict[str, Any]) -> None:
        if isinstance(e, Road) and self.place.mirror and (e.surface is not None or self.place.mirror == "z"):
            self.refuse(e, "a road has no mirror image here; leave it out, and add it to the whole mechanism")
        if e.body != GROUND:
            new["position"] = self._local("position", new["position"])
            if self.planar:
                new["angle"] = scaled(self.place.sign, new["angle"])
            else:
                new["orientation"] = self._local("orientation", new["orientation"])
            return
        self._pose(e, new)
        if self.on != GROUND:
            new |= self._relative(new["position"], new.get("orientation"), new.get("angle", 0.0))

    def _relative(self, position: Any, orientation: Any, angle: Any) -> dict[str, Any]:
        """Return a pose in the world relative to the body on which the copy stands."""
        b = self.whole[self.on]
        R = rotation_of(b.orientation, b.angle if self.planar else 0.0, f"orientation of {b.title}")
        back = Placement(rotation=R.T)
        arm = tuple(total(x, scaled(-1.0, p)) for x, p in zip(position, b.position, strict=False))
        pose: dict[str, Any] = {"position": product(back.rotation, arm)}
        return pose | (
            {"angle": back.plane_angle(angle)} if self.planar else {"orientation": back.orientation(orientation)}
        )

    def _ground_frame(self) -> str:
        """Return the frame of the copy's ground, added when first needed."""
        name = self.named(GROUND)
        if name not in self.whole:
            origin = (0.0,) * (2 if self.planar else 3)
            new: dict[str, Any] = {"position": origin, "orientation": None, "angle": 0.0}
            self._frame(Frame(name, GROUND, position=origin), new)
            self.whole.add(Frame(name, self.on, **new))
        return name

    def _ground(self, e: Ground, new: dict[str, Any]) -> None:
        if self.on != GROUND:
            self.refuse(
                e, f"parts of ground cannot move with {self.on!r}; leave it out, or make it a Body with a Fixed joint"
            )
        self._pose(e, new)
        self._shapes(e, new)

    def _bodies(self, e: Bodies) -> Element:
        """Return the copy of a set of bodies, whose arrays are numbers."""
        new: dict[str, Any] = {
            k: self._texts(e, getattr(e, k), kind) for k, kind in _kinds(type(e)).items() if k not in ARRAYS
        }
        self._shapes(e, new)
        try:
            t = np.array([float(x) for x in self.place.translation])
        except ValueError:
            self.refuse(e, "its positions are numbers; give 'at' in numbers too")
        S, n = self.place.reflection, e.position.shape[-1]
        new["name"], new["position"] = self.named(e.name), (e.position @ self.place.polar[:n, :n].T) + t[:n]
        if e.velocity is not None:
            new["velocity"] = e.velocity @ self.place.polar[: e.velocity.shape[-1], : e.velocity.shape[-1]].T
        _, R, _, w = e.start(self.planar)
        if self.planar:
            new["angle"] = self.place.sign * np.arctan2(R[:, 1, 0], R[:, 0, 0]) + self.place.angle
            new["angular_velocity"] = None if e.angular_velocity is None else self.place.sign * w[:, 2]
        else:
            new["orientation"] = matrix_to_quaternion(self.place.polar @ R @ S)
            new["angular_velocity"] = None if e.angular_velocity is None else w @ self.place.axial.T
        return dataclasses.replace(e, **new)

    def _standing(self, e: Any, new: dict[str, Any]) -> None:
        """Attach what is given by frames, of which ground's is one, to the frame of the copy's ground."""
        for name in (
            ("body_i", "body_j", "bodies") if getattr(e, "at", "") is None and not isinstance(e, BodyForce) else ()
        ):
            given = getattr(e, name, ())
            if given == GROUND:
                new[name] = self._ground_frame()
            elif isinstance(given, tuple) and GROUND in given:
                new[name] = tuple(self._ground_frame() if x == GROUND else self.reference(x, e) for x in given)

    def _vectors(self, e: Any, new: dict[str, Any]) -> None:
        """Transform the points and directions in the world."""
        for name, unit in fields_with(type(e), Unit).items():
            value = self._value(e, new, name)
            if (
                name in (*e.local, *e.in_own_axes, *e.handed)
                or not isinstance(value, tuple)
                or unit.dimension not in ("m", "")
            ):
                continue
            if unit.dimension == "m":
                new[name] = self.place.points(value)
            else:
                new[name] = self.place.directions(value, axial=name in ("axis", "axes") and getattr(e, "axial", False))
        for name in e.handed if self.planar and self.place.mirror else ():
            if (given := self._value(e, new, name)) is not None:
                new[name] = tuple(scaled(-1.0, x) for x in given)
        own = not type(e).__module__.startswith("flyball.")
        if own and (self.place.mirror or self.place.turned) and not type(e).mirrors:
            self.refuse(e, f"{type(e).__name__} does not declare that its formulas allow it: mirrors = True")

    def _joint(self, e: Joint, new: dict[str, Any]) -> None:
        self._standing(e, new)
        self._vectors(e, new)
        moved = dataclasses.replace(e, **{k: x for k, x in new.items() if k not in e.local})
        f, m = self._joint_frames(e, moved)
        found = [joint_image(k, e, (f, m), self.planar, self._rest(e)) for k in e.measured(self.planar)]
        sign = {k: x.sign if x else 1.0 for k, x in zip(e.measured(self.planar), found, strict=True)}
        factors = e.reversed_factors(tuple(sign.get(k, 1.0) for k in e.coordinates))
        for name, factor in factors.items():
            new[name] = scaled(factor, self._value(e, new, name))
        for name in e.local:
            given = self._value(e, new, name)
            if given is not None:  # points, or the formulas of a point
                point = isinstance(given[0], str)
                new[name] = product(f, given) if point else tuple(product(f, p) for p in given)

    def _force(self, e: Force, new: dict[str, Any]) -> None:
        self._standing(e, new)
        if isinstance(e, CoordinateForce) and e.along():
            self._along_coordinates(e, new)
        else:
            self._laws(e, new, {}, {})
            self._vectors(e, new)
            for name, factor in e.reversing.items():
                coordinate = getattr(e, name)
                if coordinate is not None and self.image(coordinate, e).sign < 0.0:
                    new[factor] = scaled(-1.0, self._value(e, new, factor))
        if isinstance(e, TwoFrameForce) and e.on_bodies:
            self._tyre(e, new)
        if isinstance(e, BodyForce):
            self._components(e, new)
        elif getattr(e, "orientation", "") != "" and e.at is not None and isinstance(e, TwoFrameForce):  # type: ignore[attr-defined]
            if self.planar:
                new["angle"] = self.place.plane_angle(self._value(e, new, "angle"))
            else:
                new["orientation"] = self.place.orientation(self._value(e, new, "orientation"))

    def _tyre(self, e: Any, new: dict[str, Any]) -> None:
        """Keep ground as the road of the whole; change the side of a mirrored tyre."""
        if e.body_i == GROUND:
            new["body_i"] = GROUND
        if self.place.mirror == "y" and e.side is not None:
            new["side"] = "left" if e.side == "right" else "right"
        elif self.place.mirror == "y" and hasattr(e.model, "measured_right"):
            self.refuse(e, f"{e.model.title} was measured on one side; give side='left' or 'right', which is mirrored")

    def _components(self, e: BodyForce, new: dict[str, Any]) -> None:
        """Transform forces and torques given by components."""
        place = self.place.local if getattr(e, "axes", "world") == "body" else self.place
        for name in ("force", "torque"):
            given = new.get(name)
            if given is None:
                continue
            if not isinstance(given, tuple):
                new[name] = self.law(getattr(e, name), e, place.sign)
                continue
            if any(callable(x) for x in given) and (place.turned or place.mirror):
                self.refuse(e, f"its {name} has components that are Python functions; write expressions")
            new[name] = place.directions(given, axial=name == "torque")

    def _laws(self, e: Any, new: dict[str, Any], signs: Mapping[str, float], inputs: Mapping[str, str]) -> None:
        """Rename the laws of a force; ``signs``: factors of its fields, ``inputs``: formulas of the laws' inputs."""
        kind: Any = type(e)
        for name in [k for k, what in _kinds(kind).items() if what == "formulas"]:
            value = getattr(e, name)
            of = fields_with(type(e), LawOf).get(name)
            known = {k: inputs.get(k, k) for k in of.inputs} if of else {}
            if isinstance(value, tuple):
                new[name] = tuple(self._law_or_points(x, e, known) for x in value)
            elif value is not None:
                new[name] = self.law(value, e, signs.get(name, 1.0), known)

    def _law_or_points(self, value: Any, e: Any, inputs: Mapping[str, str]) -> Any:
        if isinstance(value, tuple):
            return tuple(self._law_or_points(x, e, inputs) for x in value)
        return self.law(value, e, 1.0, inputs)

    def _along_coordinates(self, e: Any, new: dict[str, Any]) -> None:
        """Reverse what acts along coordinates that are reversed."""
        if isinstance(e, Coupling) and "law" in new:  # it names the images of its coordinates
            return
        images = [self.image(text, e) for text in self._along(e)]
        signs = tuple(x.sign for x in images)
        factors = e.reversed_factors(signs) if min(signs, default=1.0) < 0.0 else {}
        shift = self._shift(e, images, bool(factors))
        single = {k: x for k, x in factors.items() if not isinstance(x, tuple)}
        inward = signs[0] if factors and not isinstance(e, WeightedSumForce) else 1.0
        own = list(getattr(e, "outputs", ()))[:2]
        inputs = [Image(k, inward, x).original() for k, x in zip(own, (shift, 0.0), strict=False)]
        self._laws(e, new, single, dict(zip(own, inputs, strict=True)))
        for name in SHIFTED if shift != 0.0 else ():
            if (given := new.get(name)) is not None and name in fields_with(type(e), Unit):
                new[name] = total(given, shift)
        for name, factor in factors.items():
            if isinstance(factor, tuple):
                given = self._value(e, new, name)
                new[name] = factor if given is None else tuple(scaled(a, x) for a, x in zip(factor, given, strict=True))
        if factors and isinstance(e, WeightedSumForce) and isinstance(e.coordinate, str):
            new["coordinate"] = (new["coordinate"],)

    def _shift(self, e: Any, images: list[Image], reversed_: bool) -> Any:
        """Return what is added to the quantity along which it acts, which is measured from another origin there."""
        moved = [x for x in images if x.shift != 0.0]
        if not moved or getattr(e, "value", "") is None or getattr(e, "middle", "") is None:
            return 0.0
        if len(images) > 1 or getattr(e, "weights", None) is not None:
            self.refuse(e, f"{moved[0].name!r} is measured from the world's origin, and is one of a sum; use a joint's")
        weighted = reversed_ and isinstance(e, WeightedSumForce)
        return scaled(moved[0].sign if weighted else 1.0, moved[0].shift)

    def _prescribed(self, e: Any, new: dict[str, Any]) -> None:
        image = self.image(self._along(e)[0], e)
        if isinstance(e, Driver):
            new["law"] = e.law if callable(e.law) else image.of_value(self.law(e.law, e))
            return
        if new["value"] is not None:
            new["value"] = image.of_value(new["value"])
        if new["rate"] is not None:
            new["rate"] = scaled(image.sign, new["rate"])

    def _sensor(self, e: Sensor, new: dict[str, Any]) -> None:
        if curve_parts(e.of)[0] == ENERGY:
            self.refuse(e, "energies are those of the whole mechanism; measure them there")
        found = self._image(e.of)
        new["of"] = self.named(e.of) if found is None else found.name

    def _controller(self, e: Any, new: dict[str, Any]) -> None:
        if not hasattr(e, "coordinates"):
            return
        if any(not self.image(text, e).same for text in e.coordinates):
            self.refuse(e, "one of its coordinates is reversed; reverse the joint's axis, or name its frames")
        if e.base is None and self.on != GROUND:
            new["base"] = self.on

    def _contact(self, e: Contact, new: dict[str, Any]) -> None:
        if e.between is None:
            every: tuple[Any, ...] = (*self.part.bodies, *self.part.bulk, *self.part.ground)
            new["between"] = tuple(self.named(x.name) for x in every if x.shapes())

    def _event(self, e: Event, new: dict[str, Any]) -> None:
        if isinstance(e.when, str) and not e.at_start:
            sides = comparison_sides(e.when, e)
            new["when"] = self.formula(e.when) if sides is None else " < ".join(self.formula(x) for x in sides)
        elif e.at_start:
            new["when"] = e.when
        new["do"] = tuple(self._action(e, a) for a in e.do)

    def _action(self, e: Event, a: Action) -> Action:
        new = {k: self._texts(e, getattr(a, k), kind) for k, kind in _kinds(type(a)).items()}
        if isinstance(a, Set):
            new["parameter"] = self.named(a.parameter)
        if isinstance(a, Impulse):
            along = not isinstance(self.part.find(a.on), (Body, Frame))
            if along and "." not in a.on:
                a = dataclasses.replace(a, on=f"{a.on}.{next(iter(self.part[a.on].measured(self.planar)))}")
                new["on"] = self.reference(a.on, e)
            sign = self.image(a.on, e).sign if along else 1.0
            place = self.place.local if a.axes == "body" else self.place
            for name, axial in (("impulse", False), ("torque", True)):
                x = new[name]
                if x is not None:
                    new[name] = (
                        place.directions(x, axial) if isinstance(x, tuple) else scaled(sign if along else place.sign, x)
                    )
            if a.at is not None:
                new["at"] = self.place.points(new["at"])
        return dataclasses.replace(a, **new)
