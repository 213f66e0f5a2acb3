"""A tree in Pinocchio: hinges and slides, loops closed by rigid constraints.

Pinocchio has no time integrator. One setting is a classical Runge-Kutta method written in Python, which costs it 10 to
20 us a step; the other is SciPy's DOP853 with error control. Without loops the accelerations are those of the
articulated-body algorithm, else those of ``constraintDynamics`` with Baumgarte's correction. (At the N-four-bar's
singular positions DOP853 gets stuck or errs by tens of joules at any tolerance; fixed steps pass them.)
"""

from __future__ import annotations

import time

import numpy as np
import pinocchio as pin
from steppers import controlled, fixed_steps
from trees import Axis, Motion, Tree

from mechanisms import GROUND

# label -> (fixed steps or not, Baumgarte's damping rate [1/s], or with fixed steps and below 1: times the step)
SETTINGS = {
    "Python RK4": (True, 0.2),
    "Python RK4, 5/s": (True, 5.0),
    "SciPy DOP853": (False, 5.0),
    "SciPy DOP853, 20/s": (False, 20.0),
}
ROUNDS = pin.ProximalSettings(1e-12, 1e-8, 20)
REDUNDANT = pin.ProximalSettings(1e-10, 1e-3, 50)  # a smaller regularisation blows up what rounding leaves of a gap


def joint(a: Axis):
    """Joint model of an axis; those along a coordinate axis have their own, faster ones."""
    names = ("X", "Y", "Z")
    if np.count_nonzero(a.direction) == 1 and a.direction.sum() == 1.0:
        return getattr(pin, f"JointModel{'R' if a.kind == 'hinge' else 'P'}{names[int(a.direction.argmax())]}")()
    return (pin.JointModelRevoluteUnaligned if a.kind == "hinge" else pin.JointModelPrismaticUnaligned)(a.direction)


class Built:
    """The model; the frame of every joint is drawn at its point, along the world's axes."""

    def __init__(self, tree: Tree) -> None:
        self.tree = tree
        self.model = pin.Model()
        self.model.gravity.linear = tree.gravity
        self.last: list[int] = []  # joint that carries each link
        self.at = [np.zeros(3)]  # of each joint, where it is drawn
        for link in tree.links:
            parent = 0 if link.parent == GROUND else self.last[link.parent]
            for a in link.axes:
                shift = pin.SE3(np.eye(3), a.point - self.at[parent])
                parent = self.model.addJoint(parent, joint(a), shift, f"joint{len(self.at)}")
                self.at.append(np.asarray(a.point))
            inertia = pin.Inertia(link.mass, link.centre - self.at[parent], np.asarray(link.inertia))
            self.model.appendBodyToJoint(parent, inertia, pin.SE3.Identity())
            self.last.append(parent)
        self.order = np.array([self.model.joints[k].idx_v for k in range(1, len(self.at))])
        self.data = self.model.createData()

    def start(self) -> tuple[np.ndarray, np.ndarray]:
        """Coordinates and rates."""
        v = np.zeros(self.model.nv)
        v[self.order] = self.tree.rates
        return np.zeros(self.model.nq), v

    def acceleration(self, rate: float):
        """Function of (t, q, v); ``rate``: Baumgarte's damping rate [1/s]."""
        effort, solve = self.effort(), self.solver(rate)
        return lambda t, q, v: solve(q, v, effort(t, q, v)).copy()

    def solver(self, rate: float):
        """Pinocchio's own function of (q, v, efforts): what of the right-hand side is compiled."""
        model, data = self.model, self.data
        if not self.tree.cuts:
            return lambda q, v, tau: pin.aba(model, data, q, v, tau)
        cuts = self.cuts(rate)
        work = pin.StdVec_RigidConstraintData([c.createData() for c in cuts])
        pin.initConstraintDynamics(model, data, cuts, work)
        rounds = REDUNDANT if self.tree.redundant else ROUNDS
        return lambda q, v, tau: pin.constraintDynamics(model, data, q, v, tau, cuts, work, rounds)

    def cuts(self, rate: float):
        """Rigid constraints: one for each point that a cut holds together."""
        out = pin.StdVec_RigidConstraintModel()
        for c in self.tree.cuts:
            i, j = (0 if k == GROUND else self.last[k] for k in (c.i, c.j))
            for x in c.points:
                places = (pin.SE3(np.eye(3), x - self.at[k]) for k in (i, j))
                first, second = places
                one = pin.RigidConstraintModel(pin.ContactType.CONTACT_3D, self.model, i, first, j, second)
                one.setBaumgarteCorrectorParameters(pin.BaumgarteCorrectorParameters(rate**2 / 4, rate))
                out.append(one)
        return out

    def effort(self):
        """Function of (t, q, v): efforts of springs and motors along joints.

        Raises
        ------
        ValueError
            If there are springs elsewhere.
        """
        if self.tree.springs:
            raise ValueError("springs between points are not built for this engine")
        axes, motors = self.tree.axes, self.tree.motors
        stiffness, rest, damping = np.zeros(self.model.nv), np.zeros(self.model.nv), np.zeros(self.model.nv)
        stiffness[self.order] = [a.stiffness for a in axes]
        rest[self.order] = [a.rest for a in axes]
        damping[self.order] = [a.damping for a in axes]
        zero = np.zeros(self.model.nv)
        if motors:
            place = self.order[[m.axis for m in motors]]
            kp, kd, swing, speed, given = np.array(
                [(m.stiffness, m.damping, m.swing, m.speed, m.torque) for m in motors]
            ).T

            def driven(t, q, v):
                turn = speed * t
                tau = stiffness * (rest - q) - damping * v
                tau[place] += given + kp * (swing * (1 - np.cos(turn)) - q[place])
                tau[place] += kd * (swing * speed * np.sin(turn) - v[place])
                return tau

            return driven
        if damping.any():
            return lambda t, q, v: stiffness * (rest - q) - damping * v
        if stiffness.any():
            return lambda t, q, v: stiffness * (rest - q)
        return lambda t, q, v: zero

    def motion(self, q: np.ndarray, v: np.ndarray) -> Motion:
        """Of the links, at coordinates and rates of shape (times, joints)."""
        out = [[], [], [], []]
        for one_q, one_v in zip(q, v, strict=True):
            pin.forwardKinematics(self.model, self.data, one_q, one_v)
            rows = [self.pose(k) for k in range(len(self.last))]
            for part, values in zip(out, zip(*rows, strict=True), strict=True):
                part.append(values)
        return Motion(*(np.array(part) for part in out))

    def pose(self, k: int):
        """Position of the centre, rotation, velocity of the centre and angular velocity of link k."""
        place, twist = self.data.oMi[self.last[k]], self.data.v[self.last[k]]
        R = place.rotation.copy()
        arm = self.tree.links[k].centre - self.at[self.last[k]]
        return place.act(arm), R, R @ (twist.linear + np.cross(twist.angular, arm)), R @ twist.angular


def solve(tree: Tree, t_end: float, resolution: float, setting: str, samples: int = 0):
    """Integrate. Returns (motion, CPU seconds of the stepping); no motion where samples is 0."""
    built, rate, (q, v, seconds) = integrated(tree, t_end, resolution, setting, samples)
    return (built.motion(q, v) if samples else None), seconds


def integrated(tree: Tree, t_end: float, resolution: float, setting: str, samples: int):
    """(model, Baumgarte's rate, (coordinates, rates, CPU seconds)) of a run."""
    built = Built(tree)
    fixed, rate = SETTINGS[setting]
    if fixed:
        rate = rate * resolution / t_end if rate < 1 else rate
        run = fixed_steps(built.acceleration(rate), *built.start(), t_end, int(resolution), samples)
    else:
        run = controlled(built.acceleration(rate), *built.start(), t_end, resolution, samples)
    return built, rate, run


def compiled_part(tree: Tree, t_end: float, resolution: float, setting: str, samples: int) -> float:
    """CPU seconds of Pinocchio's own calls in a run, without efforts and the integrator, which Python runs here.

    Their time at the states of the samples, times their number.
    """
    built, rate, (q, v, _) = integrated(tree, t_end, resolution, setting, samples)
    solve, effort = built.solver(rate), built.effort()
    tau = [effort(0.0, *state) for state in zip(q, v, strict=True)]
    states = list(zip(q, v, tau, strict=True))
    begin = time.process_time()
    for state in states:
        solve(*state)
    each = (time.process_time() - begin) / len(states)
    return each * calls(built, rate, t_end, resolution, setting)


def calls(built: Built, rate: float, t_end: float, resolution: float, setting: str) -> int:
    """How many right-hand sides a run takes."""
    if SETTINGS[setting][0]:
        return 4 * int(resolution)
    count = 0
    inner = built.acceleration(rate)

    def counted(t, q, v):
        nonlocal count
        count += 1
        return inner(t, q, v)

    controlled(counted, *built.start(), t_end, resolution, 0)
    return count


def start_accelerations(tree: Tree) -> np.ndarray:
    """Acceleration of each centre and angular acceleration, (links, 6), at the start."""
    built = Built(tree)
    q, v = built.start()
    a = built.acceleration(0.0)(0.0, q, v)
    pin.forwardKinematics(built.model, built.data, q, v, a)
    out = []
    for k, j in enumerate(built.last):
        R, twist, rate = built.data.oMi[j].rotation, built.data.v[j], built.data.a[j]
        arm = tree.links[k].centre - built.at[j]
        w, alpha = twist.angular, rate.angular
        linear = rate.linear + np.cross(w, twist.linear) + np.cross(alpha, arm) + np.cross(w, np.cross(w, arm))
        out.append(np.r_[R @ linear, R @ alpha])
    return np.array(out)
