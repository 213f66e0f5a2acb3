"""Writing of a mechanism as MJCF, MuJoCo's format: bodies in a tree of joints, closed loops as equalities.

A body of MJCF is a body with the same reference frame; `qpos0` is the drawn configuration, and joints have the values
they have in it (``ref``). A joint with several coordinates is a sequence of hinges and slides of one body. MuJoCo's
constraints are soft: equalities are as hard as it permits. Elements along sums of coordinates and along paths are
tendons. What the format cannot express is listed in a `ModelWarning` with the reason, or refused where joints and
bodies would differ.
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
from ..forces.motor import Actuator, Motor
from ..forces.path_spring import PathSpring
from ..forces.rope import Rope
from ..forces.rotor_inertia import RotorInertia
from ..forces.spring_damper import SpringDamper
from ..forces.torsional_spring import TorsionalSpringDamper
from ..joints.fixed import Fixed
from ..joints.revolute import Revolute
from ..joints.spherical import Spherical
from ..model.body import GROUND, Body, frame_of
from ..model.element import Element
from ..model.force import CoordinateForce, Force
from ..model.geometry import matrix_to_quaternion
from ..model.inertia import checked_shapes, mass_properties
from ..model.joint import Joint
from ..model.model import Model
from ..model.names import curve_parts
from ..model.output_files import write_file
from ..model.shapes.box import Box
from ..model.shapes.capsule import Capsule
from ..model.shapes.cylinder import Cylinder
from ..model.shapes.ellipsoid import Ellipsoid
from ..model.shapes.plane import Plane
from ..model.shapes.rod import Rod
from ..model.shapes.sphere import Sphere
from ..tables.element_numbers import element_numbers
from ..tables.forest import coordinate_row, joint_bodies
from ..tables.structure import Choices, structure
from ..tables.structure_definition import FrameSpec, velocity_names
from ..tables.table_definitions import FREE, PLANAR, POINT, PRISMATIC, REVOLUTE, SPHERICAL
from ..tables.values import values
from .robot_file import (
    UNLIMITED,
    Names,
    control_of,
    coupling_numbers,
    numbers_text,
    omitted_elements,
    shared_controls,
)

CLOSED_BY_EQUALITIES = (Spherical, Fixed, Revolute)
"""Joints that may close loops: connect, weld, and connect at two points of the axis."""
EQUALITY_IMPEDANCE = {"solimp": "0.9999 0.9999 0.001 0.5 2"}
"""Impedance of equalities: the largest of MuJoCo (mjMAXIMP)."""
WORLD = "world"
"""Name of ground in MJCF, which no other body can have."""
SMALLEST_INERTIA = 1e-15
"""Mass and moments of inertia that MuJoCo demands of bodies that move (mjMINVAL)."""
ADDITIVE = {"damping", "frictionloss", "armature"}
"""Attributes of a joint that add up over several elements; others of a second element are those of a tendon."""
PARAMETER_LAWS = "its law is not a multiple of a parameter"
SPRINGS = (CoordinateSpring, TorsionalSpringDamper, SpringDamper, PathSpring)
GEOMS: dict[type, str] = {Box: "box", Sphere: "sphere", Capsule: "capsule", Cylinder: "cylinder", Rod: "cylinder",
                          Ellipsoid: "ellipsoid", Plane: "plane"}  # fmt: skip
"""Shapes with a geom of their own; others are written as meshes."""


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
        self.reasons: dict[str, str] = {}  # by element
        self.tags: dict[str, ET.Element] = {}  # by body
        self.root = ET.Element("mujoco", model=model.name)
        ET.SubElement(self.root, "compiler", angle="radian", autolimits="true")
        if any(law is not None for law in model.gravity_laws()):
            self.missing.append("the change of gravity with time")
        ET.SubElement(self.root, "option", gravity=numbers_text(self.values.system.gravity))
        self.places = self._drawn_joints()
        self.joint_tags: dict[int, ET.Element] = {}  # by row
        self.assets, self.tendons, self.equalities, self.actuators = (
            ET.Element(x) for x in ("asset", "tendon", "equality", "actuator")
        )
        self.names = Names(e.name for e in model.elements())
        self.not_world = self.names.new(f"{WORLD}_")
        self.motors: list[tuple[Element, str]] = []  # with the parameter that is the control

    def text(self) -> str:
        """The file."""
        world = ET.Element("worldbody")
        self._bodies(world)
        self._closed_loops()
        for c in self.model.couplings:
            self._coupling(c)
        for e in (*self.model.limits, *self.model.forces):
            self._force(e)
        parts = (self.assets, world, self.tendons, self.equalities, self.actuators)
        self.root.extend(x for x in parts if len(x) or x is world)
        controls = [float(self.values.env[parameter]) for _, parameter in self.motors]
        if any(controls):  # MuJoCo's controls are zero but for keyframes
            ET.SubElement(ET.SubElement(self.root, "keyframe"), "key", name="as described", ctrl=numbers_text(controls))
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
        self.tags[GROUND] = world
        self._carried(world, GROUND)
        for b, parent in enumerate(tree.parent.tolist()):
            above, carrier, waiting = tags[parent]
            joints = [*waiting, b]
            if b not in names or (children[b] == 1 and self._is_link(names[b])):
                tags[b] = above, carrier, joints
                self.written.add(names.get(b, ""))
                continue
            name = names[b]
            T = np.linalg.inv(self._pose(carrier)) @ self._pose(name)
            if name == WORLD:
                self.missing.append(f"the name of Body {name!r} (MuJoCo's of ground; {self.not_world} in the file)")
            tag = self.tags[name] = ET.SubElement(above, "body", {"name": self._body_name(name)} | _placed(T))
            for row in joints:
                self._joint(tag, name, row)
            self._inertial(tag, name, any(tree.nv[row] for row in joints) or len(joints) > 1)
            self._carried(tag, name)
            tags[b] = tag, name, []

    def _body_name(self, name: str) -> str:
        """Name of a body in the file."""
        return self.not_world if name == WORLD else name

    def _is_link(self, name: str) -> bool:
        """Whether a body only connects joints: it has no mass, shape, frame or end of a force, and closes no loop."""
        body: Body = self.model[name]
        used = {end for j in self.cut for end in joint_bodies(self.model, self.model[j])}
        used |= {e.body for e in self.model.frames}
        used |= {self.model.carrier(x, e) for e in self.model.forces for x in e.ends().values()}
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
            ET.SubElement(tag, "freejoint", name=self.names.new(f"{body}_free"))
            return
        steps = {REVOLUTE: [("hinge", 2)], PRISMATIC: [("slide", 2)], SPHERICAL: [("ball", 2)],
                 PLANAR: [("slide", 0), ("slide", 1), ("hinge", 2)],
                 POINT: [("slide", k) for k in range(int(S.tree.nv[b]))]}.get(int(kind), [])  # fmt: skip
        for k, (what, axis) in enumerate(steps):
            name = velocity_names(self.s)[int(S.tree.v[b]) + k].name
            owner = curve_parts(name)[0]
            alone = what == "ball" or sum(x.name.startswith(f"{owner}.") for x in velocity_names(self.s)) == 1
            given = {
                "name": owner if alone else self.names.new(name.replace(".", "_")),
                "type": what,
                "pos": numbers_text(p),
            }
            if what != "ball":
                given |= {"axis": numbers_text(R @ axes[:, axis]), "ref": repr(float(S.bodies.offset[b]))}
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
        given = {"mass": repr(float(found.mass)), "diaginertia": numbers_text(np.maximum(moments, 0.0))}
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
            place = np.eye(4)
            if name == GROUND:
                place[:3, 3], place[:3, :3] = frame_of(e, self.numbers[e.name])
            self.written.add(e.name)
            for s, numbers, title in checked_shapes(e, self.env, self.model.planar):
                if not s.hole:  # holes are not drawn, and their mass is that of the body
                    self._geom(tag, place, s, numbers, title)
        for f in self.model.frames:
            if f.body == name:
                self.written.add(f.name)
                T = np.linalg.inv(self._pose(name)) @ self._pose(f.name)
                ET.SubElement(tag, "site", {"name": f.name} | _placed(T))

    def _geom(self, tag: ET.Element, place: np.ndarray, s: Any, n: Any, title: str) -> None:
        """A shape, for display; one without a geom of its own as a mesh."""
        T, given = np.eye(4), {"type": GEOMS.get(type(s), "mesh")}
        T[:3, 3], T[:3, :3] = s.pose(n)
        if type(s) in GEOMS:
            given["size"] = numbers_text(_size(s, n))
        else:
            v, f = s.surface(n)
            name = f"mesh{len(self.assets)}"
            faces = " ".join(map(str, np.ravel(f).tolist()))
            # MuJoCo demands a closed surface unless the inertia is that of a shell; it is not used
            ET.SubElement(self.assets, "mesh", name=name, vertex=numbers_text(np.ravel(v)), face=faces, inertia="shell")
            given["mesh"] = name
        ET.SubElement(tag, "geom", given | {"contype": "0", "conaffinity": "0", "mass": "0"} | _placed(place @ T))

    def _row_of(self, text: str) -> int | None:
        """Row of the joint that has a coordinate, written ``joint.coordinate``."""
        joint, what = curve_parts(text)
        row = coordinate_row(self.s, joint, what)
        return row if row in self.joint_tags else None

    def _force(self, e: Force) -> None:
        """A stop, spring, damper, friction or motor, on a joint or a tendon; else note why not."""
        n = self.numbers[e.name]
        control = control_of(self.model, e)
        given = {} if control else attributes_of(e, n, self.poses.frame_separation(e))
        if isinstance(given, str):
            self.reasons[e.name] = given
            return
        row = self._row_of(e.coordinate_text()) if isinstance(e, CoordinateForce) else None
        tag = None if row is None else self.joint_tags[row]
        lower, upper = given.pop("rest", (0.0, 0.0))
        if tag is not None and lower == upper and not (set(given) - ADDITIVE) & set(tag.attrib):
            given |= {k: [float(tag.attrib[k]) + given[k][0]] for k in set(given) & set(tag.attrib)}
            named = {k: numbers_text(x) for k, x in given.items()}
            tag.attrib.update(named | ({"springref": numbers_text([lower])} if "stiffness" in given else {}))
        else:
            tag = self._tendon(e, n)
            if tag is None:
                return
            named = {k: numbers_text(x) for k, x in given.items()}
            tag.attrib.update(named | ({"springlength": numbers_text([lower, upper])} if "stiffness" in given else {}))
        self.written.add(e.name)
        if getattr(n, "restitution", None):
            self.missing.append(f"the restitution of {e.title} (stops are soft in MuJoCo)")
        if control:
            gear, parameter = control
            # MuJoCo's force lengthens a tendon, a tension shortens it
            gear = -gear if isinstance(e, SpringDamper | PathSpring) else gear
            on = "joint" if tag.tag == "joint" else "tendon"
            ET.SubElement(self.actuators, "motor", {"name": e.name, on: tag.attrib["name"], "gear": repr(gear)})
            self.motors.append((e, parameter))

    def _tendon(self, e: Force, n: Any) -> ET.Element | None:
        """A new tendon along the coordinates or the path of an element; None, with the reason, if there is none."""
        if isinstance(e, CoordinateForce) and e.along():
            return self._fixed_tendon(e, e.along(), e.switch_weights(n, "") or (1.0,))
        found = ET.SubElement(self.tendons, "spatial", name=e.name)
        for k, role in enumerate(e.ends()):
            p, R, carrier = self.poses.world(FrameSpec(0, e, role))
            place = np.eye(4)
            place[:3, 3], place[:3, :3] = np.real(p), np.real(R)
            site = self.names.new(f"{e.name}_{k}")
            T = np.linalg.inv(self._pose(carrier)) @ place
            ET.SubElement(self.tags[carrier], "site", {"name": site} | _placed(T))
            ET.SubElement(found, "site", site=site)
        return found

    def _fixed_tendon(self, e: Element, along: tuple[str, ...], weights: Any) -> ET.Element | None:
        """A new tendon along a weighted sum of coordinates."""
        rows = [self._row_of(text) for text in along]
        if None in rows:
            self.reasons[e.name] = f"{along[rows.index(None)]} is not the coordinate of a hinge or slide"
            return None
        found = ET.SubElement(self.tendons, "fixed", name=e.name)
        for row, w in zip(rows, weights, strict=True):
            ET.SubElement(found, "joint", joint=self.joint_tags[row].attrib["name"], coef=numbers_text([w]))  # type: ignore[index]
        return found

    def _closed_loops(self) -> None:
        for name in self.cut:
            e: Joint = self.model[name]
            self.written.add(name)
            first, second = joint_bodies(self.model, e)
            if first == GROUND:
                first, second = second, first
            ends = {f"body{k}": self._body_name(x) for k, x in enumerate((first, second), 1) if x != GROUND}
            ends |= EQUALITY_IMPEDANCE
            if isinstance(e, Fixed):
                ET.SubElement(self.equalities, "weld", {"name": name} | ends)
                continue
            (p, R), _ = self.poses.ends(e)
            points = [p]
            if isinstance(e, Revolute) and not self.model.planar:
                points.append(p + self.values.length * R[:, 2])
            for k, x in enumerate(points):
                anchor = (np.linalg.inv(self._pose(first)) @ [*x, 1.0])[:3]
                called = name if k == 0 else self.names.new(f"{name}_axis")
                ET.SubElement(self.equalities, "connect", {"name": called, "anchor": numbers_text(anchor)} | ends)

    def _coupling(self, c: Any) -> None:
        """A linear relation of coordinates: of two y - y0 = c0 + c1 (x - x0), of more a tendon of constant length."""
        at = [row for text in c.coupled() if (row := self._row_of(text)) is not None]
        if len(at) < len(c.coupled()):
            other = next(text for text in c.coupled() if self._row_of(text) is None)
            raise ModelError(f"{c.title} has no counterpart in MJCF: {other} is not the coordinate of a hinge or slide")
        if c.equation(self.model) is not None:
            raise ModelError(f"{c.title} has no counterpart in MJCF, which has linear relations of coordinates only")
        n = self.numbers[c.name]
        given = c.factors(n, self.model, self.poses.axis)
        factors, c0 = coupling_numbers(c, n, given, self.values.system.bodies.offset[at])
        names = {f"joint{k}": self.joint_tags[row].attrib["name"] for k, row in enumerate(at, 1)}
        if len(at) == 2:
            given = {"name": c.name, "polycoef": numbers_text((c0, -factors[1], 0, 0, 0))} | names
            ET.SubElement(self.equalities, "joint", given | EQUALITY_IMPEDANCE)
        else:
            self._fixed_tendon(c, c.coupled(), factors)
            given = {"name": c.name, "tendon1": c.name, "polycoef": numbers_text((c0, 0, 0, 0, 0))}
            ET.SubElement(self.equalities, "tendon", given | EQUALITY_IMPEDANCE)
        self.written.add(c.name)

    def _report(self) -> None:
        rest = [*omitted_elements(self.model, self.written, self.reasons), *self.missing, *shared_controls(self.motors)]
        if rest:
            warn_user(f"MJCF has no counterpart of {', '.join(rest)}; the file lacks them", ModelWarning)


def _tree_and_loops(model: Model) -> tuple[list[str], list[str]]:
    """Joints of the tree, and those that close loops: such that equalities can replace, and no element acts along."""
    leader = {b.name: b.name for b in model.bodies} | {GROUND: GROUND}

    def root(name: str) -> str:
        while leader[name] != name:
            name = leader[name]
        return name

    texts = [text for c in model.couplings for text in c.coupled()]
    texts += [text for e in (*model.forces, *model.limits) if isinstance(e, CoordinateForce) for text in e.along()]
    used = {curve_parts(text)[0] for text in texts}
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


def attributes_of(e: Element, n: Any, separation: float) -> dict[str, Any] | str:
    """Attributes of a joint or tendon that an element becomes, ``rest`` being the range without force; or why none."""
    if isinstance(e, Rope) and e.radii is not None:
        return "it runs over pulleys with a radius"
    if isinstance(e, Limit | Rope):
        bounds = (0.0, separation if n.length is None else n.length) if isinstance(e, Rope) else (n.lower, n.upper)
        lower, upper = (b if x is None else float(x) for x, b in zip(bounds, (-UNLIMITED, UNLIMITED), strict=True))
        if e.stiffness is None:
            return {"range": (lower, upper)}
        if n.damping:
            return "its damping acts only where its spring does"
        return {"stiffness": [n.stiffness], "rest": (lower, upper)}
    if isinstance(e, Brake):
        if not isinstance(n.capacity, int | float) or n.static != 1.0:
            return "friction is a number in MJCF, the same at rest"
        return {"frictionloss": [n.capacity]}
    if isinstance(e, RotorInertia):
        return {"armature": [e.added_inertia(n)]}
    if isinstance(e, Actuator | Motor) or (isinstance(e, SPRINGS) and e.laws()[0] is not None):
        return PARAMETER_LAWS
    if not isinstance(e, SPRINGS):
        return f"MJCF has no {type(e).__name__}"
    rest = next((getattr(n, k) for k in ("rest", "angle", "length") if hasattr(n, k)), None)
    rest = separation if rest is None else float(rest)
    spring = {"stiffness": [n.stiffness], "rest": (rest, rest)} if n.stiffness else {}
    return spring | ({"damping": [n.damping]} if n.damping else {})


def _size(s: Any, n: Any) -> tuple[float, ...]:
    """Sizes of a shape as a geom of its own."""
    if isinstance(s, Plane):  # half edges, and the spacing of its grid
        half = float(s.size(n)[0]) / 2
        return half, half, half / 10
    if isinstance(s, Box):
        return tuple(float(x) / 2 for x in n.edges)
    if isinstance(s, Ellipsoid):
        return tuple(float(x) for x in n.semi_axes)
    radius, *length = s.size(n)[:2]
    return float(radius), *(float(x) / 2 for x in length)


def _placed(T: np.ndarray) -> dict[str, str]:
    return {"pos": numbers_text(T[:3, 3]), "quat": numbers_text(matrix_to_quaternion(T[:3, :3]))}
