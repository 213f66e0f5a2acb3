"""Curves that redundant constraints leave undetermined: reactions that a self-stress changes, which nothing decides."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...errors import ModelError
from ...numerics.sparse_rank import null_spaces
from ..freedom.jacobian import scaled_jacobian
from ..freedom.stresses import CHANGED
from .curves import slopes, snapshot
from .derivatives import State
from .free import prescribed


def refuse_undetermined(x: State, names: Sequence[str]) -> None:
    """Refuse curves that multipliers which act on nothing change.

    Parameters
    ----------
    x : State
    names : sequence of str
        Sensors, or curves of the result.

    Raises
    ------
    ModelError
        Naming the first of them, and the elements that share what is not determined.
    """
    import scipy.sparse as sp

    s = x.c.structure
    if not names or not len(s.rows):
        return
    x.c.at(x.t, x.q, x.v)
    own, size, scale = scaled_jacobian(x.c)
    size = np.maximum(np.r_[size, scale[prescribed(x.c).argmax(axis=1)]], 1e-300)
    G = sp.vstack([own, prescribed(x.c)]).tocsr()
    free = (null_spaces(G)[1] / size[:, None]).T
    if not len(free):
        return
    still = np.zeros((len(free), s.nv))
    by = np.abs(slopes(x, names, (still, still, still, free))).max(axis=0)
    shot = snapshot(x)
    for name, effect in zip(names, by, strict=True):
        arm = x.c.values.length if "m" in shot.curve(name)[0] else 1.0
        if effect > CHANGED * arm:
            part = np.abs(free * size).max(axis=0) > CHANGED
            of = [r.element.name for r in s.rows] + list(s.prescribed)
            among = dict.fromkeys(n for n, p in zip(of, part, strict=True) if p)
            raise ModelError(
                f"{name!r} is not determined: redundant constraints ({', '.join(among)}) leave it open, and how the "
                f"load is shared follows from no mechanics of rigid bodies. Ask for other quantities, or take the "
                f"redundancy out: m.mobility() names it"
            )
