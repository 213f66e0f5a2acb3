"""Writing of a mechanism whose joints form a tree as URDF.

URDF puts the frame of a link at the joint that carries it, with zero joint values in the drawn configuration. What the
format cannot express is listed in a `ModelWarning` with the reason, or refused where the motion would be another one.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import ModelError, ModelWarning, warn_user
from ..forces.clutch import Brake
from ..forces.coordinate_spring import CoordinateSpring
from ..forces.limit import Limit
from ..joints.fixed import Fixed
from ..joints.planar import Planar
from ..joints.prismatic import Prismatic
from ..joints.revolute import Revolute
from ..model.body import GROUND, Body
from ..model.element import Element
from ..model.inertia import checked_shapes, mass_properties
from ..model.joint import Joint
from ..model.model import Model
from ..model.names import curve_parts
from ..model.output_files import write_file
from ..model.shapes.box import Box
from ..model.shapes.cylinder import Cylinder
from ..model.shapes.mesh import Mesh
from ..model.shapes.rod import Rod
from ..model.shapes.sphere import Sphere
from ..tables.element_numbers import element_numbers
from ..tables.forest import TreeBody, tree_bodies
from ..tables.structure import structure
from ..tables.values import values
from .robot_file import UNLIMITED, Names, control_of, coupling_numbers, numbers_text, omitted_elements, shared_controls
from .urdf import COORDINATES, SIMPLE, STANDARD_GRAVITY

TYPES: dict[type[Joint], str] = {Revolute: "revolute", Prismatic: "prismatic", Fixed: "fixed", Planar: "planar"}


def save_urdf(model: Model, path: Path) -> None:
    """Write a mechanism as URDF.

    Raises
    ------
    ModelError
        If joints close a loop, are of a kind that URDF does not have, or the mechanism is planar.
    """
    write_file(path, _Writer(model).text())


class _Writer:
    """One mechanism being written."""

    def __init__(self, model: Model) -> None:
        self.model = model
        if model.planar:
            raise ModelError(f"{model.name!r} is planar; URDF describes mechanisms in space")
        for j in model.joints:
            if type(j) not in TYPES:
                names = ", ".join(x.__name__ for x in TYPES)
                raise ModelError(f"{j.title} has no counterpart in URDF, which has {names}")
        stops = {e.name: None for e in model.limits}
        free = model.changed(stops) if stops else model  # type: ignore[attr-defined]
        self.poses = values(structure(free)).poses
        given = element_numbers(model)
        self.numbers, self.env = given.of, given.env
        self.tree = tree_bodies(model, [j.name for j in model.joints])
        self.place: dict[str, np.ndarray] = {GROUND: np.eye(4)}
        self.written: set[str] = {j.name for j in model.joints}
        self.missing: list[str] = []
        other = "URDF has damping and friction of joints and simple transmissions"
        self.reasons = dict.fromkeys((e.name for e in model.forces), other)
        self.reasons |= dict.fromkeys((e.name for e in model.limits), "URDF has rigid stops of joints")
        self.reasons |= dict.fromkeys(
            (e.name for e in model.couplings), "URDF couples two revolute or prismatic joints"
        )
        self.reasons |= dict.fromkeys((e.name for e in model.ground), "ground has no shapes in URDF")
        self.names = Names(e.name for e in model.elements())
        self.ground = self._ground_link()
        self.mimics = self._mimics()
        self.motors: list[tuple[Element, str]] = []  # with the parameter that is the control
        self.robot = ET.Element("robot", name=model.name)

    def _ground_link(self) -> str:
        """Name of the link that is ground: that of a frame at the world's origin, else ``world``."""
        for e in self.model.frames:
            p, R = self.poses.named(e.name)
            if e.body == GROUND and not p.any() and (np.eye(3) == R).all():
                return e.name
        return self.names.new("world")

    def text(self) -> str:
        """The file."""
        on_ground = any(t.joint is not None and t.parent == GROUND for t in self.tree)
        if on_ground or any(e.body == GROUND for e in self.model.frames):
            ET.SubElement(self.robot, "link", name=self.ground)
        free = [t.body for t in self.tree if t.joint is None]
        if len(free) + any(t.parent == GROUND and t.joint is not None for t in self.tree) > 1:
            raise ModelError(
                f"{self.model.name!r} has several parts that no joint connects ({', '.join(free)}): URDF has one"
            )
        for t in self.tree:
            self.place[t.body] = self._frame(t)
            self._link(t.body)
        for t in self.tree:
            if t.joint is not None:
                self._joint(t)
        for e in self.model.frames:
            self._fixed_frame(e)
        self._transmissions()
        self._report()
        ET.indent(self.robot)
        return '<?xml version="1.0"?>\n' + ET.tostring(self.robot, encoding="unicode") + "\n"

    def _frame(self, t: TreeBody) -> np.ndarray:
        """Frame of a link in the world: at its joint, with the axes of the body's reference frame."""
        out = np.eye(4)
        p, R = self.poses.named(t.body)
        out[:3, :3] = R
        out[:3, 3] = p if t.joint is None else self.poses.ends(t.joint)[0][0]
        return out

    def _local(self, link: str, body: str, point: Any, R: Any) -> np.ndarray:
        """Pose in a link's frame of a frame given in a body's reference frame."""
        p, axes = self.poses.named(body)
        T = np.eye(4)
        T[:3, 3], T[:3, :3] = p + axes @ np.asarray(point, float), axes @ R
        return np.asarray(np.linalg.inv(self.place[link]) @ T)

    def _link(self, name: str) -> None:
        link = ET.SubElement(self.robot, "link", name=name)
        body: Body = self.model[name]
        found = mass_properties(body, self.numbers[name], self.env, False)
        inertial = ET.SubElement(link, "inertial")
        _origin(inertial, self._local(name, name, found.com, np.eye(3)))
        ET.SubElement(inertial, "mass", value=repr(float(found.mass)))
        J = np.asarray(found.inertia, float)
        upper = zip(("ixx", "ixy", "ixz", "iyy", "iyz", "izz"), J[np.triu_indices(3)].tolist(), strict=True)
        ET.SubElement(inertial, "inertia", {k: repr(x) for k, x in upper})
        self.written.add(name)
        if body.velocity is not None or body.angular_velocity is not None:
            self.missing.append(f"the initial velocity of {name}")
        for s, n, _ in checked_shapes(body, self.env, False):
            self._shape(link, name, s, n)

    def _shape(self, link: ET.Element, name: str, s: Any, n: Any) -> None:
        geometry = ET.Element("geometry")
        if s.hole:  # not drawn, and its mass is that of the body
            return
        if isinstance(s, Box):
            ET.SubElement(geometry, "box", size=numbers_text(n.edges))
        elif type(s) in (Cylinder, Rod):
            radius, length = (repr(float(x)) for x in s.size(n))
            ET.SubElement(geometry, "cylinder", radius=radius, length=length)
        elif isinstance(s, Sphere):
            ET.SubElement(geometry, "sphere", radius=repr(float(n.radius)))
        elif isinstance(s, Mesh) and s.path is not None:
            ET.SubElement(geometry, "mesh", filename=s.path, scale=numbers_text([n.scale] * 3))
        else:
            self.missing.append(f"{s.title} of {name} (URDF has boxes, cylinders, spheres and mesh files)")
            return
        visual = ET.SubElement(link, "visual")
        place, R = s.pose(n)
        _origin(visual, self._local(name, name, place, R))
        visual.append(geometry)

    def _joint(self, t: TreeBody) -> None:
        e, kind = t.joint, TYPES[type(t.joint)]  # type: ignore[index]
        assert e is not None
        along = f"{e.name}.{COORDINATES.get(kind, '')}"
        lower, upper = self._range(along)
        if kind == "revolute" and lower == -UNLIMITED and upper == UNLIMITED:
            kind = "continuous"
        joint = ET.SubElement(self.robot, "joint", name=e.name, type=kind)
        parent = self.ground if t.parent == GROUND else t.parent
        _origin(joint, np.linalg.inv(self.place[t.parent]) @ self.place[t.body])
        ET.SubElement(joint, "parent", link=parent)
        ET.SubElement(joint, "child", link=t.body)
        if kind == "fixed":
            return
        axis = self.place[t.body][:3, :3].T @ self.poses.ends(e)[0][1][:, 2]
        ET.SubElement(joint, "axis", xyz=numbers_text(-axis if t.reversed else axis))
        drawn = float(getattr(self.numbers[e.name], "angle" if kind == "planar" else COORDINATES[kind], 0.0))
        if drawn:
            self.missing.append(f"the value {drawn:g} of {e.title} in the reference configuration (0 in URDF)")
        if kind not in COORDINATES:
            return
        if kind != "continuous":  # URDF demands an effort and a velocity too
            bounds = {k: x if abs(x) == UNLIMITED else x - drawn for k, x in (("lower", lower), ("upper", upper))}
            limit = bounds | {"effort": UNLIMITED, "velocity": UNLIMITED}
            ET.SubElement(joint, "limit", {k: repr(x) for k, x in limit.items()})
        losses = {"damping": self._damping(along), "friction": self._friction(along)}
        if any(losses.values()):
            ET.SubElement(joint, "dynamics", {k: repr(x) for k, x in losses.items()})
        if along in self.mimics:
            c, other, multiplier, offset = self.mimics[along]
            mimic = {"joint": other, "multiplier": repr(multiplier), "offset": repr(offset)}
            ET.SubElement(joint, "mimic", mimic)
            self.written.add(c)

    def _drawn(self, along: str) -> float | None:
        """Value of a coordinate in the reference configuration; None unless a joint of URDF has this coordinate."""
        joint, what = curve_parts(along)
        kind = TYPES.get(type(self.model.find(joint)))  # type: ignore[arg-type]
        return float(getattr(self.numbers[joint], what)) if what and COORDINATES.get(kind or "") == what else None

    def _mimics(self) -> dict[str, tuple[str, str, float, float]]:
        """Name of the coupling, joint that is followed, multiplier and offset of each coordinate that follows another.

        A joint follows one other joint, and none itself: each tree of couplings begins at one that follows none.
        """
        found: dict[str, tuple[str, str, float, float]] = {}
        reached = set[str]()
        waiting = [c for c in self.model.couplings if len(c.coupled()) == 2 and c.equation(self.model) is None]
        waiting = [c for c in waiting if all(self._drawn(x) is not None for x in c.coupled())]
        while waiting:
            c = next((c for c in waiting if len(reached & set(c.coupled())) == 1), waiting[0])
            waiting.remove(c)
            first, second = c.coupled()
            if {first, second} <= reached:
                self.reasons[c.name] = "other couplings relate these coordinates already"
                continue
            n = self.numbers[c.name]
            drawn = [self._drawn(first), self._drawn(second)]
            (_, f), c0 = coupling_numbers(c, n, c.factors(n, self.model, self.poses.axis), drawn)
            follower, other, multiplier, offset = (first, second, -f, c0)
            if first in reached:
                follower, other, multiplier, offset = (second, first, -1.0 / f, c0 / f)
            found[follower] = c.name, curve_parts(other)[0], float(multiplier), float(offset)
            reached |= {first, second}
        return found

    def _range(self, along: str) -> tuple[float, float]:
        """The bounds of all rigid stops of a coordinate."""
        lower, upper = -UNLIMITED, UNLIMITED
        for e in self.model.limits:
            if isinstance(e, Limit) and e.coordinate == along and e.stiffness is None:
                n = self.numbers[e.name]
                lower = max(lower, -UNLIMITED if n.lower is None else float(n.lower))
                upper = min(upper, UNLIMITED if n.upper is None else float(n.upper))
                self.written.add(e.name)
                if n.restitution:
                    self.missing.append(f"the restitution of {e.title} (stops have none in URDF)")
        return lower, upper

    def _damping(self, along: str) -> float:
        """Sum of the dampers of a coordinate; one with a spring or a law is not written."""
        found = [
            (e, self.numbers[e.name])
            for e in self.model.forces
            if type(e) is CoordinateSpring and e.coordinate == along and e.force is None
        ]
        return self._sum({e.name: n.damping for e, n in found if n.stiffness == 0.0})

    def _friction(self, along: str) -> float:
        """Sum of the capacities of the brakes of a coordinate; those by a law, or greater at rest, are not written."""
        found = [e for e in self.model.forces if type(e) is Brake and e.coordinate == along]
        given = {e.name: self.numbers[e.name] for e in found}
        self.reasons |= dict.fromkeys(given, "friction is a number in URDF, the same at rest")
        plain = {k: n for k, n in given.items() if isinstance(n.capacity, int | float) and n.static == 1.0}
        return self._sum({k: n.capacity for k, n in plain.items()})

    def _sum(self, given: dict[str, float]) -> float:
        """Sum of the numbers of elements, which are written thereby."""
        self.written |= set(given)
        return float(sum(given.values()))

    def _transmissions(self) -> None:
        """Motors of joints whose torque is a multiple of a parameter, the first of each joint."""
        driven = set[str]()
        for e in self.model.forces:
            control, along = control_of(self.model, e), getattr(e, "coordinate_text", str)()
            if control is None or self._drawn(along) is None or control[0] == 0.0:
                continue
            joint = curve_parts(along)[0]
            if joint in driven:
                self.reasons[e.name] = "URDF has one simple transmission a joint"
                continue
            driven.add(joint)
            self.motors.append((e, control[1]))
            if value := self.env[control[1]]:
                self.missing.append(f"the value {value:g} of the parameter {control[1]!r} of {e.title} (0 in URDF)")
            tag = ET.SubElement(self.robot, "transmission", name=f"{e.name}_transmission")
            ET.SubElement(tag, "type").text = f"transmission_interface/{SIMPLE}"
            ET.SubElement(tag, "joint", name=joint)
            motor = ET.SubElement(tag, "actuator", name=e.name)
            ET.SubElement(motor, "mechanicalReduction").text = repr(control[0])
            self.written.add(e.name)

    def _fixed_frame(self, e: Any) -> None:
        body = e.body
        link = self.ground if body == GROUND else body
        self.written.add(e.name)
        if e.name == self.ground:
            return
        ET.SubElement(self.robot, "link", name=e.name)
        joint = ET.SubElement(self.robot, "joint", name=self.names.new(f"{e.name}_fixed"), type="fixed")
        p, R = self.poses.named(e.name)
        T = np.eye(4)
        T[:3, 3], T[:3, :3] = p, R
        _origin(joint, np.linalg.inv(self.place[body]) @ T)
        ET.SubElement(joint, "parent", link=link)
        ET.SubElement(joint, "child", link=e.name)

    def _report(self) -> None:
        rest = [*omitted_elements(self.model, self.written, self.reasons), *self.missing, *shared_controls(self.motors)]
        if tuple(self.model.gravity) != (0, 0, -STANDARD_GRAVITY):
            rest.append(f"gravity {tuple(self.model.gravity)} ({STANDARD_GRAVITY} m/s^2 along -z, read again)")
        if rest:
            warn_user(f"URDF has no counterpart of {', '.join(rest)}; the file lacks them", ModelWarning)


def _origin(tag: ET.Element, T: np.ndarray) -> None:
    """Add an <origin>: position, and roll, pitch and yaw about fixed axes."""
    R = T[:3, :3]
    pitch = np.arctan2(-R[2, 0], np.hypot(R[0, 0], R[1, 0]))
    yaw = np.arctan2(R[1, 0], R[0, 0])  # near a pitch of 90 deg any yaw, with the roll that belongs to it
    c, s = np.cos(yaw), np.sin(yaw)
    roll = np.arctan2(s * R[0, 2] - c * R[1, 2], c * R[1, 1] - s * R[0, 1])
    ET.SubElement(tag, "origin", xyz=numbers_text(T[:3, 3]), rpy=numbers_text((roll, pitch, yaw)))
