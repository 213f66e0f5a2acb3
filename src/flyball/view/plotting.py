"""Matplotlib figures: style, size, panels over time, titles, files."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cache, partial
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np

from ..model.output_files import PICTURE, file_extension, replacing_file
from ..results.wording import with_unit
from .event_marks import draw_marks
from .figures import hidden_counts
from .recording import Mark, Panel

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Drawing

# Okabe and Ito's palette, distinguishable with any colour vision, darkest first.
PALETTE = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#4D4D4D", "#B8A800")
DASH_STYLES: tuple[Any, ...] = ("-", (0, (4, 4)), (0, (1.5, 3)), (0, (6, 2, 1.5, 2)))
MATPLOTLIB_STYLE: dict[str, Any] = {
    "figure.dpi": 100,
    "savefig.dpi": 150,
    "figure.facecolor": "white",
    "font.size": 10,
    "axes.titlesize": 9,
    "axes.titlelocation": "left",
    "axes.titlecolor": "#555555",
    "axes.labelcolor": "#333333",
    "axes.edgecolor": "#8a8a8a",
    "axes.linewidth": 0.8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#e4e4e4",
    "grid.linewidth": 0.7,
    "xtick.color": "#555555",
    "ytick.color": "#555555",
    "lines.linewidth": 1.6,
    "lines.solid_joinstyle": "round",
    "legend.frameon": False,
    "legend.fontsize": 9,
    "legend.handlelength": 2.0,
    "axes.formatter.useoffset": False,
    "axes.formatter.limits": (-3, 5),
    "svg.hashsalt": "flyball",
}
SUPERSCRIPTS = str.maketrans("\N{MINUS SIGN}-0123456789", "⁻⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
FONT_FAMILY = "DejaVu Sans"  # of Matplotlib; not every font has superscript digits
UNIT_TEXTS = {"N*m": "N m", "m/s^2": "m/s²", "rad/s^2": "rad/s²", "1": "-"}
LEGEND_BESIDE: dict[str, Any] = {"loc": "upper left", "bbox_to_anchor": (1.0, 1.04), "borderaxespad": 0.4}


def axis_label(name: str, unit: str) -> str:
    """Return an axis label: name and unit of a quantity."""
    return with_unit(name, UNIT_TEXTS.get(unit, unit))


@contextmanager
def plot_style() -> Iterator[None]:
    """Context manager with flyball's style, for drawing only."""
    import matplotlib
    from cycler import cycler

    style: Any = MATPLOTLIB_STYLE | {"axes.prop_cycle": cycler(color=PALETTE)}
    with matplotlib.rc_context(style):
        yield


def new_figure(height: float, width: float = 8.0) -> Drawing:
    """Return a figure without a window; notebooks still display it."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure as Drawing

    drawing = Drawing(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(drawing)
    drawing._repr_png_ = partial(_png_bytes, drawing)  # type: ignore[attr-defined]
    return drawing


def _png_bytes(drawing: Drawing) -> bytes:
    """Return the PNG image for notebooks."""
    from io import BytesIO

    data = BytesIO()
    drawing.savefig(data, format="png", dpi=100)
    return data.getvalue()


def set_title(drawing: Drawing, title: str) -> None:
    """Put the title above a figure, left-aligned."""
    drawing.suptitle(title, x=0.012, ha="left", fontsize=12, fontweight="bold")


def finish_figure(drawing: Drawing, path: str | os.PathLike | None) -> Drawing | None:
    """Return the figure, or None once it is written to ``path``, which must end in .png, .svg or .pdf."""
    _use_text_numbers(drawing)
    if path is None:
        drawing.align_ylabels()
        return drawing
    kind = file_extension(path, PICTURE)
    with replacing_file(path) as file:
        if kind in (".svg", ".pdf"):
            drawing.align_ylabels()
            drawing.savefig(file, format=kind[1:], metadata={"Date" if kind == ".svg" else "CreationDate": None})
        else:
            _write_png(drawing, file)
    return None


def _write_png(drawing: Drawing, file: BinaryIO) -> None:
    """Lay out and draw the figure only once: `savefig` would draw the same figure three times."""
    import matplotlib
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    drawing.dpi = matplotlib.rcParams["savefig.dpi"]
    layout = drawing.get_layout_engine()
    if layout is not None:
        for ax in drawing.axes:
            ax.spines[:].set_in_layout(False)  # where the axis is, which counts
        layout.execute(drawing)
        drawing.set_layout_engine("none")
    drawing.align_ylabels()  # not before: each axis would be measured again for every other one
    # files are larger by a seventh than with level 6, and written in a third of the time
    FigureCanvasAgg(drawing).print_png(file, pil_kwargs={"compress_level": 3})


def _use_text_numbers(drawing: Drawing) -> None:
    """Use plain text for numbers at axes: they look the same, without typesetting as formulas."""
    from matplotlib.ticker import ScalarFormatter

    plain = _text_formatter()
    for ax in drawing.axes:
        for axis in (ax.xaxis, ax.yaxis):
            if type(axis.get_major_formatter()) is ScalarFormatter:
                axis.set_major_formatter(plain())
                axis.get_offset_text().set_fontfamily(FONT_FAMILY)


@cache
def _text_formatter() -> Any:
    from matplotlib.ticker import ScalarFormatter

    class PlainNumbers(ScalarFormatter):
        """Formatter of numbers as plain text, including their common power of ten."""

        def get_offset(self) -> str:
            text = super().get_offset()
            return f"\N{MULTIPLICATION SIGN}10{text[2:].translate(SUPERSCRIPTS)}" if text.startswith("1e") else text

    return PlainNumbers


def panels_over_time(
    t: np.ndarray, parts: Sequence[Panel], ratios: Sequence[float] = (), marks: Sequence[Mark] = ()
) -> Drawing:
    """Return panels over the times ``t``, one below the other, high enough for their legends, with marks of events."""
    each = [max(2.3, 0.5 + 0.19 * len(p.curves)) for p in parts]
    heights = [h * r for h, r in zip(each, ratios or [1.0] * len(each), strict=False)]
    drawing = new_figure(0.9 + sum(heights))
    axes = drawing.subplots(len(parts), 1, sharex=True, squeeze=False, height_ratios=heights)[:, 0]
    for ax, panel in zip(axes, parts, strict=True):
        plot_panel(ax, t, panel)
    axes[-1].set_xlabel("time [s]")
    draw_marks(list(axes), marks)
    return drawing


def plot_panel(ax: Axes, x: np.ndarray, panel: Panel, legend: Mapping[str, Any] = LEGEND_BESIDE) -> None:
    """Draw curves of one unit over x with a legend; a curve that lies on another one is dashed."""
    values = [c.values for c in panel.curves]
    for k, (c, under) in enumerate(zip(panel.curves, hidden_counts(values), strict=True)):
        style = DASH_STYLES[max(under, k // len(PALETTE)) % len(DASH_STYLES)]
        single = "o" if len(x) == 1 else None
        ax.plot(x, c.values, label=c.name, linestyle=style, marker=single)
    _limit_zoom(ax, values)
    ax.set_ylabel(axis_label(panel.label, panel.unit))
    if panel.note:
        ax.set_title(panel.note)
    if len(x) > 1:
        ax.margins(x=0.0)
    if legend:
        ax.legend(**legend)


def _limit_zoom(ax: Axes, values: Iterable[np.ndarray]) -> None:
    """Do not enlarge the rounding errors of a constant to the height of the axis."""
    finite = np.concatenate([v[np.isfinite(v)] for v in values] or [np.zeros(0)])
    if not len(finite):
        return
    low, high = finite.min(), finite.max()
    middle = (low + high) / 2
    if high - low < 1e-9 * abs(middle) or high == low:
        room = max(abs(middle) * 0.1, 1e-3)
        ax.set_ylim(middle - room, middle + room)
