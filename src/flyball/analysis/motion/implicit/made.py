"""The steps of an implicit method, by its name."""

from __future__ import annotations

import numpy as np

from ....equations.alpha import AlphaMeans, AlphaWorkshop, alpha_steps
from ....numerics.integrators import clock as ex
from ....numerics.integrators.implicit.desk import AlphaDesk, SolverReals
from ...compiled import Compiled
from ..options import Integration
from .loop import EPS, Implicit
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


# A motion by the generalised-alpha method: what its steps work with.


class Alpha(Implicit):
    """Steps of the generalised-alpha method for one motion.

    Parameters
    ----------
    c : Compiled
    clock : Clock
    rho : float
        Spectral radius at infinity: 1 damps nothing, 0 all that steps do not resolve.
    index_3 : bool
        Whether velocities are not held to the constraints.
    """

    door, workshop, means = alpha_steps, AlphaWorkshop, AlphaMeans  # type: ignore[assignment]

    def __init__(self, c: Compiled, clock: ex.Clock, rho: float, index_3: bool) -> None:
        self.rho = rho
        super().__init__(c, clock, index_3)

    def _settle(self, real: SolverReals, turns: bool) -> None:
        super()._settle(real, turns)
        steps = float(self.clock.real.span / self.clock.real.step)  # what each leaves to its iteration adds up
        real.newton = max(10.0 * EPS / real.rtol, min(0.1, 1.0 / steps))
        self.own.array("desk.rho")[0] = self.rho

    def _desk(self, nz: int, springy: np.ndarray) -> AlphaDesk:  # type: ignore[override]
        w = super()._desk(nz, springy)
        nv, nx = self.layout.nv, self.layout.nx
        kept = {name: getattr(w, name) for name in AlphaDesk._fields if name not in ("rho", "past", "ends", "turns")}
        past, ends = np.zeros((4, nv + nx)), np.zeros((2, nv))
        return AlphaDesk(**kept, rho=np.zeros(1), past=past, ends=ends, turns=self.layout.turns)
