"""The truck in Exudyn, the robot under computed torque in MuJoCo and Pinocchio, the tracked vehicle in MuJoCo.

All read their numbers from flyball's own description of the mechanism.
"""

from __future__ import annotations

import ctypes
import time
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pinocchio as pin
from exudyn_run import IMPLICIT, exu, integrate, item, stored
from native_motor import add_clock, pointer
from numba import carray, cfunc
from peer_exudyn_spatial import turned
from scipy.integrate import solve_ivp

import flyball as fb

RK4 = "mjINT_RK4"


class ExudynTruck:
    """Bodies, joints, springs and bushings of a flyball mechanism; tyres are Exudyn's rolling discs on the plane z = 0.

    A rolling disc has the stiffness and damping of the tyre; its friction is linear in the slip velocity, with the
    slope that the tyre's slip stiffness has at ``speed``, up to Coulomb's limit. It has no relaxation length, trail
    or rolling resistance, and one slope for both directions.
    """

    def __init__(self, m: fb.Mechanism, tyre: fb.FialaTyre, speed: float, watched: tuple[str, ...] = ()) -> None:
        self.system = exu.SystemContainer().AddSystem()
        self.ground = self.system.AddObject(item.ObjectGround(referencePosition=[0, 0, 0]))
        self.numbers = {b.name: self.body(b, m, speed) for b in m.bodies}
        self.centres = {b.name: np.array(b.position) for b in m.bodies}
        for j in m.joints:
            self.joint(j)
        for f in m.forces:
            self.force(f, m, tyre, speed)
        self.sensors = [self.sensor(name) for name in watched]
        self.system.Assemble()

    def body(self, b: fb.Body, m: fb.Mechanism, speed: float) -> Any:
        spin = m.environment()["v"] / 0.49 if any(b.angular_velocity or ()) else 0.0
        start = {"initialVelocities": [speed, 0, 0, 0, 0, 0.5 * spin, 0]}
        node = self.system.AddNode(item.NodeRigidBodyEP(referenceCoordinates=[*b.position, 1, 0, 0, 0], **start))
        six = [*b.inertia, 0, 0, 0]
        body = self.system.AddObject(item.ObjectRigidBody(mass=b.mass, inertia=six, nodeNumber=node))
        marker = self.system.AddMarker(item.MarkerBodyMass(bodyNumber=body))
        self.system.AddLoad(item.LoadMassProportional(markerNumber=marker, loadVector=list(m.gravity)))
        return body

    def marker(self, name: str, at: Any, R: np.ndarray | None = None) -> Any:
        place = np.eye(4)
        place[:3, :3] = np.eye(3) if R is None else R
        place[:3, 3] = np.asarray(at) - self.centres[name]
        return self.system.AddMarker(item.MarkerBodyRigid(bodyNumber=self.numbers[name], localHT=place))

    def joint(self, j: Any) -> None:
        if isinstance(j, fb.Spherical):
            ends = [self.marker(n, j.at) for n in (j.body_i, j.body_j)]
            self.system.AddObject(item.ObjectJointSpherical(markerNumbers=ends))
        elif isinstance(j, fb.Universal):
            first, second = map(np.asarray, j.axes)
            ends = [self.marker(n, j.at, turned(second, first)) for n in (j.body_i, j.body_j)]
            self.system.AddObject(item.ObjectJointGeneric(markerNumbers=ends, constrainedAxes=[1, 1, 1, 0, 1, 0]))
        else:
            ends = [self.marker(n, j.at, turned(np.asarray(j.axis))) for n in (j.body_i, j.body_j)]
            self.system.AddObject(item.ObjectJointRevoluteZ(markerNumbers=ends))
            if j.name.startswith("kingpin"):  # the driver holds the wheels straight
                held = {"stiffness": 2e5, "damping": 2e3}
                self.system.AddObject(item.ObjectConnectorTorsionalSpringDamper(markerNumbers=ends, **held))

    def force(self, f: Any, m: fb.Mechanism, tyre: fb.FialaTyre, speed: float) -> None:
        if isinstance(f, fb.SpringDamper):
            ends = [self.marker(n, x) for n, x in zip((f.body_i, f.body_j), f.at, strict=True)]
            drawn = float(np.linalg.norm(np.subtract(*f.at)))
            numbers = {"stiffness": f.stiffness, "damping": f.damping, "referenceLength": f.length or drawn}
            self.system.AddObject(item.ObjectConnectorSpringDamper(markerNumbers=ends, **numbers))
        elif isinstance(f, fb.Bushing):
            ends = [self.marker(n, f.at) for n in (f.body_i, f.body_j)]
            six = [
                np.diag(np.r_[np.ones(3) * k, np.ones(3) * turn])
                for k, turn in ((f.stiffness, f.torsional_stiffness), (f.damping, f.torsional_damping))
            ]
            connector = item.ObjectConnectorRigidBodySpringDamper
            self.system.AddObject(connector(markerNumbers=ends, stiffness=six[0], damping=six[1]))
        elif isinstance(f, fb.Tyre):
            wheel = f.body_j
            road = self.system.AddMarker(item.MarkerBodyRigid(bodyNumber=self.ground))
            ends = [road, self.marker(wheel, self.centres[wheel])]
            data = self.system.AddNode(item.NodeGenericData(initialCoordinates=[0, 0, 0], numberOfDataCoordinates=3))
            disc = {"discRadius": tyre.radius, "discAxis": [0, 1, 0], "contactStiffness": tyre.stiffness}
            zone = tyre.friction * tyre.nominal_load * speed / tyre.slip_stiffness
            disc |= {"contactDamping": tyre.damping, "dryFriction": [tyre.friction] * 2}
            disc |= {"dryFrictionProportionalZone": zone, "useLinearProportionalZone": True}
            made = item.ObjectConnectorRollingDiscPenalty(markerNumbers=ends, nodeNumber=data, **disc)
            self.system.AddObject(made)

    def sensor(self, name: str) -> Any:
        place = {"bodyNumber": self.numbers[name], "localPosition": [0, 0, 0]}
        kind = exu.OutputVariableType.Position
        return self.system.AddSensor(item.SensorBody(**place, outputVariableType=kind, storeInternal=True))


def exudyn_truck(m: fb.Mechanism, tyre: Any, speed: float, t_end: float, setting: str, n: float, samples: int) -> Any:
    """(positions of all bodies, (times, bodies, 3); CPU seconds)."""
    if setting not in IMPLICIT:
        raise ValueError(f"{setting} is no setting of Exudyn here")
    built = ExudynTruck(m, tyre, speed, tuple(b.name for b in m.bodies) if samples else ())
    seconds = integrate(built.system, t_end, n, setting, samples, dense=False)
    if not samples:
        return None, seconds
    return np.stack(stored(built.system, built.sensors, samples), axis=1), seconds


class ArmNumbers:
    """Numbers of the robot with elastic gears, and the path its controller follows."""

    def __init__(self, example: Any, axes: int) -> None:
        self.axes, self.example = axes, example
        self.reach = np.array(example.REACH[:axes])
        self.rotors, self.stiffness = np.array(example.ROTORS[:axes]), np.array(example.STIFFNESS[:axes])
        self.kp, self.kd, self.duration = 100.0, 20.0, example.DURATION

    def path(self, t: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Reference with its rate and acceleration."""
        s, d = min(max(t / self.duration, 0.0), 1.0), self.duration
        shape = s**3 * (10 - 15 * s + 6 * s * s), 30 * s * s * (1 - s) ** 2 / d, 60 * s * (1 - s) * (1 - 2 * s) / d**2
        return tuple(self.reach * x for x in shape)


def arm_spec(a: ArmNumbers, elastic: bool, h: float) -> Any:
    """MuJoCo's model of the robot; without rotors the one that the controller knows."""
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    spec.option.gravity, spec.option.timestep = (0, 0, -9.81), h
    spec.option.integrator = getattr(mujoco.mjtIntegrator, RK4)
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    above, below = spec.worldbody, 0.0
    e = a.example
    for k in range(a.axes):
        at = (0, 0, below)
        if elastic:
            own = {"mass": 0.5, "inertia": [a.rotors[k]] * 3, "ipos": (0, 0, 0)}
            rotor = above.add_body(name=f"rotor{k}", pos=at, explicitinertial=True, **own)
            rotor.add_joint(name=f"motor{k}", type=mujoco.mjtJoint.mjJNT_HINGE, axis=e.axis(k))
        wide = 0.01 + e.MASSES[k] * e.LENGTHS[k] ** 2 / 12
        own = {"mass": e.MASSES[k], "inertia": (wide, wide, 0.01), "ipos": (0, 0, e.LENGTHS[k] / 2)}
        above = above.add_body(name=f"link{k}", pos=at, explicitinertial=True, **own)
        above.add_joint(name=f"joint{k}", type=mujoco.mjtJoint.mjJNT_HINGE, axis=e.axis(k))
        below = e.LENGTHS[k]
        if elastic:
            gear = spec.add_tendon(
                name=f"gear{k}", stiffness=[a.stiffness[k], 0, 0], damping=[1e-3 * a.stiffness[k], 0, 0]
            )
            gear.springlength = [0.0, 0.0]
            gear.wrap_joint(f"joint{k}", 1.0)
            gear.wrap_joint(f"motor{k}", -1.0)
    if elastic:
        add_clock(spec, "joint0")
    return spec.compile()


_kept: list[Any] = []  # what MuJoCo's callback reads


def install_computed_torque(a: ArmNumbers, model: Any, data: Any) -> None:
    """Have a compiled callback call `mj_inverse` of the rigid model, so that no Python runs within steps."""
    rigid = arm_spec(a, False, 1e-3)
    known = mujoco.MjData(rigid)
    library = ctypes.CDLL(str(next(Path(mujoco.__file__).parent.glob("libmujoco.so*"))))
    inverse = library.mj_inverse
    inverse.argtypes, inverse.restype = [ctypes.c_void_p, ctypes.c_void_p], None
    n, joints = a.axes, [model.joint(f"joint{k}").dofadr[0] for k in range(a.axes)]
    motors = [model.joint(f"motor{k}").dofadr[0] for k in range(n)]
    joints, motors = np.array(joints), np.array(motors)
    act, qpos, qvel, force = (x.ctypes.data for x in (data.act, data.qpos, data.qvel, data.qfrc_applied))
    q1, v1, a1, f1 = (x.ctypes.data for x in (known.qpos, known.qvel, known.qacc, known.qfrc_inverse))
    where, what, nv = rigid._address, known._address, model.nv
    reach, rotors, kp, kd, d = a.reach, a.rotors, a.kp, a.kd, a.duration

    @cfunc("void(voidptr, voidptr)")
    def control(_model, _data):
        t = carray(pointer(act), 1)[0]
        q, v, f = carray(pointer(qpos), nv), carray(pointer(qvel), nv), carray(pointer(force), nv)
        q_, v_, a_, f_ = (
            carray(pointer(q1), n),
            carray(pointer(v1), n),
            carray(pointer(a1), n),
            carray(pointer(f1), n),
        )
        s = min(max(t / d, 0.0), 1.0)
        r, rd = s**3 * (10 - 15 * s + 6 * s * s), 30 * s * s * (1 - s) ** 2 / d
        rdd = 60 * s * (1 - s) * (1 - 2 * s) / d**2
        for k in range(n):
            q_[k], v_[k] = q[joints[k]], v[joints[k]]
            a_[k] = rdd * reach[k] + kd * (rd * reach[k] - v_[k]) + kp * (r * reach[k] - q_[k])
        inverse(where, what)
        for k in range(n):
            f[motors[k]] = f_[k] + rotors[k] * a_[k]

    data.ctrl[:] = 1.0
    _kept[:] = [control, rigid, known, library]
    mujoco.set_mjcb_control(control.ctypes)


def mujoco_arm(a: ArmNumbers, t_end: float, n: float, samples: int) -> Any:
    """(angles of the links, (times, axes); CPU seconds)."""
    mujoco.set_mjcb_control(None)
    model = arm_spec(a, True, t_end / int(n))
    data = mujoco.MjData(model)
    install_computed_torque(a, model, data)
    joints = [model.joint(f"joint{k}").qposadr[0] for k in range(a.axes)]
    at = np.unique(np.linspace(0, int(n), (samples or 1) + 1).round().astype(int))
    q = [data.qpos[joints].copy()]
    begin = time.process_time()
    for count in np.diff(at):
        mujoco.mj_step(model, data, nstep=int(count))
        q.append(data.qpos[joints].copy())
    seconds = time.process_time() - begin
    mujoco.set_mjcb_control(None)
    if any(w.number for w in data.warning) or not np.isfinite(q[-1]).all():
        raise RuntimeError("MuJoCo warned of an unstable simulation")
    return np.array(q), seconds


def pinocchio_model(a: ArmNumbers, elastic: bool) -> tuple[Any, list[int], list[int]]:
    """(model, places of the links' joints, of the motors)."""
    model, above, below, joints, motors = pin.Model(), 0, 0.0, [], []
    model.gravity.linear = np.array([0, 0, -9.81])
    e = a.example
    for k in range(a.axes):
        at = pin.SE3(np.eye(3), np.array([0, 0, below]))
        kind = pin.JointModelRY if k % 2 else pin.JointModelRZ
        if elastic:
            motors.append(model.addJoint(above, kind(), at, f"motor{k}"))
            inertia = pin.Inertia(0.5, np.zeros(3), a.rotors[k] * np.eye(3))
            model.appendBodyToJoint(motors[-1], inertia, pin.SE3.Identity())
        wide = 0.01 + e.MASSES[k] * e.LENGTHS[k] ** 2 / 12
        link = pin.Inertia(e.MASSES[k], np.array([0, 0, e.LENGTHS[k] / 2]), np.diag((wide, wide, 0.01)))
        above = model.addJoint(above, kind(), at, f"joint{k}")
        joints.append(above)
        model.appendBodyToJoint(above, link, pin.SE3.Identity())
        below = e.LENGTHS[k]
    return model, [j - 1 for j in joints], [j - 1 for j in motors]


def pinocchio_arm(a: ArmNumbers, t_end: float, tolerance: float, samples: int) -> Any:
    """`rnea` for the controller and `aba` for the robot, in SciPy's DOP853."""
    full, joints, motors = pinocchio_model(a, True)
    rigid, *_ = pinocchio_model(a, False)
    data, known, n = full.createData(), rigid.createData(), full.nv
    tau = np.zeros(n)

    def rate(t: float, y: np.ndarray) -> np.ndarray:
        q, v = y[:n], y[n:]
        ql, vl = q[joints], v[joints]
        r, rd, rdd = a.path(t)
        acc = rdd + a.kd * (rd - vl) + a.kp * (r - ql)
        twist = a.stiffness * (ql - q[motors]) + 1e-3 * a.stiffness * (vl - v[motors])
        tau[joints] = -twist
        tau[motors] = twist + pin.rnea(rigid, known, ql, vl, acc) + a.rotors * acc
        return np.concatenate([v, pin.aba(full, data, q, v, tau)])

    times = np.linspace(0.0, t_end, (samples or 1) + 1)
    begin = time.process_time()
    s = solve_ivp(rate, (0.0, t_end), np.zeros(2 * n), "DOP853", times, rtol=tolerance, atol=tolerance)
    seconds = time.process_time() - begin
    if not s.success:
        raise RuntimeError(s.message)
    return s.y[joints].T, seconds


class MujocoTrack:
    """The tracked vehicle: hull with its wheels as a tree, shoes as a chain whose last pin is a stiff equality."""

    def __init__(self, m: fb.Mechanism, h: float, solref: tuple[float, float]) -> None:
        self.m, self.spec = m, mujoco.MjSpec()
        s = self.spec
        s.compiler.degree = False
        s.option.gravity, s.option.timestep = (0, -9.81, 0), h
        s.option.integrator, s.option.cone = mujoco.mjtIntegrator.mjINT_IMPLICITFAST, mujoco.mjtCone.mjCONE_ELLIPTIC
        self.soft = {"solref": solref, "solimp": (0.99, 0.999, 0.001, 0.5, 2)}
        self.shapes = {b.name: b.shape if isinstance(b.shape, (list, tuple)) else (b.shape,) for b in m.bodies}
        self.bodies: dict[str, Any] = {}
        self.at = {b.name: np.array([*b.position, 0.0]) for b in m.bodies}
        self.by_name = {b.name: b for b in m.bodies}
        plane = s.worldbody.add_geom(
            type=mujoco.mjtGeom.mjGEOM_PLANE, size=(0, 0, 1), quat=(0.5**0.5, -(0.5**0.5), 0, 0)
        )
        plane.contype, plane.conaffinity, plane.friction = 4, 0, (0.8, 0, 0)
        plane.condim, plane.solref, plane.solimp = 3, *self.soft.values()
        self.free("hull")
        self.tree()
        self.model = s.compile()

    def add(self, name: str, parent: Any, below: np.ndarray, turn: float = 0.0) -> Any:
        """A body; frames have the body's own angle, so that shapes are as drawn."""
        b = self.by_name[name]
        angle = float(b.angle) - turn
        c, sn = np.cos(turn), np.sin(turn)
        d = self.at[name] - below
        pos = (c * d[0] + sn * d[1], -sn * d[0] + c * d[1], 0)
        made = parent.add_body(name=name, pos=pos, quat=(np.cos(angle / 2), 0, 0, np.sin(angle / 2)))
        mass = float(b.mass)
        inertia = float(b.inertia) if b.inertia is not None else mass * (0.1125**2 + 0.03**2) / 12
        made.mass, made.inertia, made.ipos, made.explicitinertial = mass, [inertia] * 3, (0, 0, 0), True
        self.bodies[name] = made
        for k, shape in enumerate(self.shapes[name]):
            if shape is not None and not shape.looks:
                self.geom(made, name, k, shape)
        return made

    def geom(self, body: Any, name: str, k: int, shape: Any) -> None:
        """A plate (bits 1: wheels, 4: soil), or part of a wheel."""
        kinds = mujoco.mjtGeom
        if isinstance(shape, fb.Box):
            g = body.add_geom(type=kinds.mjGEOM_BOX, size=[0.5 * x for x in shape.edges])
        elif isinstance(shape, fb.Cylinder):
            g = body.add_geom(type=kinds.mjGEOM_CYLINDER, size=(shape.radius, 0.5 * float(shape.length), 0))
        else:
            outline = np.array(shape.outline, float)[:, :2]
            corners = np.vstack([np.c_[outline, np.full(len(outline), z)] for z in (-0.15, 0.15)])
            mesh = self.spec.add_mesh(name=f"{name} {k}", uservert=corners.ravel())
            mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_CONVEX
            g = body.add_geom(type=kinds.mjGEOM_MESH, meshname=mesh.name)
        plate = "shoe" in name
        g.contype, g.conaffinity = (0, 5) if plate else (1, 0)
        g.friction, g.condim = ((0.8 if plate else 0.3), 0, 0), 3
        g.priority = 0 if plate else 1
        g.solref, g.solimp = self.soft.values()

    def free(self, name: str) -> Any:
        """A body that moves freely in the plane."""
        body = self.add(name, self.spec.worldbody, np.zeros(3))
        turn = float(self.by_name[name].angle)
        c, s = np.cos(turn), np.sin(turn)
        slide = mujoco.mjtJoint.mjJNT_SLIDE
        body.add_joint(name=f"{name}:x", type=slide, axis=(c, -s, 0))
        body.add_joint(name=f"{name}:y", type=slide, axis=(s, c, 0))
        body.add_joint(name=f"{name}:angle", type=mujoco.mjtJoint.mjJNT_HINGE, axis=(0, 0, 1))
        return body

    def tree(self) -> None:
        """Joints in the order of the mechanism; a pin whose shoes both exist closes the chain."""
        springs = {}
        for f in self.m.forces:
            if isinstance(f, fb.TorsionalSpringDamper):
                springs[f.joint] = f.stiffness, f.damping, f.angle
            elif isinstance(f, fb.CoordinateSpring):
                springs[f.coordinate.removesuffix(".displacement")] = f.stiffness, f.damping, f.rest
        for j in self.m.joints:
            i = j.body_i
            if i not in self.bodies:
                self.free(i)
            turn = float(self.by_name[i].angle)
            if j.body_j in self.bodies:
                self.close(j)
                continue
            body = self.add(j.body_j, self.bodies[i], self.at[i], turn)
            own = float(self.by_name[j.body_j].angle)
            d = np.array([*j.at, 0.0]) - self.at[j.body_j]
            c, s = np.cos(own), np.sin(own)
            place = (c * d[0] + s * d[1], -s * d[0] + c * d[1], 0)
            hinge = isinstance(j, fb.Revolute)
            kind = mujoco.mjtJoint.mjJNT_HINGE if hinge else mujoco.mjtJoint.mjJNT_SLIDE
            made = body.add_joint(name=j.name, type=kind, pos=place, axis=(0, 0, 1) if hinge else (*j.axis, 0))
            if j.name in springs:
                k, damping, rest = springs[j.name]
                made.stiffness, made.damping, made.springref = [k, 0, 0], [damping, 0, 0], rest
            if j.name == "track.sprocket_axle":
                drive = self.spec.add_actuator(name="drive", target=j.name)
                drive.trntype = mujoco.mjtTrn.mjTRN_JOINT
                drive.set_to_velocity(kv=2e4)

    def close(self, j: Any) -> None:
        """The last pin."""
        for name in (j.body_i, j.body_j):
            d = np.array([*j.at, 0.0]) - self.at[name]
            angle = float(self.by_name[name].angle)
            c, s = np.cos(angle), np.sin(angle)
            self.bodies[name].add_site(name=f"{name} end", pos=(c * d[0] + s * d[1], -s * d[0] + c * d[1], 0))
        kind = {"type": mujoco.mjtEq.mjEQ_CONNECT, "objtype": mujoco.mjtObj.mjOBJ_SITE}
        self.spec.add_equality(name1=f"{j.body_i} end", name2=f"{j.body_j} end", **kind, **self.soft)


def mujoco_track(m: fb.Mechanism, speed: float, t_end: float, h: float, solref: tuple[float, float]) -> dict[str, Any]:
    """Speeds of hull and sprocket, forces of contact with the soil, largest overlap and CPU seconds."""
    mujoco.set_mjcb_control(None)
    built = MujocoTrack(m, h, solref)
    model, data = built.model, mujoco.MjData(built.model)
    ramp = 1.0 / (0.15 * 13 / (2 * np.pi))
    hull, axle = model.joint("hull:x").dofadr[0], model.joint("track.sprocket_axle").dofadr[0]
    rows, seconds, overlap = [], 0.0, 0.0
    for k in range(round(t_end / 0.02)):
        s = np.clip(0.02 * k - 0.5, 0.0, 1.0)
        data.ctrl[0] = -speed * ramp * s * s * (3 - 2 * s)
        begin = time.process_time()
        mujoco.mj_step(model, data, nstep=max(1, round(0.02 / h)))
        seconds += time.process_time() - begin
        soil, force = 0.0, np.zeros(6)
        for c in range(data.ncon):
            overlap = min(overlap, data.contact[c].dist)
            if 0 in (data.contact[c].geom[0], data.contact[c].geom[1]):
                mujoco.mj_contactForce(model, data, c, force)
                soil += force[0]
        rows.append((data.qvel[hull], data.qvel[axle], soil, data.ncon))
    if any(w.number for w in data.warning):
        raise RuntimeError("MuJoCo warned of an unstable simulation")
    found = np.array(rows)
    late = found[len(found) // 2 :].mean(axis=0)
    return {"speed": late[0], "sprocket": -late[1] / ramp, "soil": late[2], "overlap": -overlap, "seconds": seconds,
            "contacts": late[3]}  # fmt: skip
