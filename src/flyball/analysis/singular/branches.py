"""The branches through a point of a driven mechanism's curve: tangents and Taylor coefficients, order by order.

With x(s) = n s + x2 s^2/2 + x3 s^3/6 + ... from the point,

    J n = 0,   J x2 + F''[n, n] = 0,   J x3 + 3 F''[n, x2] + F'''[n, n, n] = 0,   ...

Each left null vector u of J turns one of these into a condition on what came before: of second order on the tangent
(u^T F''[n, n] = 0), of third order on the part of x2 in the kernel, and so on. Where J has but the one null vector that
belongs to the curve, there are none.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .closure import Closure, Place, Rank
from .halves import touching
from .tangents import directions

FLAT = 1e-7  # a Taylor coefficient of the driver below this, of unit steps, is none
DRIVES = ("a'", "a'' > 0", "a'' < 0")
ORDER = 6  # up to which the driver's coefficients are looked at


@dataclass(frozen=True)
class Curve:
    """One branch: Taylor coefficients x1 = n, x2, ... of unit steps (derivatives, not divided by factorials)."""

    x: tuple[np.ndarray, ...]
    ends: tuple[np.ndarray, ...] = ()  # of a cusp, which goes one way only: a step onto each half

    @property
    def driver(self) -> np.ndarray:
        """The driver's derivatives along it."""
        return np.array([c[-1] for c in self.x])

    @property
    def half(self) -> bool:
        """Whether it goes one way only."""
        return bool(self.ends)

    @property
    def order(self) -> int:
        """Order of the driver's first derivative that is not zero; 0 if there is none."""
        turning = np.abs(self.driver) / [math.factorial(k) for k in range(1, len(self.x) + 1)] > FLAT
        return int(np.argmax(turning)) + 1 if turning.any() else 0


@dataclass(frozen=True)
class Crossing:
    """All branches through a point."""

    kernel: np.ndarray  # (columns, k) of J
    left: np.ndarray  # (rows, l)
    curves: list[Curve]
    decided: bool  # whether the second order told all of them
    endless: tuple[str, ...]  # drives (see `DRIVES`) that infinitely many directions answer


def crossing(c: Closure, x: Place, limit: float) -> Crossing:
    """The branches through x; singular values of J below ``limit`` are zero there."""
    r = c.rank(x)
    kept = int((r.values > limit).sum())
    N, U = r.V[:, kept:], r.U[:, kept:]
    forms = quadratic(c, x, N, U)
    size = max(1.0, float(np.abs(c.second(x, N.sum(axis=1))).max()))
    found = directions(forms, size)
    curves = [taylor(c, x, r, kept, N @ t) for t in found.single]
    endless = found.endless
    open_ones = [N @ n for n in found.several]
    if found.several and not endless:
        known = [k.x[0] for k in curves]
        nearby = touching(c, x, N)
        endless = nearby is None
        for coefficients, ends in nearby or []:
            if ends or all(abs(coefficients[0] @ n) < 1.0 - 1e-5 for n in known):
                curves.append(Curve(coefficients, ends))
    drives = _answers(c, x, r, kept, open_ones) if endless else ()
    return Crossing(N, U, sorted(curves, key=_passing_first), found.decided, drives)


def _answers(c: Closure, x: Place, r: Rank, kept: int, directions: list[np.ndarray]) -> tuple[str, ...]:
    """Which drives directions without end answer: all if the driver moves along some, else the signs of a''."""
    if np.abs(r.V[-1, kept:]).max() > FLAT:
        return DRIVES
    bends = [-(r.V[-1, :kept] / r.values[:kept]) @ (r.U[:, :kept].T @ c.second(x, n)) for n in directions]
    return tuple(d for d, sign in zip(DRIVES[1:], (1.0, -1.0), strict=True) if any(sign * b > FLAT for b in bends))


def _passing_first(curve: Curve) -> tuple:
    """Those along which the driver moves, then those where it turns back, then self-motions."""
    return (curve.order or 99, -round(abs(float(curve.driver[0])), 6), *np.round(-curve.x[0], 6).tolist())


def quadratic(c: Closure, x: Place, N: np.ndarray, U: np.ndarray) -> np.ndarray:
    """The forms u^T F''[N ., N .], (l, k, k)."""
    k = N.shape[1]
    B = np.zeros((len(U), k, k))
    for i in range(k):
        for j in range(i + 1):
            B[:, i, j] = B[:, j, i] = c.second(x, N[:, i]) if i == j else c.mixed(x, N[:, i], N[:, j])
    return np.einsum("ru,rij->uij", U, B)


def taylor(c: Closure, x: Place, r: Rank, kept: int, n: np.ndarray, order: int = 3) -> Curve:
    """Taylor coefficients of the branch with tangent n; more of them where the driver's vanish."""
    n = _facing(n)
    N, U = r.V[:, kept:], r.U[:, kept:]
    aside = N - np.outer(n, n @ N)
    aside = np.linalg.svd(aside)[0][:, : N.shape[1] - 1]
    tilt = np.array([U.T @ c.mixed(x, n, e) for e in aside.T]).T if aside.shape[1] else None

    def solved(R: np.ndarray) -> np.ndarray:
        return -r.V[:, :kept] @ ((r.U[:, :kept].T @ R) / r.values[:kept])

    def remainder(known: list[np.ndarray], p: int) -> np.ndarray:
        steps = [k / math.factorial(i + 1) for i, k in enumerate(known)]
        return c.along(x, steps)[p] * math.factorial(p)

    known = [n, solved(c.second(x, n))]
    while True:
        p = len(known) + 1
        R = remainder(known, p)
        if tilt is not None:
            more = np.linalg.lstsq(p * tilt, -(U.T @ R), rcond=1e-9)[0]
            known[-1] = known[-1] + aside @ more
            R = remainder(known, p)
        known.append(solved(R))
        curve = Curve(tuple(known[:-1] if tilt is not None else known))
        if len(curve.x) >= order and (curve.order or len(curve.x) >= ORDER):
            return curve


def _facing(n: np.ndarray) -> np.ndarray:
    """The same direction with the driver, or else its largest component, growing."""
    n = n / np.linalg.norm(n)
    lead = n[-1] if abs(n[-1]) > FLAT else n[np.argmax(np.round(np.abs(n), 9))]
    n = n if lead > 0.0 else -n
    n[np.abs(n) < 1e-15] = 0.0
    return n
