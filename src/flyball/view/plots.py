"""Curves of a result as Matplotlib figures: one axis for each unit, names beside the curves."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .artist import draw
from .drawing import handed_out, headed, stacked, styled
from .edged import edged
from .figures import panels
from .marks import marks
from .pictures import standard_pictures
from .recording import Channel

if TYPE_CHECKING:
    from ..results.result import Result


def plot(result: Result, *names: str, path: str | os.PathLike | None = None) -> Any:
    """Plot curves over time; those of equal unit share an axis.

    Parameters
    ----------
    result : Result
    *names : str
        Curves such as ``"slider.x"``, or parts such as ``"slider"`` for all their curves; the energies if none is
        given.
    path : path, optional
        Write a PNG, SVG or PDF file, by the suffix, instead of returning the figure.

    Returns
    -------
    Figure, or None where a file was written.

    Raises
    ------
    ModelError
        If there is no such curve or part, the suffix is of no known kind, or the file cannot be written.
    """
    whole = edged(result)
    curves = {c.name: c for name in names or ("energy",) for c in _curves(whole, name)}
    with styled():
        drawing = stacked(whole.t, tuple(panels(list(curves.values()), len(curves))), marks=marks(result))
        headed(drawing, result.model.name)
        return handed_out(drawing, path)


def _curves(result: Result, name: str) -> list[Channel]:
    if "." in name:
        return [Channel(name, *result.channel(name))]
    return [Channel(f"{name}.{k}", unit, values) for k, (unit, values) in result[name].channels().items()]


def standard_plots(result: Result, folder: str | os.PathLike) -> list[Path]:
    """Write the pictures that tell most of a motion into a folder that is there; returns their paths."""
    return draw(standard_pictures(result), Path(folder))
