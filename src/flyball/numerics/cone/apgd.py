"""Accelerated projected gradient descent as published: Mazhar, Heyn, Negrut and Tasora 2015, algorithm 1."""

from __future__ import annotations

from ...compiler.door import door
from .accelerated import accelerated


@door
def apgd(P, X, W, O, F, task):  # type: ignore[no-untyped-def]
    """Iterations until a step would change velocities by less than `ENOUGH`, at most `MOST`; how many there were."""
    return accelerated(P, X, W, O, -1.0, (True, 2.0, 0.9, 1.0 + 1e-9))
