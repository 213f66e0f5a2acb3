"""What bodies weigh, in the body table: masses, inertias, their inverses, and stand-ins for those that are none."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..math.scalar import maximum, real_parts
from ..model.body import GROUND
from .afresh import Afresh
from .inertia import STAND_IN, THIN, inverse_inertia, usual_mass
from .specs import Structure
from .system import POINT, Bodies, blank


def mass_table(s: Structure, bodies: Mapping, places: np.ndarray, length: Any, new: Afresh) -> Bodies:
    """The body table with its masses and inertias; ``places``: of all frames, from their bodies' mass centres.

    Where a principal inertia or a mass is none, a stand-in that the solve takes out again.
    """
    joint = s.tables["tree"].joint
    table = new.table("bodies", blank(Bodies, len(joint), places.dtype), places.dtype)
    moved = {f.body for f in s.frames if new.asks(f.element)}
    rescaled = new.base is None or new.base.system.scales.length != length
    usual = usual_mass([d.mass for name, d in bodies.items() if name != GROUND])
    reach = _reaches(s, places)
    for name, b in s.place.items():
        if b < 0:
            continue
        d = bodies[name]
        heavy = d.mass.real > 0.0
        if heavy and not (rescaled or b in moved or new.asks(s.model[name])):
            continue
        bulk, more_mass = (d.mass, 0.0) if heavy else (usual, STAND_IN * usual)
        table.mass[b], table.excess_mass[b] = d.mass, more_mass
        table.inverse_mass[b], table.inverse_reference_mass[b] = 1.0 / (d.mass + more_mass), 1.0 / bulk
        if joint[b] == POINT:
            table.inverse_reference_inertia[b] = table.inverse_reference_mass[b]
            table.inverse_inertia[b, 8], table.excess_inertia[b, 8] = table.inverse_mass[b], more_mass
            table.body_rotation[b] = d.R.ravel()
        else:
            _turning(table, b, d.inertia, (bulk * reach[b] ** 2, bulk * length**2), s.model.planar)
    return table


def _turning(table: Bodies, b: int, J: np.ndarray, sizes: tuple[Any, Any], planar: bool) -> None:
    """Inertia of a body, its inverse, and what stands in for it, into its row.

    ``sizes``: what it would be if all that its frames reach were filled; and if it has no size of its own.
    """
    compact, bulky = sizes
    own = J[2, 2]
    size = maximum(own if planar else (J[0, 0] + J[1, 1] + own) / 2, compact)
    size = size if size.real > 0.0 else bulky
    table.inverse_reference_inertia[b] = 1.0 / size
    if planar and own.real >= THIN * size.real:
        table.inertia[b, 8], table.inverse_inertia[b, 8], table.excess_inertia[b, 8] = own, 1.0 / own, 0.0
        return
    inverse, more = inverse_inertia(np.diag([0.0, 0.0, own]) if planar else J, size, planar)
    table.inertia[b] = 0.0 if planar else J.ravel()
    table.inertia[b, 8] = own
    table.inverse_inertia[b], table.excess_inertia[b] = inverse.ravel(), more.ravel()


def _reaches(s: Structure, flat: np.ndarray) -> np.ndarray:
    """Of every body the largest component, taken positive, of the ways from its centre of mass to its frames."""
    out, body = np.zeros(len(s.tables["tree"].parent), flat.dtype), s.tables["frame_body"]
    best = np.argmax(np.abs(real_parts(flat)), axis=1)
    largest = flat[np.arange(len(flat)), best]
    largest = np.where(real_parts(largest) < 0.0, -largest, largest)
    order = np.argsort(real_parts(largest), kind="stable")
    order = order[body[order] >= 0]
    out[body[order]] = largest[order]  # the last one given is the largest
    return out
