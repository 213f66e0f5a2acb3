"""Generalised forces by what gives them: the engine's own loops, run for one element at a time."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...equations.loads import efforts, forces, gather, inertial
from ...tables.system import System, Work
from ..formulated import Formulated


def along(x: Formulated) -> list[tuple[str, np.ndarray]]:
    """(what, forces along the velocities) of inertia, of gravity and of every force."""
    T = x.traced
    S, W = T.system, T.work
    W = W._replace(FB=np.array([[0.0] * W.FB.shape[1]] * len(W.FB), object).reshape(W.FB.shape))
    weightless = S.glob.copy()
    weightless[:3] = 0.0
    turning = _gathered(S._replace(glob=weightless), W, None)
    out = [("Centrifugal, Coriolis and gyroscopic forces", turning)]
    if any(c != 0.0 for c in S.glob[:3]):
        out.append(("Weight", _gathered(S, W, None) - turning))
    for k, e in enumerate(T.structure.forces):
        rows = {name: getattr(S, name)[k : k + 1] for name in ("force_i", "force_x", "force_code")}
        one = S._replace(**rows)
        out.append((f"{e.name} ({type(e).__name__})", _gathered(one, W, T.t)))
    return [(title, x.cleaned(f)) for title, f in out]


def _gathered(S: System, W: Work, t: Any) -> np.ndarray:
    """Forces along the velocities: of inertia and weight, or of the elements in the tables."""
    f = np.empty(W.vel.shape[1], object)
    f[:] = 0.0
    W.FB[:] = 0.0
    rates = np.zeros(len(S.force_i) + W.y.size, object)
    if t is None:
        inertial(S, W)
        gather(S, W, f)
        return f
    forces(S, W, t, rates)
    gather(S, W, f)
    efforts(S, W, t, rates, f)
    return f
