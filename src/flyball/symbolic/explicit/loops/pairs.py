"""Two equations for two unknowns that belong together: the dyads RRR and RPR, and a slide along a direction.

An Assur group of two links (dyad) closes in circles and straight lines (Artobolevsky 1951; Angeles and Bai 2022).
The equations of the house are point equations: two for the two directions of the plane.

    RRR   p + P e(w) + N e(v) = 0         |p + P e(w)|^2 = |N|^2
    RPR   (s N + L) e(w) + k = 0          |s N + L|^2 = |k|^2

e(w) = (cos w, sin w), N, P, L turn and stretch (or turn over): their columns are of one length and at right angles.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ....graph.derivative import tangents
from ....graph.node import Node
from ....math.scalar import atan2, cos, sin
from ..probe import Probe
from .circle import NotOfThisForm, affine, depends, without
from .single import Solution, of_harmonic, of_quadratic

Pair = tuple[Node, Node]
Matrix = np.ndarray


def slide(x: Pair, d: Sequence[Any], s: Node) -> tuple[Any, Solution]:
    """Of two equations p + d s = 0, in which d holds nothing unknown: the one without s, and s.

    Returns
    -------
    (Node, Solution)
        d_2 p_1 - d_1 p_2 = 0; s = -(d . p) / (d . d).
    """
    p = [without(e, s) for e in x]
    square = d[0] * d[0] + d[1] * d[1]
    return d[1] * p[0] - d[0] * p[1], Solution(
        -(d[0] * p[0] + d[1] * p[1]) / square, "along a direction", [square] if isinstance(square, Node) else []
    )


def dyad(x: Pair, w: tuple[Node, Node], probe: Probe) -> list[Solution]:
    """Two angles (RRR).

    Returns
    -------
    list of Solution
        Of the first and of the second, which holds the first.
    """
    read = [affine(e, w, probe) for e in x]
    p = np.array([k for k, _ in read], object)
    P, N = (np.array([factors[n] for _, factors in read], object) for n in range(2))
    square, reach = _turning(N, probe), _turning(P, probe)
    if square == 0.0 or reach == 0.0:
        raise NotOfThisForm
    A, B = (2.0 * (P[0, n] * p[0] + P[1, n] * p[1]) for n in range(2))
    C = p[0] * p[0] + p[1] * p[1] + reach - square
    first = of_harmonic((A, B, C), w[0], probe)
    first.how = f"dyad of two turning links: {first.how}"
    c, s = cos(w[0]), sin(w[0])
    r = [p[n] + P[n, 0] * c + P[n, 1] * s for n in range(2)]
    e = [-1.0 * (N[0, n] * r[0] + N[1, n] * r[1]) for n in range(2)]
    second = Solution(atan2(e[1], e[0]), "direction of the other link")
    second.radius = square  # |e| = |N| |r|, and |r| = |N|
    return [first, second]


def sliding(x: Pair, w: tuple[Node, Node], probe: Probe) -> list[Solution]:
    """An angle w[0] and a slide w[1] on the link that turns by it (RPR).

    Returns
    -------
    list of Solution
        Of the slide, then of the angle.
    """
    angle, s = w
    slopes = [tangents([e], [(s, 1.0)])[0] for e in x]
    if any(depends(d, s, probe) for d in slopes):
        raise NotOfThisForm
    along = [affine(without(x[0].graph.node(d), s), [angle], probe) for d in slopes]
    still = [affine(without(e, s), [angle], probe) for e in x]
    if any(not probe.zero(k, probe.size(e)) for (k, _), e in zip(along, x, strict=True)):
        raise NotOfThisForm
    N, L = (np.array([factors[0] for _, factors in read], object) for read in (along, still))
    k = [k for k, _ in still]
    nn, ll, mixed = _turning(N, probe), _turning(L, probe), _mixed(N, L, probe)
    if nn == 0.0:
        raise NotOfThisForm
    reach = k[0] * k[0] + k[1] * k[1]
    first = of_quadratic((nn, 2.0 * mixed, ll - reach), s, probe)
    first.how = f"slide on a turning link: {first.how}"
    T = s * N + L
    e = [-1.0 * (T[0, n] * k[0] + T[1, n] * k[1]) for n in range(2)]
    second = Solution(atan2(e[1], e[0]), "direction of the slide")
    second.radius = reach  # |e| = |T| |k|, and |T| = |k|
    return [first, second]


def _turning(N: Matrix, probe: Probe) -> Any:
    """The square by which N stretches; it must only turn (or turn over)."""
    a, b = N[0, 0] * N[0, 0] + N[1, 0] * N[1, 0], N[0, 1] * N[0, 1] + N[1, 1] * N[1, 1]
    if not probe.same(a, b, probe.size(a)) or not probe.zero(N[0, 0] * N[0, 1] + N[1, 0] * N[1, 1], probe.size(a)):
        raise NotOfThisForm
    return min(a, b, key=lambda y: y.index if isinstance(y, Node) else -1)


def _mixed(N: Matrix, L: Matrix, probe: Probe) -> Any:
    """Half of N^T L + L^T N, which must be a multiple of one."""
    a, b = (N[0, n] * L[0, n] + N[1, n] * L[1, n] for n in range(2))
    across = N[0, 0] * L[0, 1] + N[1, 0] * L[1, 1] + L[0, 0] * N[0, 1] + L[1, 0] * N[1, 1]
    size = max(probe.size(a), probe.size(b))
    if not probe.same(a, b, size) or not probe.zero(across, size):
        raise NotOfThisForm
    return a
