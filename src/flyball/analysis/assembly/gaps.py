"""Errors of a start that cannot be: which elements disagree, and by how much."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ...equations.records import load
from ...equations.rows import parameters
from ...errors import AssemblyError
from ..compiled import Compiled

PARTS = ("value", "force on M", "torque on M", "torque on F", "bias")  # that a row's formula returns
SHOWN = 8  # elements that a message names
SMALL = 1e-9  # part of the mechanism's length, or radians, below which a gap is none


def disagreement(c: Compiled, best: Any) -> AssemblyError:
    """The error that says which elements cannot be fulfilled together, worst first; ``best`` is the nearest start."""
    t = best.t
    c.at(t, best.q, best.v)
    g = c.work.rows.value
    name, length = c.structure.model.name, c.values.length
    lawless = [r.element for r, x in zip(c.structure.rows, g, strict=True) if r.law >= 0 and not np.isfinite(x)]
    if lawless:
        missed = c.structure.missed(c.work.stack)
        return AssemblyError(
            f"{name!r} cannot be assembled at t = {t:g} s: the law of {lawless[0].title} has no finite value there"
            f"{f': {missed.message}' if missed else ''}"
        )
    if text := undefined_row(c):
        return AssemblyError(f"{name!r} cannot be assembled at t = {t:g} s: {text}")
    gaps: dict[str, tuple[float, float]] = {}
    for element, rows in c.structure.slices.items():
        part, metric = g[rows], c.metric[rows]
        if len(part) and not np.abs(part / np.where(metric, length, 1.0)).max() < SMALL:
            gaps[element] = float(np.linalg.norm(part[metric])), float(np.linalg.norm(part[~metric]))
    worst = sorted(gaps, key=lambda k: -max(gaps[k][0] / length, gaps[k][1]))
    shown = "; ".join(f"{k} is {_size(*gaps[k], length)} from closed" for k in worst[:SHOWN])
    return AssemblyError(
        f"{name!r} cannot be assembled at t = {t:g} s: no position fulfils all constraints. At the best position found "
        f"{shown or 'rows disagree'}. Check lengths and the points of these joints, the drivers, and initial values, "
        f"or give a better guess",
        gaps={k: gaps[k] for k in worst},
        best=best,
    )


def undefined_row(c: Compiled) -> str:
    """The constraint row of a user's own that is not finite at the kinematics in the scratch; else nothing."""
    s, S, W = c.structure, c.values.system, c.work
    for k, t in enumerate(s.terms):
        if s.term_code[k] is None:
            continue
        par, F, M = parameters(S.term_parameters, k), load(W.FK, t.F), load(W.FK, t.M)
        with np.errstate(all="ignore"):
            row = t.formula.of_kind.row(par, F, M, 0.0, S.const)
        if not np.isfinite(np.hstack(row)).all():
            named = ", ".join(f"{name} {np.array(x)}" for name, x in zip(PARTS, row, strict=True))
            return (
                f"{type(t.formula).__name__}.row of {t.element.title} is not finite for par = {np.array(par[:6])} with "
                f"its frames at {np.array(F[0])} m and {np.array(M[0])} m: {named}"
            )
    return ""


def _size(metres: float, radians: float, length: float) -> str:
    parts = [
        f"{metres:.4g} m" if metres > SMALL * length else "",
        f"{np.degrees(radians):.4g} deg" if radians > SMALL else "",
    ]
    return " and ".join(x for x in parts if x)


def no_rate(c: Compiled, t: float) -> AssemblyError | None:
    """The error for a driver's law that has no finite rate at t; rows are those last evaluated."""
    for r, x in zip(c.structure.rows, c.work.rows.nu, strict=True):
        if not np.isfinite(x):
            return AssemblyError(
                f"{c.structure.model.name!r} cannot be assembled at t = {t:g} s: the law of {r.element.title} has the "
                f"rate {x:g} there. Give a law that is smooth at the start, or start later"
            )
    return None


def contradictory_velocities(c: Compiled, gaps: Mapping[str, float], best: Any, why: str = "") -> AssemblyError:
    """The error for constraints that no velocities fulfil together; ``gaps``: of the nearest [m/s or rad/s]."""
    begin = f"{c.structure.model.name!r}: no velocities fulfil all constraints at t = {best.t:g} s"
    if why:
        return AssemblyError(f"{begin}: {why}", gaps=dict(gaps), best=best)
    listed = ", ".join(f"{k} by {x:.4g} {rate_unit(c, k)}" for k, x in list(gaps.items())[:SHOWN])
    more = f" and {len(gaps) - SHOWN} more" if len(gaps) > SHOWN else ""
    return AssemblyError(
        f"{begin}; the nearest miss {listed}{more}. Check drivers, initial rates and bodies with as_drawn=True",
        gaps=dict(gaps),
        best=best,
    )


def rate_unit(c: Compiled, name: str) -> str:
    """What the rates of an element's rows are counted in."""
    rows = c.structure.slices.get(name)
    metric = c.metric[rows] if rows is not None else np.ones(1, bool)
    return "m/s" if metric.all() else "rad/s" if not metric.any() else "m/s or rad/s"
