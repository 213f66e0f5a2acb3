"""What methods of fixed steps have in common: how a step is entered, its works, what follows one that fails."""

from __future__ import annotations

from ....compiler.formulas import formula
from ..clock import NEW, NOW
from ..loop import shorten

NARROWEST = 1e-3  # part of the step below which none is tried
GROWN = 6.0  # what tells that the last step was not refused


@formula
def account(c, h):
    """Integrals of the motion at the end of the step, by their rates at its ends."""
    for n in range(c.accounts.shape[0]):
        i = c.accounts[n]
        c.y[NEW, i] = c.y[NOW, i] + 0.5 * h * (c.K[0, i] + c.K[1, i])


@formula
def enter(c, t):
    """Make the end of the step the present state."""
    for i in range(c.y.shape[1]):
        c.y[NOW, i] = c.y[NEW, i]
        c.K[0, i] = c.K[1, i]
    c.real.h = c.real.step
    c.real.t = t
    c.real.grow = GROWN
    c.count.accepted += 1


@formula
def refuse(K, c):
    """Try half the width where slopes of laws may be infinite. Returns 0, or that there is nothing to try."""
    h = 0.5 * c.real.tried
    if K.count.steep == 0 or h < NARROWEST * c.real.step:
        return 1
    shorten(c, h)
    K.count.fresh = -1
    return 0
