"""Swings across a corner that come ever faster, and rest on it: where u and du/dt are zero, and sides move d^2u/dt^2.

A relay -sign(x) keeps on swinging; with friction -sign(v) beside it each pair of swings is shorter than the one before
by the same ratio, and after a finite time x and v are zero (the twisting algorithm: Levant, *International Journal of
Control* 58, 1993). Where the swings have become lower than rounding the rest of the series is taken at once.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ....equations.instant import SILENT, STILL
from ....equations.rows import measured
from ....laws.evaluation import evaluate_jet
from .instant import REST, Instant
from .rest import LOW

SERIES = 4  # ways through a corner that tell whether swings get shorter
SHORTER = 0.999  # ratio of two swings and the two before them: a series with an end


class Corner(NamedTuple):
    """A function u whose sign a law asks for, at the state last evaluated.

    Attributes
    ----------
    row : ndarray (nv,)
        Slopes of its rate by velocities.
    rates : bool
        Whether u depends on rates, so that ``row`` is of u itself, and du/dt of accelerations.
    size : float
        The mechanism's length, or a radian, in units of u; with rates those at the rate `instant.slowest`.
    still : float
        Rounding of what ``row`` is the slope of.
    grain : float
        Rounding of u.
    """

    row: np.ndarray
    rates: bool
    size: float
    still: float
    grain: float


def jet(n: Instant, s: int, seed: int) -> tuple[float, float, float]:
    """The u of a corner and its derivatives, by what ``seed`` says (`laws.evaluation.evaluate_jet`)."""
    law = int(n.S.switches.law[s])
    return evaluate_jet(n.S.code, n.S.const, law, n.W.stack, n.here.t, n.W.sensed, seed)


def seen(n: Instant, s: int) -> Corner:
    """The corner of switch s."""
    S, W, v = n.S, n.W, n.here.v
    nm, nr = measured(S), len(S.rows.law)
    terms, rows = n.here.structure.terms, len(n.here.structure.rows)
    measures = {x.row - rows: x.formula.measure for x in terms if x.measured}
    slopes = np.array([jet(n, s, m)[1] for m in range(2 * nm)])
    rates = bool(slopes[nm:].any())
    row, size, still = np.zeros(n.here.structure.nv), 0.0, 0.0
    for m in range(nm):
        slope = slopes[nm + m] if rates else slopes[m]
        unit = n.here.c.values.length if measures.get(m) == "m" else 1.0
        at = slice(S.row_start[nr + m], S.row_start[nr + m + 1])
        G = np.abs(W.G[at])
        row[S.column[at]] += slope * W.G[at]
        size += abs(slope) * unit
        rounding = STILL * (G @ np.abs(v[S.column[at]])) + SILENT * G.sum() * np.abs(v).max(initial=0.0)
        still += abs(slope) * (REST * unit * n.pace + rounding)
    return Corner(row, rates, size * n.pace if rates else size, still, still if rates else LOW * size)


def note(n: Instant, s: int) -> None:
    """Keep in mind that the motion passes the corner of switch s now."""
    past = n.here.swings.setdefault(s, [])
    if not past or n.here.t > past[-1]:
        past.append(n.here.t)
        del past[:-SERIES]


def remaining(n: Instant, s: int) -> float:
    """How long [s] all swings to come last together, by those of late; nan if they do not get shorter.

    Swings to one side and to the other are two series of one ratio.
    """
    past = n.here.swings.get(s, [])
    if len(past) < SERIES:
        return np.nan
    a, b, c = np.diff(past)
    ratio = c / a
    return float(ratio * (b + c) / (1.0 - ratio)) if ratio < SHORTER else np.nan


def low(n: Instant, s: int, rate: float, acceleration: float) -> bool:
    """Whether the next swing is none: its height, rate^2 / (2 acceleration), is rounding."""
    return rate * rate <= 2.0 * acceleration * LOW * seen(n, s).size


def halt(n: Instant, rows: np.ndarray, misses: np.ndarray) -> None:
    """Take from the velocities what row v is too much, by the smallest change in the metric of the masses."""
    Y = np.column_stack([n.response(row)[0] for row in rows])
    n.here.v[:] -= Y @ np.linalg.lstsq(rows @ Y, misses, rcond=1e-9)[0]


def shared(B: np.ndarray) -> np.ndarray:
    """Sides by rates, the inverse of B; where B is singular they bear in proportion to what they can."""
    scale = 1.0 / np.maximum(np.abs(B).max(axis=1), 1e-300)
    N = scale[:, None] * B
    most = np.linalg.norm(N, axis=0)
    W = 1.0 / np.maximum(most, 1e-300)
    return np.asarray(W[:, None] * N.T @ np.linalg.pinv((N * W) @ N.T, rcond=1e-9) * scale)
