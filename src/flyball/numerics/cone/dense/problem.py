"""The small problem: u = A x + b of a few rows, each with a rule that its impulse x and its velocity u fulfil together.

The same stands for accelerations and forces. Rules:

    OUT      x = 0
    HOLDS    u = 0
    PUSHES   x >= 0, u >= 0, x u = 0
    GRIPS    |x| <= reach; u = 0 within, u against x at the end
    DRIVEN   x = -lean reach: slides a known way
    TURNS    with the row behind it (its rule: WITH): |(x1, x2)| <= reach; u = 0 within, u against x at the end

reach = const + gain x, of friction never less than zero: what a row can hold may depend on what others carry, and where
that is a load made linear elsewhere, the line passes below zero. Rows are of any units; A's diagonal says
what is large. Where A is singular, rows that hold share as sum A_ii x_i^2 is least.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ....compiler.layout import Float1, Float2, Float3, Int1

OUT, HOLDS, PUSHES, GRIPS, DRIVEN, TURNS, WITH = range(7)
# states that are found: no impulse; at rest; at one end or the other of what it holds; as DRIVEN says;
# a pair that slips
FREE, EVEN, LOW, HIGH, LED, SLIPS = range(6)
# entries of Dense.info; how it ended
ENDED, PASSES, PIVOTS = range(3)
FOUND, NONE_FOUND, NOT_HELD = range(3)  # NOT_HELD: rows that must hold cannot
# rows of Dense.row
SCALE, BIAS, CONST, FIRST, REST, STEP, WAY, KEEN, BEFORE, MISSED = range(10)


class Dense(NamedTuple):
    """What is asked, what is found, and scratch."""

    A: Float2  # (n, n)
    b: Float1  # (n,)
    grain: Float1  # (n,): rounding of b
    rule: Int1  # (n,)
    const: Float1  # (n,)
    gain: Float2  # (n, n)
    lean: Float1  # (n,)
    state: Int1  # (n,): what is tried first, and what is found
    x: Float1  # (n,)
    u: Float1  # (n,)
    reach: Float1  # (n,)
    info: Int1  # (3,)
    N: Float2  # (n, n): A, scaled
    gained: Float2  # (n, n): the same of the gain
    K: Float2  # (n, n): equations of a set of states; its factor
    swap: Int1  # (n,): order of its pivots
    row: Float2  # (10, n)
    T: Float2  # (m, 2 m + 2): pivoting
    basis: Int1  # (m,)
    at: Int1  # (n + 1,): first unknown of each row in it
    Q: Float3  # (2, n, n + 1): x and reach by what pivoting looks for


def dense(n: int) -> Dense:
    """Room for n rows, all OUT."""
    m = 4 * n
    z, i = np.zeros, np.int64
    return Dense(
        z((n, n)), z(n), z(n), z(n, i), z(n), z((n, n)), z(n), z(n, i), z(n), z(n), z(n), z(3, i),
        z((n, n)), z((n, n)), z((n, n)), z(n, i), z((10, n)), z((m, 2 * m + 2)), z(m, i), z(n + 1, i), z((2, n, n + 1)),
    )  # fmt: skip
