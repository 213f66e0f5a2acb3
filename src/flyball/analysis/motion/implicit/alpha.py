"""A motion by the generalised-alpha method: what its steps work with."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ....equations.alpha import alpha_steps
from ....numerics.integrators import clock as ex
from ....numerics.integrators.implicit import desk as ds
from ....numerics.lu import Rows
from ...compiled import Compiled
from .loop import EPS, Implicit


class Desk(NamedTuple):
    """Scratch and tables of one run; what has the same name as in `numerics.integrators.implicit.desk` is the same."""

    count: np.ndarray  # type: ignore[assignment]
    real: np.ndarray
    rho: np.ndarray  # (1,): spectral radius at infinity
    d: np.ndarray
    v: np.ndarray
    dd: np.ndarray
    a: np.ndarray
    lam: np.ndarray
    found: np.ndarray
    mu: np.ndarray
    z: np.ndarray
    rate: np.ndarray
    xd: np.ndarray
    out: np.ndarray
    tol: np.ndarray
    tol_x: np.ndarray
    place: np.ndarray
    x: np.ndarray
    J: np.ndarray
    spring: np.ndarray
    put: np.ndarray
    part: np.ndarray
    real_A: np.ndarray
    real_L: np.ndarray
    real_U: np.ndarray
    real_D: np.ndarray
    real_Y: np.ndarray
    P: Rows
    past: np.ndarray  # (4, nv + nx): accelerations that the method remembers, and rates of x
    ends: np.ndarray  # (2, nv): accelerations at the ends of the step
    turns: np.ndarray  # first angular velocity of each quaternion


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

    door = alpha_steps

    def __init__(self, c: Compiled, clock: ex.Clock, rho: float, index_3: bool) -> None:
        self.rho = rho
        super().__init__(c, clock, index_3)

    def _settle(self, real: np.ndarray, turns: bool) -> None:
        super()._settle(real, turns)
        steps = float(self.clock.real[ex.SPAN] / self.clock.real[ex.STEP])  # what each leaves to its iteration adds up
        real[ds.NEWTON] = max(10.0 * EPS / real[ds.RTOL], min(0.1, 1.0 / steps))
        self.own.array("desk.rho")[0] = self.rho

    def _desk(self, nz: int, springy: np.ndarray) -> Desk:  # type: ignore[override]
        w = super()._desk(nz, springy)
        nv, nx = self.layout.nv, self.layout.nx
        kept = {name: getattr(w, name) for name in Desk._fields if name not in ("rho", "past", "ends", "turns")}
        past, ends = np.zeros((4, nv + nx)), np.zeros((2, nv))
        return Desk(**kept, rho=np.zeros(1), past=past, ends=ends, turns=self.layout.turns)
