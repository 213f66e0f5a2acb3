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
    """Increments, velocities and integrals at t + x h."""
    y = 1.0 - x
    begin, out = (1.0 + 2.0 * x) * y * y, h * x * y * y
    end, back = x * x * (3.0 - 2.0 * x), -h * x * x * y
    for i in range(d.shape[0]):
        v0 = K.v[START, i]
        d[i] = out * v0 + end * K.d[END, i] + back * K.ends[D_RATE, i]
        v[i] = begin * v0 + out * K.ends[V_RATE, i] + end * K.v[END, i] + back * K.ends[V_RATE_END, i]
    for i in range(z.shape[0]):
        z[i] = begin * K.z[START, i] + out * K.rate[START, i] + end * K.z[END, i] + back * K.rate[END, i]
