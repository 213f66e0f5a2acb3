"""Coordinate partitioning: which coordinates are independent, and which constraints determine the others.

The independent ones are named, or chosen as `analysis/linear/free.py` chooses them: QR with column pivoting of an
orthonormal basis of the motions that the constraints allow (Businger and Golub 1965; for mechanisms: Wehage and Haug
1982). Velocities are chosen among; a tree joint's coordinates follow its velocities, one by one or, where they are a
quaternion, all together.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...analysis.linear.free import compared
from ...errors import ModelError, SingularityError
from ...model.model import listing, suggest
from ...numerics.rank import null_space
from ...tables.specs import Structure

DEPENDENT = 1e-8  # part of the largest by which an independent coordinate must move


@dataclass(frozen=True)
class Free:
    """What constraints leave free, as numbers at one position.

    Attributes
    ----------
    chosen : list of int
        Independent velocities.
    rows : list of int
        As many of the constraints as are independent.
    """

    chosen: list[int]
    rows: list[int]

    def dependent(self, nv: int) -> list[int]:
        """The other velocities."""
        return [d for d in range(nv) if d not in self.chosen]


def free(G: np.ndarray, scale: np.ndarray, wanted: Sequence[int] = (), only: bool = False) -> Free:
    """Choose independent velocities and constraints.

    Parameters
    ----------
    G : ndarray (nr, nv)
        Jacobian at one position.
    scale : ndarray (nv,)
        A large step along each velocity.
    wanted : sequence of int
        Velocities that must be among them.
    only : bool
        Whether no others may be.

    Raises
    ------
    ValueError
        With the velocity that cannot be independent of those before it.
    """
    from scipy.linalg import qr

    A = compared(G, scale)
    N = null_space(A) if len(A) else np.eye(len(scale))
    f = N.shape[1]
    chosen: list[int] = []
    left = N.copy()
    largest = float(np.sqrt((N * N).sum(axis=1)).max(initial=0.0))
    for d in wanted:
        along = left[d]
        if len(chosen) == f or np.linalg.norm(along) <= DEPENDENT * largest:
            raise ValueError(d)
        e = along / np.linalg.norm(along)
        left = left - np.outer(left @ e, e)
        chosen.append(d)
    if not only and len(chosen) < f:
        *_, order = qr(left.T, mode="economic", pivoting=True)
        chosen += [int(d) for d in order if d not in chosen][: f - len(chosen)]
    rank = len(scale) - f
    rows: list[int] = []
    if rank:
        *_, order = qr(A.T, mode="economic", pivoting=True)
        rows = sorted(int(k) for k in order[:rank])
    return Free(sorted(chosen), rows)


def named(names: Sequence[str], wanted: Sequence[str], model: str) -> list[int]:
    """Velocities by name.

    Raises
    ------
    ModelError
        If there is no such coordinate; the message lists what there is.
    """
    at = {n: k for k, n in enumerate(names)}
    for n in wanted:
        if n not in at:
            known = f"{suggest(n, at)}; {listing(list(at))}"
            raise ModelError(f"{model!r} has no coordinate {n!r} in these coordinates{known}")
        if list(wanted).count(n) > 1:
            raise ModelError(f"independent names {n!r} twice")
    return [at[n] for n in wanted]


def positions(s: Structure) -> list[tuple[list[int], list[int]]]:
    """Coordinates that belong together and their velocities: one and one, or a quaternion and its turns."""
    out = []
    tree = s.tables["tree"]
    for q, v, nq, nv in zip(*(x.tolist() for x in (tree.q, tree.v, tree.nq, tree.nv)), strict=True):
        single = nv if nq == nv else nv - 3
        out += [([q + k], [v + k]) for k in range(single)]
        if nq > nv:
            out.append((list(range(q + single, q + nq)), list(range(v + single, v + nv))))
    return out


def singular(names: Sequence[str], t: float) -> SingularityError:
    """The error of a start where the constraints lose rank."""
    return SingularityError(
        f"the mechanism is in a singular position at t = {t:.6g} s: the constraints of {', '.join(names)} depend on "
        "each other here and not nearby, so that coordinates cannot be told apart; draw it away from there",
        t,
        tuple(names),
    )
