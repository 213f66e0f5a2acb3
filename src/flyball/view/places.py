"""Where elements attach: their frames on the bodies that carry them, and in the world over time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..model.body import GROUND

if TYPE_CHECKING:
    from ..results.result import Result


@dataclass(frozen=True)
class End:
    """A frame on a body: origin [m] and axes (columns) from the body's reference frame, and its number."""

    body: str
    p: np.ndarray
    R: np.ndarray
    frame: int

    @property
    def grounded(self) -> bool:
        """Whether it does not move."""
        return self.body == GROUND


class Places:
    """The frames of a result's elements."""

    def __init__(self, result: Result) -> None:
        self.result = result
        self._names = {b: name for name, b in result.values.structure.place.items()}

    def end(self, name: str, role: str) -> End | None:
        """The frame F or M of an element; None if it has no such frame."""
        x = self.result.values
        k = x.structure.frame_at.get((name, role, ""))
        if k is None:
            return None
        body = self._names.get(int(x.system.frame_body[k]), GROUND)
        p, R = x.system.frames.position[k].real, x.system.frames.rotation[k].real
        return End(body, p + x.bodies[body].com.real, R.reshape(3, 3), k)

    def ends(self, e: Any) -> tuple[End, End] | None:
        """F and M of an element that joins two bodies; None if it does not."""
        a, b = self.end(e.name, "F"), self.end(e.name, "M")
        return None if a is None or b is None else (a, b)

    def track(self, end: End) -> tuple[np.ndarray, np.ndarray]:
        """Origin (n, 3) and axes (n, 3, 3) of a frame in the world, over time."""
        n = len(self.result.t)
        p, R = self.result.records.frame(end.frame)[:2]
        full = [np.broadcast_to(c, n) for c in (*p, *R)]
        return np.stack(full[:3], axis=1), np.stack(full[3:], axis=1).reshape(-1, 3, 3)

    def seen(self, end: End, other: End) -> np.ndarray:
        """Origin of the other frame seen from the first, in its axes, over time (n, 3)."""
        (p, R), (q, _) = self.track(end), self.track(other)
        return np.einsum("nij,ni->nj", R, q - p)

    def reach(self, end: End, other: End) -> tuple[float, float, float, float, float, float]:
        """Over what stretch the other frame's origin moves along x, y, z of the first: low x, high x, low y, ..."""
        d = self.seen(end, other)
        d = d[np.isfinite(d).all(axis=1)]
        if not len(d):
            return (0.0,) * 6
        return tuple(float(x) for pair in zip(d.min(axis=0), d.max(axis=0), strict=True) for x in pair)  # type: ignore[return-value]


def three(p: np.ndarray) -> tuple[float, float, float]:
    """Three plain numbers."""
    return tuple(float(c) for c in p)  # type: ignore[return-value]
