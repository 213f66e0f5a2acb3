"""Classes of shapes: those of one class belong to the same groups, meet the same ones, and all move or all stand."""

from __future__ import annotations

import numpy as np

from ..tables import MASK, MEMBER, MOVER, Geometry
from .desk import CLASSES


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
    (of, one), (to, other) = np.unique(member, return_inverse=True), np.unique(mask, return_inverse=True)
    codes, kin = np.unique((one * len(to) + other) * 2 + still, return_inverse=True)
    exact = len(codes) <= CLASSES
    if not exact:
        of, to, codes, kin = np.array([-1]), np.array([-1]), np.array([0, 1]), still
    of, to, still = of[codes // 2 // len(to)], to[codes // 2 % len(to)], codes % 2
    met = of[:, None] & to[None, :] != 0
    meets = met & met.T & (still[:, None] & still[None, :] == 0)
    return np.ascontiguousarray(kin, np.int64), meets.astype(np.int64), exact
