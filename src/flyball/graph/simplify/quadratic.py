"""Quadratic forms with numbers for factors, as squares and products of sums: a^2 + 2 a b + b^2 = (a + b)^2.

What is of lower order is one of second order by way of an atom that is one.
"""

from __future__ import annotations

import math

Term = tuple[float, dict[int, int]]
NEAR = 1e-12  # of the two numbers whose difference it is: what may be none, if the product proves it
ROUNDED = 2e-15  # of the very same coefficient: what the product may differ by
ONE = -1  # an atom for what is no power of any


def as_product(terms: list[Term]) -> tuple[list[Term], list[Term]] | None:
    """Two sums whose product a sum is, if all its terms are of second order and there are two such sums.

    As a polynomial of one of the atoms it is a x^2 + b x + c, whose factors are real sums where b^2 - 4 a c is the
    square of a sum.
    """
    if len(terms) < 3 or len(terms) > 36:
        return None
    form: dict[tuple[int, int], float] = {}
    for c, p in terms:
        if any(n < 0 for n in p.values()) or sum(p.values()) > 2:
            return None
        i, j = sorted([k for k, n in p.items() for _ in range(n)] + [ONE] * (2 - sum(p.values())))
        form[i, j] = form.get((i, j), 0.0) + c
    atoms = sorted({k for pair in form for k in pair})
    if len(atoms) > 8:
        return None
    found = next((f for k in reversed(atoms) if (f := _by(form, atoms, k)) is not None), None)
    if found is None:
        return None
    if not _proved(form, *found):
        return None
    first, second = ([(c, {k: 1} if k != ONE else {}) for k, c in s.items() if c != 0.0] for s in found)
    return (first, second) if len(first) > 1 or len(second) > 1 else None


Line = dict[int, float]


def _by(form: dict[tuple[int, int], float], atoms: list[int], k: int) -> tuple[Line, Line] | None:
    """Factors of the form as a polynomial of atom k."""
    a = form.get((k, k), 0.0)
    if a == 0.0:
        return None
    rest = [i for i in atoms if i != k]
    b = {i: form.get((min(i, k), max(i, k)), 0.0) for i in rest}
    square: dict[tuple[int, int], float] = {}
    for n, i in enumerate(rest):
        for j in rest[n:]:
            cross = b[i] * b[j] * (1.0 if i == j else 2.0)
            less = 4.0 * a * form.get((i, j), 0.0)
            d = cross - less
            square[i, j] = 0.0 if abs(d) <= NEAR * (abs(cross) + abs(less)) else d
    root = _root(square, rest)
    if root is None:
        return None
    first, second = {k: a}, {k: 1.0}
    for i in rest:
        first[i], second[i] = _roots(a, b[i], root[i], form.get((i, i), 0.0))
    return _whole(first, second)


def _roots(a: float, b: float, root: float, c: float) -> tuple[float, float]:
    """The coefficients of an atom in both sums, whose product is c: the smaller by the larger one."""
    size = abs(b) + abs(root)
    if abs(b + root) >= abs(b - root):
        first = 0.5 * (b + root)
        return first, 0.5 * (b - root) / a if c == 0.0 and abs(b - root) > NEAR * size else c / first if first else 0.0
    second = 0.5 * (b - root) / a
    return 0.5 * (b + root) if c == 0.0 and abs(b + root) > NEAR * size else c / second, second


def _proved(form: dict[tuple[int, int], float], first: Line, second: Line) -> bool:
    """Whether the product of two sums is the form, each coefficient but for its own rounding.

    Coefficients of different atoms are not compared: they have different units.
    """
    atoms = sorted(first.keys() | second.keys())
    for n, i in enumerate(atoms):
        for j in atoms[n:]:
            parts = [first.get(i, 0.0) * second.get(j, 0.0)] + (
                [first.get(j, 0.0) * second.get(i, 0.0)] if i != j else []
            )
            wanted = form.get((i, j), 0.0)
            size = abs(wanted) if wanted else sum(map(abs, parts))
            if not abs(sum(parts) - wanted) <= ROUNDED * size:
                return False
    return True


def _root(square: dict[tuple[int, int], float], atoms: list[int]) -> Line | None:
    """The sum whose square a form is."""
    if any(square[i, i] < 0.0 for i in atoms):
        return None
    lead = next((i for i in atoms if square[i, i] > 0.0), None)
    if lead is None:
        return None if any(square.values()) else dict.fromkeys(atoms, 0.0)
    size = math.sqrt(square[lead, lead])
    line = {i: (square[min(i, lead), max(i, lead)] / (1.0 if i == lead else 2.0)) / size for i in atoms}
    for n, i in enumerate(atoms):
        for j in atoms[n:]:
            made = line[i] * line[j] * (1.0 if i == j else 2.0)
            if abs(made - square[i, j]) > 1e-11 * (abs(made) + abs(square[i, j])):
                return None
    return line


def _whole(first: Line, second: Line) -> tuple[Line, Line]:
    """Both with the smaller numbers: a factor that all of one have goes to the other where that leaves whole ones."""
    smallest = min(abs(c) for c in second.values() if c)
    if smallest < 1.0:
        first, second = {i: c * smallest for i, c in first.items()}, {i: c / smallest for i, c in second.items()}
    return first, second
