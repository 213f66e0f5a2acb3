"""Mass properties of every body as used, and of the mechanism as a whole where it starts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..model.inertia import principal, shifted
from ..model.model import Model
from ..results.mass import MassProperties, MassReport
from ..results.records import Records
from ..tables.contact.carriers import Carriers, carriers
from ..tables.structure import structure
from ..tables.values import Values, values
from .assemble import assemble
from .options import Options


@dataclass(frozen=True, kw_only=True)
class MassOptions(Options):
    """What `Mechanism.mass_properties` is asked."""

    drawn: bool
    parameters: Mapping[str, float] | None


def mass_properties(model: Model, o: MassOptions) -> MassReport:
    """Mass properties of every body and of all together: see `Mechanism.mass_properties`."""
    if o.drawn:
        model = model.snapshot()
        x = values(structure(model), model.environment(o.parameters))
        return report(model, x, x.q)
    a = assemble(model, parameters=o.parameters)
    return report(model, a.compiled.values, a.q)


def report(model: Model, x: Values, q: np.ndarray) -> MassReport:
    """The report for coordinates ``q``."""
    still = np.zeros((1, x.structure.nv))
    records = Records(x, q[None], still, still)
    bodies = {}
    placed = []
    for b in model.bodies:
        d = x.bodies[b.name]
        p, turn = records.body(x.structure.place[b.name])[:2]
        c, R = np.ravel(p), np.reshape(turn, (3, 3))
        J = np.asarray(d.inertia).real
        bodies[b.name] = _properties(float(d.mass.real), d.com.real, c, J, d.volume, model.planar)
        placed.append((float(d.mass.real), c, R @ J @ R.T))
    for e in model.bulk:
        m, c, K = _together(carriers(model, x.given, [e.name]))
        bodies[e.name] = _properties(m, c, c, K, None, model.planar)
        placed.append((m, c, K))
    mass = sum(m for m, _, _ in placed)
    com: Any = sum(m * c for m, c, _ in placed) / mass if mass else np.mean([c for _, c, _ in placed], axis=0)
    inertia: Any = sum(K + shifted(m, c - com) for m, c, K in placed)
    volumes = [b.volume for b in bodies.values()]
    volume = None if None in volumes else sum(volumes)  # type: ignore[arg-type]
    return MassReport(model.name, model.planar, bodies, _properties(mass, com, com, inertia, volume, model.planar))


def _together(at: Carriers) -> tuple[float, np.ndarray, np.ndarray]:
    """Mass, centre and inertia about it of many bodies as drawn, in the world."""
    p, R = at.movers.pose[:, :3], at.movers.pose[:, 3:].reshape(-1, 3, 3)
    mass = float(at.mass.sum())
    com = at.mass @ p / mass
    d = p - com
    steiner = np.einsum("n,nk,nk->", at.mass, d, d) * np.eye(3) - np.einsum("n,ni,nj->ij", at.mass, d, d)
    return mass, com, np.einsum("nij,njk,nlk->il", R, at.inertia, R) + steiner


def _properties(
    mass: float, com: np.ndarray, position: np.ndarray, J: np.ndarray, volume: Any, planar: bool
) -> MassProperties:
    volume = None if volume is None else float(volume.real)
    if planar:
        w = J[2:, 2]
        return MassProperties(mass, com[:2], position[:2], float(w[0]), w, np.eye(3), _gyration(w, mass), volume)
    w, V = principal(J)
    return MassProperties(mass, com, position, J, w, V, _gyration(w, mass), volume)


def _gyration(w: np.ndarray, mass: float) -> np.ndarray:
    """Radii of gyration; none where there is no mass."""
    return np.sqrt(np.maximum(w, 0.0) / mass) if mass > 0.0 else 0.0 * w
