"""Whether a point stays what it is: an equilibrium, or a motion with constant rates that looks the same later."""

from __future__ import annotations

import numpy as np

from ...analysis.linear.free import gaps
from ...errors import AnalysisError, ModelError
from ...graph.node import Node
from ...graph.values import evaluate
from ...numerics.rank import TOLERANCE, null_space, parts, rank
from .balance import unsteady
from .derivatives import Derivatives
from .free import Free, based, compared
from .point import Point
from .reduced import reduced
from .solve import number, numbers
from .traced import Mechanics

SWING = 0.1  # angle [rad], or part of the mechanism's length, that it moves by between the instants compared
STEPS = 8
SAME = 1e-7  # relative difference of equations that are the same
STEP = 1e-2  # part of a radian, or of the mechanism's length, that it is moved by to see whether its rank is the usual
PASSES = 20
CLOSED = 1e-10  # of the mechanism's length


def refuse_unsteady(m: Mechanics, d: Derivatives, f: Free, point: Point, known: dict[str, float]) -> None:
    """Refuse a motion whose linear equations change while it goes on, or that follow time.

    ``known`` tells the multipliers, and parameters that have other values than their own.

    Raises
    ------
    AnalysisError
        If they do.
    """
    v = np.array([number(x) for x in point.v])
    here = point.numbers(m) | known
    size = np.abs(v / np.array([m.values.length if n.unit == "m" else 1.0 for n in m.names])).max(initial=0.0)
    later = dict(here)
    if size > 0.0:
        for _ in range(STEPS):
            _moved(m, later, v, SWING / size / STEPS)
    else:
        later[m.x.t.data.name] += 1.0 / np.sqrt(np.abs(_matrix(m, d, f, here)).max(initial=0.0) or 1.0)
    now, then = (_matrix(m, d, f, at) for at in (here, later))
    if np.abs(then - now).max(initial=0.0) > SAME * np.abs(now).max(initial=0.0):
        if size > 0.0:
            raise unsteady(m)
        raise AnalysisError(
            f"the linear equations of {m.model.name!r} at this point change with time: laws change with time; "
            f"linearize takes this very instant with frozen=True, in numbers"
        )


def _matrix(m: Mechanics, d: Derivatives, f: Free, at: dict[str, float]) -> np.ndarray:
    """A in numbers, in the same coordinates."""
    p = d.near(at)
    n = f.Z.shape[1] + f.Zv.shape[1]
    return numbers(reduced(m, p, based(f, p)).rate[:, :n])


def _moved(m: Mechanics, at: dict[str, float], v: np.ndarray, h: float) -> None:
    """A step of Runge and Kutta's along constant velocities."""
    names = [s.data.name for s in m.x.q]
    q = np.array([at[k] for k in names])

    def rate(q: np.ndarray) -> np.ndarray:
        T = evaluate(list(m.x.T.ravel()), at | dict(zip(names, q.tolist(), strict=True)))
        return np.array(T, float).reshape(len(names), -1) @ v

    k1 = rate(q)
    k2 = rate(q + 0.5 * h * k1)
    k3 = rate(q + 0.5 * h * k2)
    k4 = rate(q + h * k3)
    at |= dict(zip(names, (q + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)).tolist(), strict=True))
    at[m.x.t.data.name] += h


def refuse_singular(m: Mechanics, G: list[Node], point: Point) -> None:
    """Refuse a position where the constraints lose rank: nothing linear holds there.

    Raises
    ------
    ModelError
        Naming the elements whose rows depend on each other there and not nearby.
    """
    which = np.flatnonzero(m.holonomic)
    here = point.numbers(m)
    if not len(which):
        return
    now = _rows(m, G, here)[which]
    N = null_space(now)
    rng = np.random.default_rng(0)
    for _ in range(2 if N.shape[1] else 0):
        step = m.scale * (N @ rng.standard_normal(N.shape[1]))
        step *= STEP * m.values.length / np.abs(step / m.scale).max()
        there = _nearby(m, G, dict(here), step, which)
        if there is not None and rank(there) > rank(now):
            raise ModelError(
                f"{m.model.name!r} is in a singular position there: the constraints of {_lost(m, now, there, which)} "
                f"depend on each other at this point and not nearby, so that there are no linear equations; give "
                f"another point"
            )


def _rows(m: Mechanics, G: list[Node], at: dict[str, float]) -> np.ndarray:
    return compared(np.array(evaluate(G, at), object).reshape(len(m.n), -1), m.scale)


def _nearby(
    m: Mechanics, G: list[Node], at: dict[str, float], step: np.ndarray, which: np.ndarray
) -> np.ndarray | None:
    """Rows at the closed position near a step away; None if none is found."""
    names = [s.data.name for s in m.x.q]
    for _ in range(PASSES):
        T = np.array(evaluate(list(m.x.T.ravel()), at), float).reshape(len(names), -1)
        for k, dq in zip(names, T @ step, strict=True):
            at[k] += float(dq)
        A = np.array(evaluate(G, at), float).reshape(len(m.n), -1)[which]
        g = gaps(np.array(evaluate(list(m.g[which]), at), float), A, m.scale)
        if np.abs(g).max() < CLOSED * m.values.length:
            return _rows(m, G, at)[which]
        step = m.scale * np.linalg.lstsq(compared(A, m.scale), -g, rcond=TOLERANCE)[0]
    return None


def _lost(m: Mechanics, now: np.ndarray, there: np.ndarray, which: np.ndarray) -> str:
    """Elements whose rows take part in dependencies that are not there nearby."""
    here, span = parts(now).dependencies, parts(there).span
    part = np.abs(here @ (here.T @ span)).max(axis=1)
    s = m.values.structure
    of = [*(r.element.name for r in s.rows), *s.prescribed]
    return ", ".join(dict.fromkeys(of[k] for k, x in zip(which, part, strict=True) if x > 1e-3))
