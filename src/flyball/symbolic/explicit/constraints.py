"""All constraints of a mechanism in one list: rows, and coordinates of tree joints that drivers prescribe."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...equations.rows import BY_TIME
from ...graph.arrays import zeros
from ...laws.evaluation import evaluate_jet
from ...tracing.trace import Traced


@dataclass(frozen=True)
class Constraints:
    """Equations g = 0, G v = nu, G vdot = gamma as expressions.

    Attributes
    ----------
    elements : list of str
        Whose each is.
    holonomic : ndarray of bool
        Which are constraints on positions.
    """

    elements: list[str]
    holonomic: np.ndarray
    g: np.ndarray
    G: np.ndarray
    nu: np.ndarray
    gamma: np.ndarray


def constraints(x: Traced) -> Constraints:
    """Rows first, in the order of the multipliers, then prescribed coordinates."""
    s, S, W = x.structure, x.system, x.work
    there = len(x.g) > len(s.rows)  # prescribed coordinates are among the rows already
    n = 0 if there else len(s.prescribed)
    later = sorted(s.prescribed, key=lambda name: s.slices[name].start) if there else list(s.prescribed)
    G, g, nu, gamma = zeros(n, s.nv), zeros(n), zeros(n), zeros(n)
    for k, b in enumerate(s.prescribed[name] for name in later[:n]):
        law = S.tree.law[b]
        value, rate, second = evaluate_jet(S.code, S.const, law, W.stack, x.t, W.sensed, BY_TIME)
        G[k, S.tree.v[b]] = 1.0
        g[k] = x.q[S.tree.q[b]] - (value - S.bodies.offset[b])
        nu[k], gamma[k] = rate, second
    return Constraints(
        [r.element.name for r in s.rows] + later,
        np.array([r.holonomic for r in s.rows] + [True] * len(later), bool),
        np.concatenate([x.g, g]),
        np.concatenate([x.G.reshape(-1, s.nv), G]),
        np.concatenate([x.nu, nu]),
        np.concatenate([x.gamma, gamma]),
    )
