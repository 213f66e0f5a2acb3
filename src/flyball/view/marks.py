"""Marks of events on time axes: which of them are drawn, and what is written beside them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from .recording import Mark

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..results.result import Result

LINES = 30  # lines through a panel; of more events there are short ticks at its upper edge
SELDOM = 5  # times that an event may happen to be a line among very many others
NEAR = 0.004  # of the time span: what happens within it is one mark
APART = 0.03  # of the time span between two names
LONG = 30  # letters of a name beside a line
DASHED = (0, (3, 2))
COLOR = "#8a8a8a"
MOST = 3  # names of one mark


def marks(result: Result) -> tuple[Mark, ...]:
    """What happened at instants, as marks on a time axis: what is close together is one.

    Where there are very many, only what happens seldom is a line.
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
    return tuple(
        Mark(t, told(sorted(names, key=counts.__getitem__)), few or (some and one))
        for (t, names), one in zip(groups, seldom, strict=True)
    )


def told(names: Sequence[str]) -> str:
    """Names of what happened at one mark, each once, and how often."""
    counts = {name: names.count(name) for name in dict.fromkeys(names)}
    texts = [f"{name} ({n} times)" if n > 1 else name for name, n in counts.items()]
    more = f", {len(texts) - MOST} more" if len(texts) > MOST else ""
    return ", ".join(texts[:MOST]) + more


def draw_marks(axes: Sequence[Axes], every: Sequence[Mark]) -> None:
    """Thin vertical lines through the panels, with names in the first one where there is room; the rest are ticks."""
    if not every:
        return
    low, high = axes[0].get_xlim()
    inside = [m for m in every if low <= m.t <= high]
    for ax in axes:
        kinds: list[tuple[bool, tuple[float, float], Any]] = [(True, (0.0, 1.0), DASHED), (False, (0.97, 1.0), "-")]
        for line, ends, dashes in kinds:
            times = [m.t for m in inside if m.line == line]
            across = ax.get_xaxis_transform()
            ax.vlines(times, *ends, transform=across, colors=COLOR, linewidth=0.6, zorder=0.9, linestyles=dashes)
        ax.set_xlim(low, high)
    _named(axes[0], [m for m in inside if m.line], high - low)


def _named(ax: Axes, inside: Sequence[Mark], span: float) -> None:
    """Names along the lines, from the upper edge down: each once, where the name before it is far enough."""
    last, counts, said = -float("inf"), Counter(m.text for m in inside), set[str]()
    for m in inside:
        if m.text in said or m.t - last < APART * span:
            continue
        last = m.t
        said.add(m.text)
        text = m.text if len(m.text) <= LONG else f"{m.text[: LONG - 1]}…"
        text += f" (1 of {counts[m.text]})" if counts[m.text] > 1 else ""
        right = m.t > ax.get_xlim()[1] - 0.5 * APART * span
        ax.annotate(
            text, (m.t, 1.0), xycoords=ax.get_xaxis_transform(), xytext=(-2 if right else 2, -2),
            textcoords="offset points", rotation=90, va="top", ha="right" if right else "left", fontsize=7, color=COLOR,
            annotation_clip=False, bbox={"facecolor": "white", "alpha": 0.75, "edgecolor": "none", "pad": 0.4},
        ).set_in_layout(False)  # fmt: skip
