"""Values within a step by cubics through those at its ends, with their rates there: for methods of order 2.

What is needed stands on the desk: values in rows START and END of ``v``, ``z``, ``rate``; increments at the end in
``d``; and ``ends``: rates of increments at the end, accelerations at the begin and at the end.
"""

from __future__ import annotations

from ....compiler.jit import formula
from .desk import START

END = 2  # row of the end of a step
D_RATE, V_RATE, V_RATE_END = range(3)  # rows of ends


@formula
def between(K, x, h, d, v, z):
    """Increments, velocities and integrals at t + x h.

    What does not change stays as it is, to the last digit: of a place on an outline that tells the edge.
    """
    y = 1.0 - x
    out, end, back = h * x * y * y, x * x * (3.0 - 2.0 * x), -h * x * x * y
    for i in range(d.shape[0]):
        v0 = K.v[START, i]
        d[i] = out * v0 + end * K.d[END, i] + back * K.ends[D_RATE, i]
        v[i] = v0 + out * K.ends[V_RATE, i] + end * (K.v[END, i] - v0) + back * K.ends[V_RATE_END, i]
    for i in range(z.shape[0]):
        z0 = K.z[START, i]
        z[i] = z0 + out * K.rate[START, i] + end * (K.z[END, i] - z0) + back * K.rate[END, i]
