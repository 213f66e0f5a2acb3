"""Efforts of drives and reactions of joints over time; what is undetermined is said, not drawn."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import ModelError
from .figures import MOST, panels
from .plots import _drawing, _handed_out, _headed, _stacked
from .recording import Channel, Panel

if TYPE_CHECKING:
    from ..results.inverse import InverseDynamics

NOTHING = 1e-9  # reactions below this part of the largest are rounding
NAMED = 8


def plot_efforts(found: InverseDynamics, path: str | os.PathLike | None = None) -> Any:
    """Draw what drives do, and the components of reactions that the motion determines.

    Parameters
    ----------
    found : InverseDynamics
    path : path, optional
        Write a PNG, SVG or PDF file, by the suffix, instead of returning the figure.

    Returns
    -------
    Figure, or None where a file was written.

    Raises
    ------
    ModelError
        If there is nothing to draw, or the file cannot be written.
    """
    curves = found.channels()
    drives = [Channel(f"{k}.effort", curves[k][0], curves[k][1]) for k in found.drives]
    rest = {k: c for k, c in curves.items() if k not in found.drives}
    parts = panels(drives)
    for unit, what in (("N", "reaction force"), ("N*m", "reaction torque")):
        sizes = {k: np.nanmax(np.abs(v), initial=0.0) for k, (u, v) in rest.items() if u == unit}
        least = NOTHING * _scale(found) * (1.0 if unit == "N" else found.result.values.length)
        shown = [k for k, size in sizes.items() if size > least][: 2 * MOST]
        free = [k for k in sizes if np.isnan(rest[k][1]).any()]
        more = f" and {len(free) - NAMED} more" if len(free) > NAMED else ""
        note = f"undetermined, not drawn: {', '.join(free[:NAMED])}{more}" if free else ""
        if shown:
            parts.append(Panel(what, tuple(Channel(k, unit, rest[k][1]) for k in shown), note))
        elif note and parts:
            last = parts[-1]
            parts[-1] = Panel(last.label, last.curves, "; ".join(x for x in (last.note, note) if x))
    if not parts:
        raise ModelError(
            f"{found.result.model.name!r}: there is no drive, and the motion determines no reaction to draw"
        )
    with _drawing():
        drawing = _stacked(found.result, parts)
        _headed(drawing, f"{found.result.model.name}: inverse dynamics")
        return _handed_out(drawing, path)


def _scale(found: InverseDynamics) -> float:
    """The largest force of a joint, which says what is no more than rounding."""
    forces = (found.reaction(j.name).one[:, :3] for j in found.result.model.joints)
    return max((float(np.abs(f).max(initial=0.0)) for f in forces), default=0.0)
