"""Continuation of a driven mechanism's curve by pseudo-arc length, and location of the singular points on it.

The curve solves the closure equations of the mechanism with a released driver: F(x) = (g(q), c(q) - a) = 0 with
x = (q, a). The law of the driver is replaced by the parameter a, the value of its coordinate c. Steps
d = (velocities, a) are dimensionless: lengths are divided by the mechanism's length, angles are in radians; rows are
scaled likewise. F is a function of the step d from a point, F(x + d), on a flat space. The compiled system gives its
first two derivatives at d = 0: J = [G | -e], and F''[d, d] = -gamma at the velocity d, since a constant velocity is a
straight step to second order. Higher derivatives come from samples of F along a polynomial of d, fitted to rounding.
Rows for all coordinates of joints and bodies are appended to the constraints. Their values, gradients and accelerations
then come from the same formulas as the motion, and every vector can be listed by coordinate names.

Prediction uses tangent and curvature; correction uses Newton's method perpendicular to the tangent. No step turns the
tangent by more than a few degrees. Two quantities vanish at singular points: the driver's component of the tangent and
the smallest singular value of J. Between two nodes, cubics through their values and exact slopes show whether a
singular point may lie there, also if no sign changes.

Where the driver turns back (its component of the tangent vanishes, J keeps its rank) the point is the root of that
component. Where J loses rank, the derivatives of the bifurcation function phi(y) = U^T F(x + N y + ...) vanish
(Lyapunov-Schmidt reduction). Newton's method on these converges also where no determinant changes its sign.

Source: H. B. Keller (1977); E. L. Allgower, K. Georg, Numerical Continuation Methods (1990), chapters 2, 6 and 8.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from ..assembly.assemble import assemble
from ..assembly.assembled_state import Assembly
from ..assembly.compiled_mechanism import CompiledMechanism, compile_mechanism, tangent_step
from ..engine.kinematics import retract
from ..errors import ModelError, NotConverged
from ..model.body import Driver, Initial
from ..model.element import LawOf
from ..model.joint import Joint
from ..model.model import Model, listing, suggest
from ..tables.table_definitions import PLANAR

CLOSURE_RESIDUAL = 1e-11  # residual of F after Newton's method
CLOSURE_ITERATIONS = 30
SAMPLED_STEP = 0.3  # largest component of a sampled step [1]
SAMPLES = 17
ZERO_SINGULAR_VALUE = 1e-11  # singular values below this part of the largest count as zero


class CurvePoint(NamedTuple):
    """A point of the curve: coordinates, driver's coordinate in its own unit, and turn counters and curve positions."""

    q: np.ndarray
    a: float
    z: np.ndarray


@dataclass(frozen=True)
class JacobianRank:
    """Singular value decomposition of J: U diag(values) V^T, all columns."""

    U: np.ndarray
    values: np.ndarray  # as many as J has columns; missing rows count as zero
    V: np.ndarray

    def below(self, limit: float) -> int:
        """Dimension of the kernel if values below ``limit`` count as zero."""
        return int((self.values < limit).sum())


class ClosureEquations:
    """F, its derivatives, and Newton's method; the last component of every step belongs to the driver."""

    def __init__(self, c: CompiledMechanism, rows: int, drive: int) -> None:
        s = c.structure
        self.c, self.rows, self.drive = c, rows, drive
        length = c.values.length
        self.scale = c.sizes
        units = {t.row: t.formula.measure for t in s.terms if not t.measured}
        scales = {"m": 1.0 / length, "rad": 1.0}
        levers = c.values.system.row_levers.real / length  # of equations of couplings, which have no terms
        self.row_scale = np.array([scales[units[k]] if k in units else levers[k] for k in range(len(s.rows))])
        self.used = np.r_[np.arange(rows), drive]
        self.turning = bool(s.rows[drive].wrap)
        self.unit = 1.0 if self.turning or units[drive] != "m" else length  # unit of the driver's coordinate

    @property
    def columns(self) -> int:
        """Number of components of a step."""
        return len(self.scale) + 1

    def moved(self, x: CurvePoint, d: np.ndarray) -> CurvePoint:
        """The point after a step d."""
        q = x.q.copy()
        retract(self.c.values.system, q, d[:-1] * self.scale)
        return CurvePoint(q, x.a + float(d[-1]) * self.unit, x.z)

    def at(self, x: CurvePoint) -> CurvePoint:
        """The point with its turn counters and curve positions updated."""
        return self.evaluated(x, np.zeros(len(self.scale)))

    def evaluated(self, x: CurvePoint, v: np.ndarray) -> CurvePoint:
        """Like `at`; leaves kinematics and rows at the velocities v in the compiled system."""
        self.c.z = x.z.copy()
        self.c.at(0.0, x.q, v)
        return CurvePoint(x.q, x.a, self.c.z.copy())

    def residual(self, x: CurvePoint, v: np.ndarray | None = None) -> np.ndarray:
        """F at a point."""
        self.evaluated(x, np.zeros(len(self.scale)) if v is None else v)
        F = self.c.work.rows.value[self.used] * self.row_scale[self.used]
        gap = self.c.work.rows.value[self.drive] - x.a
        F[-1] = (np.arctan2(np.sin(gap), np.cos(gap)) if self.turning else gap) / self.unit
        return F

    def jacobian(self, x: CurvePoint) -> np.ndarray:
        """J = [G | -e] at a point."""
        self.at(x)
        G = self.c.jacobian()[self.used] * self.row_scale[self.used][:, None] * self.scale
        G[-1] *= 1.0 / self.unit / self.row_scale[self.drive]
        J = np.zeros((len(self.used), self.columns))
        J[:, :-1] = G
        J[-1, -1] = -1.0
        return J

    def rank(self, x: CurvePoint) -> JacobianRank:
        """Singular values and vectors of J at a point."""
        J = self.jacobian(x)
        U, s, Vt = np.linalg.svd(J, full_matrices=True)
        values = np.zeros(self.columns)
        values[: len(s)] = s
        return JacobianRank(U, values, Vt.T)

    def second(self, x: CurvePoint, d: np.ndarray) -> np.ndarray:
        """F''[d, d], exact: minus gamma at the velocity d."""
        self.evaluated(x, d[:-1] * self.scale)
        out = -self.c.work.rows.gamma[self.used] * self.row_scale[self.used]
        out[-1] *= 1.0 / self.unit / self.row_scale[self.drive]
        return out

    def mixed(self, x: CurvePoint, d: np.ndarray, e: np.ndarray) -> np.ndarray:
        """F''[d, e], by polarisation."""
        return 0.25 * (self.second(x, d + e) - self.second(x, d - e))

    def along(self, x: CurvePoint, coefficients: list[np.ndarray]) -> np.ndarray:
        """Taylor coefficients (SAMPLES, rows) of F along the curve d(s) = sum of coefficients[k] s^(k+1) from x."""
        size = max(np.abs(c).max() ** (1.0 / (k + 1)) for k, c in enumerate(coefficients))
        h = SAMPLED_STEP / max(size, 1e-12)
        nodes = np.cos(np.pi * (np.arange(SAMPLES) + 0.5) / SAMPLES)
        powers = np.arange(1, len(coefficients) + 1)
        F = [self.residual(self.moved(x, np.array(coefficients).T @ (h * u) ** powers)) for u in nodes]
        series = np.polynomial.chebyshev.chebfit(nodes, np.array(F), SAMPLES - 1)
        return _chebyshev_to_powers(SAMPLES) @ series / h ** np.arange(SAMPLES)[:, None]

    def project(self, x: CurvePoint, retained: int | None = None) -> tuple[CurvePoint, JacobianRank, float] | None:
        """Newton's method: (nearest point of the curve, rank there, distance), or None if it fails.

        Only the ``retained`` largest singular values are used (by default all but one), which excludes redundant rows.
        """
        retained = self.columns - 1 if retained is None else retained
        total = 0.0
        last = np.inf
        for _ in range(CLOSURE_ITERATIONS):
            r = self.rank(x)
            F = self.residual(x)
            n = min(retained, int((r.values > ZERO_SINGULAR_VALUE * r.values[0]).sum()))
            d = -r.V[:, :n] @ ((r.U[:, :n].T @ F) / r.values[:n])
            size = float(np.abs(d).max())
            if not np.isfinite(size) or size > 0.5:
                return None
            x = self.at(self.moved(x, d))
            total += float(np.linalg.norm(d))
            if size < 1e-14 or (size < 1e-9 and size > 0.3 * last):
                break
            last = size
        if np.abs(self.residual(x)).max() > CLOSURE_RESIDUAL:
            return None
        return x, self.rank(x), total

    def way(self, x: CurvePoint, y: CurvePoint) -> np.ndarray:
        """The step from x to y, without whole turns."""
        S = self.c.values.system
        d = np.append(tangent_step(self.c, x.q, y.q), y.a - x.a)
        for b in range(len(S.tree.parent)):
            if S.tree.joint[b] == PLANAR:
                turn = S.tree.v[b] + 2
                d[turn] = np.arctan2(np.sin(d[turn]), np.cos(d[turn]))
        d[:-1] /= self.scale
        if self.turning:
            d[-1] = np.arctan2(np.sin(d[-1]), np.cos(d[-1]))
        d[-1] /= self.unit
        return d


def _chebyshev_to_powers(n: int) -> np.ndarray:
    """Matrix (n, n) from coefficients of Chebyshev polynomials to those of powers."""
    T = np.zeros((n, n))
    T[0, 0] = T[1, 1] = 1.0
    for k in range(2, n):
        T[1:, k] = 2.0 * T[:-1, k - 1]
        T[:, k] -= T[:, k - 2]
    return T


@dataclass
class ReleasedMechanism:
    """Closure equations with the start of the mechanism and the names of its coordinates."""

    model: Model
    driver: Driver
    closure: ClosureEquations
    start: CurvePoint
    labels: list[str]  # names of coordinates, then of angular velocities of spatial bodies
    units: list[str]  # units of coordinates ("m" or "rad"), and "rad" for angular velocities
    row_of: list[int]  # row of each coordinate
    coordinates: int  # number of labels that are coordinates

    @property
    def unit(self) -> str:
        """Unit of the driver's coordinate."""
        return self.units[self.labels.index(self.driver.coordinate)]

    def values(self, x: CurvePoint, near: np.ndarray | None = None) -> np.ndarray:
        """Values of the coordinates; whole turns of angles are chosen nearest to ``near``."""
        self.closure.residual(x)
        out = self.closure.c.work.rows.value[self.row_of].copy()
        if near is not None:
            turns = 2.0 * np.pi * np.round((near - out) / (2.0 * np.pi))
            out += np.where([u == "rad" for u in self.units[: self.coordinates]], turns, 0.0)
        return out

    def rates(self, x: CurvePoint, d: np.ndarray, e: np.ndarray | None = None) -> np.ndarray:
        """Rates of the labels at the velocity d; with ``e``, their accelerations at the acceleration e."""
        k = self.closure
        v = d[:-1] * k.scale
        k.residual(x, v)
        W, S = k.c.work, k.c.values.system
        bias = -W.rows.gamma[self.row_of]
        v = v if e is None else e[:-1] * k.scale
        out = (k.c.jacobian() @ v)[self.row_of]
        if e is not None:
            out += bias
        turning = []
        for b, (v0, nv) in enumerate(zip(S.tree.v, S.tree.nv, strict=True)):
            if nv == 6:
                turning.append(W.bodies.rotation[b].reshape(3, 3) @ v[v0 + 3 : v0 + 6])
        return np.r_[out, np.concatenate(turning)] if turning else out

    def outline(self, x: CurvePoint) -> list[tuple[str, str, np.ndarray]]:
        """(body, joint, point in world axes) of every joint attachment."""
        self.closure.at(x)
        s = self.closure.c.structure
        names = {b: name for name, b in s.place.items()}
        return [
            (names[spec.body], spec.element.name, self.closure.c.work.frames.position[k].copy())
            for k, spec in enumerate(s.frames)
            if spec.role in ("F", "M") and isinstance(spec.element, Joint) and not spec.coordinate
        ]


def release_driver(model: Model, driver: str, t: float, parameters: Mapping[str, float] | None) -> ReleasedMechanism:
    """Assemble as described, then release the driver; the other drivers are held at their values at time t.

    Raises
    ------
    ModelError
        If there is no such driver, or some constraints are on velocities only.
    AssemblyError
        If the start cannot be assembled.
    """
    names = [d.name for d in model.drivers]
    if driver not in names:
        known = listing(names) if names else "it has none; add a Driver of the coordinate that is to be varied"
        raise ModelError(f"{model.name!r} has no driver {driver!r}{suggest(driver, names)}; {known}")
    a = assemble(model, t=t, parameters=parameters)
    own = a.compiled.structure
    if loose := sorted({r.element.name for r in own.rows if not r.holonomic}):
        raise ModelError(
            f"{model.name!r}: {', '.join(loose)} constrain velocities only, so that the position depends on the path, "
            "and is no function of a driver's coordinate"
        )
    env = model.environment(parameters)
    copy = model.copy()
    copy.drivers = [_stopped_driver(model, d, t, env) for d in model.drivers if d.name != driver]
    copy.forces, copy.sensors = [], [x for x in model.sensors if _is_named(x.name, copy.drivers)]
    labels = _coordinate_names(model)
    copy.initial = [Initial(name, value=0.0) for name in labels]
    c = compile_mechanism(copy, parameters=parameters, holds=copy.initial)
    c.follow(a.compiled.hints)
    rows = [c.structure.slices[name].start for name in labels]
    mine = model[driver]
    if mine.coordinate not in labels:
        raise ModelError(f"{mine.title}: its coordinate {mine.coordinate!r} cannot be varied")
    closure = ClosureEquations(c, min(rows), rows[labels.index(mine.coordinate)])
    units = [model.unit(name, mine) for name in labels]
    count = len(labels)
    if not model.planar:
        bodies = sorted((b for b, k in c.structure.place.items() if k >= 0), key=lambda b: c.structure.place[b])
        labels = [
            *labels,
            *(f"{b}.omega_{axis}" for b in bodies for axis in "xyz"),
        ]
        units = [*units, *["rad"] * (3 * len(bodies))]
    out = ReleasedMechanism(model, mine, closure, CurvePoint(a.q, 0.0, c.z.copy()), labels, units, rows, count)
    value = float(out.values(out.start)[labels.index(mine.coordinate)])
    return replace(out, start=CurvePoint(a.q, _with_whole_turns(out, a, value, t, env), out.start.z))


def _coordinate_names(model: Model) -> list[str]:
    """All coordinates that a driver can drive, those with singular positions only if one drives them."""
    axes = ("x", "y", "angle") if model.planar else ("x", "y", "z")
    out = [f"{j.name}.{what}" for j in model.joints for what in j.independent(model.planar)]
    out += [f"{b.name}.{axis}" for b in model.bodies for axis in axes]
    return list(dict.fromkeys([*out, *(d.coordinate for d in model.drivers)]))


def _is_named(name: str, drivers: list[Driver]) -> bool:
    return any(isinstance(d.law, str) and re.search(rf"\b{re.escape(name)}\b", d.law) for d in drivers)


def _stopped_driver(model: Model, d: Driver, t: float, env: Mapping[str, float]) -> Driver:
    """Driver fixed at its value at time t; if its law depends on sensors, only t is fixed."""
    law = model.law(d.law, LawOf(model.unit(d.coordinate, d)), f"law of {d.title}", driver=True)
    if law.names <= {"t", *env}:
        return replace(d, law=float(law.evaluate({**env, "t": t}, tables=model.law_tables())))
    return replace(d, law=re.sub(r"\bt\b", f"({t!r})", str(law)))


def _with_whole_turns(f: ReleasedMechanism, a: Assembly, value: float, t: float, env: Mapping[str, float]) -> float:
    """Driver's coordinate at the start, with the whole turns of its law."""
    law = f.model.law(f.driver.law, LawOf(f.unit), f"law of {f.driver.title}", driver=True)
    if f.unit != "rad" or not law.names <= {"t", *env}:
        return value
    told = float(law.evaluate({**env, "t": t}, tables=f.model.law_tables()))
    return value + 2.0 * np.pi * np.round((told - value) / (2.0 * np.pi))


LOST_RANK = 1e-7  # singular values below this part of the largest count as zero at a located point
LOCATION_ITERATIONS = 60
LOCATION_RADIUS = 0.5  # largest distance that Newton's method may move [1]


def rank_limit(r: JacobianRank) -> float:
    """Limit below which a singular value counts as zero."""
    return LOST_RANK * float(r.values[0])


def locate_branch_point(c: ClosureEquations, x: CurvePoint, dropped: int = 1) -> CurvePoint | None:
    """Point near x where J loses ``dropped`` more dimensions of rank; None if there is none."""
    start = x
    best: tuple[float, CurvePoint] | None = None
    last = np.inf
    for _ in range(LOCATION_ITERATIONS):
        r = c.rank(x)
        kept = c.columns - 1 - dropped
        U, V = r.U[:, kept:], r.V[:, kept:]
        if not U.shape[1]:  # not enough rows: additional freedoms, no singular position
            return None
        F = c.residual(x)
        aside = -r.V[:, :kept] @ ((r.U[:, :kept].T @ F) / r.values[:kept])
        k = V.shape[1]
        loss = np.zeros((k, U.shape[1]))  # [j]: U^T J V_j
        np.fill_diagonal(loss, r.values[kept:])
        slopes = np.zeros((k, k, U.shape[1]))  # [j, l]: U^T F''[V_j, V_l]
        for j in range(k):
            for l in range(j + 1):
                slopes[j, l] = slopes[l, j] = U.T @ (c.second(x, V[:, j]) if j == l else c.mixed(x, V[:, j], V[:, l]))
        given = np.array([U.T @ c.mixed(x, V[:, j], aside) for j in range(k)]) if np.any(aside) else 0.0
        A = slopes.transpose(0, 2, 1).reshape(-1, k)
        y = -np.linalg.lstsq(A, (loss + given).ravel(), rcond=1e-11)[0]
        d = aside + V @ y
        size = float(np.linalg.norm(d))
        if not np.isfinite(size):
            return None
        d *= min(1.0, 0.1 / max(size, 1e-300))
        measure = float(np.abs(loss).max() + np.abs(F).max())
        if best is None or measure < best[0]:
            best = measure, x
        x = c.at(c.moved(x, d))
        if np.linalg.norm(c.way(start, x)) > LOCATION_RADIUS:
            return None
        if size < 1e-13 or (size < 1e-8 and size > 0.3 * last):
            break
        last = size
    x = x if best is None or _branch_point_residual(c, x, dropped) <= best[0] else best[1]
    r = c.rank(x)
    true = np.abs(c.residual(x)).max() < 1e-10 and r.below(rank_limit(r)) > dropped
    return x if true else None


def _branch_point_residual(c: ClosureEquations, x: CurvePoint, dropped: int) -> float:
    r = c.rank(x)
    return float(r.values[c.columns - 1 - dropped] + np.abs(c.residual(x)).max())


def interior_minimum(f0: float, g0: float, f1: float, g1: float, ds: float) -> tuple[float, float] | None:
    """Position (0 to 1) and value of the minimum of the cubic through two values and slopes; None if at an end."""
    a, b, c = 2 * (f0 - f1) + ds * (g0 + g1), 3 * (f1 - f0) - ds * (2 * g0 + g1), ds * g0
    for u in np.roots([3 * a, 2 * b, c] if abs(a) > 1e-14 else [2 * b, c] if abs(b) > 1e-14 else [1.0, 9.0]):
        if abs(u.imag) < 1e-12 and 0.0 < u.real < 1.0 and 6 * a * u.real + 2 * b > 0.0:
            u = float(u.real)
            return u, ((a * u + b) * u + c) * u + f0
    return None


MAX_TURN = 0.12  # largest rotation of the tangent in one step [rad]
SHORTEST_STEP = 1e-7  # shortest step [1]
SAME_POINT = 1e-5  # points nearer than this are equal [1]
# Singular values below this part of the largest may vanish together with the smallest one.
SMALL_SINGULAR_VALUE = 0.1
HALF_TURN = 3.0  # change of a driver's angle [rad] that shows a whole turn
STATIONARY_DRIVER = 1e-8  # driver's components of the tangent below this count as zero
AVOIDED_SINGULAR_VALUE = 1e-6  # a step to a smaller singular value than this is changed

BRANCH_LOST = "the curve cannot be followed away from a singular position along the branch chosen"


@dataclass(frozen=True)
class CurveNode:
    """A regular point of the curve."""

    s: float
    x: CurvePoint
    t: np.ndarray  # unit tangent
    bend: np.ndarray  # second derivative of x by arc length
    value: float  # smallest singular value of J besides that of the tangent
    slope: float

    @property
    def drive(self) -> float:
        """Driver's component of the tangent."""
        return float(self.t[-1])


@dataclass
class TracedCurve:
    """One direction of the curve from a point: nodes, singular points (arc length, point), and why it ends."""

    nodes: list[CurveNode] = field(default_factory=list)
    found: list[tuple[float, CurvePoint]] = field(default_factory=list)
    end: str = ""


class CurveTracer:
    """Follows the solution curve of closure equations."""

    def __init__(self, c: ClosureEquations, step: float) -> None:
        self.c, self.step = c, step

    def node(self, s: float, x: CurvePoint, r: JacobianRank, along: np.ndarray) -> CurveNode:
        """Node at a point with the rank r, with its tangent in the direction ``along``."""
        c = self.c
        n = c.columns - 1
        t = r.V[:, n] * (1.0 if r.V[:, n] @ along > 0.0 else -1.0)
        usable = r.values[:n] > 1e-9 * r.values[0]
        U, V = r.U[:, :n][:, usable[: r.U.shape[1]]], r.V[:, :n][:, usable]
        bend = -V @ ((U.T @ c.second(x, t)) / r.values[:n][usable])
        slope = float(r.U[:, n - 1] @ c.mixed(x, t, r.V[:, n - 1]))
        return CurveNode(s, x, t, bend, float(r.values[n - 1]), slope)

    def step_from(self, node: CurveNode, h: float) -> CurveNode | None:
        """Node at the distance h (backwards if negative) from another; None if one step does not reach it."""
        predicted = self.c.at(self.c.moved(node.x, h * node.t + 0.5 * h * h * node.bend))
        found = self.c.project(predicted)
        if found is None or found[2] > 0.3 * abs(h) + 1e-9:
            return None
        new = self.node(node.s + h, found[0], found[1], node.t)
        turned = float(
            np.arccos(np.clip(new.t @ (node.t + h * node.bend) / np.linalg.norm(node.t + h * node.bend), -1, 1))
        )
        return None if turned > 0.5 * MAX_TURN + 0.5 * abs(h) * MAX_TURN else new

    def off(self, x: CurvePoint, n: np.ndarray, bend: np.ndarray) -> CurveNode:
        """Regular node a small step from a point, in the direction n of one of its branches."""
        for h in (0.02, 0.01, 0.005, 0.002, 0.03, 5e-4):
            found = self.c.project(self.c.at(self.c.moved(x, h * n + 0.5 * h * h * bend)))
            if found is not None and found[2] < 0.2 * h and found[1].values[self.c.columns - 2] > 1e-5 * h:
                return self.node(h, found[0], found[1], n + h * bend)
        raise NotConverged(BRANCH_LOST)

    def node_after_step(self, x: CurvePoint, d: np.ndarray) -> CurveNode:
        """Regular node a step d from a point."""
        found = self.c.project(self.c.at(self.c.moved(x, d)))
        if found is None:
            raise NotConverged(BRANCH_LOST)
        return self.node(float(np.linalg.norm(d)), found[0], found[1], d)

    def follow(
        self, first: CurveNode, within: Callable[[float], bool], steps: int, home: CurveNode | None
    ) -> TracedCurve:
        """Follow the curve from a node until the driver's coordinate leaves its range or the curve closes."""
        way = TracedCurve([first])
        h = self._longest(first)
        while True:
            last = way.nodes[-1]
            if len(way.nodes) > steps:
                way.end = f"stopped after {steps} steps"
                return way
            new = self._next(last, h)
            self._search(last, new, way)
            way.nodes.append(new)
            if not within(new.x.a):
                way.end = "end of the range"
                return way
            # After a whole turn the driver has another value.
            again = home is not None and abs(new.x.a - home.x.a) < HALF_TURN
            if home is not None and again and new.s - first.s > 4.0 * self.step and self._is_closed(new, home):
                way.end = "closed"
                return way
            h = min(2.0 * (new.s - last.s), self._longest(new))

    def _longest(self, node: CurveNode) -> float:
        turning = float(np.linalg.norm(node.bend))
        return min(self.step / float(np.abs(node.t).max()), MAX_TURN / max(turning, 1e-12))

    def _next(self, last: CurveNode, h: float) -> CurveNode:
        while h > SHORTEST_STEP:
            new = self.step_from(last, h)
            if new is not None:
                if new.value > AVOIDED_SINGULAR_VALUE:
                    return new
                h *= 0.83
            else:
                h *= 0.5
        raise NotConverged(
            f"the curve cannot be followed beyond {last.x.a:.6g} of the driver's coordinate: no step, however short, "
            f"leads to a neighbouring position"
        )

    def _is_closed(self, node: CurveNode, home: CurveNode) -> bool:
        d = self.c.way(node.x, home.x)
        h = float(d @ node.t)
        if abs(h) > 2.0 * self.step or np.linalg.norm(d - h * node.t) > 0.3 * self.step or node.t @ home.t < 0.7:
            return False
        there = self.step_from(node, h) if abs(h) > 1e-9 else node
        return there is not None and h < 0.0 and float(np.linalg.norm(self.c.way(there.x, home.x))) < 0.05 * self.step

    def _search(self, m: CurveNode, n: CurveNode, way: TracedCurve) -> None:
        """Singular points between two nodes."""
        ds = n.s - m.s
        least = interior_minimum(m.value, m.slope, n.value, n.slope, ds)
        if least is not None and least[1] < 0.8 * min(m.value, n.value):
            self._locate_branch_point(m, n, least[0], way)
        if max(abs(m.drive), abs(n.drive)) < STATIONARY_DRIVER:
            return
        if m.drive * n.drive < 0.0:
            self._locate_turning_point(m, n, way)
            return
        sign = 1.0 if m.drive + n.drive > 0.0 else -1.0
        least = interior_minimum(sign * m.drive, sign * m.bend[-1], sign * n.drive, sign * n.bend[-1], ds)
        if least is not None and least[1] < 0.5 * min(abs(m.drive), abs(n.drive)):
            self._locate_double_root(m, n, way)

    def _locate_branch_point(self, m: CurveNode, n: CurveNode, u: float, way: TracedCurve) -> None:
        middle = self.step_from(m, u * (n.s - m.s)) or m
        for near in (middle, m, n):
            values = self.c.rank(near.x).values[: self.c.columns - 1]
            for dropped in range(max(1, int((values < SMALL_SINGULAR_VALUE * values[0]).sum())), 0, -1):
                x = locate_branch_point(self.c, near.x, dropped)
                if x is not None and self._between(m, n, x):
                    self._note(m.s + float(np.linalg.norm(self.c.way(m.x, x))), x, way)
                    return

    def _between(self, m: CurveNode, n: CurveNode, x: CurvePoint) -> bool:
        ds = n.s - m.s
        return bool(max(np.linalg.norm(self.c.way(k.x, x)) for k in (m, n)) < 1.2 * ds + 1e-9)

    def _locate_turning_point(self, m: CurveNode, n: CurveNode, way: TracedCurve) -> None:
        """Root of the driver's component of the tangent, by bracketed secant steps."""
        from scipy.optimize import brentq

        def drive(s: float) -> float:
            at[0] = self.step_from(m, s - m.s) if s > m.s else m
            if at[0] is None:
                raise ArithmeticError
            return at[0].drive

        at: list[CurveNode | None] = [None]
        try:
            s = brentq(drive, m.s, n.s, xtol=1e-14, rtol=1e-14)
            drive(s)
        except (ArithmeticError, ValueError, RuntimeError):
            return
        if at[0] is not None:
            self._note(s, at[0].x, way)

    def _locate_double_root(self, m: CurveNode, n: CurveNode, way: TracedCurve) -> None:
        """Minimum of the driver's component of the tangent: two roots, a double one, or none."""
        low, high = m, n
        sign = 1.0 if m.drive > 0.0 else -1.0
        for _ in range(60):
            middle = self.step_from(m, 0.5 * (low.s + high.s) - m.s)
            if middle is None:
                return
            if sign * middle.drive < 0.0:
                self._locate_turning_point(m, middle, way)
                self._locate_turning_point(middle, n, way)
                return
            low, high = (middle, high) if sign * middle.bend[-1] < 0.0 else (low, middle)
            if high.s - low.s < 1e-14:
                break
        if abs(low.drive) < STATIONARY_DRIVER:
            self._note(low.s, low.x, way)

    def _note(self, s: float, x: CurvePoint, way: TracedCurve) -> None:
        if all(np.linalg.norm(self.c.way(x, y)) > SAME_POINT or abs(x.a - y.a) > HALF_TURN for _, y in way.found):
            way.found.append((s, x))
