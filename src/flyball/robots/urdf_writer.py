"""Writing of a mechanism whose joints form a tree as URDF.

URDF puts the frame of a link at the joint that carries it, with zero joint values in the drawn configuration. What the
format cannot express is listed in a `ModelWarning` with the reason, or refused where the motion would be another one.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import ModelError, ModelWarning, warn_user
from ..forces.clutch import Brake
from ..forces.coordinate_spring import CoordinateSpring
from ..forces.limit import Limit
from ..joints.coupler import Coupler
from ..joints.fixed import Fixed
from ..joints.planar import Planar
from ..joints.prismatic import Prismatic
from ..joints.revolute import Revolute
from ..model.body import GROUND, Body
from ..model.element import Element
from ..model.inertia import checked_shapes, mass_properties
from ..model.joint import Joint
from ..model.model import Model
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
from .mjcf_writer import control_of, left_out
from .urdf import COORDINATES, SIMPLE, STANDARD_GRAVITY

TYPES: dict[type[Joint], str] = {Revolute: "revolute", Prismatic: "prismatic", Fixed: "fixed", Planar: "planar"}
UNLIMITED = 1e9
"""Bound of a prismatic joint without stops, which URDF always limits [m]."""


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
        self.reasons |= dict.fromkeys((e.name for e in model.couplings), "URDF couples two coordinates of joints")
        self.reasons |= dict.fromkeys((e.name for e in model.ground), "ground has no shapes in URDF")
        self.ground = self._ground_link()
        self.robot = ET.Element("robot", name=model.name)

    def _ground_link(self) -> str:
        """Name of the link that is ground: that of a frame at the world's origin, else ``world``."""
        for e in self.model.frames:
            p, R = self.poses.named(e.name)
            if e.body == GROUND and not p.any() and (np.eye(3) == R).all():
                return e.name
        name = "world"
        while self.model.find(name) is not None:
            name += "_"
        return name

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
        for s, n, _ in checked_shapes(body, self.env, False):
            self._shape(link, name, s, n)

    def _shape(self, link: ET.Element, name: str, s: Any, n: Any) -> None:
        geometry = ET.Element("geometry")
        if s.hole:  # not drawn, and its mass is that of the body
            return
        if isinstance(s, Box):
            ET.SubElement(geometry, "box", size=_row(n.edges))
        elif type(s) in (Cylinder, Rod):
            radius, length = (repr(float(x)) for x in s.size(n))
            ET.SubElement(geometry, "cylinder", radius=radius, length=length)
        elif isinstance(s, Sphere):
            ET.SubElement(geometry, "sphere", radius=repr(float(n.radius)))
        elif isinstance(s, Mesh) and s.path is not None:
            ET.SubElement(geometry, "mesh", filename=s.path, scale=_row([n.scale] * 3))
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
        if kind == "revolute" and not any(x.coordinate == f"{e.name}.angle" for x in self._limits()):
            kind = "continuous"
        joint = ET.SubElement(self.robot, "joint", name=e.name, type=kind)
        parent = self.ground if t.parent == GROUND else t.parent
        _origin(joint, np.linalg.inv(self.place[t.parent]) @ self.place[t.body])
        ET.SubElement(joint, "parent", link=parent)
        ET.SubElement(joint, "child", link=t.body)
        if kind == "fixed":
            return
        axis = self.place[t.body][:3, :3].T @ self.poses.ends(e)[0][1][:, 2]
        ET.SubElement(joint, "axis", xyz=_row(-axis if t.reversed else axis))
        if kind not in COORDINATES:
            return
        along = f"{e.name}.{COORDINATES[kind]}"
        drawn = float(getattr(self.numbers[e.name], COORDINATES[kind], 0.0))  # URDF's value is 0 there
        if kind != "continuous":
            lower, upper = self._range(along)
            limit = {"lower": repr(lower - drawn), "upper": repr(upper - drawn), "effort": "0", "velocity": "0"}
            ET.SubElement(joint, "limit", limit)
        losses = {
            "damping": self._loss(along, CoordinateSpring, "damping"),
            "friction": self._loss(along, Brake, "capacity"),
        }
        if any(losses.values()):
            ET.SubElement(joint, "dynamics", {k: repr(x) for k, x in losses.items()})
        for c in self.model.couplings:
            if isinstance(c, Coupler) and c.coordinates[0] == along and len(c.coordinates) == 2:
                n = self.numbers[c.name]
                a, b = (float(x) for x in n.weights)
                other, _, what = c.coordinates[1].partition(".")
                of_other = float(getattr(self.numbers[other], what, 0.0))
                offset = 0.0 if n.value is None else (float(n.value) - a * drawn - b * of_other) / a
                mimic = {"joint": other, "multiplier": repr(-b / a), "offset": repr(offset)}
                ET.SubElement(joint, "mimic", mimic)
                self.written.add(c.name)

    def _limits(self) -> Iterable[Limit]:
        return (x for x in self.model.limits if isinstance(x, Limit))

    def _range(self, along: str) -> tuple[float, float]:
        lower, upper = -UNLIMITED, UNLIMITED
        for e in self._limits():
            if e.coordinate == along and e.stiffness is None:
                n = self.numbers[e.name]
                lower = max(lower, -UNLIMITED if n.lower is None else float(n.lower))
                upper = min(upper, UNLIMITED if n.upper is None else float(n.upper))
                self.written.add(e.name)
        return lower, upper

    def _loss(self, along: str, kind: type[Element], field: str) -> float:
        """Sum of the numbers of one kind of force along a coordinate."""
        total = 0.0
        for e in self.model.forces:
            if type(e) is kind and getattr(e, "coordinate", "") == along:
                n = self.numbers[e.name]
                value = getattr(n, field)
                plain = kind is not CoordinateSpring or (n.stiffness == 0.0 and n.force is None)
                if isinstance(value, (int, float)) and plain:
                    total += float(value)
                    self.written.add(e.name)
        return total

    def _transmissions(self) -> None:
        """Motors of joints whose torque is a multiple of a parameter, the first of each joint."""
        driven = set[str]()
        for e in self.model.forces:
            control = control_of(self.model, e)
            joint, _, what = getattr(e, "coordinate_text", str)().partition(".")
            kind = TYPES.get(type(self.model.find(joint)))  # type: ignore[arg-type]
            if control is None or COORDINATES.get(kind or "") != what or joint in driven or control[0] == 0.0:
                continue
            driven.add(joint)
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
        joint = ET.SubElement(self.robot, "joint", name=f"{e.name}_fixed", type="fixed")
        p, R = self.poses.named(e.name)
        T = np.eye(4)
        T[:3, 3], T[:3, :3] = p, R
        _origin(joint, np.linalg.inv(self.place[body]) @ T)
        ET.SubElement(joint, "parent", link=link)
        ET.SubElement(joint, "child", link=e.name)

    def _report(self) -> None:
        rest = left_out(self.model, self.written, self.reasons) + self.missing
        if tuple(self.model.gravity) != (0, 0, -STANDARD_GRAVITY):
            rest.append(f"gravity {tuple(self.model.gravity)} ({STANDARD_GRAVITY} m/s^2 along -z, read again)")
        if rest:
            warn_user(f"URDF has no counterpart of {', '.join(rest)}; the file lacks them", ModelWarning)


def _row(x: Any) -> str:
    return " ".join(repr(float(y)) for y in x)


def _origin(tag: ET.Element, T: np.ndarray) -> None:
    """Add an <origin>: position, and roll, pitch and yaw about fixed axes."""
    R = T[:3, :3]
    pitch = np.arctan2(-R[2, 0], np.hypot(R[0, 0], R[1, 0]))
    yaw = np.arctan2(R[1, 0], R[0, 0])  # near a pitch of 90 deg any yaw, with the roll that belongs to it
    c, s = np.cos(yaw), np.sin(yaw)
    roll = np.arctan2(s * R[0, 2] - c * R[1, 2], c * R[1, 1] - s * R[0, 1])
    ET.SubElement(tag, "origin", xyz=_row(T[:3, 3]), rpy=_row((roll, pitch, yaw)))
