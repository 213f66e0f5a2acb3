"""A position at rest as a result."""

from __future__ import annotations

import numpy as np

from ...results.equilibrium import Equilibrium
from ...tables.names import velocity_names
from ..assembly.start import Assembly
from .curves import snapshot
from .derivatives import State
from .rest import Rest
from .stability import stability

SHOWN = 6  # coordinates of the direction of least stiffness


def finished(x: Rest, preload: dict[str, float], way: str) -> Equilibrium:
    """The equilibrium there, judged.

    Parameters
    ----------
    x : Rest
    preload : dict
        What was added to forces.
    way : str
        What found it.
    """
    s = stability(x)
    names = velocity_names(x.c.structure)
    large = np.argsort(-np.abs(s.direction))[:SHOWN]
    x.c.at(x.t, x.q, np.zeros(len(x.scale)))
    return Equilibrium(
        t=x.t,
        stability=s.kind,
        freedoms=tuple(s.free.labels),
        stiffness=s.stiffness,
        weakest={names[d].name: float(s.direction[d]) for d in large if abs(s.direction[d]) > 1e-3},
        least=s.least,
        unbalanced=x.unbalanced(),
        method=way,
        parameters=dict(x.c.parameters),
        result=snapshot(State.resting(x.c, x.t, x.q, x.lam)),
        assembly=Assembly(x.c, x.t, x.q, np.zeros(len(x.scale))),
        preload=preload,
        kinks=s.kinks,
    )
