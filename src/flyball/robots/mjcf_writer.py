"""Writing of a mechanism as MJCF, MuJoCo's format: bodies in a tree of joints, closed loops as equalities.

A body of MJCF is a body with the same reference frame; `qpos0` is the drawn configuration, and joints have the values
they have in it (``ref``). A joint with several coordinates is a sequence of hinges and slides of one body. MuJoCo's
constraints are soft: equalities are as hard as it permits. What the format cannot express is listed in a
`ModelWarning`, or refused where joints and bodies would differ.
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import ModelError, ModelWarning, warn_user
from ..forces.clutch import Brake
from ..forces.coordinate_spring import Actuator, CoordinateSpring
from ..forces.limit import Limit
from ..forces.rotor_inertia import RotorInertia
from ..joints.coupler import Coupler
from ..joints.fixed import Fixed
from ..joints.revolute import Revolute
from ..joints.spherical import Spherical
from ..model.body import GROUND, Body
from ..model.element import Element
from ..model.geometry import matrix_to_quaternion, orientation_matrix, vector
from ..model.inertia import checked_shapes, mass_properties
from ..model.joint import Joint
from ..model.model import Model
from ..model.output_files import write_file
from ..model.shapes.box import Box
from ..model.shapes.capsule import Capsule
from ..model.shapes.cylinder import Cylinder
from ..model.shapes.ellipsoid import Ellipsoid
from ..model.shapes.sphere import Sphere
from ..tables.element_numbers import element_numbers
from ..tables.forest import coordinate_row, joint_bodies
from ..tables.structure import Choices, structure
from ..tables.structure_definition import velocity_names
from ..tables.table_definitions import FREE, PLANAR, POINT, PRISMATIC, REVOLUTE, SPHERICAL
from ..tables.values import values

CLOSED_BY_EQUALITIES = (Spherical, Fixed, Revolute)
"""Joints that may close loops: connect, weld, and connect at two points of the axis."""
HARDEST = {"solimp": "0.9999 0.9999 0.001 0.5 2"}
"""Impedance of equalities: the largest of MuJoCo (mjMAXIMP)."""
UNLIMITED = 1e9
"""Bound of a joint with one stop, for MJCF limits joints on both sides [rad or m]."""
SMALLEST_INERTIA = 1e-15
"""Mass and moments of inertia that MuJoCo demands of bodies that move (mjMINVAL)."""
NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
CONTROL = re.compile(
    rf"(?:(?P<gear>{NUMBER})\*(?P<open>\())?(?:(?P<gain>{NUMBER})\*)?(?P<control>[A-Za-z_]\w*)(?(open)\))"
)
"""Laws of actuators that have a counterpart: a parameter, or gear*(gain*parameter), as the reader writes them."""


def save_mjcf(model: Model, path: Path) -> None:
    """Write a mechanism as MJCF.

    Raises
    ------
    ModelError
        If a joint has no counterpart, or a body that moves has no mass.
    """
    write_file(path, _Writer(model).text())


class _Writer:
    """One mechanism being written."""

    def __init__(self, model: Model) -> None:
        self.model = model
        stops = {e.name: None for e in model.limits}
        free = model.changed(stops) if stops else model  # type: ignore[attr-defined]
        self.tree, self.cut = _tree_and_loops(model)
        self.s = structure(free, Choices(tree=tuple(self.tree)))
        self.values = values(self.s)
        given = element_numbers(model)
        self.numbers, self.env, self.poses = given.of, given.env, self.values.poses
        self.written: set[str] = set(self.tree)
        self.missing: list[str] = []
        self.root = ET.Element("mujoco", model=model.name)
        ET.SubElement(self.root, "compiler", angle="radian", autolimits="true")
        ET.SubElement(self.root, "option", gravity=_row(self.values.system.gravity))
        self.places = self._drawn_joints()
        self.joint_tags: dict[int, ET.Element] = {}  # by row

    def text(self) -> str:
        """The file."""
        self._bodies(ET.SubElement(self.root, "worldbody"))
        self._along_coordinates()
        self._equalities(ET.SubElement(self.root, "equality"))
        self._actuators(ET.SubElement(self.root, "actuator"))
        for tag in [x for x in self.root if x.tag in ("equality", "actuator") and not len(x)]:
            self.root.remove(tag)
        self._report()
        ET.indent(self.root)
        return '<?xml version="1.0"?>\n' + ET.tostring(self.root, encoding="unicode") + "\n"

    def _drawn_joints(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Origin and axes (z along the joint's axis) of the joint of each row, in the world as drawn."""
        S, out, centres = self.values.system, list[tuple[np.ndarray, np.ndarray]](), list[tuple[Any, Any]]()
        for b, parent in enumerate(S.tree.parent.tolist()):
            if S.tree.joint[b] in (FREE, PLANAR, POINT):
                body = self.values.bodies[next(k for k, row in self.s.place.items() if row == b)]
                out.append((body.c, np.eye(3)))
                centres.append((body.c, body.R))
                continue
            p, R = centres[parent] if parent >= 0 else (np.zeros(3), np.eye(3))
            p, R = p + R @ S.bodies.joint_position[b], R @ S.bodies.joint_rotation[b].reshape(3, 3)
            out.append((p, R))
            p, R = p + R @ S.bodies.body_position[b], R @ S.bodies.body_rotation[b].reshape(3, 3)
            centres.append((p, R))
        return out

    def _bodies(self, world: ET.Element) -> None:
        """Bodies, parents first; joints of massless links precede those of the body that they carry."""
        tree = self.values.system.tree
        names = {row: name for name, row in self.s.place.items()}
        children = np.bincount(tree.parent[tree.parent >= 0], minlength=len(tree.parent))
        tags: dict[int, tuple[ET.Element, str, list[int]]] = {-1: (world, GROUND, [])}  # with waiting joints
        self._carried(world, GROUND)
        for b, parent in enumerate(tree.parent.tolist()):
            above, carrier, waiting = tags[parent]
            joints = [*waiting, b]
            if b not in names or (children[b] == 1 and self._is_link(names[b])):
                tags[b] = above, carrier, joints
                continue
            name = names[b]
            T = np.linalg.inv(self._pose(carrier)) @ self._pose(name)
            tag = ET.SubElement(above, "body", {"name": name} | _placed(T))
            for row in joints:
                self._joint(tag, name, row)
            self._inertial(tag, name, any(tree.nv[row] for row in joints) or len(joints) > 1)
            self._carried(tag, name)
            tags[b] = tag, name, []

    def _is_link(self, name: str) -> bool:
        """Whether a body only connects joints: it has neither mass nor shape nor frame, and closes no loop."""
        body: Body = self.model[name]
        used = {end for j in self.cut for end in joint_bodies(self.model, self.model[j])}
        used |= {e.body for e in self.model.frames}
        return self.values.system.bodies.mass[self.s.place[name]] == 0.0 and not body.shapes() and name not in used

    def _pose(self, name: str) -> np.ndarray:
        """Reference frame of a body in the world as drawn, (4, 4)."""
        T = np.eye(4)
        if name != GROUND:
            p, R = self.poses.named(name)
            T[:3, 3], T[:3, :3] = p, R
        return T

    def _joint(self, tag: ET.Element, body: str, b: int) -> None:
        """The joint of a row, or the three of a planar body."""
        S, kind = self.values.system, self.values.system.tree.joint[b]
        at, axes = self.places[b]
        R = self._pose(body)[:3, :3].T
        p = R @ (at - self._pose(body)[:3, 3])
        if kind == FREE:
            ET.SubElement(tag, "freejoint", name=f"{body}_free")
            return
        steps = {REVOLUTE: [("hinge", 2)], PRISMATIC: [("slide", 2)], SPHERICAL: [("ball", 2)],
                 PLANAR: [("slide", 0), ("slide", 1), ("hinge", 2)],
                 POINT: [("slide", k) for k in range(int(S.tree.nv[b]))]}.get(int(kind), [])  # fmt: skip
        for k, (what, axis) in enumerate(steps):
            name = velocity_names(self.s)[int(S.tree.v[b]) + k].name
            owner = name.partition(".")[0]
            alone = what == "ball" or sum(x.name.startswith(f"{owner}.") for x in velocity_names(self.s)) == 1
            given = {"name": owner if alone else re.sub(r"\W", "_", name), "type": what, "pos": _row(p)}
            if what != "ball":
                given |= {"axis": _row(R @ axes[:, axis]), "ref": repr(float(S.bodies.offset[b]))}
            found = ET.SubElement(tag, "joint", given)
            if len(steps) == 1:
                self.joint_tags[b] = found

    def _inertial(self, tag: ET.Element, name: str, moves: bool) -> None:
        found = mass_properties(self.model[name], self.numbers[name], self.env, self.model.planar)
        self.written.add(name)
        if not found.mass > 0.0:
            if moves:
                raise ModelError(f"Body {name!r} moves and has no mass: MuJoCo has no such bodies; give it a small one")
            return
        J = np.asarray(found.inertia, float)
        if self.model.planar:  # any other moments; these are those of a flat body
            J = np.diag([J[2, 2] / 2, J[2, 2] / 2, J[2, 2]])
        moments, axes = np.linalg.eigh(J)
        if moves and min(moments[0], found.mass) < SMALLEST_INERTIA:
            raise ModelError(
                f"Body {name!r} moves and has no inertia about some axis, or less than {SMALLEST_INERTIA:g}: MuJoCo "
                f"has no such bodies"
            )
        axes[:, 0] *= np.sign(np.linalg.det(axes))
        given = {"mass": repr(float(found.mass)), "diaginertia": _row(np.maximum(moments, 0.0))}
        place = np.eye(4)
        place[:3, 3], place[:3, :3] = found.com, axes
        ET.SubElement(tag, "inertial", given | _placed(place))
        body: Body = self.model[name]
        if body.velocity is not None or body.angular_velocity is not None:
            self.missing.append(f"the initial velocity of {name}")

    def _carried(self, tag: ET.Element, name: str) -> None:
        """Shapes and frames of a body, or of ground."""
        bodies: list[Any] = [self.model[name]] if name != GROUND else self.model.ground
        for e in bodies:
            place, n = np.eye(4), self.numbers[e.name]
            if name == GROUND and not self.model.planar:
                place[:3, 3] = vector(n.position, False, e.title)
                place[:3, :3] = orientation_matrix(n.orientation, e.title)
            self.written.add(e.name)
            for s, numbers, title in checked_shapes(e, self.env, self.model.planar):
                size = None if self.model.planar else _size(s, numbers)
                if size is None:
                    self.missing.append(title.rstrip(": ") + f" ({type(s).__name__})")
                    continue
                T = np.eye(4)
                T[:3, 3], T[:3, :3] = s.pose(numbers)
                kind = {"type": type(s).__name__.lower(), "size": _row(size), "contype": "0", "conaffinity": "0"}
                ET.SubElement(tag, "geom", kind | {"mass": "0"} | _placed(place @ T))
        for f in self.model.frames:
            if f.body == name:
                self.written.add(f.name)
                T = np.linalg.inv(self._pose(name)) @ self._pose(f.name)
                ET.SubElement(tag, "site", {"name": f.name} | _placed(T))

    def _row_of(self, text: str) -> int | None:
        """Row of the joint that has a coordinate, written ``joint.coordinate``."""
        joint, _, what = text.partition(".")
        row = coordinate_row(self.s, joint, what)
        return row if row in self.joint_tags else None

    def _along_coordinates(self) -> None:
        """Stops, springs, damping and friction of joints; the first of each kind that a joint has."""
        for e in (*self.model.limits, *self.model.forces):
            row = self._row_of(getattr(e, "coordinate", ""))
            given = self._of_joint(e, self.numbers[e.name]) if row is not None else {}
            if row is not None and given and not set(given) & set(self.joint_tags[row].attrib):
                self.joint_tags[row].attrib.update(given)
                self.written.add(e.name)

    def _of_joint(self, e: Element, n: Any) -> dict[str, str]:
        """Attributes of a joint that an element becomes; none if there are none for it."""
        if isinstance(e, Limit) and e.stiffness is None:
            lower, upper = (b if x is None else float(x) for x, b in ((n.lower, -UNLIMITED), (n.upper, UNLIMITED)))
            return {"range": _row((lower, upper))}
        if isinstance(e, CoordinateSpring) and e.force is None:
            spring = {"stiffness": repr(float(n.stiffness)), "springref": repr(float(n.rest))} if n.stiffness else {}
            return spring | ({"damping": repr(float(n.damping))} if n.damping else {})
        if isinstance(e, Brake) and isinstance(n.capacity, int | float) and n.static == 1.0:
            return {"frictionloss": repr(float(n.capacity))}
        if isinstance(e, RotorInertia):
            return {"armature": repr(float(e.added_inertia(n)))}
        return {}

    def _equalities(self, tag: ET.Element) -> None:
        for name in self.cut:
            e: Joint = self.model[name]
            self.written.add(name)
            first, second = joint_bodies(self.model, e)
            if first == GROUND:
                first, second = second, first
            ends = {"body1": first} | ({"body2": second} if second != GROUND else {}) | HARDEST
            if isinstance(e, Fixed):
                ET.SubElement(tag, "weld", {"name": name} | ends)
                continue
            (p, R), _ = self.poses.ends(e)
            points = [p]
            if isinstance(e, Revolute) and not self.model.planar:
                points.append(p + self.values.length * R[:, 2])
            for k, x in enumerate(points):
                anchor = (np.linalg.inv(self._pose(first)) @ [*x, 1.0])[:3]
                called = name if k == 0 else f"{name}_axis"
                ET.SubElement(tag, "connect", {"name": called, "anchor": _row(anchor)} | ends)
        for c in self.model.couplings:
            self._coupling(tag, c)

    def _coupling(self, tag: ET.Element, c: Any) -> None:
        """A linear relation of two coordinates: y - y0 = c0 + c1 (x - x0)."""
        at = [self._row_of(text) for text in c.coordinates] if isinstance(c, Coupler) else []
        if len(at) != 2 or None in at:
            raise ModelError(f"{c.title} has no counterpart in MJCF, which couples two coordinates of joints")
        n, offset = self.numbers[c.name], self.values.system.bodies.offset
        (a, b), (y, x) = (float(w) for w in n.weights), (float(offset[row]) for row in at)
        c0 = 0.0 if n.value is None else float(n.value) / a - b / a * x - y
        names = {f"joint{k}": self.joint_tags[row].attrib["name"] for k, row in enumerate(at, 1)}  # type: ignore[index]
        ET.SubElement(tag, "joint", {"name": c.name, "polycoef": _row((c0, -b / a, 0, 0, 0))} | names | HARDEST)
        self.written.add(c.name)

    def _actuators(self, tag: ET.Element) -> None:
        controls: list[float] = []
        for e in self.model.forces:
            row = self._row_of(getattr(e, "coordinate", "")) if type(e) is Actuator else None
            law = CONTROL.fullmatch(e.force.replace(" ", "")) if row is not None and isinstance(e.force, str) else None  # type: ignore[attr-defined]
            if row is None or law is None or law["control"] not in self.model.parameters:
                continue
            gear = float(law["gear"] or 1.0) * float(law["gain"] or 1.0)
            ET.SubElement(tag, "motor", name=e.name, joint=self.joint_tags[row].attrib["name"], gear=repr(gear))
            controls.append(float(self.values.env[law["control"]]))
            self.written.add(e.name)
        if any(controls):  # MuJoCo's controls are zero but for keyframes
            ET.SubElement(ET.SubElement(self.root, "keyframe"), "key", name="as described", ctrl=_row(controls))

    def _report(self) -> None:
        rest = [e.title for e in self.model.elements() if e.name not in self.written]
        if rest or self.missing:
            listed = ", ".join([*rest, *self.missing])
            warn_user(f"MJCF has no counterpart of {listed}; the file lacks them", ModelWarning)


def _tree_and_loops(model: Model) -> tuple[list[str], list[str]]:
    """Joints of the tree, and those that close loops: such that equalities can replace, and no element acts along."""
    leader = {b.name: b.name for b in model.bodies} | {GROUND: GROUND}

    def root(name: str) -> str:
        while leader[name] != name:
            name = leader[name]
        return name

    texts = [text for c in model.couplings for text in c.coupled()]
    texts += [getattr(e, "coordinate", "") for e in (*model.forces, *model.limits)]
    used = {text.partition(".")[0] for text in texts}
    tree, cut = set(), []
    for j in sorted(model.joints, key=lambda x: isinstance(x, CLOSED_BY_EQUALITIES) * (1 + (x.name not in used))):
        a, b = (root(x) for x in joint_bodies(model, j))
        if a != b:
            leader[a] = b
            tree.add(j.name)
            if j.chain is None or j.loose(model.planar):
                raise ModelError(f"{j.title} has no counterpart in MJCF, which has hinges, slides and ball joints")
        elif isinstance(j, CLOSED_BY_EQUALITIES):
            cut.append(j.name)
        else:
            names = ", ".join(x.__name__ for x in CLOSED_BY_EQUALITIES)
            raise ModelError(f"{j.title} closes a loop; MJCF can close loops by {names}")
    return [j.name for j in model.joints if j.name in tree], cut


def _size(s: Any, n: Any) -> tuple[float, ...] | None:
    """Sizes of a shape as a geom; None if it has no counterpart."""
    if isinstance(s, Box):
        return tuple(float(x) / 2 for x in n.edges)
    if isinstance(s, Sphere):
        return (float(n.radius),)
    if isinstance(s, Capsule | Cylinder):
        return float(n.radius), float(n.length) / 2
    if isinstance(s, Ellipsoid):
        return tuple(float(x) for x in n.semi_axes)
    return None


def _row(x: Any) -> str:
    return " ".join(repr(float(y)) for y in x)


def _placed(T: np.ndarray) -> dict[str, str]:
    return {"pos": _row(T[:3, 3]), "quat": _row(matrix_to_quaternion(T[:3, :3]))}
