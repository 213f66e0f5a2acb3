"""What every velocity of the mechanism is called: ``"rod.x"``, ``"A.angle"``."""

from __future__ import annotations

from typing import NamedTuple

from .forest import steps
from .specs import Structure
from .system import POINT

AXES = ("x", "y", "z")


class Named(NamedTuple):
    """A velocity by the name of what it is the rate of."""

    name: str
    unit: str  # of that: "m" or "rad"


def velocity_names(s: Structure) -> list[Named]:
    """What each velocity is the rate of, (nv,).

    Bodies that hang on ground freely: ``x``, ``y``, ``z`` of the centre of mass along the world's axes; ``angle`` in
    the plane, in space ``turn x``, ``turn y``, ``turn z`` about the body's own axes, which point masses do not
    have. Tree joints: the joint's coordinates; what has no name of its own is a ``turn`` or ``shift`` along an axis.
    """
    return s.kept.get("names of velocities", None, 1, lambda: _named(s))


def _named(s: Structure) -> list[Named]:
    tree = s.tables["tree"]
    out = [Named("", "m")] * s.nv
    hung = set()
    for t, row, step in steps(s):
        hung.add(row)
        v0, n = int(tree.v[row]), int(tree.nv[row])
        for k in range(n):
            told = step.coordinate if n == 1 else ""  # what turns about a point has three velocities
            what = told or f"{'shift' if step.kind == 'P' else 'turn'} {AXES[k] if n > 1 else step.axis}"
            unit = "m" if step.kind == "P" else "rad"
            out[v0 + k] = Named(f"{t.joint.name}.{what}", unit)
    own = ["x", "y", "angle"] if s.model.planar else [*AXES, *(f"turn {a}" for a in AXES)]
    for name, b in s.place.items():
        if b >= 0 and b not in hung and int(tree.joint[b]) <= POINT:
            for k, what in enumerate(own[: int(tree.nv[b])]):
                out[int(tree.v[b]) + k] = Named(f"{name}.{what}", "m" if what in AXES else "rad")
    return out
