"""Names of marks above a time axis, in lanes one above the other: the most important ones first, as far as they fit."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import permutations
from typing import TYPE_CHECKING, Any, NamedTuple

from .recording import Mark

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SIZE = 7.5  # of the letters [pt]
LETTER = 0.56 * SIZE  # their mean width
LANE = 1.3 * SIZE
LANES = 5
ROOM = 3.0  # between names, and below them [pt]
LONG = 40  # letters of a name
BESIDE = 0.72  # part of the picture's width that axes with a legend beside them have
THIN = 0.8


class Placed(NamedTuple):
    """A name in a lane, to the right of its mark or to the left."""

    mark: Mark
    lane: int
    right: bool


def draw_names(ax: Axes, named: Sequence[Mark], color: str) -> None:
    """Write names above the axes, each with a line up from its mark; a title of the axes goes above them."""
    low, high = ax.get_xlim()
    width = BESIDE * 72.0 * ax.figure.get_figwidth()  # type: ignore[union-attr]
    found = placed(named, [width * (m.t - low) / (high - low) for m in named], width)
    if not found:
        return
    across = ax.get_xaxis_transform()
    for m, lane, right in found:
        up = ROOM + lane * LANE
        line: dict[str, Any] = {"arrowstyle": "-", "color": color, "linewidth": THIN, "shrinkA": 0.0, "shrinkB": 0.0}
        at: dict[str, Any] = {"xycoords": across, "textcoords": "offset points", "annotation_clip": False}
        ax.annotate("", (m.t, 1.0), (0.0, up + LANE), arrowprops=line, **at).set_in_layout(False)
        side = "left" if right else "right"
        shift = ROOM if right else -ROOM
        ax.annotate(shortened(m.label), (m.t, 1.0), (shift, up), ha=side, va="bottom", fontsize=SIZE, color=color, **at)
    if title := ax.get_title(loc="left"):
        ax.set_title(title, pad=2.0 * ROOM + LANE * (1 + max(lane for _, lane, _ in found)))


def shortened(text: str) -> str:
    """A name of a length that can be written."""
    return text if len(text) <= LONG else f"{text[: LONG - 1]}…"


def placed(named: Sequence[Mark], at: Sequence[float], width: float) -> list[Placed]:
    """Lanes for names of marks at places [pt] on an axis of some width: as many as fit, by their rank.

    Lines go up to higher lanes beside names, not through them: a name is above all whose marks are below it.
    """
    kept: list[tuple[Mark, float, bool, tuple[float, float]]] = []
    lanes: list[int] = []
    for k in sorted(range(len(named)), key=lambda k: named[k].rank):
        x, long = at[k], LETTER * len(shortened(named[k].label)) + 2.0 * ROOM
        right = x + long <= width
        more = [*kept, (named[k], x, right, (x, x + long) if right else (x - long, x))]
        found = _lanes([x for _, x, _, _ in more], [span for *_, span in more])
        if found is not None and more[-1][3][0] >= 0.0:
            kept, lanes = more, found
    return [Placed(m, lane, right) for (m, _, right, _), lane in zip(kept, lanes, strict=True)]


def _lanes(at: Sequence[float], spans: Sequence[tuple[float, float]]) -> list[int] | None:
    """The lowest lanes for names over these spans; None if there are not enough."""
    out = [0] * len(at)
    pairs = list(permutations(range(len(at)), 2))
    for _ in range(LANES * len(at)):
        low = [j for j, k in pairs if out[j] <= out[k] and _over(at, spans, out, j, k)]
        if not low:
            return out
        out[low[0]] += 1
        if out[low[0]] >= LANES:
            return None
    return None


def _over(at: Sequence[float], spans: Sequence[tuple[float, float]], lanes: Sequence[int], j: int, k: int) -> bool:
    """Whether name j has to be above name k: the mark of k is below it, or else they overlap and j comes first."""
    (a, b), (c, d) = spans[j], spans[k]
    if a - ROOM < at[k] < b + ROOM and at[k] != at[j]:
        return True
    behind = c - ROOM < at[j] < d + ROOM
    return lanes[j] == lanes[k] and max(a, c) < min(b, d) and not behind and at[j] < at[k]
