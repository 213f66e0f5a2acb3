"""Marks of events on time axes: which of them are drawn, and what is written above them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from .mark_names import draw_names
from .recording import Mark

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..results.result import Result

LINES = 30  # lines through a panel; of more events there are short ticks at its upper edge
SELDOM = 5  # times that an event may happen to be a line among very many others
NEAR = 0.004  # of the time span: what happens within it is one mark
LONG = 30  # letters of a name
DASHED = (0, (3, 2))
COLOR = "#96448a"
MOST = 3  # names of one mark


def marks(result: Result) -> tuple[Mark, ...]:
    """What happened at instants, as marks on a time axis: what is close together is one.

    Where there are very many, only what happens seldom is a line. Each name is told at the first of its lines, with how
    often it happens in all.
    """
    if not len(result.t) or not len(result.events):
        return ()
    near = NEAR * float(result.t[-1] - result.t[0])
    groups: list[tuple[float, list[str]]] = []
    for h in result.events:
        if groups and h.t - groups[-1][0] <= near:
            groups[-1][1].append(h.name)
        else:
            groups.append((h.t, [h.name]))
    counts = Counter(h.name for h in result.events)
    seldom = [any(counts[name] <= SELDOM for name in names) for _, names in groups]
    few, some = len(groups) <= LINES, sum(seldom) <= LINES
    lines = [few or (some and one) for one in seldom]
    asked = {e.name for e in result.model.events}
    rank = {name: (name not in asked, counts[name]) for name in counts}
    order = {name: k for k, name in enumerate(sorted(rank, key=rank.__getitem__))}
    said, out = set[str](), []
    for (t, names), line in zip(groups, lines, strict=True):
        new = sorted({*names} - said if line else (), key=order.__getitem__)
        said |= set(new)
        first = order[new[0]] if new else 0
        text = told(sorted(names, key=counts.__getitem__))
        out.append(Mark(t, text, line, told([x for x in new for _ in range(counts[x])]), first))
    return tuple(out)


def told(names: Sequence[str]) -> str:
    """Names of what happened, each once, and how often."""
    counts = {name: names.count(name) for name in dict.fromkeys(names)}
    texts = [f"{name} ×{n}" if n > 1 else name for name, n in counts.items()]
    more = f", {len(texts) - MOST} more" if len(texts) > MOST else ""
    return ", ".join(texts[:MOST]) + more


def draw_marks(axes: Sequence[Axes], every: Sequence[Mark]) -> None:
    """Thin vertical lines through the panels, names above the first one where there is room; the rest are ticks."""
    if not every:
        return
    low, high = axes[0].get_xlim()
    inside = [m for m in every if low <= m.t <= high]
    for ax in axes:
        kinds: list[tuple[bool, tuple[float, float], Any]] = [(True, (0.0, 1.0), DASHED), (False, (0.97, 1.0), "-")]
        for line, ends, dashes in kinds:
            times = [m.t for m in inside if m.line == line]
            across = ax.get_xaxis_transform()
            ax.vlines(times, *ends, transform=across, colors=COLOR, linewidth=0.8, zorder=0.9, linestyles=dashes)
        ax.set_xlim(low, high)
    draw_names(axes[0], [m for m in inside if m.label], COLOR)
