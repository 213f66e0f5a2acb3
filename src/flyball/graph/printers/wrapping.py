"""Long formulas broken into lines, where that disturbs least: before terms that stand in few parentheses."""

from __future__ import annotations

from collections.abc import Callable


def wrapped(pieces: list[str], most: int, width: Callable[[str], int] = len) -> list[str]:
    """Pieces joined to lines of at most ``most`` letters where they are short enough.

    Parameters
    ----------
    pieces : list of str
        A line may be broken before each.
    most : int
    width : callable
        Letters of a piece.
    """
    depths = [0]
    for piece in pieces[:-1]:
        depths.append(depths[-1] + piece.count("(") - piece.count(")"))
    lines, start = [], 0
    while start < len(pieces):
        used, end = 0, start
        while end < len(pieces) and (end == start or used + width(pieces[end]) <= most):
            used += width(pieces[end])
            end += 1
        if end < len(pieces):
            end = _best(pieces[start : end + 1], depths[start : end + 1], most, width) + start
        lines.append("".join(pieces[start:end]))
        start = end
    return lines


def _best(pieces: list[str], depths: list[int], most: int, width: Callable[[str], int]) -> int:
    """Where to break: among the places that leave a line not short, the last of those in the fewest parentheses."""
    used, best, found = 0, (10**6, 0), len(pieces) - 1
    for k in range(1, len(pieces)):
        used += width(pieces[k - 1])
        rank = (depths[k] + (8 if 3 * used < most else 0), -k)
        if rank < best:
            best, found = rank, k
    return found
