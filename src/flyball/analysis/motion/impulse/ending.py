"""What comes of a motion with contact: the result, and how well it went."""

from __future__ import annotations

import dataclasses
import time
from functools import partial

import numpy as np

from ....compiler.notice import compiled_since
from ....model.touching import nothing_touches
from ....numerics.cone.choose import BY_ONE, BY_OTHER, HANDED_ON
from ....results import doubts
from ....results.contact_health import ContactHealth
from ....results.energy import EXCHANGED, STORED
from ....results.health import Health
from ....results.result import Result
from ....results.sides import Sides
from ....stepping.solvers import told
from ....stepping.stepper import Stepper
from ....stepping.tables import (
    CUTS,
    ENDLESS,
    FIRST_OVERLAP,
    IMPACTS,
    ITERATIONS,
    MOST_CONTACTS,
    REDUCED,
    TAKEN,
    WORST_AT,
    WORST_FORCE,
    WORST_OVERLAP,
    WORST_RESIDUAL,
)
from ....tables.contact import Touching
from ...assembly.start import Assembly
from ...mobility import mobility
from .collect import Collected, coordinates, sets
from .scene import smallest
from .settings import Stepping

INTERRUPTED = "interrupted by the user at t = {:.6g} s; what was computed is kept"
REACHED = "reached the end"


def result_of(
    base: Assembly,
    scene: Touching,
    stepper: Stepper,
    kept: Collected,
    sides: Sides,
    o: Stepping,
    since: float,
    message: str,
) -> Result:
    """The motion by name; ``message`` says how it ended."""
    values, model = base.compiled.values, base.compiled.structure.model
    q, v, vdot = coordinates(base, scene, kept)
    t = np.array(kept.t)
    count = stepper.pace.count
    contact = _contact_health(scene, stepper, o, smallest(scene, values))
    health = Health(
        success=message == REACHED,
        message=message,
        violation=0.0,
        velocity_violation=0.0,
        steps=int(count[TAKEN]),
        rejected=0,
        evaluations=int(count[ITERATIONS]),
        factorisations=0,
        seconds=time.perf_counter() - since,
        compiling=compiled_since(since),
        options={"method": dataclasses.asdict(o)},
        coordinates="absolute: steps of impulses",
        remarks=nothing_touches(model),
        crowd=sum(b.count for b in model.bulk),
        contact=contact,
    )
    health.late = {
        "mobility": partial(mobility, model, base),
        "energy_drift": lambda: result.energy.drift,
        "doubtful": lambda: doubts.of_impulses(result),
        "warnings": lambda: doubts.warnings_of_impulses(result),
    }
    states = np.zeros((len(t), len(values.structure.states)))
    lam = np.zeros((len(t), len(values.system.rows.law)))
    if kept.held:
        states, lam = kept.held.into(values, q, v, vdot)
        health.violation, health.velocity_violation = max(kept.held.gaps), max(kept.held.slips)
    result = Result(model, values, t, q, v, states, vdot, lam, health)
    result.final = (float(t[-1]), np.concatenate([q[-1], v[-1], states[-1]]))
    sums = np.array(kept.sums)
    result.exchanged = dict(zip((*EXCHANGED, STORED), sums.T, strict=True))
    result.contacts = kept.as_contacts(sides, model.planar)
    result.bulk = sets(model, scene, kept)
    return result


def _picked(stepper: Stepper, solver: str) -> str:
    """The solver, and which islands went where."""
    picked = told(stepper.rooms.F)
    if not len(picked):
        return solver
    newton, sweeps = int(picked[BY_ONE] - picked[HANDED_ON]), int(picked[BY_OTHER] + picked[HANDED_ON])
    if solver != "auto":
        return f"{solver}; {sweeps} of {newton + sweeps} islands by Gauss-Seidel" if sweeps else solver
    return f"auto: {newton} islands of bodies that touch by Newton's method, {sweeps} by Gauss-Seidel"


def _contact_health(scene: Touching, stepper: Stepper, o: Stepping, size: float) -> ContactHealth:
    real, count = stepper.pace.real, stepper.pace.count
    return ContactHealth(
        solver=_picked(stepper, o.solver),
        impacts=f"{o.restitution.title()}, {o.impacts}" if count[IMPACTS] else "",
        most=int(count[MOST_CONTACTS]),
        worst_overlap=max(0.0, -float(real[WORST_OVERLAP])),
        overlap_at_start=max(0.0, -float(real[FIRST_OVERLAP])),
        residual=float(real[WORST_RESIDUAL]),
        force_residual=float(real[WORST_FORCE]),
        tolerance=o.tolerance,
        solves=int(count[TAKEN]),
        iterations=int(count[ITERATIONS]),
        unconverged=int(count[CUTS]),
        worst_at=float(real[WORST_AT]),
        size=size,
        halved=int(stepper.halved),
        reduced=int(count[REDUCED]),
        impacted=int(count[IMPACTS]),
        endless=int(count[ENDLESS]),
    )
