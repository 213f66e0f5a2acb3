"""What every view of a part shares."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from ..result import Result


def stacked(a: tuple, planar: bool) -> np.ndarray:
    """(n, 2) or (n, 3) array from a tuple of components."""
    return np.stack(a[:2] if planar else a, axis=1)


class View:
    """One part of a result."""

    def __init__(self, result: Result, element: Any) -> None:
        self._result = result
        self.element = element
        self._x = result.values

    def channels(self) -> dict[str, tuple[str, np.ndarray]]:
        """Named curves of this part: name -> (unit, values)."""
        return {}

    def __repr__(self) -> str:
        return f"<{self.element.title}: {', '.join(self.channels())}>"
