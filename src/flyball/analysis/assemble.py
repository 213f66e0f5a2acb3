"""Assembly: from rough guesses to positions and velocities that fulfil every constraint.

Positions by damped Gauss-Newton with steps of least weighted size, first on residuals that are true angles (they lead
from far away, and never to an antiparallel joint), then on the rows of the motion. Velocities by the least change in
kinetic energy. What fulfils the constraints already is left alone.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from ..errors import AssemblyError
from ..model.body import Body, Driver, Frame
from ..model.element import LawOf
from ..model.expressions import number
from ..model.model import Model
from ..tables.system import G_VALUE, NU
from .compiled import Compiled, compiled

CLOSED = 1e-10
RESTARTS = 12
ITERATIONS = 200
DENSE = 300  # rows up to which a step of assembly goes through a singular value decomposition
NO_PIVOT = 1e-14  # added for redundant rows of large mechanisms; iterations take it out again
NO_PART = 1e-10  # singular values below this part of the largest are taken for rounding


@dataclass
class Assembly:
    """A consistent start: the compiled mechanism, its state, and what assembly had to change."""

    compiled: Compiled
    t: float
    q: np.ndarray
    v: np.ndarray
    moved: dict[str, float] = field(default_factory=dict)  # body -> how far its mass centre went [m]
    iterations: int = 0
    sped: dict[str, float] = field(default_factory=dict)  # body -> change of the velocities described for it [1/s]

    @property
    def y(self) -> np.ndarray:
        """State vector with work states zero."""
        return np.r_[self.q, self.v, self.compiled.z]


def assemble(model: Model, *, t: float = 0.0, parameters: Mapping[str, float] | None = None) -> Assembly:
    """Find positions and velocities that fulfil all constraints at time t, near those described.

    Raises
    ------
    AssemblyError
        If no closed position, or no consistent velocity, is found; the message names the joints that disagree and by
        how much.
    """
    model = model.snapshot()
    plain = compiled(model, parameters=parameters)
    q, v = plain.values.q.copy(), plain.values.v.copy()
    env = model.environment(parameters)
    values, rates = _told(model, env)
    known = values | _driven(model, model.drivers, t, env)
    plain.follow(_turns(plain, known))
    _wind(plain, known, q)
    holds = [i for i in model.initial if i.name in values]
    near = plain
    if holds or not all(r.holonomic for r in plain.structure.rows):
        near = compiled(model, parameters=parameters, positions=True, holds=holds, held=values)
        near.follow(plain.hints)
    start = q.copy()
    count = 0
    if _misfit(near, t, q, v) > CLOSED or _by_frames(model):
        far = compiled(model, parameters=parameters, far=True, holds=holds, held=values)
        far.follow(plain.hints)
        if _misfit(far, t, q, v) > 1e-6:
            q, count = _close(far, t, q, v)
            near.follow(far.hints)
        q, more = _newton(near, t, q, v)
        count += more
        if _misfit(near, t, q, v) > CLOSED or _misfit(far, t, q, v) > 1e-6:
            plain.follow(near.hints)
            raise _disagreement(far, Assembly(plain, t, q, v))
    plain.follow(near.hints)
    described = v.copy()
    v = _velocities(model, plain, parameters, t, q, v, rates)
    return Assembly(plain, t, q, v, _moved(plain, start, q), count, _sped(plain, described, v))


def _turns(c: Compiled, known: Mapping[str, float]) -> dict[str, float]:
    """What the states that count turns begin near, where coordinates are told their value."""
    out = {}
    for name in set(known) & set(c.structure.state_at):
        joint, what = c.structure.model.coordinate(name, c.structure.model.bodies[0])
        coordinate = joint.coordinates[what] if hasattr(joint, "coordinates") else None
        sign = coordinate.sign if coordinate else 1.0
        offset = joint.offset(c.values.numbers[joint.name], what) if coordinate else 0.0
        out[name] = sign * (known[name] - offset)
    return out


def _wind(c: Compiled, known: Mapping[str, float], q: np.ndarray) -> None:
    """Bodies in the plane that are told their angle begin with its whole turns."""
    s = c.structure
    for name, value in known.items():
        owner, what = s.model.coordinate(name, s.model.bodies[0])
        if what != "angle" or not isinstance(owner, (Body, Frame)):
            continue
        b = s.place[s.model.carrier(owner.name, owner)]
        if b >= 0:
            turns = np.round((value - c.values.poses.turned(owner)) / (2.0 * np.pi))
            q[s.tables["body_i"][b, 2] + 2] += 2.0 * np.pi * turns


def _told(model: Model, env: Mapping[str, float]) -> tuple[dict[str, float], dict[str, float]]:
    """Values and rates that initial conditions ask for."""
    values, rates = {}, {}
    for i in model.initial:
        unit = model.unit(i.name, i)
        if i.value is not None:
            values[i.name] = number(i.value, env, unit, f"value of {i.title}")
        if i.rate is not None:
            rates[i.name] = number(i.rate, env, f"{unit}/s", f"rate of {i.title}")
    return values, rates


def _driven(model: Model, drivers: list[Driver], t: float, env: Mapping[str, float]) -> dict[str, float]:
    """What drivers' laws ask for at time t, as far as they follow time alone."""
    out = {}
    tables = {x.name: x for x in model.tables}
    for d in drivers:
        law = model.law(d.law, LawOf(model.unit(d.coordinate, d)), f"law of {d.title}")
        if law.names <= {"t", *env}:
            out[d.coordinate] = law.evaluate({**env, "t": t}, tables=tables)
    return out


def _by_frames(model: Model) -> bool:
    """Whether some joint is given by frames, so that nothing says it is drawn closed."""
    return any(j.at is None for j in model.joints)


def _misfit(c: Compiled, t: float, q: np.ndarray, v: np.ndarray) -> float:
    c.at(t, q, v)
    g = c.work.row[G_VALUE]
    return float(np.abs(g).max(initial=0.0)) if np.isfinite(g).all() else np.inf


def movable(c: Compiled) -> np.ndarray:
    """1 for velocities of bodies that may move, 0 for those of bodies that stay as drawn."""
    s = c.structure
    out = np.ones(s.nv)
    for name, b in s.place.items():
        if b >= 0 and s.model[name].as_drawn:
            v0, n = s.tables["body_i"][b, 3], s.tables["body_i"][b, 5]
            out[v0 : v0 + n] = 0.0
    return out


def inverse_weights(c: Compiled) -> np.ndarray:
    """Inverse weights of the steps of assembly: metres against radians; bodies that must not move have none."""
    body_i = c.structure.tables["body_i"]
    w = np.ones(c.structure.nv)
    for v0, n in zip(body_i[:, 3], body_i[:, 5], strict=True):
        k = {3: 2, 6: 3}.get(int(n), 0)
        w[v0 + k : v0 + n] = 1.0 / c.values.length**2
    return w * movable(c)


def _step(c: Compiled, r: np.ndarray, R, damping: float) -> np.ndarray:
    """Least step with G d = r, in the metric of the inverse weights R R^T (R sparse), damped.

    Near a singular position a combination of rows may speak of a motion by a part of 1e-8 only: where the size allows
    it the singular values of G R are used, not their squares, which would drown in rounding.
    """
    import scipy.sparse as sp
    from scipy.sparse.linalg import splu

    B = c.sparse_jacobian() @ R
    if B.shape[0] <= DENSE:
        used = np.unique(B.indices)
        U, s, Vt = np.linalg.svd(B[:, used].toarray(), full_matrices=False)
        largest = s.max(initial=0.0) or 1.0
        keep = s > NO_PART * largest
        x = np.zeros(B.shape[1])
        x[used] = Vt[keep].T @ (s[keep] / (s[keep] ** 2 + damping * largest**2) * (U[:, keep].T @ r))
        return R @ x
    # [1 B^T; B -delta] with B of unit size: B B^T would square the spread of singular values here too
    m, n = B.shape
    size = np.sqrt(B.multiply(B).sum(axis=1).max()) or 1.0
    B = B / size
    K = sp.bmat([[sp.identity(n), B.T], [B, -(damping + NO_PIVOT) * sp.identity(m)]], format="csc")
    return R @ splu(K).solve(np.r_[np.zeros(n), r / size])[:n]


def _moved_by(c: Compiled, q: np.ndarray, d: np.ndarray) -> np.ndarray:
    from ..equations.tree import retract

    new = q.copy()
    retract(c.values.system, new, d)
    return new


def _newton(c: Compiled, t: float, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, int]:
    """Damped Gauss-Newton until closed or no better. Returns (q, iterations)."""
    import scipy.sparse as sp

    w = inverse_weights(c)
    R = sp.diags(np.sqrt(w)).tocsr()
    limit = 0.7 * c.values.length * np.sqrt(np.where(w > 0.0, w, 1.0))  # 0.7 rad, or 0.7 of the mechanism's size
    size = _misfit(c, t, q, v)
    g = c.work.row[G_VALUE].copy()
    damping = 0.0
    norm = float(g @ g)
    for k in range(ITERATIONS):
        if size < 1e-13:
            return q, k
        c.at(t, q, v)
        d = _step(c, -g, R, damping)
        over = np.abs(d / limit).max(initial=0.0)
        d = d / over if over > 1.0 else d
        new = _moved_by(c, q, d)
        new_size = _misfit(c, t, new, v)
        trial = c.work.row[G_VALUE].copy()
        new_norm = float(trial @ trial)
        if np.isfinite(new_size) and new_norm < norm:
            gain = 1.0 - new_norm / norm
            q, g, size, norm = new, trial, new_size, new_norm
            damping = 0.0 if damping < 1e-12 else damping / 10
            if gain < 1e-9:
                return q, k
        else:
            damping = max(10 * damping, 1e-8)
            if damping > 1e4 or size < 1e-11:
                return q, k
    return q, ITERATIONS


def _close(c: Compiled, t: float, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, int]:
    """Close from far: Newton from the guess, then from shaken guesses when it is caught short of closed."""
    w = inverse_weights(c)
    best, count = _newton(c, t, q, v)
    least = _misfit(c, t, best, v)
    random = np.random.default_rng(0)
    for k in range(RESTARTS):
        if least < 1e-9:
            break
        shake = random.normal(size=len(w)) * np.sqrt(w) * c.values.length * 0.05 * 1.5**k
        trial, more = _newton(c, t, _moved_by(c, best if k % 2 == 0 else q, shake), v)
        count += more
        misfit = _misfit(c, t, trial, v)
        if misfit < 1e-9:
            # closed from a shaken start: come back as near to the guess as the constraints allow
            return trial, count
        if misfit < least:
            best, least = trial, misfit
    return best, count


def closed_near(c: Compiled, t: float, q: np.ndarray) -> np.ndarray | None:
    """The closed position next to q, or None if none is found; of a mechanism with the rows of its positions."""
    q, _ = _newton(c, t, q, np.zeros(c.structure.nv))
    return q if _misfit(c, t, q, np.zeros(c.structure.nv)) <= CLOSED else None


def _disagreement(c: Compiled, best: Assembly) -> AssemblyError:
    """The error that says which elements cannot be fulfilled together, worst first."""
    t = best.t
    _misfit(c, t, best.q, best.v)
    g = c.work.row[G_VALUE]
    lawless = [r.element for r, x in zip(c.structure.rows, g, strict=True) if r.law >= 0 and not np.isfinite(x)]
    if lawless:
        missed = c.structure.missed(c.work.stack)
        raise AssemblyError(
            f"{c.structure.model.name!r} cannot be assembled at t = {t:g} s: the law of {lawless[0].title} has no "
            f"finite value there{f': {missed.message}' if missed is not None else ''}"
        )
    gaps: dict[str, tuple[float, float, str]] = {}
    for name, rows in c.structure.slices.items():
        part = g[rows]
        if not len(part) or np.abs(part).max() < 1e-9:
            continue
        units = [_unit(c, k) for k in range(rows.start, rows.stop)]
        metres = np.sqrt(sum(x * x for x, u in zip(part, units, strict=True) if u == "m"))
        radians = np.sqrt(sum(x * x for x, u in zip(part, units, strict=True) if u != "m"))
        text = " and ".join(
            x
            for x in (
                f"{metres:.4g} m" if metres > 1e-9 else "",
                f"{np.degrees(radians):.4g} deg" if radians > 1e-9 else "",
            )
            if x
        )
        gaps[name] = (float(metres), float(radians), text)
    worst = sorted(gaps, key=lambda k: -max(gaps[k][0] / c.values.length, gaps[k][1]))
    shown = "; ".join(f"{k} is {gaps[k][2]} from closed" for k in worst[:8])
    return AssemblyError(
        f"{c.structure.model.name!r} cannot be assembled at t = {t:g} s: no position fulfils all constraints. "
        f"At the best position found {shown or 'rows disagree'}. Check lengths and the points of these joints, "
        f"the drivers, and initial values, or give a better guess",
        gaps={k: gaps[k][:2] for k in worst},
        best=best,
    )


def _unit(c: Compiled, row: int) -> str:
    return next(x.formula.measure for x in c.structure.terms if x.row == row)


def _velocities(
    model: Model, plain: Compiled, parameters: Mapping | None, t: float, q: np.ndarray, v: np.ndarray, rates: dict
) -> np.ndarray:
    """Velocities nearest to v (in kinetic energy) with G v = nu and the rates asked for."""
    holds = [i for i in model.initial if i.name in rates]
    c = compiled(model, parameters=parameters, holds=holds, held={}) if holds else plain
    c.follow(plain.hints)
    if not len(c.values.system.row_i):
        return v
    c.at(t, q, v)
    nu = c.work.row[NU].copy()
    for i in holds:
        nu[c.structure.slices[i.name]] = rates[i.name]
    G = c.sparse_jacobian()
    r = nu - G @ v
    size = max(1.0, float(np.abs(v).max(initial=0.0)), float(np.abs(nu).max(initial=0.0)))
    if np.abs(r).max() < 1e-13 * size:
        return v
    R = c.inverse_mass_root(movable(c))
    last = np.inf
    for _ in range(ITERATIONS):
        worst = float(np.abs(r).max())
        size = max(size, float(np.abs(v).max()))
        if worst < 1e-13 * size or worst > 0.9 * last:
            break
        v, last = v + _step(c, r, R, 0.0), worst
        r = nu - G @ v
    if np.abs(r).max() > 1e-9 * size:
        gaps = {k: float(np.abs(r[rows]).max(initial=0.0)) for k, rows in c.structure.slices.items()}
        bad = sorted((k for k in gaps if gaps[k] > 1e-9 * size), key=lambda k: -gaps[k])
        listed = ", ".join(bad[:8]) + (f" and {len(bad) - 8} more" if len(bad) > 8 else "")
        raise AssemblyError(
            f"{model.name!r}: no velocities fulfil all constraints at t = {t:g} s; {listed} disagree. "
            f"Check drivers, initial rates and bodies with as_drawn=True",
            gaps={k: gaps[k] for k in bad},
            best=Assembly(plain, t, q, v),
        )
    return v


def _sped(c: Compiled, before: np.ndarray, after: np.ndarray) -> dict[str, float]:
    """How much velocities that were described were changed, relative to the body's largest; the rest was free."""
    out = {}
    for name, b in c.structure.place.items():
        if b >= 0:
            v0, n = c.structure.tables["body_i"][b, [3, 5]]
            told = before[v0 : v0 + n]
            change = np.abs(after[v0 : v0 + n] - told)[told != 0.0].max(initial=0.0)
            if change > 1e-6 * np.abs(told).max(initial=0.0):
                out[name] = float(change)
    return out


def _moved(c: Compiled, before: np.ndarray, after: np.ndarray) -> dict[str, float]:
    out = {}
    for name, b in c.structure.place.items():
        if b < 0 or c.structure.tables["body_i"][b, 5] < 3:
            continue
        q0 = c.structure.tables["body_i"][b, 2]
        k = 2 if c.structure.model.planar else 3
        d = float(np.linalg.norm(after[q0 : q0 + k] - before[q0 : q0 + k]))
        if d > 1e-12:
            out[name] = d
    return out
