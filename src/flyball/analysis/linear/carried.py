"""Changes of a start in the coordinates of the motion, from those in absolute coordinates: the bodies' are the same."""

from __future__ import annotations

import numpy as np

from ...equations.over_time import OverTime
from ...equations.tree import retract
from ...equations.velocities import velocities
from ...results.records import Records
from ...tables.coordinates import BodyState, positions
from ...tables.values import Values
from ..motion.start import Start
from ..steps import tangent_rate
from .loads import STEP, derivative
from .tangent import Direction


def carried(
    start: Start, d: Direction, own: Values, of: tuple[np.ndarray, np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Changes (nv,), (nv,) of positions, along the velocities, and of velocities.

    Parameters
    ----------
    start : Start
    d : Direction
        The parameter, in absolute coordinates.
    own : Values
        The mechanism's numbers in the coordinates of the motion, a complex step along the parameter.
    of : two arrays (nv,), (nv,)
        The changes in absolute coordinates.
    """
    base, c = start.base, start.assembly.compiled
    if c is base.compiled:
        return of
    bodies = _bodies(start, d.values, of)
    q = positions(own, bodies, base.compiled.hints | base.compiled.turned(base.q))
    still = np.zeros((1, c.structure.nv))
    W = Records(own, q[None], still, still).W
    v = velocities(own, bodies, OverTime(*(part[..., 0] for part in W)))
    return tangent_rate(c, q.real, derivative(q)), derivative(v)


def _bodies(start: Start, values: Values, of: tuple[np.ndarray, np.ndarray]) -> dict[str, BodyState]:
    """How every body moves at the start, with what the parameter changes as imaginary parts."""
    base = start.base
    q = base.q.astype(complex)
    retract(values.system, q, 1j * STEP * of[0])
    v = base.v + 1j * STEP * of[1]
    r = Records(values, q[None], v[None], np.zeros((1, len(v))))
    out = {}
    for name, b in values.structure.place.items():
        if b >= 0:
            p, R, w, u, *_ = (np.array(part)[..., 0] for part in r.body(b))
            angle = q[values.system.tree.q[b] + 2] if values.structure.model.planar else 0.0
            out[name] = BodyState(p, R.reshape(3, 3), u, w, angle)
    return out
