"""Classification of a singular position by its branches: lock-up, passage, bifurcation or self-motion.

The Taylor coefficients of a branch x(s) = n s + x2 s^2/2 + x3 s^3/6 + ... from the point satisfy

    J n = 0,   J x2 + F''[n, n] = 0,   J x3 + 3 F''[n, x2] + F'''[n, n, n] = 0,   ...

Each left null vector u of J turns these equations into conditions on lower coefficients: of second order on the tangent
(u^T F''[n, n] = 0, the algebraic bifurcation equations, H. B. Keller 1977), of third order on the part of x2 in the
kernel, and so on. Where the second order does not determine the branches, Newton's method finds positions on small
spheres around the point. Their limits are tangents of half-branches. Two half-branches make a branch if tangent and
curvature agree (branches that touch, or cross twice); a half-branch without a partner ends in a cusp.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..errors import NotConverged
from ..results.singularities import Branch, Motion, Singularity
from ..results.wording import BIFURCATION, LOCK_UP, PASSAGE, SELF_MOTION
from .continuation import ClosureEquations, CurvePoint, CurveTracer, JacobianRank, ReleasedMechanism, rank_limit

VANISHING_FORM = 1e-7  # forms below this part of the size of the derivatives vanish
SPHERE_STARTS = 400
SPHERE_ITERATIONS = 60
MAX_MULTIPLE_ZEROS = 12  # beyond so many multiple zeros they are treated as a continuum


class CommonZeros(NamedTuple):
    """Unit vectors on which all forms vanish, one of each pair of opposites."""

    single: list[np.ndarray]  # simple zeros: a branch leaves along each
    several: list[np.ndarray]  # multiple zeros (some of them): the next order decides
    endless: bool = False  # whether the multiple ones are a continuum

    @property
    def decided(self) -> bool:
        """Whether the forms determine all directions."""
        return not self.several and not self.endless


def common_zeros(forms: np.ndarray, size: float) -> CommonZeros:
    """Common zeros of quadratic forms (m, k, k), symmetric, from derivatives of a given size."""
    k = forms.shape[1]
    if k == 1:
        return CommonZeros([np.ones(1)], [])
    limit = VANISHING_FORM * max(size, 1e-300)
    if not len(forms) or np.abs(forms).max() < limit:
        return CommonZeros([], list(np.eye(k)))
    return _binary_zeros(forms, limit) if k == 2 else _zeros_on_sphere(forms, limit)


def _binary_zeros(forms: np.ndarray, limit: float) -> CommonZeros:
    M = np.column_stack([forms[:, 0, 0], 2.0 * forms[:, 0, 1], forms[:, 1, 1]])  # times (x x, x y, y y)
    _, s, Vt = np.linalg.svd(M)
    independent = int((s > limit).sum())
    if independent == 3:
        return CommonZeros([], [])
    if independent == 2:
        xx, xy, yy = Vt[2] * (1.0 if Vt[2, 0] + Vt[2, 2] > 0.0 else -1.0)
        if abs(xx * yy - xy * xy) > 1e-6 or xx < -1e-6 or yy < -1e-6:
            return CommonZeros([], [])
        n = np.array([xx, xy]) if xx > yy else np.array([xy, yy])
        return CommonZeros([n / np.linalg.norm(n)], [])
    A, B, C = Vt[0]
    w, E = np.linalg.eigh(np.array([[A, 0.5 * B], [0.5 * B, C]]))
    if min(abs(w)) < 1e-6 * max(abs(w)):
        return CommonZeros([], [E[:, np.argmin(abs(w))]])
    if w[0] * w[1] > 0.0:
        return CommonZeros([], [])
    c, s = np.sqrt(w[1]), np.sqrt(-w[0])
    return CommonZeros([(c * E[:, 0] + sign * s * E[:, 1]) / np.hypot(c, s) for sign in (1.0, -1.0)], [])


def _zeros_on_sphere(forms: np.ndarray, limit: float) -> CommonZeros:
    """Common zeros by Newton's method on the sphere from many starts; multiple zeros and curves are undecided."""
    k = forms.shape[1]
    random = np.random.default_rng(0)
    single: list[np.ndarray] = []
    several: list[np.ndarray] = []
    for n in random.normal(size=(SPHERE_STARTS, k)):
        n = _newton_on_sphere(forms, n / np.linalg.norm(n))
        if np.abs((forms @ n) @ n).max() > 1e-3 * limit:
            continue
        slopes = np.linalg.svd(np.vstack([2.0 * forms @ n, n]), compute_uv=False)
        regular = len(slopes) == k and slopes[-1] > 1e-3
        found, apart = (single, 1e-6) if regular else (several, 0.02)
        if not any(min(np.linalg.norm(n - x), np.linalg.norm(n + x)) < apart for x in found):
            found.append(n)
        if len(several) > MAX_MULTIPLE_ZEROS:
            break
    return CommonZeros(single, several[:MAX_MULTIPLE_ZEROS], len(several) > MAX_MULTIPLE_ZEROS)


def _newton_on_sphere(forms: np.ndarray, n: np.ndarray) -> np.ndarray:
    for _ in range(SPHERE_ITERATIONS):
        J = np.vstack([2.0 * forms @ n, n])
        d = -np.linalg.lstsq(J, np.r_[(forms @ n) @ n, 0.0], rcond=1e-10)[0]
        n = n + d * min(1.0, 0.3 / max(float(np.linalg.norm(d)), 1e-300))
        n = n / np.linalg.norm(n)
        if np.linalg.norm(d) < 1e-15:
            break
    return n


RADIUS = 0.1
RADIUS_FRACTIONS = (1.0, 0.75, 0.5, 0.25)
CIRCLE_STARTS = 160  # starts on a circle; twice as many in more dimensions
RADIUS_ITERATIONS = 14
SAME_DIRECTION = 2e-3  # steps nearer than this are equal, relative to the largest radius [1]
ALIGNED, CUSP = 0.02, 0.5  # largest difference of the tangents of two halves of a branch, and of a cusp [1]
MAX_HALVES = 24  # beyond so many half-branches they count as infinitely many
STATIONARY_DRIVER = 1e-4  # derivatives of the driver below this count as zero here

# tangent, half the curvature, steps (len(RADIUS_FRACTIONS), columns)
HalfBranch = tuple[np.ndarray, np.ndarray, np.ndarray]

TouchingBranch = tuple[tuple[np.ndarray, ...], tuple[np.ndarray, ...]]


def touching_branches(c: ClosureEquations, x: CurvePoint, N: np.ndarray) -> list[TouchingBranch] | None:
    """Branches through x with the kernel N: (Taylor coefficients, for a cusp also the steps onto its halves) each.

    None if there are infinitely many directions.
    """
    around = _positions_around(c, x, N)
    if len(around) > MAX_HALVES:
        return None
    left = [h for h in (_half_branch(c, x, N, d) for d in around) if h is not None]
    out: list[TouchingBranch] = []
    while left:
        n, m, d = left.pop(0)
        across = [
            (float(np.linalg.norm(m - h[1])), k) for k, h in enumerate(left) if np.linalg.norm(n + h[0]) < ALIGNED
        ]
        beside = [(float(np.linalg.norm(n - h[0])), k) for k, h in enumerate(left) if np.linalg.norm(n - h[0]) < CUSP]
        if across:
            out.append((_branch_coefficients(n, d, left.pop(min(across)[1])[2]), ()))
        elif beside:
            other = left.pop(min(beside)[1])[2]
            out.append((_cusp_coefficients(d, other), (d[0], other[0])))
        else:
            out.append(((_without_rounding(n), _without_rounding(2.0 * m)), (d[0],)))
    return out


def _cusp_coefficients(one: np.ndarray, other: np.ndarray) -> tuple[np.ndarray, ...]:
    """Tangent and curvature of the mean of a cusp's halves, whose distance has odd powers of the square root of s."""
    h = RADIUS * np.array(RADIUS_FRACTIONS)
    fit = np.linalg.solve(np.vander(h, increasing=True), 0.5 * (one + other) / h[:, None])
    return _without_rounding(fit[0] / np.linalg.norm(fit[0])), _without_rounding(2.0 * fit[1])


def _positions_around(c: ClosureEquations, x: CurvePoint, N: np.ndarray) -> list[np.ndarray]:
    """Steps from x to all closed positions at the largest radius."""
    k = N.shape[1]
    if k == 2:
        turns = 2.0 * np.pi * (np.arange(CIRCLE_STARTS) + 0.37) / CIRCLE_STARTS
        starts = np.column_stack([np.cos(turns), np.sin(turns)])
    else:
        starts = np.random.default_rng(0).normal(size=(2 * CIRCLE_STARTS, k))
        starts /= np.linalg.norm(starts, axis=1)[:, None]
    found: list[np.ndarray] = []
    for y in starts:
        d = _at_radius(c, x, N, RADIUS * N @ y, RADIUS)
        if d is not None and not any(np.linalg.norm(d - e) < SAME_DIRECTION * RADIUS for e in found):
            found.append(d)
        if len(found) > MAX_HALVES:
            break
    return found


def _at_radius(c: ClosureEquations, x: CurvePoint, N: np.ndarray, d: np.ndarray, h: float) -> np.ndarray | None:
    """Step to the closed position near x + d whose component in the kernel has the length h; None if not found."""
    for _ in range(RADIUS_ITERATIONS):
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


def _half_branch(c: ClosureEquations, x: CurvePoint, N: np.ndarray, d: np.ndarray) -> HalfBranch | None:
    """Follow a position to smaller radii; returns its tangent and curvature at x, and the steps."""
    steps = [d]
    for before, share in itertools.pairwise(RADIUS_FRACTIONS):
        guess = steps[-1] * share / before
        if len(steps) > 1:  # extrapolated linearly from two directions
            a, b = steps[-2] / (RADIUS * RADIUS_FRACTIONS[len(steps) - 2]), steps[-1] / (RADIUS * before)
            guess = (b + (b - a) * (before - share) / (RADIUS_FRACTIONS[len(steps) - 2] - before)) * RADIUS * share
        found = _at_radius(c, x, N, guess, RADIUS * share)
        if found is None:
            return None
        steps.append(found)
    h = RADIUS * np.array(RADIUS_FRACTIONS)
    slopes = np.array(steps) / h[:, None]
    fit = np.linalg.solve(np.vander(h, increasing=True), slopes)
    n = fit[0] / np.linalg.norm(fit[0])
    return n, fit[1], np.array(steps)


def _branch_coefficients(n: np.ndarray, one: np.ndarray, other: np.ndarray) -> tuple[np.ndarray, ...]:
    """Derivatives of the branch through positions on both sides, by the step along its tangent."""
    n = (
        n
        if n[-1] > STATIONARY_DRIVER or (abs(n[-1]) <= STATIONARY_DRIVER and n[np.argmax(np.round(np.abs(n), 6))] > 0.0)
        else -n
    )
    d = np.vstack([one, other])
    s = d @ n
    fit = np.linalg.solve(np.vander(s, len(s) + 1, increasing=True)[:, 1:], d)
    return tuple(_without_rounding(fit[k] * math.factorial(k + 1)) for k in range(3))


def _without_rounding(d: np.ndarray) -> np.ndarray:
    """Set the driver's component to 0 if it is rounding."""
    d = d.copy()
    d[-1] = d[-1] if abs(d[-1]) > STATIONARY_DRIVER else 0.0
    return d


ZERO_COEFFICIENT = 1e-7  # Taylor coefficients of the driver below this (for unit steps) count as zero
DRIVES = ("a'", "a'' > 0", "a'' < 0")
MAX_ORDER = 6  # highest order of the driver's coefficients


@dataclass(frozen=True)
class BranchCurve:
    """One branch: derivatives x1 = n, x2, ... by a unit step (not divided by factorials)."""

    x: tuple[np.ndarray, ...]
    ends: tuple[np.ndarray, ...] = ()  # for a cusp, which leaves in one direction only: a step onto each half

    @property
    def driver(self) -> np.ndarray:
        """Derivatives of the driver's coordinate along the branch."""
        return np.array([c[-1] for c in self.x])

    @property
    def half(self) -> bool:
        """Whether the branch leaves in one direction only (a cusp)."""
        return bool(self.ends)

    @property
    def order(self) -> int:
        """Order of the driver's first derivative that is not zero; 0 if there is none."""
        turning = np.abs(self.driver) / [math.factorial(k) for k in range(1, len(self.x) + 1)] > ZERO_COEFFICIENT
        return int(np.argmax(turning)) + 1 if turning.any() else 0


@dataclass(frozen=True)
class BranchCrossing:
    """All branches through a point."""

    kernel: np.ndarray  # (columns, k) of J
    left_null_vectors: np.ndarray  # (rows, l)
    curves: list[BranchCurve]
    decided: bool  # whether the second order determined all branches
    endless: tuple[str, ...]  # driver motions (see `DRIVES`) that infinitely many directions allow


def branches_through(c: ClosureEquations, x: CurvePoint, limit: float) -> BranchCrossing:
    """Find the branches through x; singular values of J below ``limit`` count as zero."""
    r = c.rank(x)
    kept = int((r.values > limit).sum())
    N, U = r.V[:, kept:], r.U[:, kept:]
    forms = quadratic_forms(c, x, N, U)
    size = max(1.0, float(np.abs(c.second(x, N.sum(axis=1))).max()))
    found = common_zeros(forms, size)
    curves = [taylor_branch(c, x, r, kept, N @ t) for t in found.single]
    endless = found.endless
    open_ones = [N @ n for n in found.several]
    if found.several and not endless:
        known = [k.x[0] for k in curves]
        nearby = touching_branches(c, x, N)
        endless = nearby is None
        for coefficients, ends in nearby or []:
            if ends or all(abs(coefficients[0] @ n) < 1.0 - 1e-5 for n in known):
                curves.append(BranchCurve(coefficients, ends))
    drives = _possible_drives(c, x, r, kept, open_ones) if endless else ()
    return BranchCrossing(N, U, sorted(curves, key=_sort_key), found.decided, drives)


def _possible_drives(
    c: ClosureEquations, x: CurvePoint, r: JacobianRank, retained: int, directions: list[np.ndarray]
) -> tuple[str, ...]:
    """Driver motions that a continuum of directions allows: all if a' is not zero on it, else by the sign of a''."""
    if np.abs(r.V[-1, retained:]).max() > ZERO_COEFFICIENT:
        return DRIVES
    bends = [-(r.V[-1, :retained] / r.values[:retained]) @ (r.U[:, :retained].T @ c.second(x, n)) for n in directions]
    return tuple(
        d for d, sign in zip(DRIVES[1:], (1.0, -1.0), strict=True) if any(sign * b > ZERO_COEFFICIENT for b in bends)
    )


def _sort_key(curve: BranchCurve) -> tuple:
    """Sort key: branches along which the driver moves, then those where it turns back, then self-motions."""
    return (curve.order or 99, -round(abs(float(curve.driver[0])), 6), *np.round(-curve.x[0], 6).tolist())


def quadratic_forms(c: ClosureEquations, x: CurvePoint, N: np.ndarray, U: np.ndarray) -> np.ndarray:
    """The forms u^T F''[N ., N .], (l, k, k)."""
    k = N.shape[1]
    B = np.zeros((len(U), k, k))
    for i in range(k):
        for j in range(i + 1):
            B[:, i, j] = B[:, j, i] = c.second(x, N[:, i]) if i == j else c.mixed(x, N[:, i], N[:, j])
    return np.einsum("ru,rij->uij", U, B)


def taylor_branch(
    c: ClosureEquations, x: CurvePoint, r: JacobianRank, retained: int, n: np.ndarray, order: int = 3
) -> BranchCurve:
    """Taylor coefficients of the branch with tangent n, up to the first order at which the driver moves."""
    n = _oriented(n)
    N, U = r.V[:, retained:], r.U[:, retained:]
    aside = N - np.outer(n, n @ N)
    aside = np.linalg.svd(aside)[0][:, : N.shape[1] - 1]
    tilt = np.array([U.T @ c.mixed(x, n, e) for e in aside.T]).T if aside.shape[1] else None

    def solved(R: np.ndarray) -> np.ndarray:
        return -r.V[:, :retained] @ ((r.U[:, :retained].T @ R) / r.values[:retained])

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
        curve = BranchCurve(tuple(known[:-1] if tilt is not None else known))
        if len(curve.x) >= order and (curve.order or len(curve.x) >= MAX_ORDER):
            return curve


def _oriented(n: np.ndarray) -> np.ndarray:
    """Unit vector in this direction, with the sign that makes the driver, or else its largest component, positive."""
    n = n / np.linalg.norm(n)
    lead = n[-1] if abs(n[-1]) > ZERO_COEFFICIENT else n[np.argmax(np.round(np.abs(n), 9))]
    n = n if lead > 0.0 else -n
    n[np.abs(n) < 1e-15] = 0.0
    return n


SELF_MOTION_TOLERANCE = 1e-8  # largest change of the driver's coordinate along a self-motion
SELF_MOTION_STEPS = 6  # steps along the branch that verify this


def classify(f: ReleasedMechanism, tracer: CurveTracer, x: CurvePoint, s: float, near: np.ndarray) -> Singularity:
    """Classify the singular position x."""
    c = f.closure
    r = c.rank(x)
    cross = branches_through(c, x, rank_limit(r))
    orders = [_driver_order(tracer, x, curve) for curve in cross.curves]
    motions = [
        m
        for k, (curve, order) in enumerate(zip(cross.curves, orders, strict=True))
        for m in _finite_motions(f, x, k, curve, order)
    ]
    passing = sum(order == 1 and not k.half for k, order in zip(cross.curves, orders, strict=True))
    resting = 0 in orders
    passing = 2 if DRIVES[0] in cross.endless else passing
    kind = BIFURCATION if passing > 1 else PASSAGE if passing else SELF_MOTION if resting else LOCK_UP
    U, held, V = np.linalg.svd(c.jacobian(x)[:, :-1], full_matrices=True)
    rank = int((held > rank_limit(r)).sum())
    generic = c.columns - 1
    return Singularity(
        a=float(x.a),
        kind=kind,
        isolated=not cross.curves and not cross.endless,
        self_motion=resting,
        lost=generic - rank,
        branch_point=r.below(rank_limit(r)) > 1,
        coordinates=dict(zip(f.labels, f.values(x, near).tolist(), strict=False)),
        null_vectors=[_named_motion(f, x, np.r_[v, 0.0]) for v in V[rank:]],
        left_null_vectors=[_named_rows(f, u) for u in U[:, rank:].T],
        branches=[_branch_result(f, x, curve, order) for curve, order in zip(cross.curves, orders, strict=True)],
        motions=motions,
        decided=cross.decided,
        endless=cross.endless,
        at=s,
        outline=f.outline(x),
    )


def _driver_order(tracer: CurveTracer, x: CurvePoint, curve: BranchCurve) -> int:
    """Order of the driver's first nonzero derivative along a branch; 0 if the driver rests over several steps."""
    if curve.order or curve.half:
        return curve.order
    try:
        node = tracer.off(x, curve.x[0], curve.x[1])
        for _ in range(SELF_MOTION_STEPS):
            node = tracer.step_from(node, tracer.step) or node
    except NotConverged:
        return 0
    return 0 if abs(node.x.a - x.a) < SELF_MOTION_TOLERANCE * tracer.c.unit else len(curve.x) + 1


def _finite_motions(f: ReleasedMechanism, x: CurvePoint, k: int, curve: BranchCurve, order: int) -> list[Motion]:
    """Finite motions along one branch, from a(t) = a1 s + a2 s^2/2 + a3 s^3/6 with s(t) to second order."""
    unit = f.closure.unit
    a = curve.driver * unit
    n, bend = curve.x[0], curve.x[1] if len(curve.x) > 1 else 0.0 * curve.x[0]

    def motion(rate: float, acceleration: float, s1: float, s2: float) -> Motion:
        d, e = n * s1, bend * s1 * s1 + n * s2
        v, w = f.rates(x, d), f.rates(x, d, e)
        return Motion(k, rate, acceleration, _by_label(f, v), _by_label(f, w))

    if curve.half:  # starts from rest along one half, or along the other
        return [motion(0.0, float(np.sign(a[0])), 0.0, 1.0 / abs(a[0]))] * 2 if order == 1 else []
    if order == 1:
        out = [motion(1.0, 0.0, 1.0 / a[0], -a[1] / a[0] ** 3 if len(a) > 1 else 0.0)]
        return out + [motion(0.0, sign, 0.0, sign / a[0]) for sign in (1.0, -1.0)]
    if order == 2:
        s1 = 1.0 / np.sqrt(abs(a[1]))
        s2 = -a[2] * s1 * s1 / (3.0 * a[1]) if len(a) > 2 else 0.0
        return [motion(0.0, float(np.sign(a[1])), sign * s1, s2) for sign in (1.0, -1.0)]
    return []


def _by_label(f: ReleasedMechanism, rates: np.ndarray) -> dict[str, float]:
    return dict(zip(f.labels, rates.tolist(), strict=True))


def _branch_result(f: ReleasedMechanism, x: CurvePoint, curve: BranchCurve, order: int) -> Branch:
    a = curve.driver * f.closure.unit
    one_sided = order and (order % 2 == 0 or curve.half) and order <= len(a)
    side = int(np.sign(a[order - 1])) if one_sided else 0
    what = "self-motion" if order == 0 else "passes" if order == 1 else "turns back" if side else "passes, unbounded"
    rates = f.rates(x, curve.x[0])
    tangent = _by_label(f, rates / a[0] if order == 1 else rates / np.abs(rates).max())
    return Branch("cusp" if curve.half else what, order, side, tangent, (x, curve))


def _named_motion(f: ReleasedMechanism, x: CurvePoint, d: np.ndarray) -> dict[str, float]:
    """Rates by coordinate name, scaled to a largest rate of 1."""
    rates = f.rates(x, d)
    lead = rates[np.argmax(np.round(np.abs(rates) / np.abs(rates).max(), 9))]
    return _by_label(f, rates / lead)


def _named_rows(f: ReleasedMechanism, u: np.ndarray) -> dict[str, float]:
    """Factors of the constraint rows by name, scaled to a largest factor of 1; rows in metres or radians."""
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
