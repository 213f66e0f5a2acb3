"""States that users hand over, as arrays: one state or many, real and finite, of the right length."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..errors import AnalysisError, ModelError
from ..tables.table_definitions import FREE, SPHERICAL, Tree

Array = np.ndarray


def state_rows(given: Sequence[tuple[str, Any, int]], owner: str) -> tuple[list[Array], int | None]:
    """Arguments as float arrays (k, n), each row contiguous, and the number of states: None for one.

    An argument with one state is repeated for the states of the others. The arrays may be those given.

    Parameters
    ----------
    given : sequence of (str, array_like, int)
        Name, value, and length of one state.
    owner : str
        Name of the mechanism, for messages.

    Raises
    ------
    ModelError
        If numbers are not real and finite, a shape does not fit, or numbers of states differ.
    """
    arrays, k = [], None
    for name, value, n in given:
        found = np.asarray(value)
        if found.dtype.kind not in "iuf":
            raise ModelError(f"{name} contains {found.dtype.name} numbers; coordinates, velocities and forces are real")
        if found.ndim not in (1, 2) or found.shape[-1] != n:
            raise ModelError(
                f"{name} has the shape {found.shape}; {owner!r} has {n} numbers there in these coordinates: ({n},) for "
                f"one state, (k, {n}) for k states"
            )
        if not is_finite(found):
            raise ModelError(f"{name} of {owner!r} is not finite")
        if found.ndim == 2:
            if k not in (None, len(found)):
                raise ModelError(f"{name} has {len(found)} states, and the arguments before it {k}")
            k = len(found)
        arrays.append(found)
    rows = 1 if k is None else k
    return [
        np.ascontiguousarray(np.broadcast_to(x, (rows, x.shape[-1])) if x.ndim == 1 else x, np.float64) for x in arrays
    ], k


def is_finite(x: Array) -> bool:
    """Whether all numbers are finite."""
    return math.isfinite(np.add.reduce(x, axis=None)) or bool(np.isfinite(x).all())  # the sum may overflow


def refuse_overflow(results: Sequence[Array], owner: str) -> None:
    """Refuse results (k, ...) that are not finite numbers.

    Raises
    ------
    AnalysisError
        With the first state that has such results.
    """
    for x in results:
        flat = x.reshape(-1)
        if not math.isfinite(flat.dot(flat)) and not (finite := np.isfinite(x).reshape(len(x), -1).all(axis=1)).all():
            raise AnalysisError(
                f"{owner!r}: the results at state {int(np.argmin(finite))} are not finite: coordinates, velocities, "
                f"accelerations or forces there are so large that products of them overflow"
            )


def quaternion_places(tree: Tree) -> list[tuple[int, int]]:
    """Of each quaternion among the coordinates: its first entry, and the first velocity of its body or joint."""
    turning = np.flatnonzero((tree.joint == FREE) | (tree.joint == SPHERICAL)).tolist()
    return [(int(tree.q[b]) + (3 if tree.joint[b] == FREE else 0), int(tree.v[b])) for b in turning]


def refuse_zero_quaternions(q: Array, places: Sequence[tuple[int, int]], names: Sequence[str]) -> None:
    """Refuse quaternions without direction in rows of coordinates (k, nq).

    Raises
    ------
    ModelError
    """
    for at, d in places:
        if not np.all(np.any(q[:, at : at + 4] != 0.0, axis=1)):
            raise ModelError(f"q[{at}:{at + 4}], the quaternion beside {names[d]!r}, is zero; it must be a rotation")
