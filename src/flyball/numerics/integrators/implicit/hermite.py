"""Values within a step by cubics through those at its ends, with their rates there: for methods of order 2.

What is needed stands on the desk: values in rows START and END of ``v``, ``z``, ``rate``; increments at the end in
``d``; accelerations at the begin and at the end in ``ends``; in ``turns`` the first of the three components of each
increment that is a turn. Such increments are Cayley's steps, axis times 2 tan(angle / 2), which no polynomial follows
far: a turn is one at the mean of the angular velocities of its ends, and what is left, a small one, a cubic behind it.
So steady turns are exact, whole ones too.
"""

from __future__ import annotations

from ....compiler.formulas import formula
from ....math.cayley import bent, quaternion, rate, step
from ....math.scalar import cos, sin, sqrt
from ....math.vec import add, dot, quaternion_product, scale, sub
from .desk import START

END = 2  # row of the end of a step
V_RATE, V_RATE_END = range(2)  # rows of ends
SMALL = 1e-4  # half a turn [rad] below which its sine is its series


@formula
def between(K, x, h, d, v, z):
    """Increments, velocities and integrals at t + x h.

    What does not change stays as it is, to the last digit: of a place on an outline that tells the edge.
    """
    y = 1.0 - x
    out, end, back = h * x * y * y, x * x * (3.0 - 2.0 * x), -h * x * x * y
    for i in range(d.shape[0]):
        v0 = K.v[START, i]
        d[i] = out * v0 + end * K.d[END, i] + back * K.v[END, i]
        v[i] = v0 + out * K.ends[V_RATE, i] + end * (K.v[END, i] - v0) + back * K.ends[V_RATE_END, i]
    for n in range(K.turns.shape[0]):
        turned_between(K, x, h, d, K.turns[n])
    for i in range(z.shape[0]):
        z0 = K.z[START, i]
        z[i] = z0 + out * K.rate[START, i] + end * (K.z[END, i] - z0) + back * K.rate[END, i]


@formula
def turned_between(K, x, h, d, i):
    """The turn whose components begin at i, at t + x h.

    It is exp(x h w) cay(c): w is the mean angular velocity, and c goes from nothing at the begin to what the end asks
    for, its rate being what the angular velocities there leave: w0 - w, and those of w1 - R(c)^T w.
    """
    first = (K.v[START, i], K.v[START, i + 1], K.v[START, i + 2])
    last = (K.v[END, i], K.v[END, i + 1], K.v[END, i + 2])
    mean = scale(0.5, add(first, last))
    left = step(quaternion_product(spun(mean, -h), quaternion((K.d[END, i], K.d[END, i + 1], K.d[END, i + 2]))))
    left_rate = rate(left, sub(sub(last, mean), bent(left, mean)))
    y = 1.0 - x
    c = add(scale(h * x * y * y, sub(first, mean)), scale(-h * x * x * y, left_rate))
    c = add(c, scale(x * x * (3.0 - 2.0 * x), left))
    there = step(quaternion_product(spun(mean, x * h), quaternion(c)))
    for k in range(3):
        d[i + k] = there[k]


@formula
def spun(w, time):
    """The quaternion of a turn at an angular velocity, for a time."""
    half = 0.5 * time * sqrt(dot(w, w))
    by = sin(half) / half if abs(half) > SMALL else 1.0 - half * half / 6.0
    e = scale(0.5 * time * by, w)
    return (cos(half), e[0], e[1], e[2])
