"""Closure equations of a mechanism with a released driver: F(x) = (g(q), c(q) - a) = 0 with x = (q, a).

The law of the driver is replaced by the parameter a, the value of its coordinate c. Steps d = (velocities, a) are
dimensionless: lengths are divided by the mechanism's length, angles are in radians; rows are scaled likewise. F is a
function of the step d from a point, F(x + d), on a flat space. The compiled system gives its first two derivatives at
d = 0: J = [G | -e], and F''[d, d] = -gamma at the velocity d, since a constant velocity is a straight step to second
order. Higher derivatives come from samples of F along a polynomial of d, fitted to rounding.

Rows for all coordinates of joints and bodies are appended to the constraints. Their values, gradients and accelerations
then come from the same formulas as the motion, and every vector can be listed by coordinate names.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ..assembly.assemble import assemble
from ..assembly.assembled_state import Assembly
from ..assembly.compiled_mechanism import CompiledMechanism, compile_mechanism, tangent_step
from ..engine.kinematics import retract
from ..errors import ModelError
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
        self.row_scale = np.array([1.0 / length if units[k] == "m" else 1.0 for k in range(len(s.rows))])
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
        return replace(d, law=float(law.evaluate({**env, "t": t}, tables={x.name: x for x in model.tables})))
    return replace(d, law=re.sub(r"\bt\b", f"({t!r})", str(law)))


def _with_whole_turns(f: ReleasedMechanism, a: Assembly, value: float, t: float, env: Mapping[str, float]) -> float:
    """Driver's coordinate at the start, with the whole turns of its law."""
    law = f.model.law(f.driver.law, LawOf(f.unit), f"law of {f.driver.title}", driver=True)
    if f.unit != "rad" or not law.names <= {"t", *env}:
        return value
    told = float(law.evaluate({**env, "t": t}, tables={x.name: x for x in f.model.tables}))
    return value + 2.0 * np.pi * np.round((told - value) / (2.0 * np.pi))
