"""Check of a description without simulation: degrees of freedom, redundancy, assembly, warnings; mass properties.

Mass properties are given for every body and for the whole mechanism in its initial position.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from .analysis_options import AnalysisOptions
from .assembly.assemble import assemble
from .assembly.assembled_state import Assembly
from .errors import FlyballError
from .mobility.mobility import mobility
from .model.body import GROUND
from .model.element import LawOf, fields_with
from .model.force import CoordinateForce
from .model.inertia import parallel_axis_term, principal
from .model.model import Model
from .model.unsupported_elements import ignored_elements
from .results.health import changed_velocities, velocity_not_allowed
from .results.mechanism_report import BodyReport, MassReport, PrincipalMassProperties, Report
from .results.mobility import Mobility
from .results.motion_record import RecordedMotion
from .simulation.law_faults import out_of_table_at_start
from .tables.contact_tables import Carriers, contact_carriers
from .tables.structure import structure
from .tables.values import Values, values


@dataclass(frozen=True, kw_only=True)
class MassOptions(AnalysisOptions):
    """Options of `Mechanism.mass_properties`."""

    drawn: bool
    parameters: Mapping[str, float] | None


def mass_properties(model: Model, o: MassOptions) -> MassReport:
    """Return the mass properties of every body and of the mechanism: see `Mechanism.mass_properties`."""
    if o.drawn:
        model = model.snapshot()
        x = values(structure(model), model.environment(o.parameters))
        return mass_report(model, x, x.q)
    a = assemble(model, parameters=o.parameters)
    return mass_report(model, a.compiled.values, a.q)


def mass_report(model: Model, x: Values, q: np.ndarray) -> MassReport:
    """Return the mass report for coordinates ``q``."""
    still = np.zeros((1, x.structure.nv))
    records = RecordedMotion(x, q[None], still, still)
    bodies = {}
    placed = []
    for b in model.bodies:
        d = x.bodies[b.name]
        p, turn = records.body(x.structure.place[b.name])[:2]
        c, R = np.ravel(p), np.reshape(turn, (3, 3))
        J = np.asarray(d.inertia).real
        bodies[b.name] = _mass_properties(float(d.mass.real), d.com.real, c, J, d.volume, model.planar)
        placed.append((float(d.mass.real), c, R @ J @ R.T))
    for e in model.bulk:
        m, c, K = _combined_mass(contact_carriers(model, x.given, [e.name]))
        bodies[e.name] = _mass_properties(m, c, c, K, None, model.planar)
        placed.append((m, c, K))
    mass = sum(m for m, _, _ in placed)
    com: Any = sum(m * c for m, c, _ in placed) / mass if mass else np.mean([c for _, c, _ in placed], axis=0)
    inertia: Any = sum(K + parallel_axis_term(m, c - com) for m, c, K in placed)
    volumes = [b.volume for b in bodies.values()]
    volume = None if None in volumes else sum(volumes)  # type: ignore[arg-type]
    return MassReport(model.name, model.planar, bodies, _mass_properties(mass, com, com, inertia, volume, model.planar))


def _combined_mass(at: Carriers) -> tuple[float, np.ndarray, np.ndarray]:
    """Return mass, centre of mass and inertia about it of several bodies, in world axes."""
    p, R = at.movers.pose[:, :3], at.movers.pose[:, 3:].reshape(-1, 3, 3)
    mass = float(at.mass.sum())
    com = at.mass @ p / mass
    d = p - com
    steiner = np.einsum("n,nk,nk->", at.mass, d, d) * np.eye(3) - np.einsum("n,ni,nj->ij", at.mass, d, d)
    return mass, com, np.einsum("nij,njk,nlk->il", R, at.inertia, R) + steiner


def _mass_properties(
    mass: float, com: np.ndarray, position: np.ndarray, J: np.ndarray, volume: Any, planar: bool
) -> PrincipalMassProperties:
    volume = None if volume is None else float(volume.real)
    if planar:
        w = J[2:, 2]
        return PrincipalMassProperties(
            mass, com[:2], position[:2], float(w[0]), w, np.eye(3), _gyration_radii(w, mass), volume
        )
    w, V = principal(J)
    return PrincipalMassProperties(mass, com, position, J, w, V, _gyration_radii(w, mass), volume)


def _gyration_radii(w: np.ndarray, mass: float) -> np.ndarray:
    """Return the radii of gyration; None if there is no mass."""
    return np.sqrt(np.maximum(w, 0.0) / mass) if mass > 0.0 else 0.0 * w


SIZE_RATIO = 30.0  # a radius of gyration this many times larger or smaller than the body's size gives a warning
TRIANGLE_SLACK = (
    1e-3  # slack of the triangle inequality, relative to the largest moment, below which a body counts as almost flat
)


def check(model: Model) -> Report:
    """Check a mechanism without simulating it.

    Parameters
    ----------
    model : Model

    Returns
    -------
    Report

    Raises
    ------
    ModelError
        If the description is wrong: no bodies, or a movable body without inertia.
    AssemblyError
        If no position or velocity fulfils all constraints.
    """
    a = assemble(model)
    m = mobility(model, a, inertia=True)
    x = a.compiled.values
    weights = mass_report(model, x, a.q)
    bodies = {name: _body_report(b, model.planar) for name, b in weights.bodies.items()}
    return Report(
        name=model.name,
        planar=model.planar,
        bodies=bodies,
        joints=len(model.joints),
        forces=len(model.forces),
        drivers=len(model.drivers),
        events={e.name: e.description for e in model.events},
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


def _body_report(b: PrincipalMassProperties, planar: bool) -> BodyReport:
    axes = () if planar else tuple(map(tuple, b.axes.T.tolist()))
    return BodyReport(b.mass, tuple(b.com.tolist()), tuple(b.moments.tolist()), axes)


def _warnings(model: Model, a: Assembly, bodies: dict[str, BodyReport], m: Mobility) -> Iterator[str]:
    for b in model.bodies:
        yield from _inertia_warnings(a.compiled.values, b.name, bodies[b.name])
    yield from (velocity_not_allowed(d) for d in changed_velocities(a.departures))
    if text := ignored_elements(model):
        yield text
    held, pushed = _connected_bodies(model)
    for b in model.bodies:
        if b.name not in held | pushed and not (model.contacts and any(s.touches for s in b.shapes())):
            kept = "; as_drawn keeps assembly from moving it, it does not weld it to ground" if b.as_drawn else ""
            yield f"body {b.name!r} has neither a joint nor a force: it moves on its own{kept}"
    if not model.gravity_told and not model.gravity_vector().any():
        example = "(0, -9.81)" if model.planar else "(0, 0, -9.81)"
        yield f"no gravity; if that is not meant, give gravity={example}"
    freedoms = m.freedoms
    # in a locked mechanism every driver is redundant
    if model.drivers and freedoms == 0 and m.redundancy and _locked(model):
        yield "no freedom is left even without the drivers: the mechanism is locked in the reference configuration"
    elif model.drivers and freedoms == 0:
        yield "drivers take every freedom: the motion is prescribed, forces change only reactions and efforts"
    elif freedoms == 0 and not model.bulk:
        yield "no freedom is left: it is a structure and will not move"
    if any(x.beyond == "refuse" for x in model.tables) and (missed := out_of_table_at_start(a)):
        yield missed.message
    used = _names_used(model)
    for name in model.parameters:
        if name not in used:
            yield f"parameter {name!r} is used nowhere"


def _locked(model: Model) -> bool:
    """Return whether the mechanism cannot move when all drivers are at rest."""
    trial = model.copy()
    trial.drivers = []
    try:
        return mobility(trial, assemble(trial), inertia=False).freedoms == 0
    except FlyballError:  # driven bodies may have no inertia, or may need the drivers for their position
        return False


def _connected_bodies(model: Model) -> tuple[set[str], set[str]]:
    """Return the bodies that a joint or driver constrains, and the bodies that a force acts on."""
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


def _inertia_warnings(x: Values, name: str, b: BodyReport) -> Iterator[str]:
    """Return warnings on inertia that does not fit the body's size.

    The size is the largest distance from the centre of mass to a point where joints, forces or shapes attach.
    """
    k = x.structure.place[name]
    arms = x.system.frames.position[x.system.frame_body == k]
    size = float(np.sqrt((arms**2).sum(axis=1)).max(initial=0.0))
    radius = float(np.sqrt(max(b.moments) / b.mass)) if b.mass > 0.0 else 0.0
    if size > 0.0 and radius > SIZE_RATIO * size:
        yield (
            f"body {name!r}: its inertia is that of a body {radius:.3g} m across, but its joints lie within "
            f"{size:.3g} m of its centre of mass; check the unit (kg m^2) and inertia_about"
        )
    elif 0.0 < radius < size / SIZE_RATIO:
        yield (
            f"body {name!r}: its inertia is that of a body {radius:.3g} m across, but its joints lie {size:.3g} m "
            f"from its centre of mass; check the unit (kg m^2)"
        )
    if len(b.moments) == 3:
        p, q, r = b.moments
        numbers = f"body {name!r}: its principal moments {p:g}, {q:g}, {r:g} kg m^2"
        if p > 0.0 and p + q - r < -1e-15 * r:
            yield f"{numbers} break the triangle inequality, though within rounding"
        elif (
            q - p > TRIANGLE_SLACK * r
            and abs(p + q - r) < TRIANGLE_SLACK * r
            and p > TRIANGLE_SLACK * r
            and not _has_inertia_of_shapes(x, name)
        ):
            yield f"{numbers} are those of a flat plate (the first two add up to the third)"


def _has_inertia_of_shapes(x: Values, name: str) -> bool:
    """Return whether the body's inertia was computed from shapes; a flat body is then intended."""
    return x.numbers[name].inertia is None


def _names_used(model: Model) -> set[str]:
    """Return every word in every string of the description; used parameters are among them."""
    import re

    from .model.element import written_fields

    text = (
        repr([written_fields(e) for e in model.elements()])
        + repr(model.gravity)
        + repr(list(model.parameters.values()))
    )
    return set(re.findall(r"\w+(?:\.\w+)*", text)).union(
        *(inspect.signature(f).parameters for f in _law_functions(model))
    )


def _law_functions(model: Model) -> Iterator[Callable]:
    """Return the Python functions that are used as laws."""
    for e in model.elements():
        for name in fields_with(e.__class__, LawOf):
            value = getattr(e, name)
            yield from (law for law in (value if isinstance(value, tuple) else (value,)) if callable(law))
