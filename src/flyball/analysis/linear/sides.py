"""Stability where forces have kinks: every side by its own stiffness.

Forces are continuous across kinks, so an equilibrium is stable if the potential rises on all sides, and unstable if it
falls along a direction on the side where that direction leads. Where forces have no potential, it is unstable if a
motion grows along a direction on its side. Sides that say neither leave it open.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from ...results.equilibrium import MARGINAL, STABLE, UNSTABLE
from .free import Free
from .kinks import Kink, refused
from .rest import Rest
from .stiffness import Stiffness, stiffness

NEUTRAL = 1e-5  # stiffness below this part of what acts is none, the way across considered
MANY = 6  # kinks of which all sides are looked at
ACROSS = 2e-6  # way to a side of a kink, in radians or parts of the mechanism's length
GROWS = 1e-4  # growth below this part of the fastest is none
INSIDE = 1e-6  # a direction lies on a side, but for this part


def from_all_sides(x: Rest, f: Free, found: Sequence[Kink]) -> tuple[str, Stiffness]:
    """What all sides of kinks say together, and the stiffness of that with the least.

    Raises
    ------
    SingularityError
        If a force jumps, or the sides leave stability open.
    """
    if any(k.jump for k in found):
        raise refused(found, x.t, "whether it is stable there is open")
    normals = _apart([k.along[0] * x.scale for k in found])
    if len(normals) > MANY:
        raise refused(found, x.t, f"of more than {MANY} at once it is open whether it is stable there")
    kinds, least = [], None
    for signs in itertools.product((1.0, -1.0), repeat=len(normals)):
        own = np.array(signs)[:, None] * normals
        step = _into(own @ (f.Zv / x.scale[:, None] * f.scale[f.chosen_v]))
        if step is None:
            continue
        way = f.Zv @ (f.scale[f.chosen_v] * step) / x.scale
        there = x.moved(ACROSS * way / np.abs(own @ way).min(), 0.0 * x.lam)
        s = stiffness(there, f)
        kinds.append(_on_side(s, own, there, f))
        if least is None or s.parts.min(initial=np.inf) < least.parts.min(initial=np.inf):
            least = s
    assert least is not None
    kind = next((k for k in (UNSTABLE, "", MARGINAL) if k in kinds), STABLE)
    if not kind:
        raise refused(found, x.t, "whether it is stable there is open")
    return kind, least


def _on_side(s: Stiffness, normals: np.ndarray, x: Rest, f: Free) -> str:
    """What one side of kinks says of stability; nothing if it leaves it open.

    On a cone a quadratic form is least along a direction in which it is stationary within one of the cone's faces
    (Kaplan 2000), so every face is asked for its own. Without a potential only a motion that stays on the side tells.
    """
    if not s.potential:
        return UNSTABLE if _runs_away(x, f, normals) else ""
    said = STABLE
    for k in range(len(normals) + 1):
        for on in itertools.combinations(range(len(normals)), k):
            along, parts = s.across(normals[list(on)])
            inside = _inside(along, np.delete(normals, on, axis=0))
            if (inside & (parts < -NEUTRAL)).any():
                return UNSTABLE
            if (inside & (parts <= NEUTRAL)).any():
                said = MARGINAL
    return said


def _inside(along: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Which directions (nv, n), or their opposites, lead to the inside of normals, or along their border."""
    inward = normals @ along / np.linalg.norm(normals, axis=1)[:, None]
    return (inward >= -INSIDE).all(axis=0) | (inward <= INSIDE).all(axis=0)


def _runs_away(x: Rest, f: Free, normals: np.ndarray) -> bool:
    """Whether a straight motion grows that stays on a side: d e^(s t), of real s > 0 and d on the side."""
    from scipy.linalg import eig

    e = x.equations
    r = e.at["r"]
    M, D, K = (f.Zv.T @ X[r] @ f.Zv for X in (e.by_acceleration, e.by_velocity, e.by_position))
    one, none = np.eye(len(M)), np.zeros_like(M)
    w, V = eig(np.block([[none, one], [-K, -D]]), np.block([[one, none], [none, M]]))
    grows = np.isfinite(w) & (w.real > GROWS * np.abs(w[np.isfinite(w)]).max(initial=0.0)) & (w.imag == 0.0)
    d = f.Zv @ V[: len(M), grows].real / x.scale[:, None]
    return bool(_inside(d / np.linalg.norm(d, axis=0), normals).any())


def _apart(normals: Sequence[np.ndarray]) -> np.ndarray:
    """Normals of which none is along another."""
    out: list[np.ndarray] = []
    for n in normals:
        n = n / np.linalg.norm(n)
        if not any(abs(abs(n @ m) - 1.0) < INSIDE for m in out):
            out.append(n)
    return np.array(out)


def _into(A: np.ndarray) -> np.ndarray | None:
    """A step that leads to the inside of A step >= 0, of entries up to one; None if there is none."""
    from scipy.optimize import linprog

    m, n = A.shape
    size = np.abs(A).max(axis=1, keepdims=True)
    found = linprog(
        np.r_[np.zeros(n), -1.0], np.hstack([-A / size, np.ones((m, 1))]), np.zeros(m), bounds=[(-1, 1)] * n + [(0, 1)]
    )
    return found.x[:n] if found.success and found.x[-1] > INSIDE else None
