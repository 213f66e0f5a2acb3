"""Determinants of sparse matrices of polynomials, without a division: Laplace's expansion, every minor once."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ...errors import ModelError

ORDER = 24  # rows
TERMS = 20_000  # of a polynomial


def determinant(rows: Sequence[Sequence[Any]], ring: Any, what: str) -> Any:
    """Determinant of a matrix of polynomials.

    Expanded by rows, those with few entries first; minors that come again are known. Nothing is divided, so no
    coefficient grows beyond those of the minors themselves.

    Parameters
    ----------
    rows : sequence (n) of sequences (n) of polynomials
    ring : Ring
    what : str
        Whose it is, for messages.

    Raises
    ------
    ModelError
        If it is too large, with the size met.
    """
    n = len(rows)
    if n > ORDER:
        raise ModelError(
            f"the linear equations of {what} are {n} with their constraints, and transfer functions with symbols are "
            f"found up to {ORDER}: ask for numbers (linearize)"
        )
    order = sorted(range(n), key=lambda k: sum(bool(x) for x in rows[k]))
    sparse = [[(j, x) for j, x in enumerate(rows[k]) if x] for k in order]
    known: dict[int, Any] = {}

    def minor(k: int, used: int) -> Any:
        if k == n:
            return ring.ring.one
        found = known.get(used)
        if found is None:
            found = ring.ring.zero
            for j, x in sparse[k]:
                if not used >> j & 1:
                    rest = minor(k + 1, used | 1 << j)
                    if rest:
                        free_before = j - (used & ((1 << j) - 1)).bit_count()
                        found += -x * rest if free_before % 2 else x * rest
            found = known[used] = ring.reduced(found)
            if len(found) > TERMS:
                raise ModelError(
                    f"the determinant of the linear equations of {what} has minors of {len(found)} terms, and "
                    f"transfer functions with symbols are found up to {TERMS}: give numbers for some parameters, or "
                    f"ask for numbers (linearize)"
                )
        return found

    value = minor(0, 0)
    return -value if odd(order) else value


def odd(order: Sequence[int]) -> bool:
    """Whether a permutation is odd."""
    seen: set[int] = set()
    swaps = 0
    for start in range(len(order)):
        k, length = start, 0
        while k not in seen:
            seen.add(k)
            k = order[k]
            length += 1
        swaps += max(length - 1, 0)
    return swaps % 2 == 1
