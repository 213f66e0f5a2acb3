"""Sums of squares that are one, as of the parts of a unit quaternion: told by whoever knows."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence

from .terms import Key, Powers, Terms, plus, powers_product, put

SQUARE = 2


def reduced(terms: Terms, units: Sequence[tuple[int, ...]]) -> Terms:
    """Terms in which the first of every unit has no square: equal ones are then seen to be equal.

    Without this a product of rotations that is the identity stays a polynomial of the eighth degree.
    """
    for first, *others in units:
        high = [key for key in terms if any(k == first and n >= SQUARE for k, n in key[0])]
        while high:
            terms = dict(terms)
            for key in high:
                powers, waves = key
                c = terms.pop(key)
                lower = powers_product(powers, ((first, -SQUARE),))
                put(terms, (lower, waves), c)
                for k in others:
                    put(terms, (powers_product(lower, ((k, SQUARE),)), waves), -c)
            high = [key for key in terms if any(k == first and n >= SQUARE for k, n in key[0])]
    return terms


def shortened(terms: Terms, units: Sequence[tuple[int, ...]]) -> Terms:
    """Terms with multiples of x^2 + y^2 + ... - 1 added where fewer are left; ``units`` are indices of x, y, ..."""
    for unit in units:
        for _ in range(4):  # of higher order once more
            change = _change(terms, unit)
            if not change:
                break
            terms = plus(terms, change)
    return terms


def _change(terms: Terms, unit: tuple[int, ...]) -> Terms:
    """What to add: for each product that a square of the unit's stands at, the multiple that leaves the fewest."""
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
                put(change, (p, waves), -best * sign)
    return change
