"""Measured curves: tables read from files or arrays, and a motion compared with them."""

from __future__ import annotations

import csv
import os
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..errors import ModelError
from ..model.quantities import single_quantity
from ..model.units import to_si
from .wording import json_numbers, number_text

if TYPE_CHECKING:
    from ..model.model import Model
    from .result import Result


class Measurements(NamedTuple):
    """Measured curves: names, times (n,), values (n, of) in SI units, and whether each was measured."""

    names: tuple[str, ...]
    t: np.ndarray
    values: np.ndarray
    known: np.ndarray


def read_measurements(model: Model, data: Any) -> Measurements:
    """Read measurements from a table in a file, or from arrays by name.

    Parameters
    ----------
    model : Model
        Whose quantities the columns are named after.
    data : str, path, or mapping of str to array
        A table (.csv) with a heading line, or arrays by heading: times ``t [s]``, and measured curves such as
        ``slider.x [mm]``; without a unit in SI. An empty entry or nan is a value that was not measured.

    Raises
    ------
    ModelError
        If there is no such file or quantity, an entry is no number, a unit does not fit, or times do not ascend. The
        message names the file, the line and the column.
    """
    table = _table_of_file(data) if isinstance(data, str | os.PathLike) else _Table("the data", dict(data), [])
    names = [name.partition("[")[0].strip() for name in table.columns]
    if repeated := next((x for k, x in enumerate(names) if x in names[:k]), None):
        raise ModelError(f"{table.source}: two columns are named {repeated!r}; leave one of them out")
    columns = dict(zip(names, table.columns.items(), strict=True))
    time = next((columns.pop(k) for k in ("t", "time") if k in columns), None)
    if time is None or not columns:
        raise ModelError(
            f"{table.source}: the data need times, 't' or 'time', and at least one measured curve, such as "
            f"'slider.x [mm]'; the columns are {', '.join(map(repr, table.columns)) or 'none'}"
        )
    t = _times(table, *time)
    values = []
    for name, (heading, x) in columns.items():
        v = _in_si(table, heading, x, _unit_of(table, model, name))
        if v.shape != t.shape:
            raise ModelError(f"{table.source}: {name!r} has {v.size} values at {len(t)} times; leave gaps as nan")
        if not np.isfinite(v).any():
            raise ModelError(f"{table.source}: {name!r} has no finite value")
        values.append(v)
    found = np.stack(values, axis=1)
    return Measurements(tuple(columns), t, found, np.isfinite(found))


class _Table(NamedTuple):
    """Columns by heading, and where they come from: file or words, and the line of each row in the file."""

    source: str
    columns: dict[str, Any]
    lines: list[int]

    def place(self, row: int) -> str:
        """Return where a row is, for messages."""
        return f"{self.source}, line {self.lines[row]}" if self.lines else f"{self.source}, row {row + 1}"


def _table_of_file(path: str | os.PathLike) -> _Table:
    """Read a table with a heading line; empty entries are nan.

    Raises
    ------
    ModelError
        If it cannot be read, or is no table of numbers.
    """
    name = os.fspath(path)
    try:
        with open(path, newline="", encoding="utf-8-sig") as file:
            reader = csv.reader(file)
            rows = [(reader.line_num, [x.strip() for x in row]) for row in reader if row]
    except OSError as error:
        raise ModelError(f"cannot read {name!r}: {error.strerror}") from None
    except (UnicodeDecodeError, csv.Error) as error:
        raise ModelError(f"{name!r} is no table of comma-separated values: {error}") from None
    if not rows:
        raise ModelError(f"{name!r} is empty; the first line has the headings, such as 't [s], A.angle [deg]'")
    (line, head), *rest = rows
    for k, heading in enumerate(head):
        if not heading or heading in head[:k]:
            what = f"the heading {heading!r} occurs twice" if heading else "there is no heading"
            raise ModelError(f"{name}, line {line}, column {k + 1}: {what}; give each column a heading of its own")
    for line, row in rest:
        if len(row) != len(head):
            raise ModelError(
                f"{name}, line {line}: {len(row)} entries for {len(head)} headings ({', '.join(head)}); separate "
                "entries by commas, and leave what was not measured empty"
            )
    table = [[_entry(name, line, heading, x) for heading, x in zip(head, row, strict=True)] for line, row in rest]
    columns = {heading: np.array([row[k] for row in table]) for k, heading in enumerate(head)}
    return _Table(name, columns, [line for line, _ in rest])


def _entry(name: str, line: int, heading: str, text: str) -> float:
    try:
        return float(text) if text else np.nan
    except ValueError:
        raise ModelError(
            f"{name}, line {line}, column {heading!r}: {text!r} is no number; separate entries by commas, "
            "write decimal points, and give units in brackets in the heading"
        ) from None


def _times(table: _Table, heading: str, values: Any) -> np.ndarray:
    """Return the times [s]: two or more, ascending."""
    t = _in_si(table, heading, values, "s")
    if t.ndim != 1 or len(t) < 2:
        raise ModelError(f"{table.source}: the data need two or more finite times in ascending order")
    if not np.isfinite(t).all():
        row = int(np.flatnonzero(~np.isfinite(t))[0])
        raise ModelError(f"{table.place(row)}, column {heading!r}: every row needs a finite time")
    if not (np.diff(t) > 0.0).all():
        row = 1 + int(np.flatnonzero(np.diff(t) <= 0.0)[0])
        raise ModelError(
            f"{table.place(row)}, column {heading!r}: {t[row]:.9g} s does not follow {t[row - 1]:.9g} s; the data need "
            "finite times in ascending order"
        )
    return t


def _unit_of(table: _Table, model: Model, name: str) -> str:
    """Return the SI unit of a measured curve."""
    try:
        return single_quantity(model, name).unit
    except ModelError as error:
        raise type(error)(f"{table.source}, column {name!r}: {error}") from None


def _in_si(table: _Table, heading: str, values: Any, unit: str) -> np.ndarray:
    """Return a column in SI units; its own unit stands in brackets in its heading."""
    name, bracket, own = heading.partition("[")
    try:
        x = np.array(values, float)
    except (TypeError, ValueError, OverflowError):
        raise ModelError(f"{table.source}, column {name.strip()!r}: {values!r} are no numbers") from None
    if not bracket:
        return x
    try:
        return x * to_si(f"1 {own.rstrip('] ')}", unit or "1")
    except ModelError as error:
        raise type(error)(f"{table.source}, column {heading!r}: {error}") from None


NEAR_PART = 1e-6  # distance of two times relative to the mean step, below which the second adds rounding errors only


def curve_at(result: Result, names: tuple[str, ...], times: np.ndarray) -> np.ndarray:
    """Return curves (n, k) at any times, interpolated by cubic splines between output times; nan outside the motion.

    A spline does not go across an event: the states on both sides of it are used, so that a jump stays one.
    """
    from ..view.motion_with_events import motion_with_event_states

    whole = motion_with_event_states(result)
    return np.stack([_interpolated(whole.t, np.asarray(whole.curve(name)[1], float), times) for name in names], axis=1)


def _interpolated(t: np.ndarray, values: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Interpolate within each run of ascending times and finite values; nan between them."""
    from scipy.interpolate import CubicSpline

    out = np.full(len(times), np.nan)
    finite = np.isfinite(values)
    steps = np.diff(t, prepend=-np.inf)
    near = (steps > 0.0) & (steps < NEAR_PART * (t[-1] - t[0]) / len(t))
    run = np.cumsum(~finite | (steps <= 0.0))
    for k in np.unique(run[finite]):
        all_rows = np.flatnonzero((run == k) & finite)
        rows = all_rows[~near[all_rows] | (all_rows == all_rows[0])]
        inside = (times >= t[rows[0]]) & (times <= t[all_rows[-1]])
        out[inside] = CubicSpline(t[rows], values[rows])(times[inside]) if len(rows) > 1 else values[rows[0]]
    return out


@dataclass
class MeasurementComparison:
    """A motion compared with measured curves; in SI units.

    Attributes
    ----------
    source : str
        File of the measurements, or "arrays".
    names, units : tuple of str
        Measured curves.
    t : ndarray (n,) [s]
        Times of the measurements.
    measured : ndarray (n, k)
        Measured values, nan where there is none.
    computed : ndarray (n, k)
        Values of the motion at these times, interpolated between output times; nan outside the motion.
    result : Result
        The motion.
    """

    source: str
    names: tuple[str, ...]
    units: tuple[str, ...]
    t: np.ndarray
    measured: np.ndarray = field(repr=False)
    computed: np.ndarray = field(repr=False)
    result: Result = field(repr=False)

    @property
    def residuals(self) -> np.ndarray:
        """Measured less computed values, (n, k); nan where one of them is missing."""
        return np.asarray(self.measured - self.computed)

    @property
    def rms(self) -> dict[str, float]:
        """Root mean square of the residuals, by curve."""
        return dict(zip(self.names, np.sqrt(np.nanmean(self.residuals**2, axis=0)).tolist(), strict=True))

    @property
    def largest(self) -> dict[str, tuple[float, float]]:
        """Residual of the largest magnitude, and its time [s], by curve."""
        rows = np.nanargmax(np.abs(self.residuals), axis=0)
        return {
            name: (float(self.residuals[i, k]), float(self.t[i]))
            for k, (name, i) in enumerate(zip(self.names, rows, strict=True))
        }

    @property
    def r_squared(self) -> dict[str, float]:
        """Coefficient of determination by curve: 1 less the ratio of mean square residual to variance of the data.

        It is negative where the mean of the data would be nearer to them than the motion is, and nan for data that do
        not vary.
        """
        out = {}
        for k, name in enumerate(self.names):
            r = self.residuals[:, k]
            compared = self.measured[np.isfinite(r), k]
            spread = float(((compared - compared.mean()) ** 2).sum())
            out[name] = 1.0 - float(np.nansum(r**2)) / spread if spread > 0.0 else float("nan")
        return out

    @property
    def counts(self) -> dict[str, int]:
        """Number of compared values, by curve."""
        return dict(zip(self.names, np.isfinite(self.residuals).sum(axis=0).tolist(), strict=True))

    def lines(self) -> list[tuple[str, str]]:
        """Return the data, and RMS, largest deviation with its time and R^2 of each curve."""
        motion = self.result.t
        out = [
            ("measured", f"{self.source}: {len(self.t)} times, {self.t[0]:g} to {self.t[-1]:g} s"),
            ("computed", f"{self.result.model.name}, interpolated between {len(motion)} output times"),
        ]
        outside = int(((self.t < motion[0]) | (self.t > motion[-1])).sum())
        if outside:
            times = "time" if outside == 1 else "times"
            out.append(("left out", f"{outside} {times} outside the motion, {motion[0]:g} to {motion[-1]:g} s"))
        rms, largest, r_squared, counts = self.rms, self.largest, self.r_squared, self.counts
        for k, name in enumerate(self.names):
            size = float(np.nanmax(np.abs(self.measured[:, k])))
            unit = "" if self.units[k] in ("", "1") else f" {self.units[k].replace('*', ' ')}"
            deviation, at = largest[name]
            texts = [f"{number_text(x, size, 4)}{unit}" for x in (rms[name], deviation)]
            told = f"RMS {texts[0]}, largest deviation {texts[1]} at {at:.6g} s, R^2 {r_squared[name]:.6g}"
            out.append((name, f"{told}, {counts[name]} values"))
        return out

    def as_dict(self) -> dict[str, Any]:
        """Everything as plain numbers and names."""
        rms, largest, r_squared, counts = self.rms, self.largest, self.r_squared, self.counts
        return {
            "source": self.source,
            "t": self.t.tolist(),
            "curves": {
                name: {
                    "unit": self.units[k],
                    "measured": json_numbers(self.measured[:, k]),
                    "computed": json_numbers(self.computed[:, k]),
                    "rms": rms[name],
                    "largest": largest[name][0],
                    "largest_at": largest[name][1],
                    "r_squared": r_squared[name],
                    "values": counts[name],
                }
                for k, name in enumerate(self.names)
            },
        }

    def plot(self, path: str | os.PathLike | None = None) -> Any:
        """The curves over time and the measured values; returns the Matplotlib figure, or writes it to ``path``."""
        from ..view.result_plots import measurement_plot

        return measurement_plot(self, path)

    def __repr__(self) -> str:
        width = max(len(label) for label, _ in self.lines())
        return "\n".join(f"{label:<{width}}  {text}" for label, text in self.lines())


def compare_with_measurements(result: Result, data: Any) -> MeasurementComparison:
    """Compare a motion with measured curves: see `Result.compare`."""
    m = read_measurements(result.model, data)
    source = os.fspath(data) if isinstance(data, str | os.PathLike) else "arrays"
    if not len(result.t):
        raise ModelError(f"{source}: the result of {result.model.name!r} has no output time to compare with")
    computed = curve_at(result, m.names, m.t)
    for k in np.flatnonzero(~np.isfinite(m.values - computed).any(axis=0)):
        raise ModelError(
            f"{source}: no value of {m.names[k]!r} can be compared: the motion has {result.t[0]:g} to "
            f"{result.t[-1]:g} s, the data {m.t[0]:g} to {m.t[-1]:g} s"
        )
    units = tuple(single_quantity(result.model, name).unit for name in m.names)
    values = np.where(m.known, m.values, np.nan)
    return MeasurementComparison(source, m.names, units, m.t, values, computed, result)
