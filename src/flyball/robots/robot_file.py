"""What readers and writers of robot files share: XML that knows its lines, names, stops, motors, omissions."""

from __future__ import annotations

import math
import os
import re
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NoReturn
from xml.parsers import expat

import numpy as np

from ..errors import ModelError
from ..forces.coordinate_spring import CoordinateSpring
from ..forces.limit import Limit
from ..forces.motor import Actuator, Motor
from ..forces.path_spring import PathSpring
from ..forces.spring_damper import SpringDamper
from ..model.body import Initial
from ..model.element import Element, resolve
from ..model.model import Model
from ..model.shapes.box import Box
from ..model.shapes.cylinder import Cylinder
from ..model.shapes.mesh import MESH_FORMATS, Mesh
from ..model.shapes.solid import Solid
from ..model.shapes.sphere import Sphere

ONCE = {"inertial", "origin", "mass", "inertia", "geometry", "parent", "child", "axis", "limit", "dynamics", "mimic"}
"""Tags of which a link, a joint, or a tag in them has one."""
ROUNDING = 1e-9
"""Of numbers in files, relative to the largest of their kind."""
UNLIMITED = 1e9
"""Written where a format demands a bound and the mechanism has none [SI units]; read as no bound."""
NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
CONTROL = re.compile(
    rf"(?:(?P<gear>{NUMBER})\*(?P<open>\())?(?:(?P<gain>{NUMBER})\*)?(?P<control>[A-Za-z_]\w*)(?(open)\))"
)
"""Laws of actuators that have a counterpart: a parameter, or gear*(gain*parameter), as the reader writes them."""
REASONS = {
    **dict.fromkeys(("materials", "material_pairs", "contacts", "bulk"), "contact is not written"),
    **dict.fromkeys(("tables", "controllers"), "the file has no laws"),
    "sensors": "the file describes the motion only",
    "events": "the file has no events",
    "drivers": "the format prescribes no motion",
    "initial": "the file starts at the reference configuration",
}
"""Why elements of a category are not written."""


class _Element(ET.Element):
    """An element of XML that knows its line."""

    line = 0


class RobotFile:
    """One file being read."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.robot = self._parsed()
        self.missing: list[str] = []  # shapes that cannot be drawn, and why

    def fail(self, tag: ET.Element | None, what: str) -> NoReturn:
        """Raise an error that names the file and the line."""
        where = f", line {line_of(tag)}" if tag is not None else ""
        raise ModelError(f"{self.path}{where}: {what}")

    def _parsed(self) -> ET.Element:
        try:
            data = self.path.read_bytes()
        except OSError as error:
            raise ModelError(f"{self.path} cannot be read: {error.strerror}") from None
        builder, parser = ET.TreeBuilder(element_factory=_Element), expat.ParserCreate()

        def start(tag: str, attributes: dict[str, str]) -> None:
            builder.start(tag, attributes).line = parser.CurrentLineNumber  # type: ignore[attr-defined]

        parser.StartElementHandler, parser.EndElementHandler = start, builder.end
        parser.CharacterDataHandler = builder.data
        try:
            parser.Parse(data, True)
        except (expat.ExpatError, LookupError) as error:  # the latter of an unknown encoding
            raise ModelError(f"{self.path} is no XML: {error}") from None
        root = builder.close()
        if root.tag != "robot":
            self.fail(root, f"<{root.tag}> is not URDF, whose first tag is <robot>")
        macro = next((x for x in root.iter() if str(x.tag).startswith("xacro:")), None)
        if macro is not None:
            self.fail(macro, f"<{macro.tag}> is a macro; expand the file first: xacro robot.urdf.xacro > robot.urdf")
        for part in (*root.findall("link"), *root.findall("joint")):
            for x in part.iter():
                twice = [y for k, y in enumerate(x) if y.tag in ONCE and y.tag in {z.tag for z in x[:k]}]
                if twice:
                    self.fail(
                        twice[0], f"<{x.tag}> of {part.get('name')!r} has a second <{twice[0].tag}>; leave one out"
                    )
        return root

    def _named(self, tag: str) -> dict[str, ET.Element]:
        found: dict[str, ET.Element] = {}
        for x in self.robot.findall(tag):
            name = self.attribute(x, "name")
            if not name.strip():
                self.fail(x, f"a {tag} has an empty name")
            if name in found:
                self.fail(x, f"there are two {tag}s {name!r}")
            found[name] = x
        return found

    def attribute(self, tag: ET.Element, name: str) -> str:
        """An attribute that must be there."""
        if name not in tag.attrib:
            self.fail(tag, f"<{tag.tag}> needs the attribute {name!r}")
        return tag.attrib[name]

    def numbers(self, tag: ET.Element | None, name: str, default: str | None, n: int = 3) -> np.ndarray:
        """Numbers of an attribute; without a default it must be there."""
        text = default
        if tag is not None and (default is None or name in tag.attrib):
            text = self.attribute(tag, name)
        assert text is not None
        try:
            out = np.array([float(x) for x in text.split()])
        except ValueError:
            out = np.zeros(0)
        if "_" in text or len(out) != n or not np.isfinite(out).all():
            needed = "a finite number is" if n == 1 else f"{n} finite numbers are"
            self.fail(tag, f"{name}={text!r} of <{getattr(tag, 'tag', '')}>: {needed} needed")
        return out

    def number(self, tag: ET.Element | None, name: str, default: str | None = None) -> float:
        """The number of an attribute."""
        return float(self.numbers(tag, name, default, 1)[0])

    def child(self, tag: ET.Element, name: str) -> ET.Element:
        """A tag in another that must be there."""
        found = tag.find(name)
        if found is None:
            self.fail(tag, f"<{tag.tag}> {tag.get('name', '')!r} needs <{name}>")
        return found

    def origin(self, tag: ET.Element) -> np.ndarray:
        """Pose of an <origin>, (4, 4): roll, pitch and yaw are rotations about fixed axes x, y, z."""
        place = tag.find("origin")
        out = np.eye(4)
        out[:3, 3] = self.numbers(place, "xyz", "0 0 0")
        (r, p, y) = self.numbers(place, "rpy", "0 0 0")
        cr, sr, cp, sp, cy, sy = math.cos(r), math.sin(r), math.cos(p), math.sin(p), math.cos(y), math.sin(y)
        out[:3, :3] = [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
        return out

    def shapes(self, link: ET.Element) -> list[Solid]:
        """Visible shapes of a link, those for collision where there are no others that can be read."""
        found = list(self._solids(link.findall("visual")))
        return found or list(self._solids(link.findall("collision")))

    def _solids(self, tags: list[ET.Element]) -> Iterator[Solid]:
        for tag in tags:
            T = self.origin(tag)
            geometry = self.child(tag, "geometry")
            given: dict[str, Any] = {"position": tuple(T[:3, 3]), "orientation": rows(T[:3, :3]), "looks": True}
            if not len(geometry):
                self.missing.append(f"<geometry> in line {line_of(geometry)}: it is empty")
            for x in geometry:
                try:
                    if (solid := self._solid(x, given)) is not None:
                        solid.check(resolve(solid, {}))
                        yield solid
                except ModelError as error:
                    self.missing.append(f"<{x.tag}> in line {line_of(x)}: {error}")

    def _solid(self, x: ET.Element, given: dict[str, Any]) -> Solid | None:
        if x.tag == "box":
            return Box(edges=tuple(self.numbers(x, "size", None)), **given)
        if x.tag == "sphere":
            return Sphere(radius=self.number(x, "radius"), **given)
        if x.tag == "cylinder":
            return Cylinder(radius=self.number(x, "radius"), length=self.number(x, "length"), **given)
        if x.tag != "mesh":
            return None
        file = self._mesh_file(x)
        scale = self.numbers(x, "scale", "1 1 1")
        if np.ptp(scale) == 0.0 and scale[0] > 0.0:
            return Mesh(path=str(file), scale=float(scale[0]), **given)
        if not scale.all():
            raise ModelError(f"it is scaled by {' '.join(f'{k:g}' for k in scale)}, which leaves no solid")
        surface = Mesh(path=str(file)).triangulation
        faces = surface.f if scale.prod() > 0.0 else surface.f[:, ::-1]  # a mirror image turns triangles inside out
        return Mesh(vertices=surface.v * scale, faces=faces, **given)

    def _mesh_file(self, tag: ET.Element) -> Path:
        """The file of a mesh: ``package://name/path`` is looked for in the folders above the model."""
        text = self.attribute(tag, "filename")
        inside = re.sub(r"^(package|model|file)://", "", text)
        folders = [self.path.parent, *self.path.absolute().parents]
        tries = [folder / part for folder in folders for part in (inside, inside.partition("/")[2])]
        found = next((x for x in tries if os.path.isfile(x)), None)  # False, too, for a name that is too long
        if found is None:
            raise ModelError(f"there is no file {text}")
        if found.suffix.lower() not in MESH_FORMATS:
            raise ModelError(f"{text} is not of a kind that can be read: {', '.join(MESH_FORMATS)}")
        return found

    def color(self, link: ET.Element, shapes: Sequence[Solid]) -> str | None:
        """Colour of the first visible shape, also by the name of a material of the robot; else that of its mesh."""
        material = link.find("visual/material")
        if material is None:
            return next((x.triangulation.color or None for x in shapes[:1] if isinstance(x, Mesh) and x.path), None)
        color = material.find("color")
        if color is None:
            same = [x for x in self.robot.findall("material") if x.get("name") == material.get("name")]
            color = same[0].find("color") if same else None
        if color is None:
            return None
        rgba = np.clip(self.numbers(color, "rgba", None, 4), 0.0, 1.0)
        return "#" + "".join(f"{round(255 * x):02x}" for x in rgba[:3])


def line_of(tag: ET.Element) -> int:
    """Line of the file in which a tag begins."""
    return getattr(tag, "line", 0)


def rows(R: np.ndarray) -> tuple[tuple[float, ...], ...]:
    """A matrix as tuples of its rows."""
    return tuple(tuple(row) for row in R.tolist())


class Names:
    """Names of one file or mechanism, each of which is given once."""

    def __init__(self, given: Iterable[str]) -> None:
        self.given = set(given)

    def new(self, wanted: str) -> str:
        """Return the name, with underscores added if it has been given before."""
        while wanted in self.given:
            wanted += "_"
        self.given.add(wanted)
        return wanted

    def new_identifier(self, wanted: str) -> str:
        """Return the same, with other characters where Python permits none."""
        plain = re.sub(r"\W", "_", wanted)
        return self.new(plain if plain.isidentifier() else f"_{plain}")


def numbers_text(x: Any) -> str:
    """Return numbers as an attribute, from which they are read to the last bit."""
    return " ".join(repr(float(y)) for y in x)


def stops(name: Callable[[], str], lower: float, upper: float, **along: Any) -> Iterator[Limit]:
    """Yield the stops between two bounds, without those that are `UNLIMITED`; nothing if both are."""
    bounds: dict[str, Any] = {k: x for k, x in (("lower", lower), ("upper", upper)) if abs(x) < UNLIMITED}
    if bounds:
        yield Limit(name(), **along, **bounds)


def initial_in_range(along: str, lower: float, upper: float, drawn: float) -> Iterator[Initial]:
    """Yield an initial value in the middle of a range, or at its only bound, if the drawn one is not permitted."""
    if not lower <= drawn <= upper:
        bounds = [x for x in (lower, upper) if abs(x) < UNLIMITED]
        yield Initial(along, value=sum(bounds) / len(bounds))


def omitted_elements(model: Model, written: set[str], reasons: Mapping[str, str]) -> list[str]:
    """Return title and reason of each element that was not written."""
    rest = [e for e in model.elements() if e.name not in written]
    return [f"{e.title} ({reasons.get(e.name) or REASONS[e.category]})" for e in rest]


def control_of(model: Model, e: Element) -> tuple[float, str] | None:
    """Return factor and parameter of an element that is a motor; None of any other."""
    if not isinstance(e, Actuator | Motor | CoordinateSpring | SpringDamper | PathSpring):
        return None
    law = e.laws()[0]
    found = CONTROL.fullmatch(law.replace(" ", "")) if isinstance(law, str) else None
    only = getattr(e, "stiffness", 0.0) == 0.0 == getattr(e, "damping", 0.0)
    if found is None or not only or found["control"] not in model.parameters:
        return None
    return float(found["gear"] or 1.0) * float(found["gain"] or 1.0), found["control"]


def shared_controls(motors: Iterable[tuple[Element, str]]) -> list[str]:
    """Return what is lost of parameters that drive several motors, for a file has one control for each motor."""
    titles: dict[str, list[str]] = {}
    for e, parameter in motors:
        titles.setdefault(parameter, []).append(e.title)
    return [f"the one parameter {k!r} of {' and '.join(v)}" for k, v in titles.items() if len(v) > 1]


def coupling_numbers(c: Any, n: Any, factors: Any, drawn: Any) -> tuple[np.ndarray, float]:
    """Return f and c_0 of a coupling sum_k f_k (q_k - drawn_k) = c_0, with f_1 = 1."""
    f, total = np.array(factors, float) / float(factors[0]), c.total(n)
    return f, 0.0 if total is None else float(total) / float(c.first_weight(n)) - float(f @ np.asarray(drawn))
