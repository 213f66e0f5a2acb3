"""Whether a motion may go on where an earlier result ended: edits since then must leave all where and as it was."""

from __future__ import annotations

import numpy as np

from ...equations.engine import MOTION
from ...errors import ModelError
from ...results.result import Result
from ...tables.coordinates import BodyState
from ..compiled import Compiled

NEAR = 1e-6  # of the mechanism's length, or radians, that a motion may go on from
ALIKE = 1e-4  # of the largest velocity
LEFT = 1e-5  # velocities [m/s, rad/s] that a motion may leave in its constraints


def refuse_jump(before: Result, c: Compiled, t: float, q: np.ndarray, v: np.ndarray) -> None:
    """Refuse a state that constraints do not allow, or that joint coordinates would put elsewhere.

    Raises
    ------
    ModelError
        Naming what is off, and how far.
    """
    if c.values is before.values:
        return
    now = _moving(c, t, q, v)
    size = c.values.length
    off = dict(zip(_rows(c), np.abs(c.work.rows.value) / size, strict=True))
    fast = {name: abs(x) for name, x in zip(_rows(c), c.jacobian() @ v - c.work.rows.nu, strict=True)}
    most = max(np.abs(v).max(initial=0.0), np.abs(c.work.rows.nu).max(initial=0.0))
    if c.structure.tree:
        then = _moving(Compiled(before.values, before.final[1][len(q) + len(v) :].copy()), t, q, v)
        off |= {f"body {k!r}": max(_most(x.p - then[k].p) / size, _most(x.R - then[k].R)) for k, x in now.items()}
        fast |= {f"body {k!r}": _faster(x, then[k]) for k, x in now.items()}
        most = max([most, *(_most(np.r_[x.v, x.w]) for x in (*now.values(), *then.values()))])
    _refuse(before, c, off, NEAR, "", size)
    _refuse(before, c, fast, max(LEFT, ALIKE * most), " in velocity", 1.0)


def _moving(c: Compiled, t: float, q: np.ndarray, v: np.ndarray) -> dict[str, BodyState]:
    """How every body moves, where prescribed coordinates are what drivers want then."""
    c.at(t, q, v, MOTION)
    K = c.work.BK.copy()
    return {
        name: BodyState(K[b, :3], K[b, 3:12], K[b, 15:18], K[b, 12:15])
        for name, b in c.structure.place.items()
        if b >= 0
    }


def _rows(c: Compiled) -> list[str]:
    return [f"{r.element.title} ({r.label}, row {k})" for k, r in enumerate(c.structure.rows)]


def _most(x: np.ndarray) -> float:
    return float(np.abs(x).max(initial=0.0))


def _faster(a: BodyState, b: BodyState) -> float:
    return max(_most(a.v - b.v), _most(a.w - b.w))


def _refuse(before: Result, c: Compiled, off: dict[str, float], most: float, what: str, size: float) -> None:
    if not off:
        return
    worst = max(off, key=lambda name: off[name] if off[name] == off[name] else np.inf)
    if not off[worst] <= most:
        raise ModelError(
            f"the result of {before.model.name!r} cannot be gone on with: {worst} of {c.structure.model.name!r} is "
            f"{off[worst] * size:.3g}{what} from where the result ended. Were parameters or parts changed? A change "
            "must leave every body where it is, and as fast"
        )
