"""Points and line segments: where they are nearest, and the one or two contacts of two rounded lines."""

from __future__ import annotations

from ...compiler.formulas import formula
from ...math.vec import dot, sub


@formula
def within(t):
    """T held between 0 and 1."""
    return max(0.0, min(1.0, t))


@formula
def on_line(p, a, u):
    """How far along the line from a to a + u (0 to 1) it is nearest to p."""
    uu = dot(u, u)
    return within(dot(sub(p, a), u) / uu) if uu > 0.0 else 0.0


@formula
def nearest_on_lines(a, u, b, v):
    """Parts of the lines a + s u, b + t v at which they are nearest (Ericson 2005, 5.1.9)."""
    w = sub(a, b)
    uu, vv, uv = dot(u, u), dot(v, v), dot(u, v)
    uw, vw = dot(u, w), dot(v, w)
    if not uu > 0.0:
        return 0.0, (within(vw / vv) if vv > 0.0 else 0.0)
    if not vv > 0.0:
        return within(-uw / uu), 0.0
    square = uu * vv - uv * uv
    s = within((uv * vw - uw * vv) / square) if square > 1e-14 * uu * vv else 0.0
    t = (uv * s + vw) / vv
    if t < 0.0:
        return within(-uw / uu), 0.0
    if t > 1.0:
        return within((uv - uw) / uu), 1.0
    return s, t
