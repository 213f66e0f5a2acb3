"""What is rounding of a guard: of it, of what it depends on, of the state that it is asked at, and of time.

A guard of the user's may be zero all along, as a difference of what is equal by symmetry. Then it is rounding, has no
side and no slope. So it leaves its side only as it gets to the other one by more than that; where it passed zero before
is the event. A state strays from step to step as the sum of so many roundings does, by the root of how many there were.
That of a law's corner leaves its side at zero: forces are those of the other side from there on, however little it gets
beyond, as in swings that come ever faster and end on the corner.
"""

from __future__ import annotations

from ...compiler.formulas import formula
from ...math.scalar import sqrt
from .clock import ULP
from .concave import NOISE
from .watching import ASTRAY, GRAIN_END, GRAIN_START, LEAST, MOST, START

STRAYS = 8.0  # grains that a step adds, as a random walk
BEGUN = 16.0  # steps that it takes to stray as far as a state does that has just been made
RESOLVED = 16.0 * ULP  # part of the largest time that is none


@formula
def strayed(W, c):
    """Note how many grains the state may be off by."""
    W.real.strayed = STRAYS * sqrt(BEGUN + c.count.accepted)


@formula
def corner(W, i):
    """Whether guard i is that of a law's corner: it is told how far it may be on the wrong side."""
    return W.g[ASTRAY, i] == W.g[ASTRAY, i]


@formula
def hush(W, i, x):
    """By how much guard i is beyond zero at most at a part x of the step where it has not left its side."""
    return 0.0 if corner(W, i) else blur(W, i, x)


@formula
def blur(W, i, x):
    """What is rounding of guard i at a part x of the step."""
    if W.kept[i] == 1 or corner(W, i):
        return NOISE * W.grain[i]
    return W.real.strayed * ((1.0 - x) * W.g[GRAIN_START, i] + x * W.g[GRAIN_END, i])


@formula
def rounding(W, c, i, slope, x):
    """What is no more than rounding of a guard at a part x of the step, or of time, by which it changes so fast."""
    return blur(W, i, x) + RESOLVED * max(abs(c.real.t), c.real.largest) * abs(slope)


@formula
def side_at_start(W, i):
    """The side that guard i is on as the step begins: that which it was last on beyond rounding; 0 if that is none."""
    f = W.g[START, i]
    if abs(f) > hush(W, i, 0.0):
        return 1.0 if f > 0.0 else -1.0
    return W.side[i] if abs(W.side[i]) == 1.0 else 0.0


@formula
def gone(W, i, s, f, x):
    """Whether guard i, which was on side s, has left it where it is f: beyond zero, or at zero and was not before."""
    return s * f < -hush(W, i, x) or (f == 0.0 and max(s * W.g[LEAST, i], s * W.g[MOST, i]) > hush(W, i, x))
