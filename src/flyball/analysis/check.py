"""Is the description sound? Freedoms, redundancy, assembly and mass properties, looked at before any motion."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator

import numpy as np

from ..errors import FlyballError
from ..model.body import GROUND
from ..model.element import LawOf, fields_with
from ..model.force import CoordinateForce
from ..model.model import Model
from ..results.check import BodyReport, Report
from ..results.departure import changed_velocities, not_allowed
from ..results.mass import MassProperties
from ..results.mobility import Mobility
from ..tables.values import Values
from .assemble import assemble
from .assembly.start import Assembly
from .mass import report
from .mobility import mobility
from .motion.ahead import missed_at_start
from .untouched import left_out

FAR = 30.0  # a radius of gyration this many times the body's size, or this part of it, is worth a look
BARELY = 1e-3  # slack of the triangle inequality, as part of the largest moment, below which a body is all but flat


def check(model: Model) -> Report:
    """Look a mechanism over without simulating it.

    Parameters
    ----------
    model : Model

    Returns
    -------
    Report

    Raises
    ------
    ModelError
        If the description is wrong: no bodies, or a body that can move without inertia.
    AssemblyError
        If no position or velocity fulfils all constraints.
    """
    a = assemble(model)
    m = mobility(model, a, inertia=True)
    x = a.compiled.values
    weights = report(model, x, a.q)
    bodies = {name: _body(b, model.planar) for name, b in weights.bodies.items()}
    return Report(
        name=model.name,
        planar=model.planar,
        bodies=bodies,
        joints=len(model.joints),
        forces=len(model.forces),
        drivers=len(model.drivers),
        events={e.name: e.told for e in model.events},
        gruebler=m.gruebler,
        freedoms=m.freedoms,
        redundant=m.redundant,
        redundancy=m.redundancy,
        undetermined=m.undetermined,
        cut=m.cut,
        moved=a.moved,
        departures=a.departures,
        mass=weights.total.mass,
        com=tuple(weights.total.com.tolist()),
        warnings=tuple(_warnings(model, a, bodies, m)),
    )


def _body(b: MassProperties, planar: bool) -> BodyReport:
    axes = () if planar else tuple(map(tuple, b.axes.T.tolist()))
    return BodyReport(b.mass, tuple(b.com.tolist()), tuple(b.moments.tolist()), axes)


def _warnings(model: Model, a: Assembly, bodies: dict[str, BodyReport], m: Mobility) -> Iterator[str]:
    for b in model.bodies:
        yield from _of_inertia(a.compiled.values, b.name, bodies[b.name])
    yield from (not_allowed(d) for d in changed_velocities(a.departures))
    if text := left_out(model):
        yield text
    held, pushed = _touched(model)
    for b in model.bodies:
        if b.name not in held | pushed and not (model.contacts and any(s.touches for s in b.shapes())):
            kept = "; as_drawn keeps assembly from moving it, it does not weld it to ground" if b.as_drawn else ""
            yield f"body {b.name!r} has neither a joint nor a force: it moves on its own{kept}"
    if not model.gravity_told and not model.gravity_vector().any():
        example = "(0, -9.81)" if model.planar else "(0, 0, -9.81)"
        yield f"no gravity; if that is not meant, give gravity={example}"
    freedoms = m.freedoms
    # a mechanism that is locked anyway makes its drivers redundant
    if model.drivers and freedoms == 0 and m.redundancy and _locked(model):
        yield "no freedom is left even without the drivers: it is locked as it is drawn and will not move"
    elif model.drivers and freedoms == 0:
        yield "drivers take every freedom: the motion is prescribed, forces change only reactions and efforts"
    elif freedoms == 0 and not model.bulk:
        yield "no freedom is left: it is a structure and will not move"
    if any(x.beyond == "refuse" for x in model.tables) and (missed := missed_at_start(a)):
        yield missed.message
    used = _names_used(model)
    for name in model.parameters:
        if name not in used:
            yield f"parameter {name!r} is used nowhere"


def _locked(model: Model) -> bool:
    """Whether nothing can move where drivers ask for nothing."""
    trial = model.copy()
    trial.drivers = []
    try:
        return mobility(trial, assemble(trial), inertia=False).freedoms == 0
    except FlyballError:  # what drivers hold may have no inertia, or need them to be placed
        return False


def _touched(model: Model) -> tuple[set[str], set[str]]:
    """Bodies that some joint or driver holds, and bodies that some force acts on."""
    held, pushed = set(), set()
    for joint in model.joints:
        held |= {model.carrier(name, joint) for name in (joint.body_i, joint.body_j)}
    for driver in model.drivers:
        owner, _ = model.coordinate(driver.coordinate, driver)
        held |= {getattr(owner, "body", getattr(owner, "name", ""))}
    for force in model.forces:
        pushed |= {model.carrier(name, force) for name in force.ends().values()}
        for text in force.along() if isinstance(force, CoordinateForce) else ():
            owner, _ = model.coordinate(text, force)
            pushed |= {getattr(owner, "body", getattr(owner, "name", ""))}
    return held - {GROUND}, pushed - {GROUND}


def _of_inertia(x: Values, name: str, b: BodyReport) -> Iterator[str]:
    """Inertia against the body's size: where joints, forces and shapes attach, how far from the centre of mass."""
    k = x.structure.place[name]
    arms = x.system.frames.position[x.system.frame_body == k]
    size = float(np.sqrt((arms**2).sum(axis=1)).max(initial=0.0))
    radius = float(np.sqrt(max(b.moments) / b.mass)) if b.mass > 0.0 else 0.0
    if size > 0.0 and radius > FAR * size:
        yield (
            f"body {name!r}: its inertia is that of a body {radius:.3g} m across, but its joints lie within "
            f"{size:.3g} m of its centre of mass; check the unit (kg m^2) and inertia_about"
        )
    elif 0.0 < radius < size / FAR:
        yield (
            f"body {name!r}: its inertia is that of a body {radius:.3g} m across, but its joints lie {size:.3g} m "
            f"from its centre of mass; check the unit (kg m^2)"
        )
    if len(b.moments) == 3:
        p, q, r = b.moments
        numbers = f"body {name!r}: its principal moments {p:g}, {q:g}, {r:g} kg m^2"
        if p > 0.0 and p + q - r < -1e-15 * r:
            yield f"{numbers} break the triangle inequality, though within rounding"
        elif q - p > BARELY * r and abs(p + q - r) < BARELY * r and p > BARELY * r and not _flat(x, name):
            yield f"{numbers} are those of a flat plate (the first two add up to the third)"


def _flat(x: Values, name: str) -> bool:
    """Whether its inertia was computed from shapes, so that flatness is meant."""
    return x.numbers[name].inertia is None


def _names_used(model: Model) -> set[str]:
    """Every word in every text of the description: parameters that are used are among them."""
    import re

    from ..model.element import written

    text = repr([written(e) for e in model.elements()]) + repr(model.gravity) + repr(list(model.parameters.values()))
    return set(re.findall(r"\w+", text)).union(*(inspect.signature(f).parameters for f in _functions(model)))


def _functions(model: Model) -> Iterator[Callable]:
    """Python functions that are laws."""
    for e in model.elements():
        for name in fields_with(e.__class__, LawOf):
            value = getattr(e, name)
            yield from (law for law in (value if isinstance(value, tuple) else (value,)) if callable(law))
