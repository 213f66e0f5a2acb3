"""Tasks of the engine (see `engine.motion_kernel`) and of the residuals, by number; and where they write."""

from __future__ import annotations

from typing import NamedTuple

from ..compiler.layout import Complex1, Complex2, Float2

POSITION, MOTION, INTEGRATE, FOLLOW, ARRIVE, REPORT, RESIDUAL, SOLVE, TANGENT, INSPECT, COMPLETE = range(11)
SLOPES, WATCH = 11, 12
STEPS, ALONG, GAPS, PARTS, PUSHES = range(5)


class Sheet(NamedTuple):
    """Where the engine writes."""

    rows: Float2


class Bench(NamedTuple):
    """A state, steps from it, and what the residuals are there; all complex."""

    t: Complex1  # (1,) [s]
    state: Complex1  # (nq + nv + nz,)
    vdot: Complex1  # (nv,)
    lam: Complex1  # (nr,)
    steps: Complex2  # (n, 3 nv + 1): of positions (along the velocities), velocities, accelerations, and of time;
    # behind these, if there are more, of states of controllers
    out: Complex2  # (n, nv + 3 nr + 3 nm), or more: what x' = f misses of these where they do not change
