"""Classes of shapes: those of one class belong to the same groups, meet the same ones, and all move or all stand."""

from __future__ import annotations

import numpy as np

from .desk import CLASSES
from .tables import MASK, MEMBER, MOVER, Geometry


def classes(G: Geometry) -> tuple[np.ndarray, np.ndarray, bool]:
    """Sort shapes into classes.

    Returns
    -------
    kin : ndarray (ns,)
        The class of every shape.
    meets : ndarray (classes, classes)
        1 where shapes of two classes may touch.
    exact : bool
        Whether that says all; where there are too many combinations of groups, classes tell only what moves.
    """
    member, mask = G.shape_i[:, MEMBER], G.shape_i[:, MASK]
    still = (G.shape_i[:, MOVER] < 0).astype(np.int64)
    told, kin = np.unique(np.stack([member, mask, still], axis=1), axis=0, return_inverse=True)
    exact = len(told) <= CLASSES
    if not exact:
        told, kin = np.array([[-1, -1, 0], [-1, -1, 1]]), still
    one, other = told[:, None, :], told[None, :, :]
    meets = (one[..., 0] & other[..., 1] != 0) & (one[..., 1] & other[..., 0] != 0) & (one[..., 2] & other[..., 2] == 0)
    return np.ascontiguousarray(kin.reshape(-1), np.int64), meets.astype(np.int64), exact
