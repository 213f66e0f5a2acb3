"""Plots of contact forces, convergence of contact solves, efforts of drives and reactions over time.

Components that redundancy leaves undetermined are named, not drawn.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import ModelError
from ..model.names import curve_parts
from .figures import MAX_PANEL_CURVES, panels_by_unit
from .plotting import LEGEND_BESIDE, PALETTE, finish_figure, new_figure, panels_over_time, plot_style, set_title
from .recording import Channel, Panel

if TYPE_CHECKING:
    from ..results.contacts import Contacts
    from ..results.convergence import Convergence
    from ..results.inverse_dynamics import InverseDynamics


MAX_PAIRS = 8  # number of pairs drawn if none are named


def plot_contacts(
    contacts: Contacts, pairs: Sequence[Sequence[str]] = (), path: str | os.PathLike | None = None
) -> Any:
    """Draw normal and tangential contact forces over time.

    Parameters
    ----------
    contacts : Contacts
    pairs : pairs of names
        Acting and affected side, as for `Contacts.between`; if none are named, up to eight pairs with the largest
        forces.
    path : path, optional
        Write a PNG, SVG or PDF file, by the suffix, instead of returning the figure.

    Raises
    ------
    ModelError
        If there was no contact and no pair is named, a name is unknown, or the file cannot be written.
    """
    if any(isinstance(p, str) or len(p) != 2 for p in pairs):
        raise ModelError("contacts: name pairs of two names, such as plot(('ball', 'ground'), ('ball', 'wall'))")
    chosen = [tuple(p) for p in pairs] or _largest_pairs(contacts)
    if not chosen:
        raise ModelError("nothing touched at any output time: there are no contact forces to draw")
    found = [contacts.between(a, b) for a, b in chosen]
    parts = [
        Panel(label, tuple(Channel(f"{f.by}, {f.on}", "N", getattr(f, what)) for f in found))
        for label, what in (("normal force", "normal_force"), ("tangential force", "tangential_force"))
    ]
    with plot_style():
        drawing = panels_over_time(contacts.t, parts)
        set_title(drawing, "contact forces")
        return finish_figure(drawing, path)


def _largest_pairs(contacts: Contacts) -> list[tuple[str, ...]]:
    """The pairs with the largest normal forces, in their order."""
    if not len(contacts):
        return []
    every, which = np.unique(contacts.pair, axis=0, return_inverse=True)
    size = np.zeros(len(every))
    np.maximum.at(size, which.ravel(), contacts.normal_force)
    best = np.sort(np.argsort(-size)[:MAX_PAIRS])
    return [(contacts.sides.name(a), contacts.sides.name(b)) for a, b in every[best].tolist()]


def plot_convergence(histories: Sequence[Convergence], path: str | os.PathLike | None = None) -> Any:
    """Draw residuals over the iterations: as velocities, complementarity, energy; a curve for each step.

    Raises
    ------
    ModelError
        If there is nothing to draw, or the file cannot be written.
    """
    if not any(len(h) for h in histories):
        raise ModelError("no step with contacts was recorded, so there are no residuals to draw")
    with plot_style():
        drawing = new_figure(7.2)
        axes = drawing.subplots(4, 1, sharex=True)
        for ax, what in zip(axes, ("velocity", "primal", "complementarity", "energy"), strict=True):
            for k, h in enumerate(histories):
                for n, step in enumerate(h):
                    values = getattr(step, what)
                    values = values if what == "energy" else np.where(values > 0.0, values, np.nan)
                    look = {"color": PALETTE[k % len(PALETTE)], "linestyle": ("-", "--", ":")[k % 3], "lw": 1.2}
                    ax.plot(step.iteration, values, label=h.solver if n == 0 else None, **look)
            if what != "energy":
                ax.set_yscale("log")
            ax.set_ylabel(f"{'residual' if what == 'velocity' else what} [{histories[0].units[what]}]")
        axes[0].legend(**LEGEND_BESIDE)
        axes[-1].set_xlabel("iteration")
        set_title(drawing, "residuals of contact solves")
        return finish_figure(drawing, path)


ROUNDING_PART = 1e-9  # reactions below this part of the largest are rounding errors
MAX_NAMED_JOINTS = 8
NOTE_WIDTH = 120  # characters per line


def plot_efforts(found: InverseDynamics, path: str | os.PathLike | None = None) -> Any:
    """Draw efforts of drives, and the determined components of reactions.

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
    parts = panels_by_unit(drives)
    for unit, what in (("N", "reaction force"), ("N*m", "reaction torque")):
        sizes = {k: np.nanmax(np.abs(v), initial=0.0) for k, (u, v) in rest.items() if u == unit}
        least = ROUNDING_PART * _force_scale(found) * (1.0 if unit == "N" else found.result.values.length)
        shown = [k for k, size in sizes.items() if size > least][: 2 * MAX_PANEL_CURVES]
        if shown:
            parts.append(Panel(what, tuple(Channel(k, unit, rest[k][1]) for k in shown)))
    if not parts:
        raise ModelError(
            f"{found.result.model.name!r}: there is no drive, and the motion determines no reaction to draw"
        )
    with plot_style():
        drawing = panels_over_time(found.result.t, parts)
        if note := _undetermined_note(rest):
            drawing.supxlabel(note, fontsize=8, x=0.012, ha="left")
        set_title(drawing, f"{found.result.model.name}: inverse dynamics")
        return finish_figure(drawing, path)


def _undetermined_note(curves: dict[str, tuple[str, np.ndarray]]) -> str:
    """Return a note on undetermined components, joint by joint."""
    free: dict[str, list[str]] = {}
    for name, (_, values) in curves.items():
        if np.isnan(values).any():
            joint, what = curve_parts(name)
            free.setdefault(joint, []).append(what)
    if not free:
        return ""
    told = "; ".join(f"{joint} {', '.join(what)}" for joint, what in list(free.items())[:MAX_NAMED_JOINTS])
    more = f"; and {len(free) - MAX_NAMED_JOINTS} more joints" if len(free) > MAX_NAMED_JOINTS else ""
    return "\n".join(wrap(f"undetermined because of redundancy, not plotted: {told}{more}", NOTE_WIDTH))


def _force_scale(found: InverseDynamics) -> float:
    """Return the largest force of a joint, the reference for rounding errors."""
    forces = (found.reaction(j.name).one[:, :3] for j in found.result.model.joints)
    return max((float(np.abs(f).max(initial=0.0)) for f in forces), default=0.0)
