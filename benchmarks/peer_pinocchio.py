"""The N-four-bar in Pinocchio: a tree of hinges closed by rigid constraints, ``constraintDynamics`` inside an RK4.

Pinocchio has no time integrator; the one here is written in Python, which costs it 10 to 20 us a step.
"""

from __future__ import annotations

import time

import numpy as np
import pinocchio as pin

from mechanisms import GRAVITY, ROD, from_tree

SETTINGS = {"constraintDynamics, Python RK4": 0.2}  # label -> Baumgarte damping rate times step
THIN = 1e-6


def build(n: int, damping: float):
    """(model, constraints): upright rods on ground, each but the last carrying a level one, and the cut joints."""
    model = pin.Model()
    model.gravity.linear = np.array([0.0, -GRAVITY, 0.0])
    upright = pin.Inertia(1.0, np.array([0.0, 0.5, 0.0]), np.diag([ROD, THIN, ROD]))
    flat = pin.Inertia(1.0, np.array([0.5, 0.0, 0.0]), np.diag([THIN, ROD, ROD]))
    x, y = (pin.SE3(np.eye(3), np.eye(3)[k]) for k in range(2))
    up, level = [], []
    for i in range(n + 1):
        foot = pin.SE3(np.eye(3), np.array([float(i), 0.0, 0.0]))
        up.append(model.addJoint(0, pin.JointModelRZ(), foot, f"up{i}"))
        model.appendBodyToJoint(up[-1], upright, pin.SE3.Identity())
        if i < n:
            level.append(model.addJoint(up[-1], pin.JointModelRZ(), y, f"level{i}"))
            model.appendBodyToJoint(level[-1], flat, pin.SE3.Identity())
    cuts = pin.StdVec_RigidConstraintModel()
    for i in range(n):
        cut = pin.RigidConstraintModel(pin.ContactType.CONTACT_3D, model, level[i], x, up[i + 1], y)
        cut.setBaumgarteCorrectorParameters(pin.BaumgarteCorrectorParameters(damping**2 / 4, damping))
        cuts.append(cut)
    return model, cuts, [model.joints[j].idx_v for j in up], [model.joints[j].idx_v for j in level]


def solve(n: int, t_end: float, steps: int, setting: str, samples: int = 0):
    """Integrate. Returns (coordinates, rates, CPU seconds of the stepping); no arrays where samples is 0."""
    h = t_end / steps
    model, cuts, up, level = build(n, SETTINGS[setting] / h)
    data = model.createData()
    work = pin.StdVec_RigidConstraintData([c.createData() for c in cuts])
    pin.initConstraintDynamics(model, data, cuts, work)
    proximal = pin.ProximalSettings(1e-12, 1e-8, 20)
    q, v, tau = np.zeros(model.nq), np.zeros(model.nv), np.zeros(model.nv)
    v[up], v[level] = -1.0, 1.0

    def acceleration(q, v):
        return pin.constraintDynamics(model, data, q, v, tau, cuts, work, proximal).copy()

    kept = set(np.linspace(0, steps, samples + 1).round().astype(int).tolist()) if samples else set()
    angle, rate = [], []
    begin = time.process_time()
    for k in range(steps + 1):
        if k in kept:
            angle.append(q)
            rate.append(v)
        if k < steps:
            q, v = runge_kutta(acceleration, q, v, h)
    seconds = time.process_time() - begin
    if not samples:
        return None, None, seconds
    order = np.array(up + level)
    return *from_tree(n, np.array(angle)[:, order], np.array(rate)[:, order]), seconds


def runge_kutta(acceleration, q, v, h):
    """One step of the classical method of order 4."""
    a1 = acceleration(q, v)
    v2 = v + h / 2 * a1
    a2 = acceleration(q + h / 2 * v, v2)
    v3 = v + h / 2 * a2
    a3 = acceleration(q + h / 2 * v2, v3)
    v4 = v + h * a3
    a4 = acceleration(q + h * v3, v4)
    return q + h / 6 * (v + 2 * v2 + 2 * v3 + v4), v + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
