"""Branches through a point where derivatives of second order leave them open: seen at small distances from it.

On small spheres round the point all positions are found by Newton's method from many starts. What they tend to as the
sphere shrinks are the tangents of half-branches, two of which make a branch if tangent and curvature agree (branches
that touch, or cross twice); one that has no other half ends here in a cusp.
"""

from __future__ import annotations

import itertools
import math

import numpy as np

from .closure import Closure, Place

RADIUS = 0.1
SHARES = (1.0, 0.75, 0.5, 0.25)
ROUND = 160  # starts on a circle; as many in more dimensions
ITERATIONS = 14
SAME = 2e-3  # directions nearer than this are one, at the largest radius [1]
ALIGNED, CUSP = 0.02, 0.5  # how far the tangents of the halves of a branch, of a cusp, may seem apart [1]
ENDLESS = 24  # halves beyond which there is no end of them
FLAT = 1e-4  # derivatives of the driver below this are none, here

Half = tuple[np.ndarray, np.ndarray, np.ndarray]  # tangent, half the curvature, steps (len(SHARES), columns)

Touch = tuple[tuple[np.ndarray, ...], tuple[np.ndarray, ...]]


def touching(c: Closure, x: Place, N: np.ndarray) -> list[Touch] | None:
    """Branches through x, whose kernel is N: Taylor coefficients of each; of a cusp also steps onto its halves.

    None if there are directions without end.
    """
    around = _around(c, x, N)
    if len(around) > ENDLESS:
        return None
    left = [h for h in (_shrunk(c, x, N, d) for d in around) if h is not None]
    out: list[Touch] = []
    while left:
        n, m, d = left.pop(0)
        across = [
            (float(np.linalg.norm(m - h[1])), k) for k, h in enumerate(left) if np.linalg.norm(n + h[0]) < ALIGNED
        ]
        beside = [(float(np.linalg.norm(n - h[0])), k) for k, h in enumerate(left) if np.linalg.norm(n - h[0]) < CUSP]
        if across:
            out.append((_fitted(n, d, left.pop(min(across)[1])[2]), ()))
        elif beside:
            other = left.pop(min(beside)[1])[2]
            out.append((_tip(d, other), (d[0], other[0])))
        else:
            out.append(((_quiet(n), _quiet(2.0 * m)), (d[0],)))
    return out


def _tip(one: np.ndarray, other: np.ndarray) -> tuple[np.ndarray, ...]:
    """Tangent and curvature of the middle of a cusp's halves, which are apart by odd powers of the root of distance."""
    h = RADIUS * np.array(SHARES)
    fit = np.linalg.solve(np.vander(h, increasing=True), 0.5 * (one + other) / h[:, None])
    return _quiet(fit[0] / np.linalg.norm(fit[0])), _quiet(2.0 * fit[1])


def _around(c: Closure, x: Place, N: np.ndarray) -> list[np.ndarray]:
    """Steps to all positions at the largest radius."""
    k = N.shape[1]
    if k == 2:
        turns = 2.0 * np.pi * (np.arange(ROUND) + 0.37) / ROUND
        starts = np.column_stack([np.cos(turns), np.sin(turns)])
    else:
        starts = np.random.default_rng(0).normal(size=(2 * ROUND, k))
        starts /= np.linalg.norm(starts, axis=1)[:, None]
    found: list[np.ndarray] = []
    for y in starts:
        d = _at_radius(c, x, N, RADIUS * N @ y, RADIUS)
        if d is not None and not any(np.linalg.norm(d - e) < SAME * RADIUS for e in found):
            found.append(d)
        if len(found) > ENDLESS:
            break
    return found


def _at_radius(c: Closure, x: Place, N: np.ndarray, d: np.ndarray, h: float) -> np.ndarray | None:
    """The step to the position next to x + d whose part in the kernel is of length h."""
    for _ in range(ITERATIONS):
        y = c.at(c.moved(x, d))
        part = N.T @ d
        r = np.r_[c.residual(y), (part @ part - h * h) / (2.0 * h)]
        if np.abs(r).max() < 1e-14:
            break
        J = np.vstack([c.jacobian(y), (N @ part) / h])
        e = -np.linalg.lstsq(J, r, rcond=1e-9)[0]
        if not np.isfinite(e).all() or np.linalg.norm(e) > h:
            return None
        d = c.way(x, c.moved(y, e))
    y = c.at(c.moved(x, d))
    closed = np.abs(c.residual(y)).max() < 1e-12 and abs(np.linalg.norm(N.T @ d) - h) < 1e-9
    return d if closed and np.linalg.norm(d) < 1.5 * h else None


def _shrunk(c: Closure, x: Place, N: np.ndarray, d: np.ndarray) -> Half | None:
    """Follow a position to smaller radii: its tangent and curvature at x."""
    steps = [d]
    for before, share in itertools.pairwise(SHARES):
        guess = steps[-1] * share / before
        if len(steps) > 1:  # straight on, from two directions
            a, b = steps[-2] / (RADIUS * SHARES[len(steps) - 2]), steps[-1] / (RADIUS * before)
            guess = (b + (b - a) * (before - share) / (SHARES[len(steps) - 2] - before)) * RADIUS * share
        found = _at_radius(c, x, N, guess, RADIUS * share)
        if found is None:
            return None
        steps.append(found)
    h = RADIUS * np.array(SHARES)
    slopes = np.array(steps) / h[:, None]
    fit = np.linalg.solve(np.vander(h, increasing=True), slopes)
    n = fit[0] / np.linalg.norm(fit[0])
    return n, fit[1], np.array(steps)


def _fitted(n: np.ndarray, one: np.ndarray, other: np.ndarray) -> tuple[np.ndarray, ...]:
    """Derivatives of the branch through positions on both sides, by the step along its tangent."""
    n = n if n[-1] > FLAT or (abs(n[-1]) <= FLAT and n[np.argmax(np.round(np.abs(n), 6))] > 0.0) else -n
    d = np.vstack([one, other])
    s = d @ n
    fit = np.linalg.solve(np.vander(s, len(s) + 1, increasing=True)[:, 1:], d)
    return tuple(_quiet(fit[k] * math.factorial(k + 1)) for k in range(3))


def _quiet(d: np.ndarray) -> np.ndarray:
    """Without what is but rounding in the driver's part."""
    d = d.copy()
    d[-1] = d[-1] if abs(d[-1]) > FLAT else 0.0
    return d
