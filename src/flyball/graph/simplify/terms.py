"""Sums of terms: a number times powers of atoms times a sine or cosine of a sum of angles.

    terms = {(powers, waves): number},  powers = ((atom, exponent), ...),  waves = ((kind, angle), ...)
    angle = ((atom, factor), ...)

Atoms are nodes of a graph, by their index; what is multiplied out holds at most one wave a term, as a product of two is
a sum of two. Both are sorted, so that equal terms have equal keys.
"""

from __future__ import annotations

COS, SIN = 0, 1
ONE = -1  # in the place of an atom: the plain number in an angle

Powers = tuple[tuple[int, int], ...]
Angle = tuple[tuple[int, float], ...]
Wave = tuple[int, Angle]
Key = tuple[Powers, tuple[Wave, ...]]
Terms = dict[Key, float]

PLAIN: Key = ((), ())
ROUNDING = 1e-14
"""What is left of numbers that cancel, relative to them, is rounding."""


def put(out: Terms, key: Key, c: float) -> None:
    """Add a term; one that cancels to rounding is gone."""
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


def plus(a: Terms, b: Terms) -> Terms:
    """Sum."""
    out = dict(a)
    for key, c in b.items():
        put(out, key, c)
    return out


def scaled(a: Terms, c: float) -> Terms:
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


def inverse(a: Powers) -> Powers:
    """One over powers of atoms."""
    return tuple((atom, -n) for atom, n in a)


def turned(angle: dict[int, float]) -> tuple[Angle, float]:
    """An angle with its first factor positive, and whether it was turned round: 1 or -1."""
    items = sorted((k, c) for k, c in angle.items() if c != 0.0)
    if items and items[1 if items[0][0] == ONE and len(items) > 1 else 0][1] < 0.0:
        return tuple((k, -c) for k, c in items), -1.0
    return tuple(items), 1.0


def combined(a: Angle, b: Angle, sign: float) -> dict[int, float]:
    """A + b or a - b."""
    out = dict(a)
    for k, c in b:
        old = out.get(k, 0.0)
        new = old + sign * c
        out[k] = 0.0 if abs(new) <= ROUNDING * abs(old) else new
    return out


def wave(kind: int, angle: dict[int, float]) -> tuple[tuple[Wave, ...], float]:
    """Cosine or sine of an angle, as waves and a factor; that of nothing is a number."""
    found, sign = turned(angle)
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
    less, more = wave(kind, combined(x, y, -1.0)), wave(kind, combined(x, y, 1.0))
    sign = -0.5 if i == j == SIN else 0.5
    return [(less[0], 0.5 * less[1]), (more[0], sign * more[1])]


def times(a: Terms, b: Terms) -> Terms:
    """Product, multiplied out; each term of the factors has at most one wave."""
    out: Terms = {}
    for (p, u), c in a.items():
        for (r, w), d in b.items():
            powers = powers_product(p, r)
            if u and w:
                for waves, e in wave_product(u[0], w[0]):
                    put(out, (powers, waves), c * d * e)
            else:
                put(out, (powers, u or w), c * d)
    return out


def divided(a: Terms, b: Terms) -> tuple[Powers, float] | None:
    """The powers and the number by which ``a`` is ``b`` times them, if it is."""
    if len(a) != len(b) or not b:
        return None
    if len(b) == 1:
        ((p, u), c), ((r, w), d) = next(iter(a.items())), next(iter(b.items()))
        return (powers_product(p, inverse(r)), c / d) if u == w else None
    (p, u), c = min(a.items())
    for (r, w), d in b.items():
        if w == u:
            ratio, number = powers_product(p, inverse(r)), c / d
            moved = {(powers_product(q, ratio), v): number * e for (q, v), e in b.items()}
            if moved.keys() == a.keys() and all(abs(moved[k] - a[k]) <= ROUNDING * abs(a[k]) for k in a):
                return ratio, number
    return None
