"""Heights over a grid, as the tables hold them."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...errors import ModelError


def field(heights: Any, dx: float, dy: float) -> tuple[np.ndarray, tuple[float, float, float, float]]:
    """Rows for `Geometry.vertex` and the parameters of a height field.

    Parameters
    ----------
    heights : (nx, ny) numbers [m]
        Height (i, j) stands over (i dx, j dy) of the shape's axes.
    dx, dy : float
        Width of a cell [m].

    Raises
    ------
    ModelError
        If heights are no finite numbers in two or more rows and columns, or a width is not greater than zero.
    """
    z = np.asarray(heights, dtype=float)
    if z.ndim != 2 or min(z.shape) < 2 or not np.isfinite(z).all():
        raise ModelError(f"a height field takes finite heights in two or more rows and columns, got shape {z.shape}")
    if not (0 < dx < np.inf and 0 < dy < np.inf):
        raise ModelError(f"a height field takes cells of a width greater than zero, got {dx} and {dy} m")
    rows = np.zeros(-(-z.size // 3) * 3)
    rows[: z.size] = z.ravel()
    return rows.reshape(-1, 3), (float(z.shape[0]), float(z.shape[1]), float(dx), float(dy))
