"""How far bodies come to be turned wrongly by steps of fixed width.

A turn in space is integrated as a quaternion, q' = q w / 2. A method of order p is off by about (w h)^(p + 1) a step
there, and neither energy nor constraints tell: of what turns by radians a step the angle may be all that is wrong. By
how much is known of a steady turn, which is u' = i w u / 2 of a number u that every evaluation gives the length 1; of
`radau` it is d' = w (1 + d^2 / 4), d being Cayley's step. Where steps follow an error of their own that bounds it, and
generalised-alpha and the variational method turn steadily without any error.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from ..equations.tree import quaternion_at
from ..numerics.integrators.implicit.coefficients import A as RADAU
from ..numerics.integrators.tableaux import TABLEAUX, tableau

if TYPE_CHECKING:
    from .result import Result

FAR = 0.02  # angle [rad] by which a body may be turned wrongly
WIDEST, FINE = 12.0, 0.01  # turn in a step [rad] up to which its error is known; between two of which that is
WIDEST_RADAU = 2.0 * np.arctan(3.0**0.5)  # the same of `radau`, which takes no wider steps
ENOUGH = 20  # iterations of Newton's method


def overturned(result: Result) -> str:
    """What is to be said of a motion whose steps turn a body too far for their method; nothing where none does."""
    if not _known(result):
        return ""
    off, name, turn = 0.0, "", 0.0
    for body, b in result.values.structure.place.items():
        i = quaternion_at(result.values.system, b)[1] if b >= 0 else -1
        if i < 0:
            continue
        pieces = result.pieces or (result,)
        size = sum(_off(x, i) for x in pieces)
        fastest = max(float(np.linalg.norm(x.v[:, i : i + 3], axis=1).max(initial=0.0)) for x in pieces)
        off, name, turn = max((off, name, turn), (size, body, fastest * result.health.options["step"]))
    if not off > FAR:
        return ""
    return (
        f"{name!r} turns by up to {turn:.2g} rad a step, which method={result.health.options['method']!r} is not exact "
        f"for: by that alone its angle comes to be off by about {off:.2g} rad, whatever the energy balance says; give "
        f"a shorter step"
    )


def _known(result: Result) -> bool:
    o = result.health.options
    return bool(o.get("step")) and (o.get("method") in TABLEAUX or o.get("method") == "radau") and len(result.t) > 1


def _off(result: Result, i: int) -> float:
    """Largest angle [rad] by which a body is turned wrongly; i: first of its angular velocities."""
    o, w = result.health.options, result.v[:, i : i + 3]
    h = o["step"]
    turn, error = _errors(o["method"])
    size = np.linalg.norm(w, axis=1)
    rate = w * (np.interp(size * h, turn, error) / (h * np.maximum(size, 1e-300)))[:, None]
    ways = 0.5 * (rate[1:] + rate[:-1]) * np.diff(result.t)[:, None]
    return float(np.linalg.norm(np.cumsum(ways, axis=0), axis=1).max(initial=0.0))


@lru_cache
def _errors(method: str) -> tuple[np.ndarray, np.ndarray]:
    """Turns in a step [rad], and how much farther each comes out."""
    x = np.arange(0.0, WIDEST_RADAU if method == "radau" else WIDEST, FINE)
    return x, (_by_radau(x) if method == "radau" else _explicitly(method, x)) - x


def _explicitly(method: str, x: np.ndarray) -> np.ndarray:
    R = tableau(method)
    stages = int(R.order_i[1])
    K: list[np.ndarray] = []
    for i in range(stages + 1):
        u = 1.0 + sum((a * k for a, k in zip(R.A[i], K, strict=False)), np.zeros(len(x), complex))
        if i < stages:
            K.append(0.5j * x * u / np.abs(u))
    return 2.0 * np.unwrap(np.angle(u))


def _by_radau(x: np.ndarray) -> np.ndarray:
    A, d, out = np.array(RADAU), np.zeros(3), np.zeros(len(x))
    for n, turn in enumerate(x.tolist()):
        for _ in range(ENOUGH):
            d = d - np.linalg.solve(np.eye(3) - turn * A * (0.5 * d), d - turn * A @ (1.0 + 0.25 * d * d))
        out[n] = 2.0 * np.arctan(0.5 * d[2])
    return out
