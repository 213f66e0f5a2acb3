"""The guard of a group, the least of several distances at best, by what it comes from: a concave function of its terms.

It is flat as long as another distance than that which falls is the least, and then has a corner; its terms, bounds and
forces of each cell of `cone.shares`, are smooth. So these are judged with it: whether they are as expected, and whether
the guard may dip below zero between two places that are looked at. Between these it is no less than

    (1 - u) f + u g - D u (1 - u),

f, g being its values there, u in (0, 1), D = h^2 |terms''| / 2: it is concave, and changes by no more than its terms.
"""

from __future__ import annotations

from ...compiler.formulas import formula
from ...math.scalar import sqrt
from .watching import CHECKS, LEAST, MISS, MOST, NODE, NODES

ODD = 1e-2  # part of its change over a step by which a guard may differ from what is expected
FAR = 0.05  # part of its least distance from zero by which it may
BLURRED = 1e-9  # part of its size that is nothing
NOISE = 4.0  # times what is rounding of a guard
REACH = 1.5  # times the second differences that are seen that there may be


@formula
def borne_out(W):
    """Whether terms are as expected where stages of the step have met them."""
    if W.count.terms == 0:
        return True
    last = W.way.shape[0] - 1
    near = FAR * W.g[LEAST, last]
    for k in range(W.count.terms):
        i = last + 1 + k
        low, high, miss = W.g[LEAST, i], W.g[MOST, i], W.g[MISS, i]
        if miss > max(near, ODD * (high - low)) + BLURRED * max(abs(low), abs(high)) + NOISE * W.grain[last]:
            return False
    return True


@formula
def bent(W):
    """Whether the guard may dip below zero between two nodes of a panel, or its terms are not resolved there."""
    last, n = W.way.shape[0] - 1, W.count.terms
    if n == 0:
        return False
    least = W.g[NODE, last]
    for j in range(1, NODES + CHECKS):
        least = min(least, W.g[NODE + j, last])
    for k in range(n):
        if not smooth(W, last + 1 + k, FAR * least):
            return True
    for j in range(1, NODES):
        f, g = W.g[NODE + j - 1, last], W.g[NODE + j, last]
        if f < 0.0 or g < 0.0 or f != f or g != g:
            continue
        sag = REACH * (W.nodes[j] - W.nodes[j - 1]) ** 2 * steepest(W, j, last + 1, n)
        if sqrt(f) + sqrt(g) < sqrt(sag) and sag > NOISE * W.grain[last]:
            return True
    return False


@formula
def smooth(W, i, near):
    """Whether a term is the polynomial through its values at the nodes, or as near to it as does not matter."""
    low, high = W.g[NODE, i], W.g[NODE, i]
    for j in range(1, NODES + CHECKS):
        low, high = min(low, W.g[NODE + j, i]), max(high, W.g[NODE + j, i])
    allowed = max(near, ODD * (high - low)) + BLURRED * max(abs(low), abs(high)) + NOISE * W.grain[W.way.shape[0] - 1]
    for j in range(CHECKS):
        f = W.g[NODE + NODES + j, i]
        for k in range(NODES):
            f -= W.checks[j, k] * W.g[NODE + k, i]
        if not abs(f) <= allowed:
            return False
    return True


@formula
def steepest(W, j, first, n):
    """Half the most by which terms of a cell bend about the interval that ends at node j, by divided differences."""
    most = 0.0
    for c in range(first, first + n, 3):
        bend = 0.0
        for m in range(max(j, 2), min(j + 1, NODES - 1) + 1):
            here = 0.0
            for i in range(c, c + 3):
                here += abs(second(W, m, i))
            bend = max(bend, here)
        most = max(most, bend)
    return most


@formula
def second(W, m, i):
    """The second divided difference of column i at nodes m - 2, m - 1, m."""
    x, y, z = W.nodes[m - 2], W.nodes[m - 1], W.nodes[m]
    f, g, e = W.g[NODE + m - 2, i], W.g[NODE + m - 1, i], W.g[NODE + m, i]
    return ((e - g) / (z - y) - (g - f) / (y - x)) / (z - x)
