"""Reading of models in MJCF, by MuJoCo's own reader: default classes, includes and references are resolved by it.

A body is a body whose reference frame is the body's frame; the drawn configuration is that of `qpos0`. Joints of one
body are a chain of massless links. What has no meaning here is listed in a `ModelWarning`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from ..errors import ModelError, ModelWarning, warn_user
from ..forces.clutch import Brake
from ..forces.coordinate_spring import CoordinateSpring
from ..forces.motor import Actuator
from ..forces.rotor_inertia import RotorInertia
from ..joints.fixed import Fixed
from ..joints.prismatic import Prismatic
from ..joints.revolute import Revolute
from ..joints.spherical import Spherical
from ..model.body import GROUND, Body, Frame, Ground
from ..model.element import Element
from ..model.geometry import quaternion_to_matrix
from ..model.model import Model
from ..model.shapes.box import Box
from ..model.shapes.capsule import Capsule
from ..model.shapes.cylinder import Cylinder
from ..model.shapes.ellipsoid import Ellipsoid
from ..model.shapes.mesh import Mesh
from ..model.shapes.plane import Plane
from ..model.shapes.solid import Solid
from ..model.shapes.sphere import Sphere
from .mjcf_tendons import Tendons, linear_relation
from .robot_file import ROUNDING, Names, initial_in_range, rows, stops

T = TypeVar("T", bound=Model)
FREE, BALL, SLIDE, HINGE = range(4)
"""MuJoCo's kinds of joints (mjtJoint)."""
COORDINATES = {SLIDE: "displacement", HINGE: "angle"}
ON_JOINT, ON_TENDON = (0, 1), 3
"""MuJoCo's kinds of transmissions (mjtTrn): along a joint, also in the parent's axes; along a tendon."""


def load_mjcf(path: Path, make: Callable[..., T]) -> T:
    """Read a model from an MJCF file.

    Raises
    ------
    ModelError
        If MuJoCo is not installed, or refuses the file: with its message, which names element and line.
    """
    try:
        import mujoco
    except ImportError:
        raise ModelError(f"{path}: MJCF is read by MuJoCo; install it: pip install 'flyball[mjcf]'") from None
    if not path.is_file():
        raise ModelError(f"{path} cannot be read: {'it is a folder' if path.is_dir() else 'there is no such file'}")
    try:
        return Reader(mujoco, mujoco.MjModel.from_xml_path(str(path)), path).mechanism(make)
    except ValueError as error:
        if isinstance(error, ModelError):
            raise type(error)(f"{path}: {error}") from None
        raise ModelError(f"{path}: {' '.join(str(error).split())}") from None


class Reader:
    """One compiled model being read."""

    def __init__(self, mujoco: Any, model: Any, path: Path) -> None:
        self.mujoco, self.M, self.path = mujoco, model, path
        self.D = mujoco.MjData(model)
        mujoco.mj_kinematics(model, self.D)
        self.names = Names({GROUND})
        self.bodies: dict[int, str] = {0: GROUND}
        self.joints: dict[int, str] = {}
        self.coordinates: dict[int, str] = {}  # of hinges and slides
        self.sites: dict[int, str] = {}
        self.unused: list[str] = []
        self.start = model.qpos0.copy()  # configuration in which a motion begins

    def name(self, kind: str, k: int, default: str) -> str:
        """A name that flyball permits and that is not taken."""
        return self.free_name(self.given_name(kind, k) or default)

    def given_name(self, kind: str, k: int) -> str:
        """The name in the file; empty if there is none."""
        return self.mujoco.mj_id2name(self.M, getattr(self.mujoco.mjtObj, f"mjOBJ_{kind}"), k) or ""

    def free_name(self, wanted: str) -> str:
        """A name that flyball permits and that is not taken."""
        return self.names.new_identifier(wanted)

    def mechanism(self, make: Callable[..., T]) -> T:
        """The mechanism."""
        M = self.M
        name = self.free_name(self.path.stem)
        m = make(name, gravity=tuple(M.opt.gravity.tolist()))
        later: list[Element] = []
        for b in range(M.nbody):
            joints = list(range(M.body_jntadr[b], M.body_jntadr[b] + M.body_jntnum[b])) if M.body_jntnum[b] else []
            self._add_body(m, b, joints)
            for j in joints:
                later += self._joint_elements(j)
        m.add(*later)
        for k in range(M.nsite):
            m.add(self._frame(k))
        self.tendons = Tendons(self)
        m.add(*self.tendons.elements())
        for k in range(M.neq):
            m.add(*self._equality(k))
        parameters: dict[str, float] = {}
        actuators = list(self._actuators(parameters))
        if actuators:
            m.parameters.update(parameters)
            m.add(*actuators)
        self._report()
        return m

    def _frame(self, k: int) -> Frame:
        """A site as a frame."""
        name, body = self.name("SITE", k, f"site{k}"), self.bodies[self.M.site_bodyid[k]]
        self.sites[k] = name
        p, R = self.D.site_xpos[k], self.D.site_xmat[k].reshape(3, 3)
        if body != GROUND:
            p, R = self.M.site_pos[k], quaternion_to_matrix(self.M.site_quat[k])
        place: dict[str, Any] = {"position": tuple(p.tolist()), "orientation": rows(R)}
        return Frame(name, body, **place)

    def _pose(self, b: int) -> dict[str, Any]:
        return {"position": tuple(self.D.xpos[b].tolist()), "orientation": rows(self.D.xmat[b].reshape(3, 3))}

    def _add_body(self, m: Model, b: int, joints: list[int]) -> None:
        M = self.M
        parent = self.bodies[M.body_parentid[b]] if b else GROUND
        shapes = tuple(self._shapes(b))
        if b == 0 or (not joints and parent == GROUND):
            if b:
                self.bodies[b] = GROUND
                m.add(Frame(self.name("BODY", b, f"body{b}"), GROUND, **self._pose(b)))
            if shapes:
                m.add(Ground(self.free_name(f"ground{b}"), shape=shapes, **self._pose(b)))
            return
        name = self.bodies[b] = self.name("BODY", b, f"body{b}")
        given: dict[str, Any] = {"mass": float(M.body_mass[b]), "inertia": 0.0}
        if M.body_mass[b] > 0.0:
            given |= {
                "inertia": tuple(M.body_inertia[b].tolist()),
                "com": tuple(M.body_ipos[b].tolist()),
                "inertia_axes": rows(quaternion_to_matrix(M.body_iquat[b])),
            }
        m.add(Body(name, **given, **self._pose(b), shape=shapes or None))
        links = [self.free_name(f"{name}_link{k}") for k in range(1, len(joints))]
        for link in links:
            m.add(Body(link, mass=0, inertia=0, **self._pose(b)))
        ends = [parent, *links, name]
        if not joints:
            m.add(Fixed(self.free_name(f"{name}_fixed"), parent, name, at=tuple(self.D.xpos[b].tolist())))
        for k, j in enumerate(joints):
            if M.jnt_type[j] != FREE:
                m.add(self._joint(j, ends[k], ends[k + 1]))

    def _joint(self, j: int, first: str, second: str) -> Element:
        M = self.M
        name = self.joints[j] = self.name("JOINT", j, f"joint{j}")
        if M.jnt_type[j] in COORDINATES:
            self.coordinates[j] = f"{name}.{COORDINATES[M.jnt_type[j]]}"
        at, axis = tuple(self.D.xanchor[j].tolist()), tuple(self.D.xaxis[j].tolist())
        drawn = float(M.qpos0[M.jnt_qposadr[j]])
        if M.jnt_type[j] == BALL:
            return Spherical(name, first, second, at=at)
        if M.jnt_type[j] == SLIDE:
            return Prismatic(name, first, second, at=at, axis=axis, displacement=drawn)
        return Revolute(name, first, second, at=at, axis=axis, angle=drawn)

    def _joint_elements(self, j: int) -> Iterator[Element]:
        """Stops, spring, damping and friction of a joint, and an initial value if that of `qpos0` is not permitted."""
        M, d = self.M, self.M.jnt_dofadr[j]
        armature = M.dof_armature[d : d + (6, 3, 1, 1)[M.jnt_type[j]]]
        if M.jnt_type[j] not in COORDINATES:
            if armature.any():
                self.unused.append(f"armature of {self.joints.get(j, 'the free joint')}, which has no axis")
            if M.jnt_limited[j] or M.jnt_stiffness[j] or M.dof_damping[d] or M.dof_frictionloss[d]:
                whose = self.joints.get(j, "the free joint")
                self.unused.append(f"limit, stiffness, damping or friction of {whose} (read of hinges and slides only)")
            return
        name = self.joints[j]
        along = self.coordinates[j]
        if M.jnt_limited[j]:
            lower, upper = M.jnt_range[j].tolist()
            yield from stops(lambda: self.free_name(f"{name}_limit"), lower, upper, coordinate=along)
            for e in initial_in_range(along, lower, upper, float(M.qpos0[M.jnt_qposadr[j]])):
                self.start[M.jnt_qposadr[j]] = e.value
                yield e
        stiffness, damping, friction = (float(x) for x in (M.jnt_stiffness[j], M.dof_damping[d], M.dof_frictionloss[d]))
        if stiffness or damping:
            rest = float(M.qpos_spring[M.jnt_qposadr[j]])
            given: dict[str, Any] = {"stiffness": stiffness, "rest": rest} if stiffness else {}
            yield CoordinateSpring(self.free_name(f"{name}_spring"), along, damping=damping, **given)
        if friction:
            yield Brake(self.free_name(f"{name}_friction"), along, capacity=friction)
        if armature[0]:
            yield RotorInertia(self.free_name(f"{name}_rotor"), along, inertia=float(armature[0]))

    def _equality(self, k: int) -> Iterator[Element]:
        """Equalities as hard joints: connect, weld, and linear relations of joints."""
        M, kinds = self.M, self.mujoco.mjtEq
        kind = kinds(int(M.eq_type[k]))
        name = self.name("EQUALITY", k, f"equality{k}")
        a, b, data = M.eq_obj1id[k], M.eq_obj2id[k], M.eq_data[k]
        relation: Element | str = ""
        if not M.eq_active0[k]:
            relation = "it is not active"
        elif kind in (kinds.mjEQ_CONNECT, kinds.mjEQ_WELD):
            yield from self._closed_loop(name, k, kind == kinds.mjEQ_WELD)
        elif kind not in (kinds.mjEQ_JOINT, kinds.mjEQ_TENDON):
            relation = "of flexible bodies"
        elif data[2:5].any():
            relation = "its polynomial is not linear"
        elif kind == kinds.mjEQ_TENDON:
            relation = self.tendons.equality(name, int(a), int(b), float(data[0]), float(data[1]))
        else:
            relation = self._joint_relation(name, int(a), int(b), float(data[0]), float(data[1]))
        if isinstance(relation, Element):
            yield relation
        elif relation:
            self.unused.append(f"equality {name} ({relation})")

    def _closed_loop(self, name: str, k: int, weld: bool) -> Iterator[Element]:
        """The joint of a connect or weld, of bodies as they are in `qpos0`, or of sites, which it brings together."""
        M, D = self.M, self.D
        a, b, data = int(M.eq_obj1id[k]), int(M.eq_obj2id[k]), M.eq_data[k]
        joint = Fixed if weld else Spherical
        if M.eq_objtype[k] == self.mujoco.mjtObj.mjOBJ_SITE:
            yield joint(name, self.sites[a], self.sites[b])
            return
        if self.bodies[a] == self.bodies[b]:
            self.unused.append(f"equality {name} (both its bodies are fixed to the world)")
            return
        at, R = D.xpos[a] + D.xmat[a].reshape(3, 3) @ data[:3], D.xmat[b].reshape(3, 3)
        if weld:
            at = D.xpos[a]
            wanted = D.xmat[a].reshape(3, 3) @ quaternion_to_matrix(data[6:10])
            gap = D.xpos[a] + D.xmat[a].reshape(3, 3) @ data[3:6] - D.xpos[b] - R @ data[:3]
            if max(np.abs(gap).max() / M.stat.extent, np.abs(wanted - R).max()) > ROUNDING:
                self.unused.append(f"relpose of equality {name} (bodies are welded as they are in qpos0)")
        yield joint(name, self.bodies[a], self.bodies[b], at=tuple(at.tolist()))

    def _joint_relation(self, name: str, first: int, second: int, offset: float, slope: float) -> Element | str:
        """Relation y - y0 = offset + slope (x - x0) of two joints, or of one (``second`` is -1)."""
        y0, x0 = (float(self.M.qpos0[self.M.jnt_qposadr[j]]) if j >= 0 else 0.0 for j in (first, second))
        weights = {self.coordinates[first]: 1.0} | ({self.coordinates[second]: -slope} if second >= 0 else {})
        return linear_relation(name, weights, y0 + offset - (slope * x0 if second >= 0 else 0.0))

    def _actuators(self, parameters: dict[str, float]) -> Iterator[Element]:
        """Actuators of joints and tendons, with the control as a parameter ``control_NAME``."""
        M, clamped, controls = self.M, list[str](), self._controls()
        for k in range(getattr(M, "nactuator", M.nu)):
            given = self.given_name("ACTUATOR", k) or f"actuator{k}"
            name = self.free_name(given)
            if reason := self._no_law(k):
                self.unused.append(f"actuator {name} ({reason})")
                continue
            control, target = self.free_name(f"control_{given}"), int(M.actuator_trnid[k, 0])
            found: Element | None = None
            if M.actuator_trntype[k] in ON_JOINT and target in self.coordinates:
                found = Actuator(name, self.coordinates[target], force=self._actuator_law(k, control))
            elif M.actuator_trntype[k] == ON_TENDON:
                found = self.tendons.actuator(name, target, lambda *of, k=k, c=control: self._actuator_law(k, c, *of))
            if found is None:
                self.unused.append(
                    f"actuator {name} (it acts on neither a hinge, nor a slide, nor a tendon that is read)"
                )
                continue
            parameters[control] = float(controls[getattr(M, "actuator_ctrladr", range(M.nu))[k]])
            if M.actuator_ctrllimited[k] or M.actuator_forcelimited[k]:
                clamped.append(name)
            yield found
        if clamped:
            self.unused.append(
                f"ranges of control and force of actuators ({', '.join(clamped)}: parameters have no range)"
            )

    def _controls(self) -> np.ndarray:
        """Controls at the start: those of the only keyframe, if it is at rest in `qpos0`; else 0."""
        M = self.M
        if M.nkey == 1 and not M.key_qvel.any() and np.allclose(M.key_qpos[0], M.qpos0, rtol=0.0, atol=ROUNDING):
            return M.key_ctrl[0]
        if M.nkey:
            self.unused.append(f"{M.nkey} keyframes (states are set by Initial)")
        return np.zeros(M.nu)

    def _no_law(self, k: int) -> str:
        """Why an actuator's force is no linear law of its control, length and velocity; empty if it is one."""
        M = self.M
        if M.actuator_dyntype[k] != 0:
            return "it has activation states"
        if M.actuator_gaintype[k] != 0 or M.actuator_biastype[k] > 1:
            return "its force is not linear in control, length and velocity"
        if any(np.any(getattr(M, f"actuator_{x}", np.zeros(k + 1))[k]) for x in ("damping", "armature")):
            return "it has damping or armature of its own"
        return ""

    def _actuator_law(self, k: int, control: str, value: str = "value", sign: float = 1.0) -> str:
        """Force of an actuator: gear (gain control + bias), the bias linear in gear times value and rate."""
        M = self.M
        gear, gain, bias = float(M.actuator_gear[k, 0]), float(M.actuator_gainprm[k, 0]), M.actuator_biasprm[k]
        force = f"{sign * gear!r}*({gain!r}*{control}"
        if M.actuator_biastype[k]:
            force += f" + {float(bias[0])!r} + {float(bias[1])!r}*{gear!r}*{value} + {float(bias[2])!r}*{gear!r}*rate"
        return force + ")"

    def _shapes(self, b: int) -> Iterator[Solid]:
        """Shapes of a body, for display."""
        M, kinds = self.M, self.mujoco.mjtGeom
        for g in range(M.body_geomadr[b], M.body_geomadr[b] + M.body_geomnum[b]) if M.body_geomnum[b] else ():
            R, size = quaternion_to_matrix(M.geom_quat[g]), M.geom_size[g].tolist()
            given: dict[str, Any] = {"position": tuple(M.geom_pos[g].tolist()), "orientation": rows(R)}
            kind = M.geom_type[g]
            if kind == kinds.mjGEOM_PLANE:
                yield Plane(**given)
            elif kind == kinds.mjGEOM_SPHERE:
                yield Sphere(radius=size[0], looks=True, **given)
            elif kind == kinds.mjGEOM_CAPSULE:
                yield Capsule(radius=size[0], length=2 * size[1], looks=True, **given)
            elif kind == kinds.mjGEOM_CYLINDER:
                yield Cylinder(radius=size[0], length=2 * size[1], looks=True, **given)
            elif kind == kinds.mjGEOM_ELLIPSOID:
                yield Ellipsoid(semi_axes=tuple(size), looks=True, **given)
            elif kind == kinds.mjGEOM_BOX:
                yield Box(edges=tuple(2 * x for x in size), looks=True, **given)
            elif kind == kinds.mjGEOM_MESH:
                k = M.geom_dataid[g]
                first, at = M.mesh_vertadr[k], M.mesh_faceadr[k]
                vertices = M.mesh_vert[first : first + M.mesh_vertnum[k]]
                faces = M.mesh_face[at : at + M.mesh_facenum[k]]
                yield Mesh(vertices=vertices.tolist(), faces=faces.tolist(), looks=True, **given)
            else:
                what = kinds(int(kind)).name.removeprefix("mjGEOM_").lower()
                self.unused.append(f"geom {self.given_name('GEOM', g) or g} of {self.bodies.get(b, GROUND)} ({what})")

    def _report(self) -> None:
        M = self.M
        counts = {
            "sensors": M.nsensor,
            "contact pairs": M.npair,
            "flexible bodies": getattr(M, "nflex", 0),
            "plugins": M.nplugin,
            "mocap bodies, which stay where they are": M.nmocap,
        }
        for what, count in counts.items():
            if count:
                self.unused.append(f"{count} {what}")
        effects = {
            "gravity compensation of bodies": M.body_gravcomp,
            "forces of a fluid (density, viscosity, wind)": (M.opt.density, M.opt.viscosity),
            "nonlinear stiffness or damping of joints": np.append(
                *(np.ravel(getattr(M, what, 0.0)) for what in ("jnt_stiffnesspoly", "dof_dampingpoly"))
            ),
            "ranges of actuator forces of joints": M.jnt_actfrclimited,
        }
        self.unused += [what for what, values in effects.items() if np.any(values)]
        if (M.geom_contype | M.geom_conaffinity).any():
            self.unused.append("contact of geoms (add shapes without looks=True, and fb.Contact)")
        if self.unused:
            warn_user(f"{self.path.name}: not used: {'; '.join(dict.fromkeys(self.unused))}", ModelWarning)
        if self.tendons.out_of_range:
            warn_user(
                f"{self.path.name}: {'; '.join(self.tendons.out_of_range)}. A motion cannot begin there: add Initial "
                f"elements that bring it into the range",
                ModelWarning,
            )
