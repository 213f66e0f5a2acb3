"""Marks at the instants of events: their names, and how figures show them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from itertools import permutations
from typing import TYPE_CHECKING, Any, NamedTuple

from .recording import Mark

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..results.result import Result


FONT_SIZE = 7.5  # size of the letters [pt]
LETTER_WIDTH = 0.56 * FONT_SIZE  # their mean width
LANE_HEIGHT = 1.3 * FONT_SIZE
MAX_LANES = 5
NAME_GAP = 3.0  # spacing between names, and below them [pt]
MAX_NAME_LETTERS = 40  # characters of a name
AXES_WIDTH_PART = 0.72  # relative width of axes with a legend beside them
NAME_LINE_WIDTH = 0.8


class PlacedName(NamedTuple):
    """A name in a row of labels, to the right or left of its mark."""

    mark: Mark
    lane: int
    right: bool


def draw_names(ax: Axes, named: Sequence[Mark], color: str) -> None:
    """Write names above the axes, each with a line up from its mark; the title of the axes is moved above them."""
    low, high = ax.get_xlim()
    width = AXES_WIDTH_PART * 72.0 * ax.figure.get_figwidth()  # type: ignore[union-attr]
    found = place_names(named, [width * (m.t - low) / (high - low) for m in named], width)
    if not found:
        return
    across = ax.get_xaxis_transform()
    for m, lane, right in found:
        up = NAME_GAP + lane * LANE_HEIGHT
        line: dict[str, Any] = {
            "arrowstyle": "-",
            "color": color,
            "linewidth": NAME_LINE_WIDTH,
            "shrinkA": 0.0,
            "shrinkB": 0.0,
        }
        at: dict[str, Any] = {"xycoords": across, "textcoords": "offset points", "annotation_clip": False}
        ax.annotate("", (m.t, 1.0), (0.0, up + LANE_HEIGHT), arrowprops=line, **at).set_in_layout(False)
        side = "left" if right else "right"
        shift = NAME_GAP if right else -NAME_GAP
        ax.annotate(
            shortened_name(m.label),
            (m.t, 1.0),
            (shift, up),
            ha=side,
            va="bottom",
            fontsize=FONT_SIZE,
            color=color,
            **at,
        )
    if title := ax.get_title(loc="left"):
        ax.set_title(title, pad=2.0 * NAME_GAP + LANE_HEIGHT * (1 + max(lane for _, lane, _ in found)))


def shortened_name(text: str) -> str:
    """Return a name shortened to the permitted length."""
    return text if len(text) <= MAX_NAME_LETTERS else f"{text[: MAX_NAME_LETTERS - 1]}…"


def place_names(named: Sequence[Mark], at: Sequence[float], width: float) -> list[PlacedName]:
    """Return rows for the names of marks at positions [pt] on an axis of some width: as many as fit, by rank.

    Lines to higher rows pass beside names, not through them: a name is above all names whose
    marks are under it.
    """
    kept: list[tuple[Mark, float, bool, tuple[float, float]]] = []
    lanes: list[int] = []
    for k in sorted(range(len(named)), key=lambda k: named[k].rank):
        x, long = at[k], LETTER_WIDTH * len(shortened_name(named[k].label)) + 2.0 * NAME_GAP
        right = x + long <= width
        more = [*kept, (named[k], x, right, (x, x + long) if right else (x - long, x))]
        found = _assign_lanes([x for _, x, _, _ in more], [span for *_, span in more])
        if found is not None and more[-1][3][0] >= 0.0:
            kept, lanes = more, found
    return [PlacedName(m, lane, right) for (m, _, right, _), lane in zip(kept, lanes, strict=True)]


def _assign_lanes(at: Sequence[float], spans: Sequence[tuple[float, float]]) -> list[int] | None:
    """Return the lowest rows for names with these spans; None if there are not enough."""
    out = [0] * len(at)
    pairs = list(permutations(range(len(at)), 2))
    for _ in range(MAX_LANES * len(at)):
        low = [j for j, k in pairs if out[j] <= out[k] and _must_be_above(at, spans, out, j, k)]
        if not low:
            return out
        out[low[0]] += 1
        if out[low[0]] >= MAX_LANES:
            return None
    return None


def _must_be_above(
    at: Sequence[float], spans: Sequence[tuple[float, float]], lanes: Sequence[int], j: int, k: int
) -> bool:
    """Return whether name j has to be above name k: the mark of k is under j, or they overlap and j is first."""
    (a, b), (c, d) = spans[j], spans[k]
    if a - NAME_GAP < at[k] < b + NAME_GAP and at[k] != at[j]:
        return True
    behind = c - NAME_GAP < at[j] < d + NAME_GAP
    return lanes[j] == lanes[k] and max(a, c) < min(b, d) and not behind and at[j] < at[k]


MAX_MARK_LINES = 30  # largest number of lines through a panel; further events get short ticks at its upper edge
RARE_COUNT = 5  # largest number of occurrences of an event drawn as lines among very many others
MERGED_SPAN = 0.004  # relative to the time span: events closer than this are one mark
MAX_LABEL_LETTERS = 30  # characters of a name
MARK_DASHES = (0, (3, 2))
MARK_COLOR = "#96448a"
MAX_MARK_NAMES = 3  # number of names of one mark


def event_marks(result: Result) -> tuple[Mark, ...]:
    """Return events as marks on a time axis; close events share a mark.

    If there are very many, only rare events are lines. Each name is written at its first line, with its total count.
    """
    if not len(result.t) or not len(result.events):
        return ()
    near = MERGED_SPAN * float(result.t[-1] - result.t[0])
    groups: list[tuple[float, list[str]]] = []
    for h in result.events:
        if groups and h.t - groups[-1][0] <= near:
            groups[-1][1].append(h.name)
        else:
            groups.append((h.t, [h.name]))
    counts = Counter(h.name for h in result.events)
    seldom = [any(counts[name] <= RARE_COUNT for name in names) for _, names in groups]
    few, some = len(groups) <= MAX_MARK_LINES, sum(seldom) <= MAX_MARK_LINES
    lines = [few or (some and one) for one in seldom]
    asked = {e.name for e in result.model.events}
    rank = {name: (name not in asked, counts[name]) for name in counts}
    order = {name: k for k, name in enumerate(sorted(rank, key=rank.__getitem__))}
    said, out = set[str](), []
    for (t, names), line in zip(groups, lines, strict=True):
        new = sorted({*names} - said if line else (), key=order.__getitem__)
        said |= set(new)
        first = order[new[0]] if new else 0
        text = event_names_text(sorted(names, key=counts.__getitem__))
        out.append(Mark(t, text, line, event_names_text([x for x in new for _ in range(counts[x])]), first))
    return tuple(out)


def event_names_text(names: Sequence[str]) -> str:
    """Return the names of events, each once, with counts."""
    counts = {name: names.count(name) for name in dict.fromkeys(names)}
    texts = [f"{name} ×{n}" if n > 1 else name for name, n in counts.items()]
    more = f", {len(texts) - MAX_MARK_NAMES} more" if len(texts) > MAX_MARK_NAMES else ""
    return ", ".join(texts[:MAX_MARK_NAMES]) + more


def draw_marks(axes: Sequence[Axes], every: Sequence[Mark]) -> None:
    """Draw thin vertical lines through the panels, with names above the first if space permits; the rest are ticks."""
    if not every:
        return
    low, high = axes[0].get_xlim()
    inside = [m for m in every if low <= m.t <= high]
    for ax in axes:
        kinds: list[tuple[bool, tuple[float, float], Any]] = [
            (True, (0.0, 1.0), MARK_DASHES),
            (False, (0.97, 1.0), "-"),
        ]
        for line, ends, dashes in kinds:
            times = [m.t for m in inside if m.line == line]
            across = ax.get_xaxis_transform()
            ax.vlines(times, *ends, transform=across, colors=MARK_COLOR, linewidth=0.8, zorder=0.9, linestyles=dashes)
        ax.set_xlim(low, high)
    draw_names(axes[0], [m for m in inside if m.label], MARK_COLOR)
