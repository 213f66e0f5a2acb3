"""The steps of an implicit method, by its name."""

from __future__ import annotations

from ....numerics.integrators import clock as ex
from ...compiled import Compiled
from ..options import Integration
from .alpha import Alpha
from .loop import Implicit
from .suited import ALPHA, RHO, VARIATIONAL
from .variational import Variational


def implicit(method: str, c: Compiled, clock: ex.Clock, o: Integration) -> Implicit | Variational:
    """Steps of a method for one motion.

    Parameters
    ----------
    method : str
    c : Compiled
        In the coordinates of the motion, with the scratch that it is run on.
    clock : Clock
    o : Integration
    """
    if method == VARIATIONAL:
        return Variational(c, clock)
    index_3 = o.stabilization == "none"
    if method == ALPHA:
        return Alpha(c, clock, RHO if o.rho_inf is None else float(o.rho_inf), index_3)
    return Implicit(c, clock, index_3)
