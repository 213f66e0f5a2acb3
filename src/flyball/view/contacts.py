"""Contact forces over time, and how far the solves behind them went."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import ModelError
from .drawing import BESIDE, PALETTE, handed_out, headed, new_figure, stacked, styled
from .recording import Channel, Panel

if TYPE_CHECKING:
    from ..results.contacts import Contacts
    from ..results.convergence import Convergence

MOST = 8  # pairs that are drawn where none are named


def plot_contacts(
    contacts: Contacts, pairs: Sequence[Sequence[str]] = (), path: str | os.PathLike | None = None
) -> Any:
    """Draw normal and tangential contact forces over time.

    Parameters
    ----------
    contacts : Contacts
    pairs : pairs of names
        Who and whom, as `Contacts.between` has them; if none are named, those of the largest forces, eight at most.
    path : path, optional
        Write a PNG, SVG or PDF file, by the suffix, instead of returning the figure.

    Raises
    ------
    ModelError
        If nothing touched and no pair is named, a name is unknown, or the file cannot be written.
    """
    if any(isinstance(p, str) or len(p) != 2 for p in pairs):
        raise ModelError("contacts: name pairs of two names, such as plot(('ball', 'ground'), ('ball', 'wall'))")
    chosen = [tuple(p) for p in pairs] or _largest(contacts)
    if not chosen:
        raise ModelError("nothing touched at any output time: there are no contact forces to draw")
    found = [contacts.between(a, b) for a, b in chosen]
    parts = [
        Panel(label, tuple(Channel(f"{f.by}, {f.on}", "N", getattr(f, what)) for f in found))
        for label, what in (("normal force", "normal_force"), ("tangential force", "tangential_force"))
    ]
    with styled():
        drawing = stacked(contacts.t, parts)
        headed(drawing, "contact forces")
        return handed_out(drawing, path)


def _largest(contacts: Contacts) -> list[tuple[str, ...]]:
    """The pairs with the largest normal forces, in their order."""
    if not len(contacts):
        return []
    every, which = np.unique(contacts.pair, axis=0, return_inverse=True)
    size = np.zeros(len(every))
    np.maximum.at(size, which.ravel(), contacts.normal_force)
    best = np.sort(np.argsort(-size)[:MOST])
    return [(contacts.sides.name(a), contacts.sides.name(b)) for a, b in every[best].tolist()]


def plot_convergence(histories: Sequence[Convergence], path: str | os.PathLike | None = None) -> Any:
    """Draw residuals as velocities and as forces, in logarithmic scale; several solvers beside each other.

    Raises
    ------
    ModelError
        If they are over different things, or the file cannot be written.
    """
    over = {h.over for h in histories}
    if len(over) != 1:
        raise ModelError("convergence: give histories that are all over time, or all over iterations")
    unit = "time [s]" if over == {"time"} else "iteration"
    with styled():
        drawing = new_figure(5.4)
        axes = drawing.subplots(2, 1, sharex=True)
        for ax, what, label in zip(axes, ("velocity", "force"), ("residual [m/s]", "residual force [-]"), strict=True):
            for k, h in enumerate(histories):
                values = np.where(np.asarray(getattr(h, what)) > 0.0, getattr(h, what), np.nan)
                ax.semilogy(h.x, values, label=h.solver or "solves", color=PALETTE[k % len(PALETTE)])
            ax.set_ylabel(label)
            ax.legend(**BESIDE)
        axes[-1].set_xlabel(unit)
        headed(drawing, "residuals of contact solves")
        return handed_out(drawing, path)
