"""A tree of hinges in Exudyn's ``KinematicTree``: joint coordinates, explicit solvers."""

from __future__ import annotations

import numpy as np
from exudyn_run import exu, integrate, item, stored
from trees import Motion, Tree

from mechanisms import GROUND

SETTINGS = ("RK44", "RK67", "DOPRI5")  # the last with error control


def build(tree: Tree, watched: bool):
    """(system, sensors of coordinates and rates). Links are hinged about z.

    Raises
    ------
    ValueError
        If there are loops, springs or other joints.
    """
    n = len(tree.links)
    if tree.cuts or tree.springs or any(len(k.axes) != 1 or k.axes[0].kind != "hinge" for k in tree.links):
        raise ValueError("only hinges are built for this engine")
    system = exu.SystemContainer().AddSystem()
    start = {"initialCoordinates": [0.0] * n, "initialCoordinates_t": list(tree.rates)}
    node = system.AddNode(item.NodeGenericODE2(referenceCoordinates=[0.0] * n, numberOfODE2Coordinates=n, **start))
    centres, inertias, turns, shifts = exu.Vector3DList(), exu.Matrix3DList(), exu.Matrix3DList(), exu.Vector3DList()
    for link in tree.links:
        at = link.axes[0].point
        before = np.zeros(3) if link.parent == GROUND else tree.links[link.parent].axes[0].point
        centres.Append(list(link.centre - at))
        inertias.Append(np.asarray(link.inertia))
        turns.Append(np.eye(3))
        shifts.Append(list(at - before))
    system.AddObject(item.ObjectKinematicTree(
        nodeNumber=node, jointTypes=[exu.JointType.RevoluteZ] * n, linkParents=[k.parent for k in tree.links],
        jointTransformations=turns, jointOffsets=shifts, linkInertiasCOM=inertias, linkCOMs=centres,
        linkMasses=[k.mass for k in tree.links], baseOffset=[0, 0, 0], gravity=list(tree.gravity)))  # fmt: skip
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
    return hinged_motion(tree, *stored(system, sensors, samples)), seconds


def hinged_motion(tree: Tree, q: np.ndarray, v: np.ndarray) -> Motion:
    """Motion of links hinged about z, from angles and rates (times, links)."""
    count = (len(q), len(tree.links))
    p, u, angle, w = np.zeros((*count, 3)), np.zeros((*count, 3)), np.zeros(count), np.zeros(count)
    zero = np.zeros((count[0], 3))
    for k, link in enumerate(tree.links):
        i = link.parent
        ground = i == GROUND
        at = link.axes[0].point
        angle[:, k] = q[:, k] + (0 if ground else angle[:, i])
        w[:, k] = v[:, k] + (0 if ground else w[:, i])
        from_i = at if ground else turned(angle[:, i], at - tree.links[i].centre)
        place = (zero if ground else p[:, i]) + from_i
        speed = zero if ground else u[:, i] + across(w[:, i], from_i)
        arm = turned(angle[:, k], link.centre - at)
        p[:, k], u[:, k] = place + arm, speed + across(w[:, k], arm)
    spin = np.zeros((*count, 3))
    spin[:, :, 2] = w
    R = np.stack([turned(angle, e) for e in np.eye(3)], axis=-1)
    return Motion(p, R, u, spin)


def turned(angle: np.ndarray, x: np.ndarray) -> np.ndarray:
    """A vector turned about z, (..., 3)."""
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([c * x[0] - s * x[1], s * x[0] + c * x[1], x[2] + 0 * c], axis=-1)


def across(w: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Angular velocity w about z times x."""
    return w[:, None] * np.column_stack([-x[:, 1], x[:, 0], 0 * w])
