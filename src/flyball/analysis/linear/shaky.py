"""Loads that nothing carries: positions at rest that only the closing tolerance keeps from being singular.

Where constraints lose rank without letting anything move, the structure can shake: w with G w = 0 for which the gaps
grow as kappa s^2 / 2 with the way s along it. Forces that do work along w are balanced by no finite reaction. Newton's
method ends beside the singular position, where G w = sigma u and the reaction is as large as the way s = sigma / kappa
is short. A way whose gaps are within the closing tolerance says nothing: such reactions are made of it.
"""

from __future__ import annotations

import numpy as np

from ...errors import SingularityError
from ...numerics.saddle import surely_independent
from ...tables.names import velocity_names
from .derivatives import Equations, State
from .rest import Rest

DENSE = 300  # rows or columns up to which all singular values are found
CLOSED = 1e-10  # gaps that Newton's method leaves, of the mechanism's length
WEAK, NONE = 1e-3, 1e-11  # singular values of rows of unit length that are looked at: smaller ones carry nothing
STEP = 1e-3  # way along which it is seen how a singular value changes, in radians or parts of the mechanism's length
LOADED = 1e-4  # work of the forces along the shake, of what they could do: less is none
PART = 1e-3  # of a dependency: elements with less have none in it


def refuse_shaky(x: Rest) -> None:
    """Refuse a position at rest whose reactions are made of the closing tolerance.

    Raises
    ------
    SingularityError
        Naming the elements whose constraints depend on each other there, and what they let shake.
    """
    if not len(x.g):
        return
    if min(x.G.shape) > DENSE and surely_independent(x.G):  # others bend too much to be shaky
        return
    U, d, Vt = np.linalg.svd(x.G.toarray(), full_matrices=False)
    force = x.scale * Equations(State.resting(x.c, x.t, x.q)).block("r")
    for u, sigma, w in zip(U.T, d, Vt, strict=True):
        if not NONE * d[0] < sigma < WEAK * d[0]:
            continue
        there, back = (u @ x.moved(s * STEP * w, 0.0 * x.lam).G @ w for s in (1.0, -1.0))
        bends = abs(there - back) / (2.0 * STEP)
        if sigma**2 < 2.0 * CLOSED * bends and abs(w @ force) > LOADED * (np.abs(w) @ np.abs(force)):
            raise _refused(x, u, w)


def _refused(x: Rest, u: np.ndarray, w: np.ndarray) -> SingularityError:
    """The error that names what is shaky."""
    rows = x.c.structure.rows
    names = tuple(dict.fromkeys(r.element.name for r, part in zip(rows, u, strict=True) if abs(part) > PART))
    shakes = velocity_names(x.c.structure)[int(np.argmax(np.abs(w)))].name
    return SingularityError(
        f"{x.c.structure.model.name!r} has no equilibrium at t = {x.t:.6g} s: the constraints of {', '.join(names)} "
        f"depend on each other there, so that it can shake along {shakes}, and no finite reaction carries the load "
        f"along it. Move them out of this position, take one of them out, or give what yields: a spring, a bushing",
        x.t,
        names,
    )
