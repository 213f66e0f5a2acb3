"""Which bodies are free, and which are a mechanism: held by joints, pulled by forces, driven."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ....model.model import Model
from ....tables.system import BETWEEN
from ....tables.values import Values


@dataclass(frozen=True)
class Parts:
    """Names of what moves.

    Attributes
    ----------
    free : tuple of str
        Bodies and sets of bodies on which nothing acts but gravity and contact.
    held : tuple of str
        The other bodies.
    """

    free: tuple[str, ...]
    held: tuple[str, ...]


def parts(model: Model, values: Values) -> Parts:
    """Tell free bodies from those of the mechanism, by what the tables of absolute coordinates say acts on them."""
    S = values.system
    between = S.forces.family == BETWEEN
    frames = np.concatenate([S.terms.F, S.terms.M, S.forces.F[between], S.forces.M[between]])
    used = set(S.frame_body[frames[frames >= 0]].tolist())
    place = values.structure.place
    free = tuple(b.name for b in model.bodies if place[b.name] not in used)
    return Parts((*free, *(b.name for b in model.bulk)), tuple(b.name for b in model.bodies if place[b.name] in used))
