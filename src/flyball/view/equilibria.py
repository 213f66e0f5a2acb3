"""Pictures of series of equilibria: curves over a parameter, unstable parts dashed."""

from __future__ import annotations

import os
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from ..results.equilibrium import UNSTABLE
from .drawing import BESIDE, PALETTE, handed_out, headed, new_figure, styled, titled
from .figures import LABELS

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..results.equilibria import EquilibriumSeries
    from ..results.equilibrium import Equilibrium

UNSOUND = (0, (3.5, 2.5))
JUMPED = (0, (1.0, 2.0))

Stretch = list[tuple[float, "Equilibrium"]]


def series(found: EquilibriumSeries, *names: str, path: str | os.PathLike | None = None) -> Any:
    """Curves over the parameter; those of equal unit share an axis. See `EquilibriumSeries.plot`."""
    chosen = names or tuple(found.telling())
    units: dict[str, list[str]] = {}
    for name in chosen:
        units.setdefault(found.channel(name)[0], []).append(name)
    with styled():
        drawing = new_figure(0.9 + 2.9 * max(len(units), 1))
        axes = drawing.subplots(max(len(units), 1), 1, sharex=True, squeeze=False)[:, 0]
        for ax, (unit, group) in zip(axes, units.items(), strict=False):
            for k, name in enumerate(group):
                _curve(ax, found, name, PALETTE[k % len(PALETTE)])
            ax.set_ylabel(titled(LABELS.get(unit, ""), unit))
        _explained(axes[0], found)
        for ax in axes:
            if ax.get_legend_handles_labels()[1]:
                ax.legend(**BESIDE)
        axes[-1].set_xlabel("time [s]" if found.parameter == "t" else found.parameter)
        drawing.align_ylabels(axes)
        headed(drawing, f"{found.name}: equilibria over {found.parameter}")
        return handed_out(drawing, path)


def stretches(found: EquilibriumSeries) -> list[Stretch]:
    """The equilibria in order, with those at jumps, cut where it jumps."""
    out: list[Stretch] = [[]]
    jumps = list(found.jumps)
    for k, (value, e) in enumerate(zip(found.values, found.equilibria, strict=True)):
        before = found.values[k - 1] if k else value
        while jumps and min(before, value) <= jumps[0].value <= max(before, value):
            j = jumps.pop(0)
            out[-1].append((j.value, j.before))
            out.append([(j.value, j.after)])
        out[-1].append((float(value), e))
    return out


def _curve(ax: Axes, found: EquilibriumSeries, name: str, color: str) -> None:
    cuts = stretches(found)
    ax.plot([], [], color=color, label=name)
    for part in cuts:
        x = np.array([value for value, _ in part])
        y = np.array([e[name] for _, e in part])
        bad = np.array([e.stability == UNSTABLE for _, e in part])
        for dashed, style in ((False, "-"), (True, UNSOUND)):
            own = (bad[:-1] | bad[1:]) == dashed
            points = np.full((3, 2, len(own)), np.nan)  # segments, each ended by a gap
            points[0], points[1] = (x[:-1], y[:-1]), (x[1:], y[1:])
            ax.plot(*points[:, :, own].transpose(1, 2, 0).reshape(2, -1), color=color, linestyle=style)
        if len(found.values) < 16 or len(part) == 1:
            ax.plot(x, y, ".", color=color, markersize=5)
    for a, b in pairwise(cuts):
        (x0, before), (x1, after) = a[-1], b[0]
        ax.plot([x0, x1], [before[name], after[name]], color=color, linestyle=JUMPED, linewidth=1.2)


def _explained(ax: Axes, found: EquilibriumSeries) -> None:
    """What dashes and dots mean, where there are some."""
    if UNSTABLE in found.stability or any(j.before.stability == UNSTABLE for j in found.jumps):
        ax.plot([], [], color="#555555", linestyle=UNSOUND, label="unstable")
    if found.jumps:
        ax.plot([], [], color="#555555", linestyle=JUMPED, linewidth=1.2, label="jump")
