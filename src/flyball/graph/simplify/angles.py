"""Sums of sines and cosines of sums of angles taken together to products, where that makes fewer terms.

cos a + cos b = 2 cos((a+b)/2) cos((a-b)/2),    1 + cos 2a = 2 cos^2 a,    and so on
"""

from __future__ import annotations

import math
from collections import defaultdict
from typing import Any

from ..node import Graph, Node
from .terms import COS, ONE, ROUNDING, SIN, Angle, Powers, Terms, Wave, combined, turned

Product = tuple[float, Powers, tuple[Wave, ...]]
"""A term with any number of waves."""


def opened(graph: Graph, w: Wave) -> Node:
    """A wave as a node."""
    kind, angle = w
    total: Any = 0.0
    for k, c in sorted(angle, key=lambda item: (item[0] == ONE, item[0])):
        total = total + (c if k == ONE else c * graph.nodes[k])
    return graph.function("cos" if kind == COS else "sin", total)


def contracted(terms: Terms) -> list[Product]:
    """Terms with pairs taken together as long as there are any; the simplest results first."""
    left = {n: (c, powers, waves) for n, ((powers, waves), c) in enumerate(sorted(terms.items()))}
    fresh = len(left)
    while True:
        found = _pairs(left)
        if not found:
            return list(left.values())
        gone: set[int] = set()
        for _, i, j, made in found:
            if i not in gone and j not in gone:
                gone |= {i, j}
                del left[i], left[j]
                left[fresh] = made
                fresh += 1


def phased(terms: Terms) -> Terms:
    """Terms with a cos u + b sin u as one wave, c cos(u - p) or c sin(u - p), where p is a number that one knows."""
    out = dict(terms)
    for powers, waves in terms:
        sine = (powers, ((SIN, waves[0][1]),)) if waves and waves[0][0] == COS else None
        if sine in terms and sine is not None and math.isfinite(terms[powers, waves] + terms[sine]):
            a, b = terms[powers, waves], terms[sine]
            whole = math.atan2(b, a)
            quarter = round(whole / (0.5 * math.pi))
            phase = _known(whole - quarter * 0.5 * math.pi)
            if phase is not None:
                del out[powers, waves], out[sine]
                angle = (*waves[0][1], *(((ONE, -phase),) if phase else ()))
                kind, sign = ((COS, 1.0), (SIN, 1.0), (COS, -1.0), (SIN, -1.0))[quarter % 4]
                out[powers, ((kind, angle),)] = sign * math.hypot(a, b)
    return out


def _known(phase: float) -> float | None:
    """A part of pi or a short decimal that a phase is, but for rounding."""
    part = round(phase * 48.0 / math.pi) * math.pi / 48.0
    short = float(f"{phase:.5g}")
    return next((x for x in (part, short) if abs(x - phase) < ROUNDING), None)


def doubled(terms: Terms) -> list[Product]:
    """Terms with 2 sin a cos a in place of sin 2a."""
    out: list[Product] = []
    for (powers, waves), c in sorted(terms.items()):
        half = _halved(dict(waves[0][1])) if waves and waves[0][0] == SIN else None
        if half is None:
            out.append((c, powers, waves))
        else:
            out.append((2.0 * c * half[1], powers, ((COS, half[0]), (SIN, half[0]))))
    return out


def _pairs(left: dict[int, Product]) -> list[tuple[float, int, int, Product]]:
    """Pairs that become one term, the simplest first."""
    alike: dict[Any, list[tuple[int, Wave | None]]] = defaultdict(list)
    for n, (c, powers, waves) in left.items():
        number = f"{abs(c):.12e}"
        for k, own in enumerate(waves):
            if k == 0 or waves[k - 1] != own:
                alike[powers, waves[:k] + waves[k + 1 :], number].append((n, own))
        alike[powers, waves, number].append((n, None))
    found: list[tuple[float, int, int, Product]] = []
    for (powers, rest, _), members in alike.items():
        if len(members) > 40:
            continue
        for a, (i, u) in enumerate(members):
            for j, w in members[:a]:
                if i == j or (u is None and w is None):
                    continue
                made = _product(left[i][0], u, left[j][0], w)
                if made is not None:
                    c, two = made
                    found.append((_size(two), min(i, j), max(i, j), (c, powers, tuple(sorted(rest + two)))))
    return sorted(found)


def _size(waves: tuple[Wave, ...]) -> float:
    return sum(abs(c) + 1.0 for _, angle in waves for _, c in angle)


def _product(c: float, u: Wave | None, d: float, w: Wave | None) -> tuple[float, tuple[Wave, ...]] | None:
    """C u + d w as one product, where |c| = |d| and the halves of the angles are whole."""
    a, b = u or (COS, ()), w or (COS, ())
    if a[0] != b[0] or abs(abs(c) - abs(d)) > ROUNDING * abs(c):
        return None
    half = _halved(combined(a[1], b[1], 1.0)), _halved(combined(a[1], b[1], -1.0))
    if half[0] is None or half[1] is None:
        return None
    (p, turn_p), (m, turn_m) = half[0], half[1]
    if u and w and _size(((COS, p), (COS, m))) > _size((u, w)):  # cos 2a + cos 2b stays
        return None
    same = (c > 0.0) == (d > 0.0)
    if a[0] == COS:
        kinds, factor = ((COS, COS), 2.0 * c) if same else ((SIN, SIN), -2.0 * c)
    else:
        kinds, factor = ((SIN, COS), 2.0 * c) if same else ((COS, SIN), 2.0 * c)
    factor *= (turn_p if kinds[0] == SIN else 1.0) * (turn_m if kinds[1] == SIN else 1.0)
    return factor, ((kinds[0], p), (kinds[1], m))


def _halved(angle: dict[int, float]) -> tuple[Angle, float] | None:
    """Half an angle, if what it is made of stays whole and is something."""
    if any(k != ONE and (0.5 * c) % 1.0 for k, c in angle.items()):
        return None
    found, sign = turned({k: 0.5 * c for k, c in angle.items()})
    return (found, sign) if found else None
