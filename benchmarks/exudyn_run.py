"""Exudyn's solvers, run and read: what the planar, the spatial and the tree models share."""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence

import numpy as np

sys.exudynFast = True  # the wheel's build without range checks; read once, when the package is imported

import exudyn as exu  # noqa: E402
import exudyn.itemInterface as item  # noqa: E402
import exudyn.utilities as symbolic  # noqa: E402

exu.SetWriteToConsole(False)  # a run that fails is told by its result

_kept: list = []  # compiled functions must outlive the systems that call them

__all__ = ["DENSE", "IMPLICIT", "driven", "exu", "integrate", "item", "stored"]

# label -> (dynamic solver, spectral radius, modified Newton)
IMPLICIT = {
    "generalised-alpha 0.95": ("GeneralizedAlpha", 0.95, True),
    "generalised-alpha 0.7": ("GeneralizedAlpha", 0.7, True),
    "generalised-alpha 0.95, full Newton": ("GeneralizedAlpha", 0.95, False),
    "trapezoidal, index 2": ("TrapezoidalIndex2", 1.0, True),
    "trapezoidal, index 2, full Newton": ("TrapezoidalIndex2", 1.0, False),
}
DENSE = 20  # bodies up to which the dense factorisation is the faster one


def settings(t_end: float, resolution: float, setting: str, samples: int, dense: bool, redundant: bool):
    """(simulation settings, solver): ``resolution`` is the number of steps, or a tolerance below 1."""
    s = exu.SimulationSettings()
    s.timeIntegration.endTime = t_end
    s.timeIntegration.verboseMode = 0
    s.solution.file.write = False
    s.solution.sensors.writePeriod = t_end / samples if samples else 2 * t_end
    s.timeIntegration.numberOfSteps = int(resolution) if resolution >= 1 else 100
    s.timeIntegration.automaticStepSize = resolution < 1
    if resolution < 1:
        s.timeIntegration.absoluteTolerance = s.timeIntegration.relativeTolerance = resolution
    if setting in IMPLICIT:
        setting, radius, modified = IMPLICIT[setting]
        s.timeIntegration.generalizedAlpha.spectralRadius = radius
        s.timeIntegration.newton.useModifiedNewton = modified
    types = exu.LinearSolverType
    s.linearSolver.solverType = types.EXUdense if dense else types.EigenSparse
    if redundant:  # of the dense solvers only Eigen's copes with redundant rows, if told to
        s.linearSolver.solverType, s.linearSolver.ignoreSingularJacobian = types.EigenDense, True
    return s, getattr(exu.DynamicSolverType, setting)


def integrate(system, t_end: float, resolution: float, setting: str, samples: int, *, dense=True, redundant=False):
    """Run the solver; returns the CPU seconds it took.

    Raises
    ------
    RuntimeError
        If the solver gives up.
    """
    s, solver = settings(t_end, resolution, setting, samples, dense, redundant)
    begin = time.process_time()
    done = system.SolveDynamic(s, solverType=solver, showHints=False)
    seconds = time.process_time() - begin
    if not done:
        raise RuntimeError("SolveDynamic gave up")
    return seconds


def driven(system, item_number, motor, name: str, zero: float = 0.0) -> None:
    """Have a connector give a motor's torque, as an expression that Exudyn compiles.

    ``name``: of the connector's function; it is given time, number, coordinate, rate and further numbers, and returns
    what acts against them. ``zero``: the coordinate as drawn.
    """
    sin, cos = exu.symbolic.sin, exu.symbolic.cos

    def against(mbs, t, number, x, rate, stiffness, damping, offset):
        turn = motor.speed * t
        wanted, faster = motor.swing * (1 - cos(turn)), motor.swing * motor.speed * sin(turn)
        return motor.stiffness * (x - zero - wanted) + motor.damping * (rate - faster)

    made = symbolic.CreateSymbolicUserFunction(system, against, name, item_number)
    _kept.append(made)
    system.SetObjectParameter(item_number, name, made)


def stored(system, sensors: Sequence, samples: int) -> list[np.ndarray]:
    """What sensors stored, without the column of times.

    Raises
    ------
    RuntimeError
        If the motion is not whole or not finite.
    """
    data = [np.array(system.GetSensorStoredData(sensor))[:, 1:] for sensor in sensors]
    if any(len(d) < samples or not np.isfinite(d).all() for d in data):
        raise RuntimeError("the solver left the motion incomplete")
    return data
