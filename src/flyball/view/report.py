"""The report of a run: one page with health, animation, curves, tables of model and events, and the model file."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields, replace
from html import escape
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from ..constraints.switches.switch_kind import FROZEN, OFF
from ..model.element import written_fields
from ..model.joint import Joint
from ..model.model_files import dumps
from ..results.events import EventRecord, Moment
from ..results.wording import tuple_text
from .animation import attachment_text, motion_to_show, record_comparison
from .figures import standard_figures
from .page import player_page
from .recording import Channel, Figure

if TYPE_CHECKING:
    from ..model.model import Model
    from ..results.health import Health
    from ..results.result import Result
    from ..tables.values import Values


@dataclass(frozen=True)
class ReportTable:
    """Columns, rows of texts, and the texts above and below."""

    name: str
    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    total: tuple[str, ...] = ()
    note: str = ""
    folded: str = ""  # heading to click for unfolding


MAX_WITHOUT_SUMMARY = 12  # number of events listed without a summary
FIRST_LISTED, LAST_LISTED = 150, 50  # number of listed events if there are more


def events(result: Result) -> list[ReportTable]:
    """Return the list of events; if there are many, it is folded and preceded by their counts."""
    found = _event_list(list(result.events))
    return found if result.events.lost.any() else [_without_last_column(t) for t in found]


def _without_last_column(t: ReportTable) -> ReportTable:
    """Return a table without its last column."""
    return replace(t, columns=t.columns[:-1], rows=tuple(row[:-1] for row in t.rows), total=t.total[:-1])


def _event_list(every: list[EventRecord]) -> list[ReportTable]:
    columns = ("t [s]", "name", "kind", "what was done", "energy lost [J]")
    if len(every) <= MAX_WITHOUT_SUMMARY:
        return [ReportTable("events", "Events", columns, tuple(_event_rows(every)))]
    shown, note = every, ""
    if len(every) > FIRST_LISTED + LAST_LISTED:
        shown = [*every[:FIRST_LISTED], *every[-LAST_LISTED:]]
        note = f"The first {FIRST_LISTED} and the last {LAST_LISTED} of {len(every)}; run.events has all."
    rows = _event_rows(shown)
    if note:
        rows.insert(FIRST_LISTED, ("...", f"{len(every) - FIRST_LISTED - LAST_LISTED} more", "", "", ""))
    listed = ReportTable(
        "all-events", "", columns, tuple(rows), note=note, folded=f"All {len(every)} in the order of time"
    )
    return [_event_summary(every), listed]


def _event_rows(every: Sequence[EventRecord]) -> list[tuple[str, ...]]:
    return [(f"{h.t:.6g}", h.name, h.kind, "; ".join(h.done) or "noted", _lost_energy_text([h])) for h in every]


def _lost_energy_text(every: Sequence[EventRecord]) -> str:
    """Return the total energy lost, if any."""
    lost = sum(h.lost for h in every)
    return f"{lost:.4g}" if lost else ""


def _event_summary(every: Sequence[EventRecord]) -> ReportTable:
    """Return how often each event occurred, first and last time, and lost energy."""
    groups: dict[tuple[str, str], list[EventRecord]] = {}
    for h in every:
        groups.setdefault((h.name, h.kind), []).append(h)
    rows = []
    for (name, kind), own in groups.items():
        rows.append((name, kind, str(len(own)), f"{own[0].t:.6g}", f"{own[-1].t:.6g}", _lost_energy_text(own)))
    columns = ("name", "kind", "times", "first at [s]", "last at [s]", "energy lost [J]")
    return ReportTable(
        "events", "Events", columns, tuple(rows), ("all", "", str(len(every)), "", "", _lost_energy_text(every))
    )


def holding(result: Result) -> ReportTable:
    """Return the table of switching elements: initial and final state, and fraction of the time active."""
    columns = ("part", "kind", "acts on", "at the start", "at the end", "of output times", "listed above")
    title = "Stops, ropes, latches and friction"
    if result.phases is None or not len(result.t):
        return ReportTable("holding", title, columns, ())
    held = _active_switches(result)
    counts, rows = result.events.counts(), []
    for k, x in enumerate(result.phases.all[0].values.structure.switches):
        yes, no = x.switch.kind.states
        if not yes:
            continue
        told = [yes if held[k, i] else no for i in (0, -1)]
        if result.phases.all[-1].modes.released[k] != 0.0 and not x.switch.kind.permanent:
            told[-1] = "released"
        event = x.element.category == "events"
        name = x.switch.label if event else x.element.name
        kind = "locked by events" if event else type(x.element).__name__
        times = "once" if counts.get(name) == 1 else f"{counts[name]} times" if name in counts else "never"
        rows.append((name, kind, _acts_on_text(x), *told, f"{yes} {100 * held[k].mean():.3g} %", times))
    return ReportTable("holding", title, columns, tuple(rows))


def _active_switches(result: Any) -> np.ndarray:
    """Return whether each switch is active at each output time, (ns, n)."""
    every = result.phases.all[0].values.structure.switches
    elastic = np.array([x.switch.kind.elastic for x in every], bool)
    pressed = (result.phases.sigma != FROZEN) & (result.phases.sigma != 0.0)
    return np.where(elastic[:, None], pressed, result.phases.mode != OFF)


def _acts_on_text(x: Any) -> str:
    """Return the coordinates along which it acts, or the bodies between which it acts."""
    if x.switch.along:
        return " and ".join(x.switch.along)
    bodies = getattr(x.element, "bodies", None) or (getattr(x.element, "body_i", ""), getattr(x.element, "body_j", ""))
    return " - ".join(b for b in bodies if b)


MAX_TABLE_ROWS = 200  # number of rows of one table
MAX_CHANGES = 4  # number of listed parameter changes, and the last one


def report_tables(result: Result) -> list[ReportTable]:
    """Return all tables that have rows."""
    made = [
        health(result),
        *events(result),
        holding(result),
        parameters(result),
        bodies(result),
        joints(result),
        controllers(result),
        forces(result),
        drivers(result),
        sensors(result),
    ]
    return [_shortened_table(t) for t in made if t.rows]


def _shortened_table(t: ReportTable) -> ReportTable:
    if len(t.rows) <= MAX_TABLE_ROWS or t.folded:
        return t
    note = "; ".join(x for x in (t.note, f"the first {MAX_TABLE_ROWS} of {len(t.rows)}") if x)
    return ReportTable(t.name, t.title, t.columns, t.rows[:MAX_TABLE_ROWS], t.total, note)


def fixed(x: Any) -> str:
    """Return a number with four digits."""
    return f"{float(np.real(x)):.4g}"


def vector_4_digits(a: Any, planar: bool) -> str:
    """Return a point or vector as text."""
    return tuple_text(np.asarray(a).real[: 2 if planar else 3])


def health(result: Result) -> ReportTable:
    """Return the health of the run, and versions and options."""
    options = {k: v for k, v in result.health.options.items() if v is not None}
    said = dict(result.health.lines())
    asked = {k.replace("_", " "): f"{v:.4g}" if isinstance(v, float) else str(v) for k, v in options.items()}
    rows = [*said.items(), *((k, v) for k, v in asked.items() if k not in said and v != "inf")]
    return ReportTable("run", "Run", ("", ""), tuple(rows))


def parameters(result: Result) -> ReportTable:
    """Return parameters as written, and their values in SI units: initial values, and those set by events."""
    values = _parameter_values(result.model, first_piece(result).values)
    changes = _parameter_changes(result)
    rows = []
    for k, v in result.model.parameters.items():
        told = [f"{fixed(x)} at {t:.6g} s" for t, x in changes.get(k, ())]
        more = [f"{len(told) - MAX_CHANGES} more", told[-1]] if len(told) > MAX_CHANGES + 1 else told[MAX_CHANGES:]
        rows.append((k, str(v), fixed(values[k]), ", ".join([*told[:MAX_CHANGES], *more])))
    columns = ("name", "as written", "value [SI]", "set by events to")
    if not changes:
        return ReportTable("parameters", "Parameters", columns[:-1], tuple(row[:-1] for row in rows))
    return ReportTable("parameters", "Parameters", (*columns[:2], "at the start [SI]", columns[3]), tuple(rows))


def first_piece(result: Result) -> Result:
    """Return the first part of a motion, with the initial parameters."""
    return result.pieces[0] if result.pieces else result


def _parameter_values(model: Model, values: Values) -> dict[str, Any]:
    """Return the parameters by name."""
    return dict(zip(model.parameters, values.system.const.tolist(), strict=False))


def _parameter_changes(result: Result) -> dict[str, list[tuple[float, float]]]:
    """Return the times at which events changed parameters, and the new values."""
    out: dict[str, list[tuple[float, float]]] = {}
    for h in result.events:
        if not isinstance(h.before, Moment) or h.before.values is h.after.values:
            continue
        was, now = (_parameter_values(result.model, m.values) for m in (h.before, h.after))
        for name in (k for k in now if now[k] != was[k]):
            out.setdefault(name, []).append((h.t, now[name]))
    return out


def bodies(result: Result) -> ReportTable:
    """Mass properties and positions at the start; the sum of masses and their centre."""
    p, rows, masses, centres = result.planar, [], [], []
    for e in result.model.bodies:
        b = first_piece(result).values.bodies[e.name]
        moments = [b.inertia[2, 2]] if p else np.linalg.eigvalsh(np.asarray(b.inertia).real)
        centre = np.array([c[0] for c in result.records.body(result.values.structure.place[e.name])[0]])
        masses.append(float(np.real(b.mass)))
        centres.append(centre)
        rows.append(
            (
                e.name,
                fixed(b.mass),
                vector_4_digits(b.com, p),
                ", ".join(map(fixed, moments)),
                vector_4_digits(centre, p),
            )
        )
    total = float(np.sum(masses))
    middle = np.average(centres, axis=0, weights=masses if total > 0.0 else None) if rows else np.zeros(3)
    inertia = "inertia [kg m²]" if p else "principal inertias [kg m²]"
    columns = ("body", "mass [kg]", "centre of mass in body [m]", inertia, "centre of mass at start [m]")
    return ReportTable(
        "bodies", "Bodies", columns, tuple(rows), ("all", fixed(total), "", "", vector_4_digits(middle, p))
    )


def joints(result: Result) -> ReportTable:
    """Return initial positions of joints, their constraints, and the largest reactions."""
    p, s, rows = result.planar, result.values.structure, []
    sizes = {e.name: _largest_reaction(result[e.name]) for e in result.model.joints if e.blocks}
    passed = {e.name: _largest_coupling_efforts(result[e.name]) for e in result.model.couplings}
    force, torque = (max((v[i] for v in sizes.values()), default=0.0) for i in (0, 1))
    least = (1e-9 * force, 1e-9 * max(torque, force * result.values.length))  # smaller values are rounding errors
    for e in (*result.model.joints, *result.model.couplings):
        k = s.frame_at.get((e.name, "M", ""))
        at = axis = ""
        if k is not None:
            origin, R = result.records.frame(k)[:2]
            at = vector_4_digits([np.ravel(c)[0] for c in origin], p)
            axis = vector_4_digits([np.ravel(R[i])[0] for i in (2, 5, 8)], False)
        count = str(len(e.rows(p))) if isinstance(e, Joint) else "1"
        free = ", ".join(getattr(result[e.name], "undetermined", ()))
        most = [fixed(v if v > tiny else 0.0) for v, tiny in zip(sizes.get(e.name, ()), least, strict=False)]
        rows.append(
            (
                e.name,
                type(e).__name__,
                attachment_text(e),
                at,
                axis,
                count,
                *(most or passed.get(e.name, ("", ""))),
                free,
            )
        )
    columns = ("joint", "kind", "between", "at, start [m]", "axis, start", "rows")
    loads = ("largest |force| [N]", "largest |torque| [N m]")
    if not any(r[-1] for r in rows):
        return ReportTable("joints", "Joints", (*columns, *loads), tuple(r[:-1] for r in rows))
    note = "The named components are undetermined because of redundancy; one of their solutions is shown."
    return ReportTable("joints", "Joints", (*columns, *loads, "not determined"), tuple(rows), note=note)


def _largest_reaction(view: Any) -> tuple[float, float]:
    """Return the largest reaction force and torque of a joint."""
    sizes = []
    for a in (np.asarray(view.force), np.asarray(view.torque)):
        size = np.abs(a) if a.ndim == 1 else np.sqrt((a**2).sum(axis=1))
        sizes.append(float(np.nanmax(size, initial=0.0)))
    return sizes[0], sizes[1]


def _largest_coupling_efforts(view: Any) -> tuple[str, str]:
    """Return the largest force and torque of a coupling on its coordinates."""
    curves = view.channels().values()
    sizes = [[np.nanmax(np.abs(v), initial=0.0) for u, v in curves if u == unit] for unit in ("N", "N*m")]
    return tuple(fixed(max(x)) if x else "" for x in sizes)  # type: ignore[return-value]


def controllers(result: Result) -> ReportTable:
    """Return inputs of controllers as written, and the range of their first signal."""
    rows = []
    for e in result.model.controllers:
        name = next(iter(e.signals()))
        values = result[e.name].quantity(name)[1]
        span = f"{name} {fixed(np.nanmin(values))} to {fixed(np.nanmax(values))}" if len(values) else ""
        rows.append((e.name, type(e).__name__, _as_written(e), span))
    return ReportTable("controllers", "Controllers", ("controller", "kind", "as written", "between"), tuple(rows))


def forces(result: Result) -> ReportTable:
    """Return targets of forces, their constants and laws as written, and the largest values."""
    rows = []
    for e in (*result.model.forces, *result.model.limits):
        curves = result[e.name].channels()
        sizes = [f"{fixed(np.nanmax(np.abs(v), initial=0.0))} {u}" for k, (u, v) in curves.items() if u in ("N", "N*m")]
        rows.append(
            (e.name, type(e).__name__, attachment_text(e), _as_written(e), ", ".join(sizes).replace("N*m", "N m"))
        )
    columns = ("force", "kind", "between", "as written", "largest component")
    return ReportTable("forces", "Forces", columns, tuple(rows))


def _as_written(e: Any) -> str:
    """Return an element's own numbers and laws, as written by the user."""
    common = {"name", "body_i", "body_j", "body", "bodies", "joint", "at", "axis"}
    own = {f.name for f in fields(e)} - common
    return "; ".join(f"{k} = {_value_text(v)}" for k, v in written_fields(e).items() if k in own)


def _value_text(value: Any) -> str:
    return "(" + ", ".join(map(_value_text, value)) + ")" if isinstance(value, (list, tuple)) else str(value)


def drivers(result: Result) -> ReportTable:
    """Return laws of drivers, their largest effort, and their work."""
    rows: list[Sequence[str]] = []
    for e in result.model.drivers:
        view = result[e.name]
        unit = view.channels()["effort"][0].replace("*", " ")
        effort = f"{fixed(np.nanmax(np.abs(view.effort), initial=0.0))} {unit}"
        rows.append((e.name, e.coordinate, str(e.law), effort, f"{fixed(view.work[-1])} J"))
    columns = ("driver", "coordinate", "law", "largest |effort|", "work given")
    return ReportTable("drivers", "Drivers", columns, tuple(tuple(r) for r in rows))


def sensors(result: Result) -> ReportTable:
    """Return measured quantities of sensors, and their ranges."""
    rows = []
    for e in result.model.sensors:
        for k, (unit, v) in result[e.name].channels().items():
            low, high = (fixed(x) for x in (np.nanmin(v), np.nanmax(v)))
            rows.append((e.name, type(e).__name__, attachment_text(e), k, low, high, unit.replace("*", " ")))
    return ReportTable("sensors", "Sensors", ("sensor", "kind", "of", "curve", "least", "largest", "unit"), tuple(rows))


MAX_WARNINGS = 6  # number of figures at the top
HEADING_HEIGHT, NOTE_HEIGHT = (
    0.3,
    0.1,
)  # heights of a figure's heading and of a note below a panel, relative to a panel


def report_html(result: Result, **options: Any) -> str:
    """Write a result as one HTML document: summary, animation, plots, tables of the model, and its file.

    Parameters
    ----------
    result : Result
    **options
        As in `flyball.view.animation.animation_html`.

    Returns
    -------
    str
        A document that needs nothing else and opens offline in any browser.

    Raises
    ------
    ModelError
        If there is no output time, so nothing to draw.
    """
    recording = record_comparison(result, **options)
    whole, every, _, _ = motion_to_show(result)
    chosen = tuple(_thinned_figure(f, every) for f in standard_figures(whole))
    parts = report_tables(result)
    names = {"animation": "Animation", **{f"plot-{f.name}": f.title for f in chosen}}
    names |= {f"table-{t.name}": t.title for t in parts if t.title} | {"file": "Model file"}
    links = "".join(f'<a href="#{key}">{escape(title)}</a>' for key, title in names.items())
    before = (
        f'<div class="report">\n<div class="top"><h1>{escape(result.model.name)}</h1>'
        f"<p>{escape(_headline(result))}</p>\n{_verdict_html(result)}\n<dl class='cards'>{_figure_cards(result)}</dl>\n"
        f'<nav aria-label="Contents">{links}</nav></div>\n<section id="animation" class="frame">\n'
    )
    plots = _figure_columns(chosen)
    after = (
        f'</section>\n<section class="charts">\n{plots}</section>\n{"".join(map(_table_html, parts))}'
        f"{_model_file_html(result)}\n<footer class='by'>{escape(_version_note())}</footer>\n</div>\n"
    )
    return player_page(replace(recording, figures=chosen), "<h2>Animation</h2>", before, after)


def _thinned_figure(figure: Figure, every: np.ndarray) -> Figure:
    """Return the figure at the displayed times."""
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


def _verdict_html(result: Result) -> str:
    """Return one line: whether the run reached its end, and what to check."""
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
    listed = "".join(f"<li>{escape(w)}</li>" for w in warnings[:MAX_WARNINGS])
    if len(warnings) > MAX_WARNINGS:
        listed += f'<li><a href="#table-run">{len(warnings) - MAX_WARNINGS} more</a></li>'
    told = f'\n<ul class="warnings">{listed}</ul>' if warnings else ""
    return f'<p class="verdict {kind}" role="status">{escape(text)}</p>{told}'


def figure_text(value: float) -> str:
    """Return a figure with three digits, with an exponent if it is small or large."""
    return f"{value:.2e}" if value and not 1e-3 <= abs(value) < 1e5 else f"{value:.4g}"


def _figure_cards(result: Result) -> str:
    """Return the key figures for judging the run; exact values in ``data-value``."""
    h = result.health
    largest = float(np.nanmax(np.abs(result.energy.total), initial=0.0))
    known = not np.isnan(h.energy_drift)
    relative = f"{h.energy_drift / largest:.1e} of the largest energy" if known and largest > 0.0 else ""
    cards: list[tuple[str, str, float, str]] = [
        ("Freedoms", str(h.freedoms), h.freedoms, "by rank, at the start"),
        ("Redundant parts", str(len(h.redundant)), len(h.redundant), ", ".join(h.redundant) or "none too many"),
        (
            "Energy balance",
            f"{figure_text(h.energy_drift)} J" if known else "not measured",
            h.energy_drift,
            (relative or "largest deviation") if known else "fewer than two output times",
        ),
        ("Violation", figure_text(h.violation), h.violation, "largest gap of a constraint [m or rad]"),
        ("Velocity violation", figure_text(h.velocity_violation), h.velocity_violation, "[m/s or rad/s]"),
        ("Steps", str(h.steps), h.steps, f"{h.rejected} refused, {_computing_time(h)}"),
    ]
    return "".join(
        f'<div><dt>{escape(term)}</dt><dd data-value="{value!r}">{escape(text)}</dd>'
        f'<dd class="more">{escape(more)}</dd></div>'
        for term, text, value, more in cards
    )


def _computing_time(h: Health) -> str:
    """Return the computing time, and the compilation time in it."""
    compiled = f", after {h.compiling:.1f} s of compiling" if h.compiling > 0.1 * h.seconds else ""
    return f"{h.seconds - h.compiling:.2f} s of computing{compiled}"


def _figure_columns(chosen: Sequence[Figure]) -> str:
    """Return two columns of figures of nearly equal height; each figure has its index for a single column."""
    heights = [HEADING_HEIGHT + sum(1.0 + bool(p.note) * NOTE_HEIGHT for p in f.panels) for f in chosen]

    def height_difference(right: tuple[bool, ...]) -> float:
        return abs(sum(-h if aside else h for h, aside in zip(heights, right, strict=True)))

    sides = product((False,), *[(False, True)] * (len(chosen) - 1)) if chosen else ()
    best = min(sides, key=height_difference, default=())
    columns = ("".join(_figure_html(f, k) for k, f in enumerate(chosen) if best[k] is aside) for aside in (False, True))
    return "".join(f'<div class="column">{plots}</div>' for plots in columns)


def _figure_html(figure: Figure, place: int) -> str:
    note = f"<p>{escape(figure.note)}</p>" if figure.note else ""
    return (
        f'<article id="plot-{figure.name}" style="order: {place}"><h2>{escape(figure.title)}</h2>{note}'
        f'<div data-figure="{escape(figure.name)}"></div></article>\n'
    )


def _table_html(table: ReportTable) -> str:
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


def _model_file_html(result: Result) -> str:
    """Return the model's file, for viewing and copying."""
    return (
        '<section class="listing" id="file"><h2>Model file</h2><details><summary>TOML text, as '
        '<code>flyball.load</code> reads it</summary><button type="button" data-copy="toml">Copy</button>'
        f'<pre id="toml">{escape(dumps(result.model))}</pre></details></section>'
    )


def _version_note() -> str:
    from .. import __version__

    return f"Made by flyball {__version__}"
