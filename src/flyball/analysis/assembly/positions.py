"""Closed positions from rough guesses: damped Gauss-Newton with steps of least weighted size."""

from __future__ import annotations

import numpy as np

from ...numerics.rank import svd
from ..compiled import Compiled
from .described import rotation

CLOSED = 1e-10  # part of the mechanism's length, or radians, by which closed rows may be off
OPEN = 1e-6  # the same, above which a position found on residuals that lead from far away is none
RESTARTS = 12
ITERATIONS = 200
LONGEST = 0.7  # radians, or parts of the mechanism's length, by which a step turns or shifts a body at most
WALK = 50  # steps of the usual length before longer ones
DENSE = 300  # rows up to which a step of assembly goes through a singular value decomposition
NO_PIVOT = 1e-14  # added for redundant rows of large mechanisms; iterations take it out again
DIGITS = 16 * np.finfo(float).eps  # part of a coordinate that a few operations leave uncertain
NO_PART = 1e-10  # singular values below this part of the largest are taken for rounding


def misfit(c: Compiled, t: float, q: np.ndarray, v: np.ndarray, near: float | None = None) -> float:
    """The largest row at a position: radians, or parts of the mechanism's length and of what rounding leaves there.

    ``near``: what rounding leaves [m], if that is told.
    """
    c.at(t, q, v)
    g = np.abs(c.work.rows.value)
    if not np.isfinite(g).all():
        return np.inf
    return float(
        (g / np.where(c.metric, c.values.length + (rounding(c) if near is None else near) / CLOSED, 1.0)).max(
            initial=0.0
        )
    )


def rounding(c: Compiled) -> float:
    """What is left of a closed row [m] by rounding of the places last evaluated: far from the origin it is much."""
    return DIGITS * float(np.abs(c.work.FK[:, :3]).max(initial=0.0))


def movable(c: Compiled) -> np.ndarray:
    """1 for velocities of bodies that may move, 0 for those of bodies that stay as drawn."""
    s = c.structure
    out = np.ones(s.nv)
    for name, b in s.place.items():
        if b >= 0 and s.model[name].as_drawn:
            v0, n = s.tables["tree"].v[b], s.tables["tree"].nv[b]
            out[v0 : v0 + n] = 0.0
    return out


def inverse_weights(c: Compiled) -> np.ndarray:
    """Inverse weights of the steps of assembly: metres against radians; bodies that must not move have none."""
    return np.where(_shifts(c), 1.0, 1.0 / c.values.length**2) * movable(c)


def _shifts(c: Compiled) -> np.ndarray:
    """Which velocities are those of points, not turning."""
    tree = c.structure.tables["tree"]
    out = np.ones(c.structure.nv, bool)
    shifts = 2 if c.structure.model.planar else 3
    for v0, n in zip(tree.v, tree.nv, strict=True):
        out[v0 + min(n, shifts) : v0 + n] = False
    return out


def _longest(c: Compiled, d: np.ndarray) -> tuple[float, float]:
    """How far a step shifts a body at most, and how far it turns one.

    A step is as long as its vectors are, which is the same in whatever axes the world is described.
    """
    tree, shifts = c.structure.tables["tree"], _shifts(c)
    body = np.repeat(np.arange(len(tree.nv)), tree.nv)
    place = np.concatenate([np.arange(v0, v0 + n) for v0, n in zip(tree.v, tree.nv, strict=True)])
    both = (np.bincount(body, (d**2 * kind)[place]) for kind in (shifts, ~shifts))
    shifted, turned = (float(np.sqrt(x.max(initial=0.0))) for x in both)
    return shifted, turned


def row_scales(c: Compiled) -> np.ndarray:
    """Factors (nr,) that make rows dimensionless: lengths are counted in the mechanism's length, turns in radians.

    Without them a sum of squares over rows, and what singular values are small, would depend on the unit of length.
    """
    return np.where(c.metric, 1.0 / c.values.length, 1.0)


def _step(c: Compiled, r: np.ndarray, scale: np.ndarray, root: np.ndarray, damping: float) -> np.ndarray:
    """Least step with diag(scale) G d = r, in the metric of the inverse weights root^2, damped.

    Near a singular position a combination of rows may speak of a motion by a part of 1e-8 only: where the size allows
    it the singular values of G diag(root) are used, not their squares, which would drown in rounding.
    """
    if len(r) <= DENSE:
        G = c.jacobian()
        used = np.flatnonzero(G.any(axis=0))
        U, s, Vt = svd(scale[:, None] * G[:, used] * root[used])
        largest = s.max(initial=0.0) or 1.0
        keep = s > NO_PART * largest
        x = np.zeros(len(root))
        x[used] = Vt[keep].T @ (s[keep] / (s[keep] ** 2 + damping * largest**2) * (U[:, keep].T @ r))
        return root * x
    import scipy.sparse as sp
    from scipy.sparse.linalg import splu

    # [1 B^T; B -delta] with B of unit size: B B^T would square the spread of singular values here too
    B = sp.diags(scale) @ c.sparse_jacobian() @ sp.diags(root)
    m, n = B.shape
    size = np.sqrt(B.multiply(B).sum(axis=1).max()) or 1.0
    B = B / size
    K = sp.bmat([[sp.identity(n), B.T], [B, -(damping + NO_PIVOT) * sp.identity(m)]], format="csc")
    return root * splu(K).solve(np.r_[np.zeros(n), r / size])[:n]


def _moved_by(c: Compiled, q: np.ndarray, d: np.ndarray) -> np.ndarray:
    from ...equations.tree import retract

    new = q.copy()
    retract(c.values.system, new, d)
    return new


def newton(c: Compiled, t: float, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, int]:
    """Damped Gauss-Newton until closed or no better. Returns (q, iterations)."""
    root, scale = np.sqrt(inverse_weights(c)), row_scales(c)
    size = misfit(c, t, q, v)
    g = scale * c.work.rows.value
    damping, wider, capped = 0.0, 1.0, 0
    norm = float(g @ g)
    for k in range(ITERATIONS):
        if size < 1e-13:
            return q, k
        c.at(t, q, v)
        d = _step(c, -g, scale, root, damping)
        longest, farthest = _longest(c, d)
        over = max(longest / (wider * LONGEST * c.values.length), farthest / LONGEST)
        d = d / over if over > 1.0 else d
        new = _moved_by(c, q, d)
        new_size = misfit(c, t, new, v)
        trial = scale * c.work.rows.value
        new_norm = float(trial @ trial)
        if np.isfinite(new_size) and new_norm < norm:
            gain = 1.0 - new_norm / norm
            q, g, size, norm = new, trial, new_size, new_norm
            damping = 0.0 if damping < 1e-12 else damping / 10
            capped += over > 1.0
            if capped > WALK:  # it is a long way, straight on: as many steps as its length would take are not there
                wider *= 2.0
            if gain < 1e-9:
                return q, k
        else:
            damping, wider, capped = max(10 * damping, 1e-8), 1.0, min(capped, WALK)
            if damping > 1e4 or size < 1e-11:
                return q, k
    return q, ITERATIONS


def close(c: Compiled, t: float, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, int]:
    """Close from far: Newton from the guess, then from shaken guesses when it is caught short of closed."""
    w = inverse_weights(c)
    best, count = newton(c, t, q, v)
    least = misfit(c, t, best, v)
    random = np.random.default_rng(0)
    for k in range(RESTARTS):
        if least < 1e-9:
            break
        start = best if k % 2 == 0 else q
        shake = _along_bodies(c, start, random.normal(size=len(w))) * np.sqrt(w) * c.values.length * 0.05 * 1.5**k
        trial, more = newton(c, t, _moved_by(c, start, shake), v)
        count += more
        gap = misfit(c, t, trial, v)
        if gap < 1e-9:
            # closed from a shaken start: come back as near to the guess as the constraints allow
            return trial, count
        if gap < least:
            best, least = trial, gap
    return best, count


def _along_bodies(c: Compiled, q: np.ndarray, d: np.ndarray) -> np.ndarray:
    """The same, translations turned from each body's own axes to the world's: what they do depends on no world axes."""
    tree, out = c.structure.tables["tree"], d.copy()
    for name, b in c.structure.place.items():
        if b >= 0:
            at, n = int(tree.v[b]), min(int(tree.nv[b]), 2 if c.structure.model.planar else 3)
            out[at : at + n] = rotation(c.values, name, q)[:n, :n] @ d[at : at + n]
    return out


def closed_near(c: Compiled, t: float, q: np.ndarray) -> np.ndarray | None:
    """The closed position next to q, or None if none is found; of a mechanism with the rows of its positions."""
    q, _ = newton(c, t, q, np.zeros(c.structure.nv))
    return q if misfit(c, t, q, np.zeros(c.structure.nv)) <= CLOSED else None
