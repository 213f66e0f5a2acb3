"""The scaled constraint Jacobian, its rank and null spaces, sparse bases of these, and self-stresses.

Rows and columns of the Jacobian are scaled to comparable units. A null space is split into subspaces that no smaller
set of elements carries (in matroid terms: circuits of the elements), first into unconnected parts, then by leaving out
one element after the other. Multipliers without effect are self-stresses: they show which reaction components
redundancy leaves undetermined.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..assembly.assembled_state import Assembly
from ..assembly.compiled_mechanism import CompiledMechanism
from ..engine.kinematics import load_record
from ..engine.rows import row_parameters
from ..math.vec import neg, scale
from ..numerics.rank import (
    MAX_DOUBTFUL_SVD_SIZE,
    MAX_SVD_SIZE,
    column_space,
    fundamental_subspaces,
    null_space,
    sparse_matrix_rank,
    sparse_null_space,
)
from ..tables.values import Values


@dataclass(frozen=True)
class ConstraintNullSpaces:
    """The position at which a mechanism was examined, and the null spaces of its Jacobian there."""

    assembly: Assembly
    dependencies: np.ndarray  # multipliers (nr, k) without effect; as many as `ROOM` allows
    allowed_velocities: np.ndarray | None  # velocities (nv, f) that the rows allow; None: computed on access
    gap: str = ""  # why it cannot be assembled, if it cannot

    @property
    def velocities(self) -> np.ndarray:
        """Velocities (nv, f) that the rows allow; as many as `ROOM` (in `numerics.rank`) allows."""
        if self.allowed_velocities is not None:
            return self.allowed_velocities
        a = self.assembly
        a.compiled.at(a.t, a.q, a.v)
        G, _, scale = scaled_jacobian(a.compiled)
        few = max(G.shape) <= MAX_DOUBTFUL_SVD_SIZE
        return (null_space(G.toarray()) if few else sparse_null_space((G.T @ G).tocsr())[1]) * scale[:, None]


def velocity_scales(c: CompiledMechanism) -> np.ndarray:
    """Return 1 for translational velocities, 1 / length of the mechanism for angular velocities."""
    return c.sizes / c.values.length


def scaled_jacobian(c: CompiledMechanism, dense: bool = False) -> tuple[Any, np.ndarray, np.ndarray]:
    """Return the Jacobian last evaluated with rotations times length and rows of unit size, and both scales.

    Returns
    -------
    G : sparse (nr, nv), or an array if ``dense``
    size : ndarray (nr,)
        Divisors of the rows.
    scale : ndarray (nv,)
        Factors of the columns: velocities are ``scale`` times those of G.
    """
    scale = velocity_scales(c)
    if dense:
        A = c.jacobian() * scale
        size = np.sqrt((A * A).sum(axis=1))
        return A / np.maximum(size, 1e-300)[:, None], size, scale
    import scipy.sparse as sp

    G = c.sparse_jacobian() @ sp.diags(scale)
    size = np.sqrt(np.asarray(G.multiply(G).sum(axis=1)).ravel())
    return (sp.diags(1.0 / np.maximum(size, 1e-300)) @ G).tocsr(), size, scale


def jacobian_rank(c: CompiledMechanism) -> int:
    """Return the rank of the Jacobian last evaluated."""
    return sparse_matrix_rank(scaled_jacobian(c, is_small(c))[0])


def is_small(c: CompiledMechanism) -> bool:
    """Return whether the Jacobian is small enough for a rank from the dense matrix."""
    return max(len(c.structure.rows), c.structure.nv) <= MAX_SVD_SIZE


CHANGE_TOLERANCE = 1e-6  # relative effect of a self-stress on a reaction component that counts as zero
COMPONENTS = ("force x", "force y", "force z", "torque x", "torque y", "torque z")


def self_stresses(
    x: Values, frame: Callable[[int], tuple], z: np.ndarray, lam: np.ndarray, names: list[str]
) -> dict[str, np.ndarray]:
    """Return the wrenches (..., 6, k) on ``body_j`` at the joint's point there caused by each of the self-stresses.

    World axes, torques divided by the mechanism's length. At one position, or at many: then the entries of frame
    records are arrays (n,).

    Parameters
    ----------
    x : Values
    frame : callable
        The kinematic record of a frame.
    z : ndarray (nz, ...)
        Angles and curve positions.
    lam : ndarray (..., nr, k)
        Self-stresses.
    names : list of str
        Joints.
    """
    s, S = x.structure, x.system
    out = {n: np.zeros((*lam.shape[:-2], 6, lam.shape[-1])) for n in names}
    for name in names:
        for k in s.terms_of.get(name, ()):
            t = s.terms[k]
            par = row_parameters(S.term_parameters, k)
            hint = z[t.hint] if t.hint >= 0 else 0.0
            _, f, tM, tF, _ = t.formula.of_kind.row(par, frame(t.F), frame(t.M), hint, S.const)
            if s.frames[t.M].role != "M":  # measured from M to F
                f, tM = neg(f), tF
            wrench = np.stack(np.broadcast_arrays(*f, *scale(1.0 / x.length, tM)), axis=-1)
            out[name] += par[7] * wrench[..., :, None] * lam[..., t.row, None, :]
    return out


def undetermined_components(a: Assembly, lam: np.ndarray, names: list[str]) -> dict[str, tuple[str, ...]]:
    """Return the reaction components (world axes, on body_j) of these elements that self-stresses ``lam`` (nr, k)
    change.
    """
    c = a.compiled
    planar = c.structure.model.planar
    wrenches = self_stresses(c.values, lambda k: load_record(c.work.frames, k), c.z, lam, names)
    largest = max(np.abs(w).max() for w in wrenches.values())
    out = {}
    for name, w in wrenches.items():
        free = np.abs(w).max(axis=1) > CHANGE_TOLERANCE * largest
        if planar:
            free[[2, 3, 4]] = False
        text = tuple(
            x if not planar else x.replace("torque z", "torque") for x, f in zip(COMPONENTS, free, strict=True) if f
        )
        if text:
            out[name] = text
    return out


ROUNDING_TOLERANCE = 1e-8  # singular values below this are rounding; bases are orthonormal
INDEPENDENCE_TOLERANCE = 1e-6  # singular values above this belong to independent directions


def minimal_subspaces(
    N: np.ndarray, groups: Sequence[np.ndarray], max_dimensions: int | None = None
) -> list[tuple[list[int], np.ndarray]]:
    """Return subspaces that make up a null space, each carried by a minimal set of elements.

    Parameters
    ----------
    N : ndarray (n, k)
        A basis of the null space, its rows in comparable units.
    groups : sequence of ndarray of int
        The rows of every element.
    max_dimensions : int, optional
        Largest number of dimensions of a connected part that is split; of a larger one only so many are used.

    Returns
    -------
    list of (elements, basis)
        Numbers of the elements, and vectors (n, c) that only they carry. All bases together are k independent vectors,
        or fewer with ``max_dimensions``.
    """
    out: list[tuple[list[int], np.ndarray]] = []
    for part in _unconnected_parts(N, groups):
        basis = column_space(part[:, :max_dimensions])
        blocks = [basis[g] for g in groups]
        touched = [e for e, b in enumerate(blocks) if len(b) and np.abs(b).max() > ROUNDING_TOLERANCE]
        if basis.shape[1] == 1:
            out.append((touched, basis))
            continue
        found = np.zeros((basis.shape[1], 0))
        while found.shape[1] < basis.shape[1]:
            P = min(
                (_minimal_support(blocks, order, found) for order in (touched, touched[::-1])),
                key=_support_size(blocks),
            )
            new = _independent_part(found, P)
            carriers = [e for e in touched if np.abs(blocks[e] @ P).max(initial=0.0) > ROUNDING_TOLERANCE]
            out.append((carriers, basis @ new))
            found = column_space(np.hstack([found, new]))
    return out


def _unconnected_parts(N: np.ndarray, groups: Sequence[np.ndarray]) -> list[np.ndarray]:
    """Return the null space as a sum of spaces that share no element."""
    from scipy.linalg import qr
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    k = N.shape[1]
    if k < 2:
        return [N] if k else []
    _, _, order = qr(N.T, mode="economic", pivoting=True)
    reduced = np.linalg.solve(N[order[:k]].T, N.T).T  # the unit matrix in the rows chosen: as sparse as rows allow
    touches = np.array([np.abs(reduced[g]).max(axis=0, initial=0.0) for g in groups]).reshape(len(groups), k) > 1e-7
    e, j = np.nonzero(touches)
    n = len(groups) + k
    graph = coo_matrix((np.ones(len(e)), (e, len(groups) + j)), shape=(n, n))
    part = connected_components(graph, directed=False)[1][len(groups) :]
    return [reduced[:, part == p] for p in dict.fromkeys(part.tolist())]


def _minimal_support(blocks: list[np.ndarray], order: list[int], found: np.ndarray) -> np.ndarray:
    """Return coefficients (k, p) of the rest after removing every element that can be spared while a new vector
    remains.
    """
    P = np.eye(found.shape[0])
    for e in order:
        B = blocks[e] @ P
        if np.abs(B).max(initial=0.0) <= ROUNDING_TOLERANCE:
            continue
        Q = P @ null_space(B, ROUNDING_TOLERANCE, 1.0)
        if Q.shape[1] and _independent_part(found, Q).shape[1]:
            P = Q
    return P


def _independent_part(found: np.ndarray, P: np.ndarray) -> np.ndarray:
    """Return the columns of P, unchanged in direction, that are independent of the vectors found already."""
    if not found.shape[1]:
        return P
    rest = P - found @ (found.T @ P)
    return P @ fundamental_subspaces(rest, INDEPENDENCE_TOLERANCE, 1.0).row_space


def _support_size(blocks: list[np.ndarray]):
    def weight(P: np.ndarray) -> int:
        return sum(np.abs(b @ P).max(initial=0.0) > ROUNDING_TOLERANCE for b in blocks)

    return weight
