"""Tables beside the animation of compared motions: parameters, parts, curves, events, health, measurements."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..results.differences import Differences, value_text
from .recording import ComparisonTable

if TYPE_CHECKING:
    from ..results.measurements import MeasurementComparison

MOTION = "motion"  # head of a column of labels of motions
NOTHING = "–"


def difference_tables(label: str, found: Mapping[str, Differences]) -> tuple[ComparisonTable, ...]:
    """Return the tables of the differences of other motions, by their labels, from the motion of the first label."""
    parts = {
        name: {k: d.parts.get(name, NOTHING) for k, d in found.items()} for d in found.values() for name in d.parts
    }
    tables = [
        _values_table("Parameters [SI]", "parameter", label, found, lambda d: d.parameters, value_text),
        _curve_table(found),
        _values_table("Events", "event", label, found, lambda d: {f"{n} ({k})": v for (n, k), v in d.events.items()}),
        ComparisonTable("Parts", ("part", *found), tuple((name, *cells) for name, cells in parts.items())),
        _values_table("Run", "", label, found, lambda d: d.health),
    ]
    return tuple(t for t in tables if t.rows)


def _values_table(
    title: str,
    head: str,
    label: str,
    found: Mapping[str, Differences],
    pairs: Callable[[Differences], Mapping[str, tuple[Any, Any]]],
    text: Callable[[Any], str] = str,
) -> ComparisonTable:
    """Return a table with a column for each motion, and the rows in which one of the others differs from the first."""
    own = {name: text(a) for d in found.values() for name, (a, _) in pairs(d).items()}
    others = {k: {name: text(b) for name, (_, b) in pairs(d).items()} for k, d in found.items()}
    rows = tuple(
        (name, mine or NOTHING, *(theirs.get(name, mine) or NOTHING for theirs in others.values()))
        for name, mine in own.items()
    )
    return ComparisonTable(title, (head, label, *found), rows)


def _curve_table(found: Mapping[str, Differences]) -> ComparisonTable:
    """Return the table of curves, a row for each other motion; the page shows the rows of plotted curves."""
    names = dict.fromkeys(c.name for d in found.values() for c in d.curves)
    own = [{c.name: c for c in d.curves} for d in found.values()]
    rows, curves = [], []
    for name in names:
        for label, known in zip(found, own, strict=True):
            cells = (NOTHING, "", NOTHING)
            if name in known:
                largest, at, final = known[name].texts()
                unit = unit_text(known[name].unit)
                cells = (f"{largest}{unit}", at, f"{final}{unit}")
            rows.append((name, label, *cells))
            curves.append(name)
    interpolated = any(d.interpolated for d in found.values())
    how = "; interpolated between output times, which differ" if interpolated else ""
    note = f"Differences from the first motion, of the plotted curves{how}."
    return ComparisonTable("Curves", ("curve", MOTION, "largest", "at [s]", "final"), tuple(rows), note, tuple(curves))


def measurement_table(found: MeasurementComparison, curves: Sequence[str]) -> ComparisonTable:
    """Return the table of deviations from measured curves; ``curves`` are their names on the page."""
    rows = []
    for name, unit in zip(found.names, found.units, strict=True):
        deviation, at = found.largest[name]
        texts = (f"{x:.4g}{unit_text(unit)}" for x in (found.rms[name], deviation))
        rms, largest = texts
        rows.append((name, rms, largest, f"{at:.5g}", f"{found.r_squared[name]:.5g}"))
    note = f"Measured less computed values; {Path(found.source).name}, {len(found.t)} times."
    return ComparisonTable("Measured", ("curve", "RMS", "largest", "at [s]", "R²"), tuple(rows), note, tuple(curves))


def unit_text(unit: str) -> str:
    """Return a unit as it follows a number."""
    return "" if unit in ("", "1") else f" {unit.replace('*', ' ')}"
