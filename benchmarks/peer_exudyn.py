"""A planar mechanism in Exudyn: 2D rigid bodies, hinges as constraints, an implicit solver with fixed steps."""

from __future__ import annotations

import numpy as np
from exudyn_run import DENSE, IMPLICIT, driven, exu, integrate, item, stored
from trees import Motor

from mechanisms import GROUND, Planar

SETTINGS = IMPLICIT


def build(p: Planar, watched: bool):
    """The assembled system and, if watched, the sensors of every body's coordinates and rates."""
    system = exu.SystemContainer().AddSystem()
    ground = system.AddObject(item.ObjectGround(referencePosition=[0, 0, 0]))
    bodies, sensors = [], []
    for mass, inertia, start, rate in zip(p.mass, p.inertia, p.start, p.rate, strict=True):
        node = system.AddNode(item.NodeRigidBody2D(referenceCoordinates=[0, 0, 0], initialCoordinates=list(start),
                                                   initialVelocities=list(rate)))  # fmt: skip
        body = system.AddObject(item.ObjectRigidBody2D(physicsMass=mass, physicsInertia=inertia, nodeNumber=node))
        if p.gravity:
            marker = system.AddMarker(item.MarkerBodyMass(bodyNumber=body))
            system.AddLoad(item.LoadMassProportional(markerNumber=marker, loadVector=[0, -p.gravity, 0]))
        bodies.append(body)
        for what in ("Coordinates", "Coordinates_t") if watched else ():
            kind = getattr(exu.OutputVariableType, what)
            sensors.append(
                system.AddSensor(item.SensorNode(nodeNumber=node, outputVariableType=kind, storeInternal=True))
            )

    def marker_at(body, at):
        number = ground if body == GROUND else bodies[body]
        return system.AddMarker(item.MarkerBodyPosition(bodyNumber=number, localPosition=[*at, 0]))

    for i, a, j, b in p.hinges:
        system.AddObject(item.ObjectJointRevolute2D(markerNumbers=[marker_at(i, a), marker_at(j, b)]))
    for i, a, j, b, stiffness, length in p.springs:
        ends = [marker_at(i, a), marker_at(j, b)]
        spring = {"stiffness": stiffness, "damping": 0, "referenceLength": length}
        system.AddObject(item.ObjectConnectorSpringDamper(markerNumbers=ends, **spring))
    for h, stiffness, damping, swing, speed in p.motors:
        drive(system, bodies, p, Motor(h, stiffness, damping, swing, speed))
    for i, torque in p.torques:
        marker = system.AddMarker(item.MarkerBodyRigid(bodyNumber=bodies[i]))
        system.AddLoad(item.LoadTorqueVector(markerNumber=marker, loadVector=[0, 0, torque]))
    system.Assemble()
    return system, sensors


def drive(system, bodies, p: Planar, motor: Motor) -> None:
    """A motor at a hinge on ground, along the body's angle; ``motor.axis`` is the hinge.

    Raises
    ------
    ValueError
        If the hinge is elsewhere.
    """
    i, _, j, _ = p.hinges[motor.axis]
    if i != GROUND:
        raise ValueError("motors between moving bodies are not built for this engine")
    node = system.GetObjectParameter(bodies[j], "nodeNumber")
    point = system.AddNode(item.NodePointGround())
    ends = [
        system.AddMarker(item.MarkerNodeCoordinate(nodeNumber=point, coordinate=0)),
        system.AddMarker(item.MarkerNodeCoordinate(nodeNumber=node, coordinate=2)),
    ]
    number = system.AddObject(item.ObjectConnectorCoordinateSpringDamper(markerNumbers=ends))
    driven(system, number, motor, "springForceUserFunction", float(p.start[j, 2]))


def solve(p: Planar, t_end: float, steps: float, setting: str, samples: int = 0):
    """Integrate. Returns ((coordinates, rates), CPU seconds of the solver); no arrays where samples is 0.

    Raises
    ------
    RuntimeError
        If the solver gives up.
    """
    system, sensors = build(p, samples > 0)
    seconds = integrate(system, t_end, steps, setting, samples, dense=len(p.mass) <= DENSE)
    if not samples:
        return None, seconds
    data = stored(system, sensors, samples)
    return (np.stack(data[0::2], axis=1), np.stack(data[1::2], axis=1)), seconds
