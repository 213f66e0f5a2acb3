"""Differences of two motions: parameters, parts, curves, events and health."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..errors import ModelError
from ..model.element import written_fields
from .measurements import curve_at
from .wording import number_text

if TYPE_CHECKING:
    from .result import Result

LISTED_CURVES = 12  # from more curves the main ones are listed
LONGEST_VALUE = 40  # letters of a field's value in a text
TIMINGS = ("time used", "engine", "events")  # lines of health that are not compared: chance, or told as events


class CurveDifference(NamedTuple):
    """Difference of one curve, the other motion's less the first one's, in ``unit``.

    ``largest`` is the one of the largest magnitude, at the time ``at`` [s]; ``final`` is that at the last common time;
    ``size`` is the largest magnitude of all compared curves of this unit.
    """

    name: str
    unit: str
    largest: float
    at: float
    final: float
    size: float

    def texts(self) -> tuple[str, str, str]:
        """Largest difference, its time, and final difference as texts; rounding errors as 0."""
        largest, final = (number_text(x, self.size, 4) for x in (self.largest, self.final))
        return largest, f"{self.at:.5g}" if largest != "0" else "", final


class EventCount(NamedTuple):
    """How often an event occurred, and when first [s]; nan if it did not."""

    occurrences: int
    first: float

    def __str__(self) -> str:
        if not self.occurrences:
            return "none"
        times = "once" if self.occurrences == 1 else f"{self.occurrences} times, first"
        return f"{times} at {self.first:.5g} s"


@dataclass
class Differences:
    """Differences of another motion from a first one.

    Attributes
    ----------
    first, other : Result
        The motions.
    parameters : dict
        Parameter -> its value in both [SI], where they differ; None where there is none of that name.
    parts : dict
        Part -> what differs in its description as written.
    curves : tuple of CurveDifference
        Of the curves that both have, over the times that both have.
    interpolated : bool
        Whether the output times differ. Curves are then interpolated at the times of both, by `curve_at`.
    events : dict
        Name and kind of an event -> `EventCount` in both, where they differ.
    health : dict
        Label of a line of the health report -> its text in both, where they differ.
    """

    first: Result = field(repr=False)
    other: Result = field(repr=False)
    parameters: dict[str, tuple[float | None, float | None]]
    parts: dict[str, str]
    curves: tuple[CurveDifference, ...]
    interpolated: bool
    events: dict[tuple[str, str], tuple[EventCount, EventCount]]
    health: dict[str, tuple[str, str]]

    def lines(self) -> list[tuple[str, str]]:
        """Return what differs; of curves the main ones, or those that were named if they are few."""
        out = [(k, _motion_text(r)) for k, r in (("first", self.first), ("other", self.other))]
        way = "interpolated at the output times of both" if self.interpolated else "at equal output times"
        out.append(("differences", f"other less first, {way}"))
        out += [("parameter", f"{k}: {value_text(a)} -> {value_text(b)}") for k, (a, b) in self.parameters.items()]
        out += [("part", f"{name}: {text}") for name, text in self.parts.items()]
        main = self.first.main_curves()
        told = list(self.curves)
        if len(told) > LISTED_CURVES:
            told = [c for c in told if c.name in main] or told[:LISTED_CURVES]
        for c in told:
            unit = "" if c.unit in ("", "1") else f" {c.unit.replace('*', ' ')}"
            largest, at, final = c.texts()
            text = f"largest {largest}{unit} at {at} s, at the end {final}{unit}" if at else "no difference"
            out.append((c.name, text))
        if len(told) < len(self.curves):
            out.append(("curves", f"{len(told)} of {len(self.curves)} listed; .curves has all"))
        out += [("event", f"{name} ({kind}): {a} -> {b}") for (name, kind), (a, b) in self.events.items()]
        return out + [(k, f"{a or 'none'} -> {b or 'none'}") for k, (a, b) in self.health.items()]

    def as_dict(self) -> dict[str, Any]:
        """Everything as plain numbers and names."""
        return {
            "parameters": {k: list(v) for k, v in self.parameters.items()},
            "parts": self.parts,
            "interpolated": self.interpolated,
            "curves": {
                c.name: {"unit": c.unit, "largest": c.largest, "at": c.at, "final": c.final} for c in self.curves
            },
            "events": [
                {"name": name, "kind": kind, "counts": [x.occurrences for x in both]}
                for (name, kind), both in self.events.items()
            ],
            "health": {k: list(v) for k, v in self.health.items()},
        }

    def to_html(self, path: str | os.PathLike) -> None:
        """Write the page of the first motion with the other one as a ghost; see `Result.html`."""
        self.first.to_html(path, others={"other": self.other}, label="first")

    def __repr__(self) -> str:
        width = max(len(label) for label, _ in self.lines())
        return "\n".join(f"{label:<{width}}  {text}" for label, text in self.lines())


def value_text(x: float | None) -> str:
    """Return the value of a parameter as text."""
    return "none" if x is None else f"{x:.6g}"


def _motion_text(r: Result) -> str:
    return f"{r.model.name}, {r.t[0]:g} to {r.t[-1]:g} s, {len(r.t)} times"


def compare_results(first: Result, other: Result, names: tuple[str, ...] = ()) -> Differences:
    """Compare two motions: see `Result.differences`."""
    _check_comparable(first, other)
    chosen = names or _common_curves(first, other)
    for name in names:
        units = [r.curve(name)[0] for r in (first, other)]
        if units[0] != units[1]:
            raise ModelError(f"{name!r} is in {units[0]} in one motion and in {units[1]} in the other: leave it out")
    equal = len(first.t) == len(other.t) and np.array_equal(first.t, other.t)
    health = {k: v for k, v in _paired(_health_lines(first), _health_lines(other), "").items() if v[0] != v[1]}
    never = EventCount(0, np.nan)
    events = _paired(_event_counts(first), _event_counts(other), never)
    return Differences(
        first=first,
        other=other,
        parameters={k: v for k, v in _paired(_parameters(first), _parameters(other), None).items() if v[0] != v[1]},
        parts=_part_differences(first, other),
        curves=_curve_differences(first, other, chosen),
        interpolated=not equal,
        events={k: v for k, v in events.items() if str(v[0]) != str(v[1])},
        health=health,
    )


def _check_comparable(first: Result, other: Result) -> None:
    """Refuse motions that have nothing to compare.

    Raises
    ------
    ModelError
        If one is planar and the other not, they have no body or no time in common.
    """
    a, b = first.model, other.model
    if first.planar != other.planar:
        kinds = ["planar" if r.planar else "spatial" for r in (first, other)]
        raise ModelError(f"{a.name!r} is {kinds[0]} and {b.name!r} is {kinds[1]}: they cannot be compared")
    bodies = [[e.name for e in m.elements() if e.category in ("bodies", "bulk")] for m in (a, b)]
    if not set(bodies[0]) & set(bodies[1]):
        told = [", ".join(x[:6]) + (", ..." if len(x) > 6 else "") or "none" for x in bodies]
        raise ModelError(
            f"{a.name!r} and {b.name!r} have no body of the same name and cannot be compared; the bodies are "
            f"{told[0]} and {told[1]}"
        )
    for r in (first, other):
        if not len(r.t):
            raise ModelError(f"the result of {r.model.name!r} has no output time: there is nothing to compare")
    if max(first.t[0], other.t[0]) > min(first.t[-1], other.t[-1]):
        spans = [f"{r.t[0]:g} to {r.t[-1]:g} s" for r in (first, other)]
        raise ModelError(f"the motions have no time in common: {spans[0]} and {spans[1]}")


def _paired(a: dict, b: dict, missing: Any) -> dict[Any, tuple[Any, Any]]:
    """Return both values by key, in the order of the first, then of the other."""
    return {k: (a.get(k, missing), b.get(k, missing)) for k in dict.fromkeys([*a, *b])}


def _common_curves(first: Result, other: Result) -> tuple[str, ...]:
    """Return the curves that both have in the same unit."""
    theirs = {k: unit for k, (unit, _) in other.channels().items()}
    return tuple(k for k, (unit, _) in first.channels().items() if theirs.get(k) == unit)


def _parameters(r: Result) -> dict[str, float]:
    """Return the parameters [SI] at the start."""
    x = (r.pieces[0] if r.pieces else r).values
    return dict(zip(r.model.parameters, np.real(x.system.const).tolist(), strict=False))


def _part_differences(first: Result, other: Result) -> dict[str, str]:
    """Return parts that only one has, and those that are described differently."""
    out = {}
    ours, theirs = ({e.name: e for e in r.model.elements()} for r in (first, other))
    if tuple(first.model.gravity) != tuple(other.model.gravity):
        out["gravity"] = _change_text(first.model.gravity, other.model.gravity)
    for name, (a, b) in _paired(ours, theirs, None).items():
        if a is None or b is None:
            out[name] = f"{type(a or b).__name__}, only in the {'first' if b is None else 'other'}"
        elif type(a) is not type(b):
            out[name] = f"{type(a).__name__} -> {type(b).__name__}"
        else:
            fields = _paired(written_fields(a), written_fields(b), None)
            changes = [f"{k} {_change_text(*v)}" for k, v in fields.items() if repr(v[0]) != repr(v[1])]
            if changes:
                out[name] = "; ".join(changes)
    return out


def _change_text(a: Any, b: Any) -> str:
    texts = ["not given" if x is None else str(x) for x in (a, b)]
    return " -> ".join(x if len(x) <= LONGEST_VALUE else x[: LONGEST_VALUE - 3] + "..." for x in texts)


def _curve_differences(first: Result, other: Result, names: tuple[str, ...]) -> tuple[CurveDifference, ...]:
    """Return the differences at the output times of both within their common span, where both are finite."""
    if not names:
        return ()
    low, high = max(first.t[0], other.t[0]), min(first.t[-1], other.t[-1])
    times = np.union1d(first.t, other.t)
    times = times[(times >= low) & (times <= high)]
    a, b = curve_at(first, names, times), curve_at(other, names, times)
    out = []
    for k, name in enumerate(names):
        change = b[:, k] - a[:, k]
        known = np.flatnonzero(np.isfinite(change))
        if len(known):
            i = known[np.abs(change[known]).argmax()]
            size = float(max(np.abs(a[known, k]).max(), np.abs(b[known, k]).max()))
            figures = (float(change[i]), float(times[i]), float(change[known[-1]]), size)
            out.append(CurveDifference(name, first.curve(name)[0], *figures))
    sizes = {unit: max(c.size for c in out if c.unit == unit) for unit in {c.unit for c in out}}
    return tuple(c._replace(size=sizes[c.unit]) for c in out)


def _event_counts(r: Result) -> dict[tuple[str, str], EventCount]:
    out: dict[tuple[str, str], EventCount] = {}
    for h in r.events:
        before = out.get((h.name, h.kind), EventCount(0, h.t))
        out[h.name, h.kind] = EventCount(before.occurrences + 1, before.first)
    return out


def _health_lines(r: Result) -> dict[str, str]:
    """Return health report and options by label; lines of one label are joined."""
    out: dict[str, str] = {}
    for label, text in r.health.lines():
        if label not in TIMINGS:
            out[label] = f"{out[label]}; {text}" if label in out else text
    options = {k.replace("_", " "): str(v) for k, v in r.health.options.items() if v is not None}
    return out | {k: v for k, v in options.items() if k not in out}
