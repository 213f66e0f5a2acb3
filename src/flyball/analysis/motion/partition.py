"""The first choice of independent coordinates, for coordinate partitioning; ``equations/partition.py`` changes it."""

from __future__ import annotations

import numpy as np

from ...model.model import Model
from ...tables.names import velocity_names
from ..mobility import mobility
from .start import Start


def choose(model: Model, start: Start) -> None:
    """Tell the compiled loop which coordinates depend on the others, and their sizes.

    As many as the rank at the start: those that QR with column pivoting takes first, lengths measured by the
    mechanism's and rows made unit vectors (Businger and Golub 1965).
    """
    from scipy.linalg import qr

    a = start.assembly
    c = a.compiled
    c.at(a.t, a.q, a.v)
    size = start.assembly.compiled.sizes
    tree = c.structure.tables["tree"]
    given = tree.v[tree.law >= 0]
    size[given] = 0.0
    G = c.jacobian() * size
    length = np.sqrt((G * G).sum(axis=1))
    G = G[length > 0.0] / length[length > 0.0, None]
    order = qr(G, mode="r", pivoting=True)[1] if len(G) else np.arange(len(size))
    dependent = order[: len(size) - len(given) - mobility(model, start.base).freedoms]
    c.work.velocities.partition[:] = -size
    c.work.velocities.partition[dependent] *= -1.0


def independent(start: Start) -> tuple[str, ...]:
    """Names of the coordinates that are independent now."""
    c = start.assembly.compiled
    return tuple(
        n.name for n, p in zip(velocity_names(c.structure), c.work.velocities.partition, strict=True) if p < 0.0
    )
