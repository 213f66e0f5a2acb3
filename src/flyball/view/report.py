"""The report: one page with what a run says of itself, its motion, its curves, and the model that it is of."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from html import escape
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from ..model.io import dumps
from .animate import record, shown_times
from .figures import figures
from .page import document
from .recording import Channel, Figure
from .tabled import Table
from .tables import tables

if TYPE_CHECKING:
    from ..results.health import Health
    from ..results.result import Result


WARNINGS = 6  # that are told at the top
HEAD, NOTE = 0.3, 0.1  # heights of a figure's heading and of a note below a panel, over that of a panel


def report(result: Result, **options: Any) -> str:
    """Write a result as one HTML document: summary, animation, plots, tables of the model, and its file.

    Parameters
    ----------
    result : Result
    **options
        ``paths`` and ``show``, as in `flyball.view.animate.animation`.

    Returns
    -------
    str
        A document that needs nothing else and opens offline in any browser.

    Raises
    ------
    ModelError
        If there is no output time, so nothing to draw.
    """
    recording = record(result, **options)
    whole, every, _, _ = shown_times(result)
    chosen = tuple(_thinned(f, every) for f in figures(whole))
    parts = tables(result)
    names = {"animation": "Animation", **{f"plot-{f.name}": f.title for f in chosen}}
    names |= {f"table-{t.name}": t.title for t in parts if t.title} | {"file": "Model file"}
    links = "".join(f'<a href="#{key}">{escape(title)}</a>' for key, title in names.items())
    before = (
        f'<div class="report">\n<div class="top"><h1>{escape(result.model.name)}</h1>'
        f"<p>{escape(_headline(result))}</p>\n{_verdict(result)}\n<dl class='cards'>{_cards(result)}</dl>\n"
        f'<nav aria-label="Contents">{links}</nav></div>\n<section id="animation" class="frame">\n'
    )
    plots = _columns(chosen)
    after = (
        f'</section>\n<section class="charts">\n{plots}</section>\n{"".join(map(_table, parts))}'
        f"{_file(result)}\n<footer class='by'>{escape(_made_by())}</footer>\n</div>\n"
    )
    return document(replace(recording, figures=chosen), "<h2>Animation</h2>", before, after)


def _thinned(figure: Figure, every: np.ndarray) -> Figure:
    """The figure at the times that are shown."""
    panels = tuple(
        replace(p, curves=tuple(Channel(c.name, c.unit, np.asarray(c.values)[every]) for c in p.curves))
        for p in figure.panels
    )
    return replace(figure, panels=panels)


def _headline(result: Result) -> str:
    m = result.model
    counts: dict[str, list] = {
        "body": m.bodies,
        "set of bodies": m.bulk,
        "joint": m.joints,
        "coupling": m.couplings,
        "force": m.forces,
        "driver": m.drivers,
        "contact": m.contacts,
    }
    many = {"body": "bodies", "set of bodies": "sets of bodies"}
    parts = [f"{len(x)} {k if len(x) == 1 else many.get(k, k + 's')}" for k, x in counts.items() if x]
    span = f"{result.t[0]:g} to {result.t[-1]:g} s, {len(result.t)} output times"
    return f"{'Planar' if result.planar else 'Spatial'} mechanism: {', '.join(parts)}; {span}"


def _verdict(result: Result) -> str:
    """One line that says whether the run came to its end, and what there is to look at twice."""
    h = result.health
    kind, text = ("good", "The run reached its end.") if h.success else ("bad", f"The run stopped: {h.message}")
    if h.ended_early:
        kind, text = "early", f"The run {h.message}."
    if h.success and h.doubtful:
        kind, text = "bad", f"{text.removesuffix('.')}, but is doubtful."
    warnings = h.warnings
    if warnings:
        count = "1 warning" if len(warnings) == 1 else f"{len(warnings)} warnings"
        kind, text = ("early" if kind == "good" else kind), f"{text.removesuffix('.')}; {count}."
    listed = "".join(f"<li>{escape(w)}</li>" for w in warnings[:WARNINGS])
    if len(warnings) > WARNINGS:
        listed += f'<li><a href="#table-run">{len(warnings) - WARNINGS} more</a></li>'
    told = f'\n<ul class="warnings">{listed}</ul>' if warnings else ""
    return f'<p class="verdict {kind}" role="status">{escape(text)}</p>{told}'


def number(value: float) -> str:
    """A figure with three digits, as a power of ten where it is small or large."""
    return f"{value:.2e}" if value and not 1e-3 <= abs(value) < 1e5 else f"{value:.4g}"


def _cards(result: Result) -> str:
    """The figures that tell at a glance whether to trust the run; exact values in ``data-value``."""
    h = result.health
    largest = float(np.nanmax(np.abs(result.energy.total), initial=0.0))
    known = not np.isnan(h.energy_drift)
    relative = f"{h.energy_drift / largest:.1e} of the largest energy" if known and largest > 0.0 else ""
    cards: list[tuple[str, str, float, str]] = [
        ("Freedoms", str(h.freedoms), h.freedoms, "by rank, at the start"),
        ("Redundant parts", str(len(h.redundant)), len(h.redundant), ", ".join(h.redundant) or "none too many"),
        (
            "Energy balance",
            f"{number(h.energy_drift)} J" if known else "not measured",
            h.energy_drift,
            (relative or "largest deviation") if known else "fewer than two output times",
        ),
        ("Violation", number(h.violation), h.violation, "largest gap of a constraint [m or rad]"),
        ("Velocity violation", number(h.velocity_violation), h.velocity_violation, "[m/s or rad/s]"),
        ("Steps", str(h.steps), h.steps, f"{h.rejected} refused, {_time(h)}"),
    ]
    return "".join(
        f'<div><dt>{escape(term)}</dt><dd data-value="{value!r}">{escape(text)}</dd>'
        f'<dd class="more">{escape(more)}</dd></div>'
        for term, text, value, more in cards
    )


def _time(h: Health) -> str:
    """What was computed, and what was compiled first."""
    compiled = f", after {h.compiling:.1f} s of compiling" if h.compiling > 0.1 * h.seconds else ""
    return f"{h.seconds - h.compiling:.2f} s of computing{compiled}"


def _columns(chosen: Sequence[Figure]) -> str:
    """Two columns of figures that end as nearly together as can be; each figure knows its place for a single column."""
    heights = [HEAD + sum(1.0 + bool(p.note) * NOTE for p in f.panels) for f in chosen]

    def apart(right: tuple[bool, ...]) -> float:
        return abs(sum(-h if aside else h for h, aside in zip(heights, right, strict=True)))

    sides = product((False,), *[(False, True)] * (len(chosen) - 1)) if chosen else ()
    best = min(sides, key=apart, default=())
    columns = ("".join(_plot(f, k) for k, f in enumerate(chosen) if best[k] is aside) for aside in (False, True))
    return "".join(f'<div class="column">{plots}</div>' for plots in columns)


def _plot(figure: Figure, place: int) -> str:
    note = f"<p>{escape(figure.note)}</p>" if figure.note else ""
    return (
        f'<article id="plot-{figure.name}" style="order: {place}"><h2>{escape(figure.title)}</h2>{note}'
        f'<div data-figure="{escape(figure.name)}"></div></article>\n'
    )


def _table(table: Table) -> str:
    def row(cells: Iterable[str], tag: str = "td") -> str:
        return "<tr>" + "".join(f"<{tag}>{escape(c)}</{tag}>" for c in cells) + "</tr>"

    body = "".join(map(row, table.rows))
    foot = f"<tfoot>{row(table.total)}</tfoot>" if table.total else ""
    note = f"<p>{escape(table.note)}</p>" if table.note else ""
    title = f"<h2>{escape(table.title)}</h2>" if table.title else ""
    grid = (
        f'<div class="wide"><table><thead>{row(table.columns, "th")}</thead><tbody>{body}</tbody>{foot}</table></div>'
    )
    if table.folded:
        grid = f"<details><summary>{escape(table.folded)}</summary>{note}{grid}</details>"
        note = ""
    return f'<section class="listing" id="table-{table.name}">{title}{note}{grid}</section>\n'


def _file(result: Result) -> str:
    """The model's file, to be opened and copied."""
    return (
        '<section class="listing" id="file"><h2>Model file</h2><details><summary>TOML text, as '
        '<code>flyball.load</code> reads it</summary><button type="button" data-copy="toml">Copy</button>'
        f'<pre id="toml">{escape(dumps(result.model))}</pre></details></section>'
    )


def _made_by() -> str:
    from .. import __version__

    return f"Made by flyball {__version__}"
