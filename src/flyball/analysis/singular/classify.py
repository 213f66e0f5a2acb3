"""What a singular position is: its null vectors, branches, and all finite motions that the driver can make there."""

from __future__ import annotations

import numpy as np

from ...errors import NotConverged
from ...results.kinds import BIFURCATION, LOCK_UP, PASSAGE, SELF_MOTION
from ...results.singularities import (
    Branch,
    Motion,
    Singularity,
)
from .branches import DRIVES, Curve, crossing
from .closure import Place
from .freed import Freed
from .locate import limit
from .trace import Tracer

STAYS = 1e-8  # the driver's coordinate does not change by more than this along a self-motion
WALK = 6  # steps along it that make sure of that


def point(f: Freed, tracer: Tracer, x: Place, s: float, near: np.ndarray) -> Singularity:
    """Tell what the singular position x is."""
    c = f.closure
    r = c.rank(x)
    cross = crossing(c, x, limit(r))
    orders = [_order(tracer, x, curve) for curve in cross.curves]
    motions = [
        m
        for k, (curve, order) in enumerate(zip(cross.curves, orders, strict=True))
        for m in _motions(f, x, k, curve, order)
    ]
    passing = sum(order == 1 and not k.half for k, order in zip(cross.curves, orders, strict=True))
    resting = 0 in orders
    passing = 2 if DRIVES[0] in cross.endless else passing
    kind = BIFURCATION if passing > 1 else PASSAGE if passing else SELF_MOTION if resting else LOCK_UP
    U, held, V = np.linalg.svd(c.jacobian(x)[:, :-1], full_matrices=True)
    rank = int((held > limit(r)).sum())
    generic = c.columns - 1
    return Singularity(
        a=float(x.a),
        kind=kind,
        isolated=not cross.curves and not cross.endless,
        self_motion=resting,
        lost=generic - rank,
        branch_point=r.below(limit(r)) > 1,
        coordinates=dict(zip(f.labels, f.values(x, near).tolist(), strict=False)),
        null_vectors=[_named(f, x, np.r_[v, 0.0]) for v in V[rank:]],
        left_null_vectors=[_rows(f, u) for u in U[:, rank:].T],
        branches=[_branch(f, x, curve, order) for curve, order in zip(cross.curves, orders, strict=True)],
        motions=motions,
        decided=cross.decided,
        endless=cross.endless,
        at=s,
        outline=f.outline(x),
    )


def _order(tracer: Tracer, x: Place, curve: Curve) -> int:
    """Order of the driver's first derivative along a branch; 0 only if it stays where it is over some steps."""
    if curve.order or curve.half:
        return curve.order
    try:
        node = tracer.off(x, curve.x[0], curve.x[1])
        for _ in range(WALK):
            node = tracer.ahead(node, tracer.step) or node
    except NotConverged:
        return 0
    return 0 if abs(node.x.a - x.a) < STAYS * tracer.c.unit else len(curve.x) + 1


def _motions(f: Freed, x: Place, k: int, curve: Curve, order: int) -> list[Motion]:
    """Finite motions along one branch: from a(t) = a1 s + a2 s^2/2 + a3 s^3/6 with s(t) to second order."""
    unit = f.closure.unit
    a = curve.driver * unit
    n, bend = curve.x[0], curve.x[1] if len(curve.x) > 1 else 0.0 * curve.x[0]

    def motion(rate: float, acceleration: float, s1: float, s2: float) -> Motion:
        d, e = n * s1, bend * s1 * s1 + n * s2
        v, w = f.rates(x, d), f.rates(x, d, e)
        return Motion(k, rate, acceleration, _dict(f, v), _dict(f, w))

    if curve.half:  # from rest along one half and back along the other
        return [motion(0.0, float(np.sign(a[0])), 0.0, 1.0 / abs(a[0]))] * 2 if order == 1 else []
    if order == 1:
        out = [motion(1.0, 0.0, 1.0 / a[0], -a[1] / a[0] ** 3 if len(a) > 1 else 0.0)]
        return out + [motion(0.0, sign, 0.0, sign / a[0]) for sign in (1.0, -1.0)]
    if order == 2:
        s1 = 1.0 / np.sqrt(abs(a[1]))
        s2 = -a[2] * s1 * s1 / (3.0 * a[1]) if len(a) > 2 else 0.0
        return [motion(0.0, float(np.sign(a[1])), sign * s1, s2) for sign in (1.0, -1.0)]
    return []


def _dict(f: Freed, rates: np.ndarray) -> dict[str, float]:
    return dict(zip(f.labels, rates.tolist(), strict=True))


def _branch(f: Freed, x: Place, curve: Curve, order: int) -> Branch:
    a = curve.driver * f.closure.unit
    one_sided = order and (order % 2 == 0 or curve.half) and order <= len(a)
    side = int(np.sign(a[order - 1])) if one_sided else 0
    what = "self-motion" if order == 0 else "passes" if order == 1 else "turns back" if side else "passes, unbounded"
    rates = f.rates(x, curve.x[0])
    tangent = _dict(f, rates / a[0] if order == 1 else rates / np.abs(rates).max())
    return Branch("cusp" if curve.half else what, order, side, tangent, (x, curve))


def _named(f: Freed, x: Place, d: np.ndarray) -> dict[str, float]:
    """A motion by names, the largest rate 1."""
    rates = f.rates(x, d)
    lead = rates[np.argmax(np.round(np.abs(rates) / np.abs(rates).max(), 9))]
    return _dict(f, rates / lead)


def _rows(f: Freed, u: np.ndarray) -> dict[str, float]:
    """A combination of rows by names, the largest factor 1; rows in metres and in radians as they are."""
    s = f.closure.c.structure
    real = u * f.closure.row_scale[f.closure.used]
    real = real / real[np.argmax(np.round(np.abs(real) / np.abs(real).max(), 9))]
    count: dict[str, int] = {}
    out = {}
    for k, factor in zip(f.closure.used[:-1], real, strict=False):
        name = s.rows[k].element.name
        count[name] = count.get(name, 0) + 1
        out[f"{name}.{count[name]}"] = float(factor)
    return out | {f"{f.driver.name}.1": float(real[-1])}
