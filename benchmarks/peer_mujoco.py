"""A tree in MuJoCo: hinges and slides, loops closed by soft ``connect`` equalities as stiff as the step allows.

With MuJoCo's default softness it is another mechanism (the N-four-bar loses 0.9 J of 25 for N = 1 at any step), so
``solref`` and ``solimp`` are set as its documentation advises for stiff constraints: a time constant of two steps,
critical damping. Springs between points are tendons. Motors are a compiled callback. A link with six freedoms has a
free joint.
"""

from __future__ import annotations

import time

import mujoco
import native_motor
import numpy as np
from trees import Link, Motion, Tree, mounted

from mechanisms import GROUND

SETTINGS = {
    "RK4, stiff": 2.0,
    "RK4, softer (4 steps)": 4.0,
    "implicitfast, stiff": 2.0,
    "implicit, stiff": 2.0,
}  # time constant of the constraints in steps
JOINT = mujoco.mjtObj.mjOBJ_JOINT
FREE = 6  # joints of a link that are one free joint
IMPEDANCE = (0.9999, 0.9999, 0.001, 0.5, 2.0)
mujoco.set_mju_user_warning(lambda text: None)  # an unstable run is told by its data, not by a log file


def build(tree: Tree, h: float, setting: str):
    """The compiled model."""
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    spec.option.gravity = tree.gravity
    spec.option.integrator = getattr(mujoco.mjtIntegrator, "mjINT_" + setting.partition(",")[0].upper())
    spec.option.timestep = h
    spec.option.tolerance, spec.option.iterations = 1e-14, 50
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    bodies: list = []
    count = 0
    for link in tree.links:
        above = spec.worldbody if link.parent == GROUND else bodies[link.parent]
        bodies.append(add_body(above, link, origin(tree, link.parent), count))
        count += len(link.axes)

    def site(k: int, x: np.ndarray, name: str) -> str:
        on = spec.worldbody if k == GROUND else bodies[k]
        on.add_site(name=name, pos=x - origin(tree, k))
        return name

    stiff = {"solref": (SETTINGS[setting] * h, 1.0), "solimp": IMPEDANCE}
    kind = {"type": mujoco.mjtEq.mjEQ_CONNECT, "objtype": mujoco.mjtObj.mjOBJ_SITE}
    for n, (i, j, x) in enumerate((c.i, c.j, x) for c in tree.cuts for x in c.points):
        names = {"name1": site(i, x, f"i{n}"), "name2": site(j, x, f"j{n}")}
        spec.add_equality(**names, **kind, **stiff)
    for n, s in enumerate(tree.springs):
        forces = {"stiffness": [s.stiffness, 0, 0], "damping": [s.damping, 0, 0], "springlength": [s.length] * 2}
        tendon = spec.add_tendon(name=f"spring{n}", **forces)
        tendon.wrap_site(site(s.i, s.at_i, f"from{n}"))
        tendon.wrap_site(site(s.j, s.at_j, f"to{n}"))
    if tree.motors:
        native_motor.add_clock(spec, f"joint{tree.motors[0].axis}")
    return spec.compile()


def origin(tree: Tree, k: int) -> np.ndarray:
    """Where a link's frame is drawn: at its first joint."""
    return np.zeros(3) if k == GROUND else tree.links[k].axes[0].point


def add_body(above, link: Link, below: np.ndarray, first: int):
    """A link with its joints, the first of that number; ``below``: where the frame is drawn that it hangs on."""
    at = link.axes[0].point
    body = above.add_body(name=link.name, pos=at - below)
    body.mass, body.ipos, body.explicitinertial = link.mass, link.centre - at, True
    J = np.asarray(link.inertia)
    if np.count_nonzero(J - np.diag(np.diag(J))):
        body.fullinertia = (J[0, 0], J[1, 1], J[2, 2], J[0, 1], J[0, 2], J[1, 2])
    else:
        body.inertia = np.diag(J)
    if len(link.axes) == FREE and not mounted(link):
        body.add_freejoint(name=f"joint{first}")
        return body
    for k, a in enumerate(link.axes):
        kind = mujoco.mjtJoint.mjJNT_HINGE if a.kind == "hinge" else mujoco.mjtJoint.mjJNT_SLIDE
        joint = body.add_joint(name=f"joint{first + k}", type=kind, pos=a.point - at, axis=a.direction)
        if a.stiffness or a.damping:
            joint.stiffness, joint.springref, joint.damping = [a.stiffness, 0, 0], a.rest, [a.damping, 0, 0]
    return body


def start_rates(tree: Tree) -> np.ndarray:
    """Rates in MuJoCo's order: of a free joint its velocity, then its angular velocity about x, y, z.

    Raises
    ------
    ValueError
        If six freedoms are not three slides along x, y, z and three hinges about z, y, x.
    """
    out, n = np.array(tree.rates), 0
    for link in tree.links:
        if len(link.axes) == FREE and not mounted(link):
            if not np.array_equal([a.direction for a in link.axes], np.eye(3)[[0, 1, 2, 2, 1, 0]]):
                raise ValueError(f"{link.name}: six freedoms that are no free joint")
            out[n + 3 : n + 6] = out[n + 3 : n + 6][::-1].copy()
        n += len(link.axes)
    return out


def ready(tree: Tree, h: float, setting: str):
    """(model, data) at the start."""
    mujoco.set_mjcb_control(None)  # that of another run writes where its data were
    model = build(tree, h, setting)
    data = mujoco.MjData(model)
    data.qvel[:] = start_rates(tree)
    if tree.motors:
        names = [f"joint{k}" for k in range(len(tree.axes))]
        native_motor.install(tree, model, data, [mujoco.mj_name2id(model, JOINT, name) for name in names])
    return model, data


def solve(tree: Tree, t_end: float, steps: float, setting: str, samples: int = 0):
    """Integrate. Returns (motion, CPU seconds of the stepping); no motion where samples is 0.

    Raises
    ------
    RuntimeError
        If MuJoCo warns of an unstable simulation.
    """
    steps = int(steps)
    model, data = ready(tree, t_end / steps, setting)
    if not samples:
        begin = time.process_time()
        mujoco.mj_step(model, data, nstep=steps)
        return None, time.process_time() - begin
    at = np.unique(np.linspace(0, steps, samples + 1).round().astype(int))
    q, v = [data.qpos.copy()], [data.qvel.copy()]
    begin = time.process_time()
    for count in np.diff(at):
        mujoco.mj_step(model, data, nstep=int(count))
        q.append(data.qpos.copy())
        v.append(data.qvel.copy())
    seconds = time.process_time() - begin
    if any(w.number for w in data.warning):
        raise RuntimeError("MuJoCo warned of an unstable simulation")
    return motion(model, q, v), seconds


def motion(model, q, v) -> Motion:
    """Motion of the links, from coordinates and rates at some times."""
    data = mujoco.MjData(model)
    links = model.nbody - 1
    twists = np.zeros((len(q), links, 6))
    p, R = np.zeros((len(q), links, 3)), np.zeros((len(q), links, 3, 3))
    one = np.zeros(6)
    for n in range(len(q)):
        data.qpos[:], data.qvel[:] = q[n], v[n]
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_comVel(model, data)
        p[n], R[n] = data.xipos[1:], data.xmat[1:].reshape(-1, 3, 3)
        for k in range(links):
            mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_BODY, k + 1, one, 0)
            twists[n, k] = one
    return Motion(p, R, twists[:, :, 3:], twists[:, :, :3])


def start_accelerations(tree: Tree) -> np.ndarray:
    """Acceleration of each centre and angular acceleration, (links, 6), at the start; soft by a part of 1e-4."""
    model, data = ready(tree, 1e-4, next(iter(SETTINGS)))
    mujoco.mj_forward(model, data)
    mujoco.mj_rnePostConstraint(model, data)
    out, one = [], np.zeros(6)
    for k in range(1, model.nbody):
        mujoco.mj_objectAcceleration(model, data, mujoco.mjtObj.mjOBJ_BODY, k, one, 0)
        out.append(np.r_[one[3:] + tree.gravity, one[:3]])
    return np.array(out)
