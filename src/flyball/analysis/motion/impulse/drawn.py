"""A start of bodies on which nothing acts: as drawn and told, without the engine, which need not be compiled then."""

from __future__ import annotations

import numpy as np

from ....tables.coordinates import BodyState
from ...assembly.described import described
from ...assembly.start import Assembly
from ...compiled import Compiled


def as_drawn(c: Compiled, t: float) -> Assembly | None:
    """The assembled start if there is nothing to assemble; None otherwise."""
    s, model = c.structure, c.structure.model
    if s.rows or s.terms or s.states or len(s.forces) or model.initial:
        return None
    q = c.values.q.copy()
    return Assembly(c, t, q, described(c.values, q))


def moving(base: Assembly) -> dict[str, BodyState]:
    """How every body moves at that start."""
    values, out = base.compiled.values, {}
    tree = values.structure.tables["tree"]
    for name, b in values.structure.place.items():
        if b >= 0:
            d = values.bodies[name]
            u = base.v[tree.velocities(b)]
            if values.structure.model.planar:
                v, w = np.r_[u[:2], 0.0], np.r_[0.0, 0.0, u[2:] if len(u) > 2 else 0.0]
            else:
                v, w = u[:3], d.R @ u[3:] if len(u) > 3 else np.zeros(3)
            out[name] = BodyState(d.c, d.R, v, w, d.angle)
    return out
