"""Curves that redundant constraints leave undetermined: reactions that a self-stress changes, which nothing decides."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ...errors import ModelError
from ...numerics.sparse_rank import null_spaces
from ...results.result import Result
from ..freedom.jacobian import scaled_jacobian
from ..freedom.stresses import CHANGED
from .curves import slopes, snapshot
from .derivatives import State
from .free import prescribed
from .least import least


def told_by_reactions(x: State, names: Sequence[str]) -> bool:
    """Whether any of some curves depends on what joints and drivers carry."""
    n = len(x.lam) + len(x.c.structure.prescribed)
    still = np.zeros((n, x.c.structure.nv))
    return bool(np.any(slopes(x, names, (still, still, still, np.eye(n))))) if names and n else False


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
        if effect > CHANGED * _arm(x, shot, name):
            raise _undetermined(x, name, np.abs(free * size).max(axis=0))


def refuse_open(x: State, names: Sequence[str], C: Any) -> None:
    """The same of a large mechanism: what a curve takes of the multipliers must be what the rows make of some motion.

    ``C`` (names, 3 nv + rows) are the curves' derivatives by everything.
    """
    x.c.at(x.t, x.q, x.v)
    G, size, _ = scaled_jacobian(x.c)
    for k, name in enumerate(names):
        by = C[[k], 3 * G.shape[1] :].toarray()[0] / np.maximum(size, 1e-300)
        left = np.abs(by - G @ least(G, by)) if by.any() else by
        most = left.max(initial=0.0)
        if most > CHANGED * min(1.0, x.c.values.length) and most > CHANGED * _arm(x, snapshot(x), name):
            raise _undetermined(x, name, left / most)


def _arm(x: State, shot: Result, name: str) -> float:
    """What one unit of force does to a curve at most, roughly."""
    return x.c.values.length if "m" in shot.curve(name)[0] else 1.0


def _undetermined(x: State, name: str, part: np.ndarray) -> ModelError:
    """The error that names the elements whose constraints have a part in it."""
    of = [r.element.name for r in x.c.structure.rows] + list(x.c.structure.prescribed)
    among = dict.fromkeys(n for n, p in zip(of, part, strict=False) if p > CHANGED)
    return ModelError(
        f"{name!r} is not determined: redundant constraints ({', '.join(among)}) leave it open, and how the "
        f"load is shared follows from no mechanics of rigid bodies. Ask for other quantities, or take the "
        f"redundancy out: m.mobility() names it"
    )
