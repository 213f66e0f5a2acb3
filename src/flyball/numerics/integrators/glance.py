"""Guards within a step: as expected from what was kept of it, or with the equations on its dense output.

What is expected is borne out by what stages of the step have met. Where it is not, as in a wide step of a state that
hardly bends, of which a distance or a force does, the equations are evaluated at every place that is looked at.
"""

from __future__ import annotations

from ...compiler.formulas import formula
from .clock import BETWEEN, PART, T
from .concave import BLURRED, FAR, ODD, borne_out
from .grains import blur
from .loop import WITHIN
from .watching import BRIEF, END, LEAST, LOOKS, LOST, MISS, MOST, PLAIN, SOUGHT, START, TERMS, THERE, TRUE, TRULY

SHORT = 1e-7  # part of the time span: in steps so short there is nothing but rounding to be found


@formula
def glance(callbacks, S, W, R, c, h, x, row):
    """Write guards at a part x of the step to a row."""
    W.count[LOOKS] += 1
    if W.count[PLAIN] == 1:
        callbacks[7](c.real[T], h, x, S, W, row)
    elif exactly(callbacks, S, W, R, c, h, x, row) != 0:
        W.count[LOST] = 1


@formula
def exactly(callbacks, S, W, R, c, h, x, row):
    """Write guards of the equations on the dense output at a part x of the step to a row. Returns a status."""
    ask, own, watch = callbacks[0], callbacks[1], callbacks[5]
    c.real[PART] = x
    if ask(own, S, W, R, c, WITHIN) != 0:
        return 1
    W.count[SOUGHT] += 1
    W.count[TRULY] += 1
    return watch(c.real[T] + x * h, c.y[BETWEEN], S, W, row)


@formula
def true_guard(callbacks, S, W, R, c, h, x, i):
    """Guard i on the dense output at a part x of the step. Returns (status, value)."""
    if x <= 0.0:
        return 0, W.g[START, i]
    if x >= 1.0:
        return 0, W.g[END, i]
    if exactly(callbacks, S, W, R, c, h, x, TRUE) != 0:
        return 1, 0.0
    return 0, W.g[TRUE, i]


@formula
def compare(look, S, W, t, h, span):
    """Note in W.count[PLAIN] whether guards are as expected where stages of the step have met them."""
    ng = W.way.shape[0]
    W.count[SOUGHT] = W.count[LOST] = 0
    W.count[PLAIN] = 1
    W.count[BRIEF] = 1 if h <= SHORT * span else 0
    every = ng + W.count[TERMS]
    for i in range(every):
        W.g[LEAST, i] = min(W.g[START, i], W.g[END, i])
        W.g[MOST, i] = max(W.g[START, i], W.g[END, i])
        W.g[MISS, i] = 0.0
    for j in range(W.met.shape[0]):
        look(t, h, W.met_at[j], S, W, THERE)
        for i in range(every):
            f, g = W.met_g[j, i], W.g[THERE, i]
            if f == g or (f != f and g != g):
                continue
            if not f - g == f - g:  # a number, and none
                W.count[PLAIN] = 0
            W.g[LEAST, i] = min(W.g[LEAST, i], f, g)
            W.g[MOST, i] = max(W.g[MOST, i], f, g)
            W.g[MISS, i] = max(W.g[MISS, i], abs(f - g))
    if W.count[BRIEF] == 1:
        W.count[PLAIN] = 1
        return
    for i in range(ng):
        low, high, miss = W.g[LEAST, i], W.g[MOST, i], W.g[MISS, i]
        if miss == 0.0 or miss <= ODD * (high - low) + BLURRED * max(abs(low), abs(high)) + min(
            blur(W, i, 0.0), blur(W, i, 1.0)
        ):
            continue
        if miss < FAR * low or miss < -FAR * high:
            continue
        W.count[PLAIN] = 0
    if not borne_out(W):
        W.count[PLAIN] = 0
