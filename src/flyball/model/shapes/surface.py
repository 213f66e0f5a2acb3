"""Closed surfaces of triangles: profiles turned about z, outlines extruded along z."""

from __future__ import annotations

import numpy as np


def lathe(profile: np.ndarray, fine: int, ring: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """Turn a profile about z.

    Parameters
    ----------
    profile : (k, 2)
        Points (r, z), the solid to the left of the way along them. It begins and ends on the axis (r = 0), or it is
        a ring: a closed way that stays off the axis.
    fine : int
        Corners of a circle.
    ring : bool

    Returns
    -------
    vertices : (m, 3)
    triangles : (l, 3)
    """
    turn = np.arange(fine) * (2 * np.pi / fine)
    r, z = np.asarray(profile, float).T
    xy = r[:, None, None] * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    v = np.concatenate([xy, np.broadcast_to(z[:, None, None], (len(r), fine, 1))], axis=2).reshape(-1, 3)
    at = np.arange(len(r))[:, None] * fine + np.where((r == 0.0)[:, None], 0, np.arange(fine))
    low, high = (at, np.roll(at, -1, axis=0)) if ring else (at[:-1], at[1:])
    a, b, c, d = (x.ravel() for x in (low, np.roll(low, -1, axis=1), np.roll(high, -1, axis=1), high))
    return _used(v, np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)]))


def extrude(outline: np.ndarray, thickness: float) -> tuple[np.ndarray, np.ndarray]:
    """Extrude a simple polygon (k, 2), counter-clockwise, from z = -thickness / 2 to thickness / 2."""
    n = len(outline)
    z = np.full((n, 1), thickness / 2)
    v = np.concatenate([np.hstack([outline, -z]), np.hstack([outline, z])])
    cap = triangulated(outline)
    a, b = np.arange(n), np.roll(np.arange(n), -1)
    sides = np.concatenate([np.stack([a, b, b + n], axis=1), np.stack([a, b + n, a + n], axis=1)])
    return v, np.concatenate([cap[:, ::-1], cap + n, sides])


def arc(centre: tuple[float, float], radius: float, start: float, end: float, steps: int) -> np.ndarray:
    """Points (steps + 1, 2) on a circle from one angle [rad] to another, both included."""
    turn = np.linspace(start, end, steps + 1)
    return np.array(centre) + radius * np.stack([np.cos(turn), np.sin(turn)], axis=1)


def on_axis(profile: np.ndarray) -> np.ndarray:
    """The profile with its ends put exactly on the axis of rotation."""
    profile[[0, -1], 0] = 0.0
    return profile


def triangulated(p: np.ndarray) -> np.ndarray:
    """Triangles (k - 2, 3) of a simple polygon (k, 2), counter-clockwise, by cutting off ears (Meisters 1975)."""
    left = list(range(len(p)))
    out = []
    while len(left) > 3:
        k = next((k for k in range(len(left)) if _is_ear(p, left, k)), None)
        if k is None:  # no ear but for rounding: cut where the turn is sharpest
            k = int(np.argmax([_turn(p, left, k) for k in range(len(left))]))
        out.append((left[k - 1], left[k], left[(k + 1) % len(left)]))
        left.pop(k)
    return np.array([*out, tuple(left)])


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """The z component of the cross product of vectors in the plane."""
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def _turn(p: np.ndarray, left: list[int], k: int) -> float:
    a, b, c = p[left[k - 1]], p[left[k]], p[left[(k + 1) % len(left)]]
    return float(cross(b - a, c - b))


def _is_ear(p: np.ndarray, left: list[int], k: int) -> bool:
    """Whether the corner turns left and no other point lies in the triangle that it makes with its neighbours."""
    corner = [left[k - 1], left[k], left[(k + 1) % len(left)]]
    a, b, c = p[corner]
    if _turn(p, left, k) < 0.0:
        return False
    q = p[[i for i in left if i not in corner]]
    inside = (cross(b - a, q - a) >= 0) & (cross(c - b, q - b) >= 0) & (cross(a - c, q - c) >= 0)
    return not inside.any()


def _used(v: np.ndarray, f: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Without triangles that have no area by their indices, and without vertices that none uses."""
    f = f[(f[:, 0] != f[:, 1]) & (f[:, 1] != f[:, 2]) & (f[:, 2] != f[:, 0])]
    used, at = np.unique(f, return_inverse=True)
    return v[used], at.reshape(f.shape)
