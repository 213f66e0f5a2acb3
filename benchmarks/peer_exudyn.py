"""A planar mechanism in Exudyn: 2D rigid bodies, hinges as constraints, an implicit solver with fixed steps."""

from __future__ import annotations

import sys
import time

import numpy as np

from mechanisms import GRAVITY, GROUND, Planar

sys.exudynFast = True  # the wheel's build without range checks; read once, when the package is imported

import exudyn as exu  # noqa: E402
import exudyn.itemInterface as item  # noqa: E402

# label -> (dynamic solver, spectral radius, modified Newton)
SETTINGS = {
    "generalised-alpha 0.95": ("GeneralizedAlpha", 0.95, True),
    "generalised-alpha 0.7": ("GeneralizedAlpha", 0.7, True),
    "generalised-alpha 0.95, full Newton": ("GeneralizedAlpha", 0.95, False),
    "trapezoidal, index 2": ("TrapezoidalIndex2", 1.0, True),
}
DENSE = 20  # bodies up to which the dense factorisation is the faster one


def build(p: Planar, watched: bool):
    """The assembled system and, if watched, the sensors of every body's coordinates and rates."""
    system = exu.SystemContainer().AddSystem()
    ground = system.AddObject(item.ObjectGround(referencePosition=[0, 0, 0]))
    bodies, sensors = [], []
    for mass, inertia, start, rate in zip(p.mass, p.inertia, p.start, p.rate, strict=True):
        node = system.AddNode(item.NodeRigidBody2D(referenceCoordinates=[0, 0, 0], initialCoordinates=list(start),
                                                   initialVelocities=list(rate)))  # fmt: skip
        body = system.AddObject(item.ObjectRigidBody2D(physicsMass=mass, physicsInertia=inertia, nodeNumber=node))
        marker = system.AddMarker(item.MarkerBodyMass(bodyNumber=body))
        system.AddLoad(item.LoadMassProportional(markerNumber=marker, loadVector=[0, -GRAVITY, 0]))
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
    system.Assemble()
    return system, sensors


def solve(p: Planar, t_end: float, steps: int, setting: str, samples: int = 0):
    """Integrate. Returns (coordinates, rates, CPU seconds of the solver); no arrays where samples is 0.

    Raises
    ------
    RuntimeError
        If the solver gives up.
    """
    system, sensors = build(p, samples > 0)
    solver, radius, modified = SETTINGS[setting]
    s = exu.SimulationSettings()
    s.timeIntegration.numberOfSteps = steps
    s.timeIntegration.endTime = t_end
    s.timeIntegration.generalizedAlpha.spectralRadius = radius
    s.timeIntegration.newton.useModifiedNewton = modified
    s.timeIntegration.verboseMode = 0
    s.solution.file.write = False
    s.solution.sensors.writePeriod = t_end / samples if samples else 2 * t_end
    dense = len(p.mass) <= DENSE
    s.linearSolver.solverType = exu.LinearSolverType.EXUdense if dense else exu.LinearSolverType.EigenSparse
    begin = time.process_time()
    done = system.SolveDynamic(s, solverType=getattr(exu.DynamicSolverType, solver), showHints=False)
    seconds = time.process_time() - begin
    if not done:
        raise RuntimeError("SolveDynamic gave up")
    if not samples:
        return None, None, seconds
    data = [np.array(system.GetSensorStoredData(sensor)) for sensor in sensors]
    return np.stack([d[:, 1:4] for d in data[0::2]], axis=1), np.stack([d[:, 1:4] for d in data[1::2]], axis=1), seconds
