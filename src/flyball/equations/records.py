"""The kinematic record of a body or frame: (p, R, w, v, alpha, a), world components.

``alpha`` and ``a`` are the bias accelerations: what is left of the accelerations when every vdot is zero.
"""

from __future__ import annotations

from ..compiler.formulas import formula
from ..math.vec import add, cross, load3, load9, mm, mv, put3, put9

WIDTH = 24


@formula
def load(K, k):
    """Record k of a table."""
    return load3(K, k, 0), load9(K, k, 3), load3(K, k, 12), load3(K, k, 15), load3(K, k, 18), load3(K, k, 21)


@formula
def store_pose(K, k, p, R):
    """Write position and rotation of record k."""
    put3(K, k, 0, p)
    put9(K, k, 3, R)


@formula
def store_motion(K, k, w, v, alpha, a):
    """Write velocities and bias accelerations of record k."""
    put3(K, k, 12, w)
    put3(K, k, 15, v)
    put3(K, k, 18, alpha)
    put3(K, k, 21, a)


@formula
def carried(record, offset, turn):
    """Record of a frame carried by a body: at ``offset`` and turned by ``turn`` in the body's axes."""
    p, R, w, v, alpha, a = record
    r = mv(R, offset)
    wr = cross(w, r)
    return add(p, r), mm(R, turn), w, add(v, wr), alpha, add(a, add(cross(alpha, r), cross(w, wr)))


@formula
def at_rest(offset, turn, o):
    """Record of a frame that does not move; ``o`` is a zero of the wanted number type."""
    zero = (o, o, o)
    return offset, turn, zero, zero, zero, zero
