"""Steps of the generalised-alpha method behind a door: what they ask of the equations, as `implicit` asks it."""

from __future__ import annotations

from typing import NamedTuple

from ..compiler.formulas import formula
from ..compiler.kernels import kernel
from ..math.scalar import atan, sqrt
from ..numerics.integrators.implicit.desk import AlphaDesk
from ..numerics.integrators.implicit.even import refuse
from ..numerics.integrators.implicit.generalised_alpha import attempt, enter
from ..numerics.integrators.implicit.hermite import between
from ..tables.system import ComplexSystem, ComplexWork, System, Work
from .asking import inspect
from .callbacks import Going, Own
from .implicit import PLAN, TURNS, Plan, arrive, compose, land, linearise, missed, perform, powers
from .tasks import Bench


class AlphaWorkshop(NamedTuple):
    """`Workshop` of this method."""

    WC: ComplexWork
    moved: Bench
    pushed: Bench
    pressed: Bench
    plan: Plan
    desk: AlphaDesk


class AlphaMeans(NamedTuple):
    """`Means` of this method."""

    SC: ComplexSystem
    own: AlphaWorkshop


SMALL = 1e-3  # half a turn [rad] below which arctan(x) / x is its series


@formula
def straight(d, out, A):
    """Increments into those of constant velocity: of turns, Cayley's step into the rotation vector."""
    for i in range(d.shape[0]):
        out[i] = d[i]
    turns = A[PLAN].turns
    for n in range(turns.shape[0]):
        i = turns[n]
        x = 0.5 * sqrt(d[i] * d[i] + d[i + 1] * d[i + 1] + d[i + 2] * d[i + 2])
        by = atan(x) / x if x > SMALL else 1.0 - x * x / 3.0 + x * x * x * x / 5.0
        for m in range(3):
            out[i + m] *= by


@formula
def residual(t, k, A, K, c):
    """What the equations miss at the end of the step; rates of increments are those of constant velocities."""
    status = missed(t, k, A, K, c)
    for i in range(K.v.shape[1]):
        K.out[k, i] = K.dd[k, i] - K.out[k, i]
    if status == 0:
        powers(A, K, k)
    return status


@formula
def slopes(t, k, A, K, c):
    """As `implicit.linearise`; rates of increments do not depend on these."""
    status = linearise(t, k, A, K, c)
    P = A[PLAN]
    for e in range(9 * P.turns.shape[0]):
        K.J[k, P.first[TURNS] + e] = 0.0
    return status


@formula
def by_alpha(S, W, M, own, going, task):
    """The generalised-alpha method."""
    callbacks = (residual, slopes, compose, land, inspect, straight, arrive)
    return perform((attempt, between, enter, refuse), callbacks, S, W, M, own, going, task)


@kernel
def alpha_steps(S: System, W: Work, M: AlphaMeans, own: Own, going: Going, task: int) -> int:
    """`by_alpha` behind an address."""
    return by_alpha(S, W, M, own, going, task)
