"""Reading of robots in URDF, the XML format of ROS: links become bodies, joints become joints with their limits.

A link is a body whose reference frame is the link's frame; the drawn configuration is that of zero joint values, with
the root link's frame at the world's origin. A link without mass and inertia that is rigidly connected to another is a
`Frame`. Every tag and attribute that is not used is listed in a `ModelWarning`.
"""

from __future__ import annotations

import math
import re
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from ..errors import ModelError, ModelWarning, warn_user
from ..forces.clutch import Brake
from ..forces.coordinate_spring import CoordinateSpring
from ..forces.motor import Actuator
from ..joints.coupler import Coupler
from ..joints.fixed import Fixed
from ..joints.planar import Planar
from ..joints.prismatic import Prismatic
from ..joints.revolute import Revolute
from ..model.body import GROUND, Body, Frame, Ground
from ..model.element import Element
from ..model.geometry import quaternion_to_matrix
from ..model.model import Model
from .robot_file import ROUNDING, UNLIMITED, Names, RobotFile, initial_in_range, line_of, rows, stops

T = TypeVar("T", bound=Model)

STANDARD_GRAVITY = 9.80665
"""Of a robot that is read, along -z [m/s^2]: URDF has none."""
MAX_LISTED = 3  # of lines or files in a warning

COORDINATES = {"revolute": "angle", "continuous": "angle", "prismatic": "displacement"}
"""Coordinate of each type of joint that has one."""
JOINT_TYPES = (*COORDINATES, "fixed", "floating", "planar")
UNDERSTOOD = {
    "robot": {"name", "link", "joint", "transmission", "material", "version"},
    "link": {"name", "inertial", "visual", "collision"},
    "inertial": {"origin", "mass", "inertia"},
    "mass": {"value"},
    "inertia": {"ixx", "ixy", "ixz", "iyy", "iyz", "izz"},
    "origin": {"xyz", "rpy"},
    "visual": {"name", "origin", "geometry", "material"},
    "collision": {"name", "origin", "geometry"},
    "geometry": {"box", "cylinder", "sphere", "mesh"},
    "box": {"size"},
    "cylinder": {"radius", "length"},
    "sphere": {"radius"},
    "mesh": {"filename", "scale"},
    "material": {"name", "color", "texture"},
    "color": {"rgba"},
    "joint": {"name", "type", "origin", "parent", "child", "axis", "limit", "dynamics", "mimic"},
    "parent": {"link"},
    "child": {"link"},
    "axis": {"xyz"},
    "limit": {"lower", "upper"},
    "dynamics": {"damping", "friction"},
    "mimic": {"joint", "multiplier", "offset"},
}
"""Tags, with the attributes and tags in them that are used."""
IN_TRANSMISSIONS = {"transmission", "type", "joint", "actuator", "mechanicalReduction", "offset"}
"""Tags of a transmission that are used; the offset moves the actuator's zero only, and no force depends on it."""
SIMPLE = "SimpleTransmission"


@dataclass
class _Joint:
    """A joint as it is written."""

    name: str
    kind: str
    parent: str
    child: str
    origin: np.ndarray
    axis: np.ndarray
    tag: ET.Element


def load_urdf(path: Path, make: Callable[..., T], floating: bool = False) -> T:
    """Read a robot from a URDF file.

    Parameters
    ----------
    path : Path
    make : callable
        The class of the mechanism.
    floating : bool
        Whether the root link is a free body; by default it is fixed to ground.

    Returns
    -------
    Mechanism
        With standard gravity along -z.

    Raises
    ------
    ModelError
        Naming file, line and element, if the file is no URDF, is incomplete, or its joints form no tree.
    """
    return _Reader(path).mechanism(make, floating)


class _Reader(RobotFile):
    """One file being read."""

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self.links = self._named("link")
        self.joints = [self._joint(tag) for tag in self._named("joint").values()]
        self._fix_at_equal_limits()
        self.names = Names({GROUND})
        self.joint_names: dict[str, str] = {}  # here, by those in the file
        self.unused: dict[str, list[int]] = {}
        self.raised: list[str] = []
        self.renamed: list[str] = []

    def _joint(self, tag: ET.Element) -> _Joint:
        name, kind = self.attribute(tag, "name"), self.attribute(tag, "type")
        if kind not in JOINT_TYPES:
            self.fail(tag, f"joint {name!r} has the unknown type {kind!r}; URDF has {', '.join(JOINT_TYPES)}")
        ends = [self.attribute(self.child(tag, role), "link") for role in ("parent", "child")]
        for end in ends:
            if end not in self.links:
                self.fail(tag, f"joint {name!r} connects the link {end!r}, which does not exist")
        axis = self.numbers(tag.find("axis"), "xyz", "1 0 0")
        if kind not in ("fixed", "floating") and not axis.any():
            self.fail(tag, f"the axis of joint {name!r} is zero")
        axis = axis / (np.abs(axis).max() or 1.0)  # its square must be finite
        return _Joint(name, kind, ends[0], ends[1], self.origin(tag), axis / (np.linalg.norm(axis) or 1.0), tag)

    def _fix_at_equal_limits(self) -> None:
        """Joints whose limits are equal do not move: they are fixed at that value."""
        for j in self.joints:
            limit = j.tag.find("limit")
            if j.kind in ("revolute", "prismatic") and limit is not None:
                value = self.number(limit, "lower", "0")
                if value == self.number(limit, "upper", "0"):
                    shift = np.eye(4)
                    if j.kind == "revolute":
                        shift[:3, :3] = quaternion_to_matrix(
                            np.array([math.cos(value / 2), *(math.sin(value / 2) * j.axis)])
                        )
                    else:
                        shift[:3, 3] = value * j.axis
                    j.origin, j.kind = j.origin @ shift, "fixed"

    def root(self) -> str:
        """The link that is no child; refuse joints that form no tree."""
        above: dict[str, _Joint] = {}
        for j in self.joints:
            if j.child in above:
                self.fail(j.tag, f"link {j.child!r} is the child of two joints, {above[j.child].name!r} and {j.name!r}")
            above[j.child] = j
        roots = [name for name in self.links if name not in above]
        if len(roots) > 1:
            found = ", ".join(map(repr, roots))
            self.fail(self.links[roots[1]], f"a robot has one link without parent; this one has {found}")
        for j in self.joints:
            met, link = set(), j.child
            while link in above:
                if link in met:
                    self.fail(above[link].tag, f"the joints above link {link!r} form a cycle")
                met.add(link)
                link = above[link].parent
        if not roots:
            self.fail(self.robot, "there is no link")
        return roots[0]

    def mechanism(self, make: Callable[..., T], floating: bool) -> T:
        """The mechanism."""
        root = self.root()
        m = make(self.robot.get("name") or self.path.stem, gravity=(0, 0, -STANDARD_GRAVITY))
        below: dict[str, list[_Joint]] = {name: [] for name in self.links}
        for j in self.joints:
            below[j.parent].append(j)
        self.place: dict[str, np.ndarray] = {root: np.eye(4)}
        self.carrier: dict[str, str] = {}
        moving: list[Element] = []
        self._add_link(m, root, None if floating else GROUND, below)
        if not floating and self.carrier[root] != GROUND:
            m.add(Fixed(self.name(f"{root}_on_ground"), GROUND, self.carrier[root], at=(0, 0, 0)))
        waiting = below[root][::-1]
        while waiting:
            j = waiting.pop()
            self.place[j.child] = self.place[j.parent] @ j.origin
            self._add_link(m, j.child, self.carrier[j.parent] if j.kind == "fixed" else None, below)
            if self.carrier[j.child] != self.carrier[j.parent] and j.kind != "floating":
                m.add(*self._connection(j))
                moving += self._limits_and_losses(j)
            waiting += below[j.child][::-1]
        m.add(*moving, *self._mimics())
        parameters: dict[str, float] = {}
        motors = list(self._motors(parameters))
        m.parameters.update(parameters)
        m.add(*motors)
        self._report()
        return m

    def name(self, wanted: str) -> str:
        """A name that flyball permits and that is not taken."""
        plain = self.names.new_identifier(wanted)
        if plain != wanted:
            self.renamed.append(f"{wanted} is {plain}")
        return plain

    def _add_link(self, m: Model, link: str, rigid: str | None, below: dict[str, list[_Joint]]) -> None:
        """Add a link as a body, or as a frame on ``rigid`` where it is rigidly connected and has no mass."""
        tag, T = self.links[link], self.place[link]
        inertial = tag.find("inertial")
        shapes = tuple(self.shapes(tag))
        name = self.name(link)
        mass = self._mass(link)
        if mass < 0.0:
            self.fail(inertial, f"the mass of link {link!r} is negative: {mass:g}")
        pose: dict[str, Any] = {"position": tuple(T[:3, 3]), "orientation": rows(T[:3, :3])}
        if rigid == GROUND and (mass == 0.0 or link == self.root()):
            m.add(Frame(name, GROUND, **pose))
            if shapes:
                m.add(Ground(self.name(f"{link}_shape"), shape=shapes, **pose, color=self.color(tag, shapes)))
            self.carrier[link] = GROUND
            return
        if mass == 0.0 and rigid is not None and not shapes:
            carrier = next(x for x in self.place if self.carrier.get(x) == rigid)  # the first link of that body
            back = np.linalg.inv(self.place[carrier]) @ T
            place: dict[str, Any] = {"position": tuple(back[:3, 3]), "orientation": rows(back[:3, :3])}
            m.add(Frame(name, rigid, **place))
            self.carrier[link] = rigid
            if inertial is not None and inertial.find("inertia") is not None:
                self.unused.setdefault("inertia of a link without mass", []).append(line_of(inertial))
            return
        if mass == 0.0 and rigid is None and not self._carries_mass(link, below):
            self.fail(tag, f"link {link!r} moves, and neither it nor a link beyond it has mass; give it <inertial>")
        given: dict[str, Any] = {"mass": mass, "inertia": 0.0}
        if inertial is not None and mass > 0.0:
            J, own = self.child(inertial, "inertia"), self.origin(inertial)
            xx, xy, xz, yy, yz, zz = (self.number(J, k) for k in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"))
            tensor = self._physical(link, np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))
            given = {"mass": mass, "com": tuple(own[:3, 3]), "inertia": tensor, "inertia_axes": rows(own[:3, :3])}
        try:
            m.add(Body(name, **given, **pose, shape=shapes or None, color=self.color(tag, shapes)))
        except ModelError as error:
            self.fail(inertial if inertial is not None else tag, str(error))
        self.carrier[link] = name

    def _mass(self, link: str) -> float:
        inertial = self.links[link].find("inertial")
        return 0.0 if inertial is None else self.number(self.child(inertial, "mass"), "value")

    def _physical(self, link: str, tensor: np.ndarray) -> tuple[tuple[float, ...], ...]:
        """Inertia of a link; if no body has it, its smaller principal moments are raised, with a warning."""
        moments, axes = np.linalg.eigh(tensor)
        raised = np.maximum(moments, 0.0)
        raised[:2] += 0.5 * max(raised[2] - raised[0] - raised[1], 0.0)
        if np.abs(raised - moments).max() <= ROUNDING * abs(moments[2]):
            return rows(tensor)
        before, after = (", ".join(f"{x:.3g}" for x in y) for y in (moments, raised))
        self.raised.append(f"{link} ({before} becomes {after} kg m^2)")
        return rows(axes @ np.diag(raised) @ axes.T)

    def _carries_mass(self, link: str, below: dict[str, list[_Joint]]) -> bool:
        """Whether a link beyond this one has mass."""
        beyond = [j.child for j in below[link]]
        while beyond:
            name = beyond.pop()
            if self._mass(name) > 0.0:
                return True
            beyond += [j.child for j in below[name]]
        return False

    def _connection(self, j: _Joint) -> Iterator[Element]:
        T = self.place[j.child]
        ends = self.carrier[j.parent], self.carrier[j.child]
        at, axis = tuple(T[:3, 3]), tuple(T[:3, :3] @ j.axis)
        name = self.name(j.name)
        self.joint_names[j.name] = name
        if j.kind == "fixed":
            yield Fixed(name, *ends, at=at)
        elif j.kind == "planar":
            yield Planar(name, *ends, at=at, axis=axis)
        elif COORDINATES[j.kind] == "angle":
            yield Revolute(name, *ends, at=at, axis=axis)
        else:
            yield Prismatic(name, *ends, at=at, axis=axis)

    def _limits_and_losses(self, j: _Joint) -> Iterator[Element]:
        """Stops, damping and friction of a joint, and an initial value if zero is not permitted."""
        if j.kind not in COORDINATES:
            if j.kind == "planar" and (j.tag.find("limit") is not None or j.tag.find("dynamics") is not None):
                self.unused.setdefault("limit and dynamics of a planar joint", []).append(line_of(j.tag))
            return
        name = self.joint_names[j.name]
        along = f"{name}.{COORDINATES[j.kind]}"
        limit, losses = j.tag.find("limit"), j.tag.find("dynamics")
        if j.kind == "continuous" and limit is not None and {"lower", "upper"} & set(limit.attrib):
            self.unused.setdefault("limit of a continuous joint", []).append(line_of(limit))
        if j.kind != "continuous":
            if limit is None:
                self.fail(j.tag, f"joint {j.name!r} of type {j.kind} needs <limit>")
            lower, upper = self.number(limit, "lower", "0"), self.number(limit, "upper", "0")
            if lower > upper:
                self.fail(limit, f"the limits of joint {j.name!r} are reversed: {lower:g} to {upper:g}")
            yield from stops(lambda: self.name(f"{name}_limit"), lower, upper, coordinate=along)
            yield from initial_in_range(along, lower, upper, 0.0)
        damping, friction = (self.number(losses, x, "0") for x in ("damping", "friction"))
        for value, what in ((damping, "damping"), (friction, "friction")):
            if value < 0.0:
                self.fail(losses, f"the {what} of joint {j.name!r} is negative: {value:g}")
        if damping:
            yield CoordinateSpring(self.name(f"{name}_damping"), along, damping=damping)
        if friction:
            yield Brake(self.name(f"{name}_friction"), along, capacity=friction)

    def _mimics(self) -> Iterator[Element]:
        """Couplings of joints that follow others: value = multiplier * value of the other + offset."""
        kinds = {j.name: j.kind for j in self.joints}
        for j in self.joints:
            tag = j.tag.find("mimic")
            if tag is None:
                continue
            if j.kind == "fixed":
                self.unused.setdefault("mimic of a fixed joint", []).append(line_of(tag))
                continue
            other = self.attribute(tag, "joint")
            if other not in kinds:
                self.fail(tag, f"joint {j.name!r} follows {other!r}, which does not exist")
            if kinds[other] not in COORDINATES or j.kind not in COORDINATES:
                self.fail(tag, f"joint {j.name!r} cannot follow {other!r}: both must be joints with one coordinate")
            factor, offset = self.number(tag, "multiplier", "1"), self.number(tag, "offset", "0")
            if factor == 0.0:
                self.fail(tag, f"the multiplier of joint {j.name!r} is 0, so that it follows nothing; make it fixed")
            self._refuse_circles(j)
            ends = [f"{self.joint_names[k]}.{COORDINATES[kinds[k]]}" for k in (j.name, other)]
            yield Coupler(
                self.name(f"{self.joint_names[j.name]}_mimic"), tuple(ends), weights=(1.0, -factor), value=offset
            )

    def _refuse_circles(self, j: _Joint) -> None:
        """Refuse a joint that follows itself, through others perhaps."""
        leader = {x.name: x.tag.find("mimic") for x in self.joints}
        name = j.name
        for _ in self.joints:
            tag = leader.get(name)
            if tag is None:
                return
            name = tag.get("joint", "")
            if name == j.name:
                self.fail(j.tag, f"joint {j.name!r} follows itself")

    def _motors(self, parameters: dict[str, float]) -> Iterator[Element]:
        """Actuators of simple transmissions: reduction times control, with the control as a parameter."""
        kinds = {j.name: j.kind for j in self.joints}
        driven: dict[str, str] = {}
        for tag in self.robot.findall("transmission"):
            kind = (tag.get("type") or tag.findtext("type") or "").strip().rpartition("/")[2]
            if kind != SIMPLE:
                why = f"transmission of type {kind or 'unknown'}, which is not {SIMPLE}"
                self.unused.setdefault(why, []).append(line_of(tag))
                continue
            name = self.attribute(tag, "name")
            joint, actuator = self._only(tag, "joint"), self._only(tag, "actuator")
            moved = self.attribute(joint, "name")
            if moved not in kinds:
                self.fail(joint, f"transmission {name!r} drives the joint {moved!r}, which does not exist")
            if moved in driven:
                self.fail(
                    joint, f"transmissions {driven[moved]!r} and {name!r} drive one joint, {moved!r}; leave one out"
                )
            driven[moved] = name
            reduction = self._reduction(tag)
            if kinds[moved] not in COORDINATES:
                why = f"transmission of a {kinds[moved]} joint"
                self.unused.setdefault(why, []).append(line_of(tag))
                continue
            given = self.attribute(actuator, "name")
            called, control = self.name(given), self.name(re.sub(r"\W", "_", f"control_{given}"))
            parameters[control] = 0.0
            along = f"{self.joint_names[moved]}.{COORDINATES[kinds[moved]]}"
            yield Actuator(called, along, force=f"{reduction!r}*{control}")

    def _only(self, transmission: ET.Element, role: str) -> ET.Element:
        """The one joint or actuator of a simple transmission."""
        found = transmission.findall(role)
        if len(found) != 1:
            name = transmission.get("name")
            self.fail(transmission, f"transmission {name!r} has {len(found)} <{role}>; a {SIMPLE} has one")
        return found[0]

    def _reduction(self, transmission: ET.Element) -> float:
        """Speed of the actuator relative to that of the joint; 1 if not given."""
        found = [x for x in transmission.iter("mechanicalReduction")]
        if not found:
            return 1.0
        text = (found[0].text or "").strip()
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if len(found) > 1 or not math.isfinite(value) or value == 0.0:
            self.fail(
                found[-1],
                f"<mechanicalReduction> of transmission {transmission.get('name')!r} is {text!r}; one finite number is "
                f"needed, not 0",
            )
        return value

    def _report(self) -> None:
        """Warn of everything that was not used."""
        self._note_unused(self.robot)
        parts = [f"<{what}> (line {shortened(lines)})" for what, lines in self.unused.items()]
        if self.missing:
            parts.append(f"shapes that cannot be drawn ({shortened(self.missing)})")
        if parts:
            warn_user(f"{self.path.name}: not used: {'; '.join(parts)}", ModelWarning)
        if self.renamed:
            warn_user(f"{self.path.name}: other names here: {', '.join(self.renamed)}", ModelWarning)
        if self.raised:
            warn_user(
                f"{self.path.name}: no body has the principal moments of {'; '.join(self.raised)}: none may be "
                f"negative, or more than the sum of the others; the smaller ones were raised",
                ModelWarning,
            )

    def _note_unused(self, tag: ET.Element) -> None:
        known = UNDERSTOOD.get(tag.tag, set())
        for name, value in tag.attrib.items():
            unlimited = tag.tag == "limit" and value == repr(UNLIMITED)  # as `save_urdf` writes it
            if name not in known and not name.startswith("xmlns") and not unlimited:
                self.unused.setdefault(f"{tag.tag} {name}", []).append(line_of(tag))
        for x in tag:
            if x.tag == "transmission":
                for y in x.iter():
                    if y.tag not in IN_TRANSMISSIONS:
                        self.unused.setdefault(str(y.tag), []).append(line_of(y))
            elif x.tag not in known:
                self.unused.setdefault(str(x.tag), []).append(line_of(x))
            else:
                self._note_unused(x)


def shortened(items: Sequence[Any]) -> str:
    """The first few items of a list."""
    return ", ".join(map(str, items[:MAX_LISTED])) + (", ..." if len(items) > MAX_LISTED else "")
