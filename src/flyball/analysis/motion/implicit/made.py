"""The loop of an implicit method, by its name."""

from __future__ import annotations

from typing import Any

from ....numerics.integrators import clock as ex
from ...compiled import Compiled
from ..options import Integration
from .alpha import RHO, Alpha
from .loop import Implicit
from .suited import ALPHA, VARIATIONAL
from .variational import Variational


def implicit(c: Compiled, clock: ex.Clock, width: int, o: Integration) -> Any:
    """A motion by the method that is asked for, ready to run.

    Parameters
    ----------
    c : Compiled
        In the coordinates of the motion, with the scratch that it is run on.
    clock : Clock
    width : int
        Of a row of output.
    o : Integration
    """
    if o.method == VARIATIONAL:
        return Variational(c, clock, width)
    index_3 = o.stabilization == "none"
    if o.method == ALPHA:
        rho = RHO if o.rho_inf is None else o.rho_inf
        return Alpha(c, clock, width, o.step or 0.0, rho, index_3)
    return Implicit(c, clock, width, o.step or 0.0, index_3)
