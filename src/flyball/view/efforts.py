"""Efforts of drives and reactions of joints over time; what is undetermined is said, not drawn."""

from __future__ import annotations

import os
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import ModelError
from .drawing import handed_out, headed, stacked, styled
from .figures import MOST, panels
from .recording import Channel, Panel

if TYPE_CHECKING:
    from ..results.inverse import InverseDynamics

NOTHING = 1e-9  # reactions below this part of the largest are rounding
NAMED = 8
WIDTH = 120  # letters of a line


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
        if shown:
            parts.append(Panel(what, tuple(Channel(k, unit, rest[k][1]) for k in shown)))
    if not parts:
        raise ModelError(
            f"{found.result.model.name!r}: there is no drive, and the motion determines no reaction to draw"
        )
    with styled():
        drawing = stacked(found.result.t, parts)
        if note := _undrawn(rest):
            drawing.supxlabel(note, fontsize=8, x=0.012, ha="left")
        headed(drawing, f"{found.result.model.name}: inverse dynamics")
        return handed_out(drawing, path)


def _undrawn(curves: dict[str, tuple[str, np.ndarray]]) -> str:
    """What is undetermined, joint by joint."""
    free: dict[str, list[str]] = {}
    for name, (_, values) in curves.items():
        if np.isnan(values).any():
            joint, _, what = name.rpartition(".")
            free.setdefault(joint, []).append(what)
    if not free:
        return ""
    told = "; ".join(f"{joint} {', '.join(what)}" for joint, what in list(free.items())[:NAMED])
    more = f"; and {len(free) - NAMED} more joints" if len(free) > NAMED else ""
    return "\n".join(wrap(f"undetermined by redundancy, not drawn: {told}{more}", WIDTH))


def _scale(found: InverseDynamics) -> float:
    """The largest force of a joint, which says what is no more than rounding."""
    forces = (found.reaction(j.name).one[:, :3] for j in found.result.model.joints)
    return max((float(np.abs(f).max(initial=0.0)) for f in forces), default=0.0)
