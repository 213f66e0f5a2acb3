"""Sums of terms: a number times powers of atoms times a sine or cosine of a sum of angles.

    terms = {(powers, waves): number},  powers = ((atom, exponent), ...),  waves = ((kind, angle), ...)
    angle = ((atom, factor), ...)

Atoms are nodes of a graph, identified by their index. An expanded term contains at most one wave (sine or
cosine), since a product of two is a sum of two. Both tuples are sorted, so that equal terms have equal keys. Sums
of squares that equal one, as of the components of a unit quaternion, are used to shorten sums of terms. Sums of
sines and cosines are contracted to products where that gives fewer terms:

    cos a + cos b = 2 cos((a+b)/2) cos((a-b)/2),    1 + cos 2a = 2 cos^2 a,    and so on
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence
from typing import Any

from ..graph import Graph, Node

COS, SIN = 0, 1
CONSTANT_ATOM = -1  # stands for the constant in an angle

Powers = tuple[tuple[int, int], ...]
Angle = tuple[tuple[int, float], ...]
Wave = tuple[int, Angle]
Key = tuple[Powers, tuple[Wave, ...]]
Terms = dict[Key, float]

CONSTANT_TERM: Key = ((), ())
ROUNDING = 1e-14
"""Relative size below which a difference of numbers is rounding."""


def add_term(out: Terms, key: Key, c: float) -> None:
    """Add a term; a term that cancels to rounding is removed."""
    old = out.get(key)
    if old is None:
        if c != 0.0:
            out[key] = c
        return
    new = old + c
    if abs(new) <= ROUNDING * max(abs(old), abs(c)):
        del out[key]
    else:
        out[key] = new


def sum_of_terms(a: Terms, b: Terms) -> Terms:
    """Sum."""
    out = dict(a)
    for key, c in b.items():
        add_term(out, key, c)
    return out


def scaled_terms(a: Terms, c: float) -> Terms:
    """Product with a number."""
    return {key: c * x for key, x in a.items()} if c != 0.0 else {}


def powers_product(a: Powers, b: Powers) -> Powers:
    """Product of powers of atoms."""
    if not a:
        return b
    if not b:
        return a
    found = dict(a)
    for atom, n in b:
        n += found.get(atom, 0)
        if n:
            found[atom] = n
        else:
            found.pop(atom, None)
    return tuple(sorted(found.items()))


def inverse_powers(a: Powers) -> Powers:
    """One over powers of atoms."""
    return tuple((atom, -n) for atom, n in a)


def normalised_angle(angle: dict[int, float]) -> tuple[Angle, float]:
    """An angle with its first factor positive, and the sign that was extracted: 1 or -1."""
    items = sorted((k, c) for k, c in angle.items() if c != 0.0)
    if items and items[1 if items[0][0] == CONSTANT_ATOM and len(items) > 1 else 0][1] < 0.0:
        return tuple((k, -c) for k, c in items), -1.0
    return tuple(items), 1.0


def angle_combination(a: Angle, b: Angle, sign: float) -> dict[int, float]:
    """Sum a + b or difference a - b."""
    out = dict(a)
    for k, c in b:
        old = out.get(k, 0.0)
        new = old + sign * c
        out[k] = 0.0 if abs(new) <= ROUNDING * abs(old) else new
    return out


def wave(kind: int, angle: dict[int, float]) -> tuple[tuple[Wave, ...], float]:
    """Cosine or sine of an angle, as waves and a factor; a number for angle zero."""
    found, sign = normalised_angle(angle)
    if not found:
        return (), 1.0 if kind == COS else 0.0
    return ((kind, found),), 1.0 if kind == COS else sign


def wave_product(a: Wave, b: Wave) -> list[tuple[tuple[Wave, ...], float]]:
    """Product of two waves as a sum of two.

    2 cos a cos b = cos(a-b) + cos(a+b), 2 sin a sin b = cos(a-b) - cos(a+b), 2 sin a cos b = sin(a+b) + sin(a-b).
    """
    (i, x), (j, y) = a, b
    if i == COS and j == SIN:
        (i, x), (j, y) = (j, y), (i, x)
    kind = COS if i == j else SIN
    less, more = wave(kind, angle_combination(x, y, -1.0)), wave(kind, angle_combination(x, y, 1.0))
    sign = -0.5 if i == j == SIN else 0.5
    return [(less[0], 0.5 * less[1]), (more[0], sign * more[1])]


def product_of_terms(a: Terms, b: Terms) -> Terms:
    """Expanded product; each term of the factors has at most one wave."""
    out: Terms = {}
    for (p, u), c in a.items():
        for (r, w), d in b.items():
            powers = powers_product(p, r)
            if u and w:
                for waves, e in wave_product(u[0], w[0]):
                    add_term(out, (powers, waves), c * d * e)
            else:
                add_term(out, (powers, u or w), c * d)
    return out


def ratio_of_terms(a: Terms, b: Terms) -> tuple[Powers, float] | None:
    """Powers and number whose product with ``b`` is ``a``; None if there are none."""
    if len(a) != len(b) or not b:
        return None
    if len(b) == 1:
        ((p, u), c), ((r, w), d) = next(iter(a.items())), next(iter(b.items()))
        return (powers_product(p, inverse_powers(r)), c / d) if u == w else None
    (p, u), c = min(a.items())
    for (r, w), d in b.items():
        if w == u:
            ratio, number = powers_product(p, inverse_powers(r)), c / d
            moved = {(powers_product(q, ratio), v): number * e for (q, v), e in b.items()}
            if moved.keys() == a.keys() and all(abs(moved[k] - a[k]) <= ROUNDING * abs(a[k]) for k in a):
                return ratio, number
    return None


SQUARE = 2


def without_squares(terms: Terms, units: Sequence[tuple[int, ...]]) -> Terms:
    """Eliminate squares of the first component of every unit vector, so that equal expressions become equal terms.

    Without this a product of rotations that is the identity remains a polynomial of the eighth degree.
    """
    for first, *others in units:
        high = [key for key in terms if any(k == first and n >= SQUARE for k, n in key[0])]
        while high:
            terms = dict(terms)
            for key in high:
                powers, waves = key
                c = terms.pop(key)
                lower = powers_product(powers, ((first, -SQUARE),))
                add_term(terms, (lower, waves), c)
                for k in others:
                    add_term(terms, (powers_product(lower, ((k, SQUARE),)), waves), -c)
            high = [key for key in terms if any(k == first and n >= SQUARE for k, n in key[0])]
    return terms


def shortened_by_unit_norms(terms: Terms, units: Sequence[tuple[int, ...]]) -> Terms:
    """Add multiples of x^2 + y^2 + ... - 1 where that leaves fewer terms; ``units`` are indices of x, y, ..."""
    for unit in units:
        for _ in range(4):  # repeated for higher orders
            change = _unit_norm_change(terms, unit)
            if not change:
                break
            terms = sum_of_terms(terms, change)
    return terms


def _unit_norm_change(terms: Terms, unit: tuple[int, ...]) -> Terms:
    """Terms to add: for each cofactor of a square of the unit vector, the multiple that leaves the fewest terms."""
    members: dict[Key, list[int]] = defaultdict(list)
    for powers, waves in terms:
        for k, n in powers:
            if k in unit and n >= SQUARE:
                members[powers_product(powers, ((k, -SQUARE),)), waves].append(k)
    change: Terms = {}
    for (powers, waves), found in members.items():
        if len(found) < 2:
            continue
        keys: list[tuple[Powers, float]] = [(powers_product(powers, ((k, SQUARE),)), 1.0) for k in unit]
        keys.append((powers, -1.0))
        own = [terms.get((p, waves), 0.0) for p, _ in keys]
        if any((p, waves) in change for p, _ in keys):
            continue
        best, fewest = 0.0, sum(1 for c in own if c)
        for c, (_, sign) in zip(own, keys, strict=True):
            left = sum(1 for d, (_, s) in zip(own, keys, strict=True) if abs(d - c * sign * s) > 1e-14 * abs(c))
            if c and left < fewest:
                best, fewest = c * sign, left
        if best:
            for p, sign in keys:
                add_term(change, (p, waves), -best * sign)
    return change


Product = tuple[float, Powers, tuple[Wave, ...]]
"""A term with any number of waves."""


def wave_node(graph: Graph, w: Wave) -> Node:
    """A wave as a node."""
    kind, angle = w
    total: Any = 0.0
    for k, c in sorted(angle, key=lambda item: (item[0] == CONSTANT_ATOM, item[0])):
        total = total + (c if k == CONSTANT_ATOM else c * graph.nodes[k])
    return graph.function("cos" if kind == COS else "sin", total)


def contracted_waves(terms: Terms) -> list[Product]:
    """Contract pairs of waves to products as long as possible; the simplest results first."""
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


def combined_phases(terms: Terms) -> Terms:
    """Combine a cos u + b sin u to one wave c cos(u - p) or c sin(u - p), if p is an exact number."""
    out = dict(terms)
    for powers, waves in terms:
        sine = (powers, ((SIN, waves[0][1]),)) if waves and waves[0][0] == COS else None
        if sine in terms and sine is not None and math.isfinite(terms[powers, waves] + terms[sine]):
            a, b = terms[powers, waves], terms[sine]
            whole = math.atan2(b, a)
            quarter = round(whole / (0.5 * math.pi))
            phase = _exact_phase(whole - quarter * 0.5 * math.pi)
            if phase is not None:
                del out[powers, waves], out[sine]
                angle = (*waves[0][1], *(((CONSTANT_ATOM, -phase),) if phase else ()))
                kind, sign = ((COS, 1.0), (SIN, 1.0), (COS, -1.0), (SIN, -1.0))[quarter % 4]
                out[powers, ((kind, angle),)] = sign * math.hypot(a, b)
    return out


def _exact_phase(phase: float) -> float | None:
    """Fraction of pi or short decimal that equals a phase within rounding; None if there is none."""
    part = round(phase * 48.0 / math.pi) * math.pi / 48.0
    short = float(f"{phase:.5g}")
    return next((x for x in (part, short) if abs(x - phase) < ROUNDING), None)


def double_angles(terms: Terms) -> list[Product]:
    """Replace sin 2a by 2 sin a cos a."""
    out: list[Product] = []
    for (powers, waves), c in sorted(terms.items()):
        half = _half_angle(dict(waves[0][1])) if waves and waves[0][0] == SIN else None
        if half is None:
            out.append((c, powers, waves))
        else:
            out.append((2.0 * c * half[1], powers, ((COS, half[0]), (SIN, half[0]))))
    return out


def _pairs(remaining: dict[int, Product]) -> list[tuple[float, int, int, Product]]:
    """Pairs of terms that contract to one term, the simplest first."""
    alike: dict[Any, list[tuple[int, Wave | None]]] = defaultdict(list)
    for n, (c, powers, waves) in remaining.items():
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
                made = _wave_pair_product(remaining[i][0], u, remaining[j][0], w)
                if made is not None:
                    c, two = made
                    found.append((_waves_cost(two), min(i, j), max(i, j), (c, powers, tuple(sorted(rest + two)))))
    return sorted(found)


def _waves_cost(waves: tuple[Wave, ...]) -> float:
    return sum(abs(c) + 1.0 for _, angle in waves for _, c in angle)


def _wave_pair_product(c: float, u: Wave | None, d: float, w: Wave | None) -> tuple[float, tuple[Wave, ...]] | None:
    """c u + d w as one product, if |c| = |d| and the half angles have integer factors."""
    a, b = u or (COS, ()), w or (COS, ())
    if a[0] != b[0] or abs(abs(c) - abs(d)) > ROUNDING * abs(c):
        return None
    half = _half_angle(angle_combination(a[1], b[1], 1.0)), _half_angle(angle_combination(a[1], b[1], -1.0))
    if half[0] is None or half[1] is None:
        return None
    (p, turn_p), (m, turn_m) = half[0], half[1]
    if u and w and _waves_cost(((COS, p), (COS, m))) > _waves_cost((u, w)):  # cos 2a + cos 2b is kept
        return None
    same = (c > 0.0) == (d > 0.0)
    if a[0] == COS:
        kinds, factor = ((COS, COS), 2.0 * c) if same else ((SIN, SIN), -2.0 * c)
    else:
        kinds, factor = ((SIN, COS), 2.0 * c) if same else ((COS, SIN), 2.0 * c)
    factor *= (turn_p if kinds[0] == SIN else 1.0) * (turn_m if kinds[1] == SIN else 1.0)
    return factor, ((kinds[0], p), (kinds[1], m))


def _half_angle(angle: dict[int, float]) -> tuple[Angle, float] | None:
    """Half of an angle, if its factors stay integers and it is not zero; else None."""
    if any(k != CONSTANT_ATOM and (0.5 * c) % 1.0 for k, c in angle.items()):
        return None
    found, sign = normalised_angle({k: 0.5 * c for k, c in angle.items()})
    return (found, sign) if found else None
