"""Preload: what has to be added to forces for a mechanism to be in equilibrium where it is drawn."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...errors import ModelError, NotConverged
from ...tables.names import velocity_names
from ..assembly.start import Assembly
from ..compiled import compiled
from .free import free
from .inputs import with_inputs
from .rest import Rest

BALANCED = 1e-9  # forces left, of those that act
ROUNDED = 1e-13  # part of a force along the free motions that is none


def preloaded(a: Assembly, names: Sequence[str]) -> tuple[Rest, dict[str, float]]:
    """The mechanism at rest with the smallest preloads that balance it, and those.

    The forces along the free motions Z have to vanish: Z^T (f + sum b_k w_k) = 0.

    Raises
    ------
    ModelError
        If there is no such force, or it has no law.
    NotConverged
        If these forces cannot balance it.
    """
    names = [names] if isinstance(names, str) else list(dict.fromkeys(names))
    model, inputs = with_inputs(a.compiled.structure.model, names)
    for i in inputs:
        if i.driver or i.name == i.parameter:
            what = "driver" if i.driver else "parameter"
            raise ModelError(f"{i.name!r} is a {what}; only forces and torques can be preloaded")
    c = compiled(model, parameters=a.compiled.parameters)
    c.follow(a.compiled.hints)
    x = Rest.at(c, a.t, a.q)
    e = x.equations
    own = free(e)
    Z = own.Z
    by = np.array([e.by_law(i.parameter)[e.at["r"]] for i in inputs]).T
    along = Z.T @ by
    most = (np.abs(by) * own.scale[:, None]).sum(axis=0) / own.scale[own.chosen, None]
    along[np.abs(along) <= ROUNDED * most] = 0.0  # what the constraints carry balances nothing
    w = np.linalg.lstsq(along, -Z.T @ e.block("r"), rcond=1e-10)[0]
    changed = c.parameters | {i.parameter: float(value) for i, value in zip(inputs, w, strict=True)}
    loaded = compiled(model, parameters=changed)
    loaded.follow(c.hints)
    y = Rest.at(loaded, a.t, a.q)
    if not y.settled(BALANCED):
        raise NotConverged(
            f"{', '.join(names)} cannot balance {model.name!r} where it is drawn: {y.pushed()} all the same; preload "
            f"other forces too",
            {n.name: float(-v) for n, v in zip(velocity_names(c.structure), y.equations.block("r"), strict=True)},
        )
    return y, dict(zip(names, w.tolist(), strict=True))
