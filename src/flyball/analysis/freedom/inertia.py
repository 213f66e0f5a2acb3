"""Motions without inertia: the constraints allow them and no mass resists, so that nothing determines them."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...errors import ModelError
from ...model.model import Model
from ...numerics.sparse_rank import sparse_null_space
from ...tables.points import points
from ..assembly.start import Assembly

FEW = 1e-3  # part of a motion that is no turn


def massless(a: Assembly, G: Any, scale: np.ndarray) -> np.ndarray:
    """Motions (nv, k) that the constraints allow and no mass resists, from M + G^T G."""
    import scipy.sparse as sp

    M = sp.diags(scale) @ a.compiled.mass() @ sp.diags(scale)
    return sparse_null_space(M / M.diagonal().max() + G.T @ G)[1] * scale[:, None]


def check_inertia(model: Model, a: Assembly, motions: np.ndarray) -> None:
    """Refuse motions that no mass resists.

    Raises
    ------
    ModelError
        Naming the body that could move without inertia.
    """
    if not motions.shape[1]:
        return
    i, j, M = a.compiled.mass_entries()
    K = motions[i].T @ (M[:, None] * motions[j])
    w, V = np.linalg.eigh(K)
    if w[0] > 1e-9 * max(w[-1], 1e-300):
        return
    motion = motions @ V[:, 0]
    tree = a.compiled.values.system.tree
    size = [np.abs(motion[v0 : v0 + n]).max() for v0, n in zip(tree.v, tree.nv, strict=True)]
    b = int(np.argmax(size))
    name = next(k for k, v in a.compiled.structure.place.items() if v == b)
    v0, n = int(tree.v[b]), int(tree.nv[b])
    shifts = 2 if model.planar else 3
    turns = motion[v0 + shifts : v0 + n]
    if np.abs(turns).max(initial=0.0) < FEW * size[b]:
        raise ModelError(
            f"body {name!r} can move without any mass resisting it, so its motion is not determined. Give it a "
            f"mass, or joints that make it move with bodies that have one"
        )
    about = "turn" if shifts == 2 else f"turn about ({', '.join(f'{x:.3g}' for x in turns / np.linalg.norm(turns))})"
    why = points(model).get(name, "")
    raise ModelError(
        f"body {name!r} can {about} (its own axes) without any inertia resisting it, so its motion is not determined. "
        f"Give it a moment of inertia, or joints that prevent this motion"
        + (f"; it is no point mass, which would not turn, since {why}" if why else "")
    )
