"""A tree of hinges in Exudyn's ``KinematicTree``: joint coordinates, explicit solvers."""

from __future__ import annotations

import numpy as np
from exudyn_run import exu, integrate, item, stored
from trees import Motion, Tree

from mechanisms import GROUND

SETTINGS = ("RK44", "RK67", "DOPRI5")  # the last with error control


KINDS = {"hinge": "Revolute", "slide": "Prismatic"}


def build(tree: Tree, watched: bool):
    """(system, sensors of coordinates and rates). Each axis is a link of its own, without mass but for a body's last.

    Raises
    ------
    ValueError
        If there are loops, springs between points, motors, or axes that are not along a coordinate axis.
    """
    axes = tree.axes
    along = [np.flatnonzero(a.direction) for a in axes]
    if (
        tree.cuts
        or tree.springs
        or tree.motors
        or any(len(e) != 1 or a.direction[e[0]] != 1 for e, a in zip(along, axes))
    ):
        raise ValueError("only axes along x, y, z are built for this engine")
    n = len(axes)
    system = exu.SystemContainer().AddSystem()
    start = {"initialCoordinates": [0.0] * n, "initialCoordinates_t": list(tree.rates)}
    node = system.AddNode(item.NodeGenericODE2(referenceCoordinates=[0.0] * n, numberOfODE2Coordinates=n, **start))
    centres, inertias, turns, shifts = exu.Vector3DList(), exu.Matrix3DList(), exu.Matrix3DList(), exu.Vector3DList()
    masses, parents, last = [], [], []
    for link in tree.links:
        parent = -1 if link.parent == GROUND else last[link.parent]
        for a in link.axes:
            body = a is link.axes[-1]
            before = np.zeros(3) if parent < 0 else axes[parent].point
            shifts.Append(list(a.point - before))
            turns.Append(np.eye(3))
            centres.Append(list(link.centre - a.point) if body else [0, 0, 0])
            inertias.Append(np.asarray(link.inertia) if body else np.zeros((3, 3)))
            masses.append(link.mass if body else 0.0)
            parents.append(parent)
            parent = len(parents) - 1
        last.append(parent)
    kinds = [getattr(exu.JointType, KINDS[a.kind] + "XYZ"[e[0]]) for a, e in zip(axes, along, strict=True)]
    system.AddObject(item.ObjectKinematicTree(
        nodeNumber=node, jointTypes=kinds,
        linkParents=parents, jointTransformations=turns, jointOffsets=shifts, linkInertiasCOM=inertias,
        linkCOMs=centres, linkMasses=masses, baseOffset=[0, 0, 0], gravity=list(tree.gravity),
        jointPControlVector=[a.stiffness for a in axes], jointDControlVector=[a.damping for a in axes],
        jointPositionOffsetVector=[a.rest for a in axes], jointVelocityOffsetVector=[0.0] * n))  # fmt: skip
    sensors = []
    for what in ("Coordinates", "Coordinates_t") if watched else ():
        kind = getattr(exu.OutputVariableType, what)
        sensors.append(system.AddSensor(item.SensorNode(nodeNumber=node, outputVariableType=kind, storeInternal=True)))
    system.Assemble()
    return system, sensors


def solve(tree: Tree, t_end: float, resolution: float, setting: str, samples: int = 0):
    """Integrate. Returns (motion, CPU seconds of the solver); no motion where samples is 0.

    Raises
    ------
    RuntimeError
        If the solver gives up.
    """
    system, sensors = build(tree, samples > 0)
    seconds = integrate(system, t_end, resolution, setting, samples)
    if not samples:
        return None, seconds
    return tree_motion(tree, *stored(system, sensors, samples)), seconds


def start_accelerations(tree: Tree) -> np.ndarray:
    """Acceleration of each centre and angular acceleration, (links, 6), by differences over two steps at the start."""
    h = 1e-5
    motion = solve(tree, 2 * h, 2, "RK44", 2)[0]
    v = np.concatenate([motion.velocity, motion.spin], axis=2)
    return (-3 * v[0] + 4 * v[1] - v[2]) / (2 * h)


def tree_motion(tree: Tree, q: np.ndarray, v: np.ndarray) -> Motion:
    """Motion of the links, from coordinates and rates (times, axes)."""
    n, links = len(q), len(tree.links)
    p, u, w = (np.zeros((n, links, 3)) for _ in range(3))
    R = np.zeros((n, links, 3, 3))
    none, still = np.zeros((n, 3)), np.broadcast_to(np.eye(3), (n, 3, 3))
    d = 0
    for k, link in enumerate(tree.links):
        i = link.parent
        x, turn, speed, spin = (none, still, none, none) if i == GROUND else (p[:, i], R[:, i], u[:, i], w[:, i])
        at = np.zeros(3) if i == GROUND else tree.links[i].centre
        for a in link.axes:
            arm = turn @ (a.point - at)
            x, speed, at = x + arm, speed + np.cross(spin, arm), a.point
            e = turn @ a.direction
            if a.kind == "slide":
                way = q[:, d, None] * e
                x, speed = x + way, speed + np.cross(spin, way) + v[:, d, None] * e
            else:
                turn, spin = turn @ about(a.direction, q[:, d]), spin + v[:, d, None] * e
            d += 1
        arm = turn @ (link.centre - at)
        p[:, k], R[:, k], u[:, k], w[:, k] = x + arm, turn, speed + np.cross(spin, arm), spin
    return Motion(p, R, u, w)


def about(e: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Rotations about an axis, (times, 3, 3)."""
    K = np.cross(np.eye(3), e)  # K x = e x x
    c, s = np.cos(angle)[:, None, None], np.sin(angle)[:, None, None]
    return c * np.eye(3) + (1 - c) * np.outer(e, e) + s * K
