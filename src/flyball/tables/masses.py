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
from .system import (
    BODY_R,
    BODY_WIDTH,
    EXCESS,
    EXCESS_MASS,
    INERTIA,
    INVERSE,
    LENGTH,
    MASS,
    PER_BULK,
    PER_COMPACT,
    PER_MASS,
    POINT,
    TREE,
)


def mass_table(s: Structure, bodies: Mapping, frame_x: np.ndarray, length: Any, new: Afresh) -> np.ndarray:
    """The body table with its masses and inertias.

    Where a principal inertia or a mass is none, a stand-in that the solve takes out again.
    """
    body_x = new.table("body_x", (len(s.tables["body_i"]), BODY_WIDTH), frame_x.dtype)
    moved = {f.body for f in s.frames if new.asks(f.element)}
    rescaled = new.base is None or new.base.system.glob[LENGTH] != length
    usual = usual_mass([d.mass for name, d in bodies.items() if name != GROUND])
    reach = _reaches(s, frame_x)
    for name, b in s.place.items():
        if b < 0:
            continue
        d, x = bodies[name], body_x[b]
        heavy = d.mass.real > 0.0
        if heavy and not (rescaled or b in moved or new.asks(s.model[name])):
            continue
        bulk, more_mass = (d.mass, 0.0) if heavy else (usual, STAND_IN * usual)
        x[MASS], x[EXCESS_MASS] = d.mass, more_mass
        x[PER_MASS], x[PER_BULK] = 1.0 / (d.mass + more_mass), 1.0 / bulk
        if s.tables["body_i"][b, TREE] == POINT:
            x[PER_COMPACT], x[INVERSE + 8], x[EXCESS + 8] = x[PER_BULK], x[PER_MASS], more_mass
            x[BODY_R : BODY_R + 9] = d.R.ravel()
        else:
            _turning(x, d.inertia, bulk * reach[b] ** 2, bulk * length**2, s.model.planar)
    return body_x


def _turning(x: np.ndarray, J: np.ndarray, compact: Any, bulky: Any, planar: bool) -> None:
    """Inertia of a body, its inverse, and what stands in for it, into its row.

    ``compact``: what it would be if all that its frames reach were filled; ``bulky``: if it has no size of its own.
    """
    own = J[2, 2]
    size = maximum(own if planar else (J[0, 0] + J[1, 1] + own) / 2, compact)
    size = size if size.real > 0.0 else bulky
    x[PER_COMPACT] = 1.0 / size
    if planar and own.real >= THIN * size.real:
        x[INERTIA + 8], x[INVERSE + 8] = own, 1.0 / own
        x[EXCESS + 8] = 0.0
        return
    inverse, more = inverse_inertia(np.diag([0.0, 0.0, own]) if planar else J, size, planar)
    x[INERTIA : INERTIA + 9] = 0.0 if planar else J.ravel()
    x[INERTIA + 8] = own
    x[INVERSE : INVERSE + 9], x[EXCESS : EXCESS + 9] = inverse.ravel(), more.ravel()


def _reaches(s: Structure, frame_x: np.ndarray) -> np.ndarray:
    """Of every body the largest component, taken positive, of the ways from its centre of mass to its frames."""
    out = np.zeros(len(s.tables["body_i"]), frame_x.dtype)
    flat = frame_x[:, :3]
    best = np.argmax(np.abs(real_parts(flat)), axis=1)
    largest = flat[np.arange(len(flat)), best]
    largest = np.where(real_parts(largest) < 0.0, -largest, largest)
    order = np.argsort(real_parts(largest), kind="stable")
    order = order[s.tables["frame_i"][order] >= 0]
    out[s.tables["frame_i"][order]] = largest[order]  # the last one given is the largest
    return out
