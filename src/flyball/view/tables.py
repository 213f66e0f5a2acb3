"""The model as tables: what a report lists of bodies, joints, forces, drivers, parameters and the run itself."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from typing import TYPE_CHECKING, Any

import numpy as np

from ..model.element import written
from ..model.joint import Joint
from ..results.moment import Moment
from ..results.numbers import tuple_of
from .facts import between
from .happened import events, holding
from .tabled import Table

if TYPE_CHECKING:
    from ..model.model import Model
    from ..results.result import Result
    from ..tables.values import Values

MOST = 200  # rows of one table
SETS = 4  # changes of a parameter that are told, and the last


def tables(result: Result) -> list[Table]:
    """Every table that has a row."""
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
    return [_cut(t) for t in made if t.rows]


def _cut(t: Table) -> Table:
    if len(t.rows) <= MOST or t.folded:
        return t
    note = "; ".join(x for x in (t.note, f"the first {MOST} of {len(t.rows)}") if x)
    return Table(t.name, t.title, t.columns, t.rows[:MOST], t.total, note)


def fixed(x: Any) -> str:
    """A number with four digits."""
    return f"{float(np.real(x)):.4g}"


def triple(a: Any, planar: bool) -> str:
    """A point or vector."""
    return tuple_of(np.asarray(a).real[: 2 if planar else 3])


def health(result: Result) -> Table:
    """What the run says of itself, and with what it was made."""
    options = {k: v for k, v in result.health.options.items() if v is not None}
    said = dict(result.health.lines())
    asked = {k.replace("_", " "): f"{v:.4g}" if isinstance(v, float) else str(v) for k, v in options.items()}
    rows = [*said.items(), *((k, v) for k, v in asked.items() if k not in said and v != "inf")]
    return Table("run", "Run", ("", ""), tuple(rows))


def parameters(result: Result) -> Table:
    """Named numbers as written, and what they are in SI units: at the start, and what events set them to."""
    values = _constants(result.model, begun(result).values)
    changes = _set(result)
    rows = []
    for k, v in result.model.parameters.items():
        told = [f"{fixed(x)} at {t:.6g} s" for t, x in changes.get(k, ())]
        more = [f"{len(told) - SETS} more", told[-1]] if len(told) > SETS + 1 else told[SETS:]
        rows.append((k, str(v), fixed(values[k]), ", ".join([*told[:SETS], *more])))
    columns = ("name", "as written", "value [SI]", "set by events to")
    if not changes:
        return Table("parameters", "Parameters", columns[:-1], tuple(row[:-1] for row in rows))
    return Table("parameters", "Parameters", (*columns[:2], "at the start [SI]", columns[3]), tuple(rows))


def begun(result: Result) -> Result:
    """The first part of a motion, with the parameters that it began with."""
    return result.pieces[0] if result.pieces else result


def _constants(model: Model, values: Values) -> dict[str, Any]:
    """Parameters by name."""
    return dict(zip(model.parameters, values.system.const.tolist(), strict=False))


def _set(result: Result) -> dict[str, list[tuple[float, float]]]:
    """Times at which events gave parameters other values, and these."""
    out: dict[str, list[tuple[float, float]]] = {}
    for h in result.events:
        if not isinstance(h.before, Moment) or h.before.values is h.after.values:
            continue
        was, now = (_constants(result.model, m.values) for m in (h.before, h.after))
        for name in (k for k in now if now[k] != was[k]):
            out.setdefault(name, []).append((h.t, now[name]))
    return out


def bodies(result: Result) -> Table:
    """Mass properties and positions at the start; the sum of masses and their centre."""
    p, rows, masses, centres = result.planar, [], [], []
    for e in result.model.bodies:
        b = begun(result).values.bodies[e.name]
        moments = [b.inertia[2, 2]] if p else np.linalg.eigvalsh(np.asarray(b.inertia).real)
        centre = np.array([c[0] for c in result.records.body(result.values.structure.place[e.name])[0]])
        masses.append(float(np.real(b.mass)))
        centres.append(centre)
        rows.append((e.name, fixed(b.mass), triple(b.com, p), ", ".join(map(fixed, moments)), triple(centre, p)))
    total = float(np.sum(masses))
    middle = np.average(centres, axis=0, weights=masses if total > 0.0 else None) if rows else np.zeros(3)
    inertia = "inertia [kg m²]" if p else "principal inertias [kg m²]"
    columns = ("body", "mass [kg]", "centre of mass in body [m]", inertia, "centre of mass at start [m]")
    return Table("bodies", "Bodies", columns, tuple(rows), ("all", fixed(total), "", "", triple(middle, p)))


def joints(result: Result) -> Table:
    """Where joints are at the start, what they hold, and the largest reactions they carried."""
    p, s, rows = result.planar, result.values.structure, []
    sizes = {e.name: _largest(result[e.name]) for e in result.model.joints}
    passed = {e.name: _passed(result[e.name]) for e in result.model.couplings}
    force, torque = (max((v[i] for v in sizes.values()), default=0.0) for i in (0, 1))
    least = (1e-9 * force, 1e-9 * max(torque, force * result.values.length))  # below, rounding errors
    for e in (*result.model.joints, *result.model.couplings):
        k = s.frame_at.get((e.name, "M", ""))
        at = axis = ""
        if k is not None:
            origin, R = result.records.frame(k)[:2]
            at = triple([np.ravel(c)[0] for c in origin], p)
            axis = triple([np.ravel(R[i])[0] for i in (2, 5, 8)], False)
        count = str(len(e.rows(p))) if isinstance(e, Joint) else "1"
        free = ", ".join(getattr(result[e.name], "undetermined", ()))
        most = [fixed(v if v > tiny else 0.0) for v, tiny in zip(sizes.get(e.name, ()), least, strict=False)]
        rows.append((e.name, type(e).__name__, between(e), at, axis, count, *(most or passed[e.name]), free))
    columns = ("joint", "kind", "between", "at, start [m]", "axis, start", "rows")
    loads = ("largest |force| [N]", "largest |torque| [N m]")
    if not any(r[-1] for r in rows):
        return Table("joints", "Joints", (*columns, *loads), tuple(r[:-1] for r in rows))
    note = "Redundancy leaves the named components undetermined; of those one choice is given."
    return Table("joints", "Joints", (*columns, *loads, "not determined"), tuple(rows), note=note)


def _largest(view: Any) -> tuple[float, float]:
    """The largest reaction force and torque of a joint."""
    sizes = []
    for a in (np.asarray(view.force), np.asarray(view.torque)):
        size = np.abs(a) if a.ndim == 1 else np.sqrt((a**2).sum(axis=1))
        sizes.append(float(np.nanmax(size, initial=0.0)))
    return sizes[0], sizes[1]


def _passed(view: Any) -> tuple[str, str]:
    """The largest force and torque that a coupling puts on its coordinates."""
    curves = view.channels().values()
    sizes = [[np.nanmax(np.abs(v), initial=0.0) for u, v in curves if u == unit] for unit in ("N", "N*m")]
    return tuple(fixed(max(x)) if x else "" for x in sizes)  # type: ignore[return-value]


def controllers(result: Result) -> Table:
    """What controllers are given, as written, and between which values their first signal stayed."""
    rows = []
    for e in result.model.controllers:
        name = next(iter(e.signals()))
        values = result[e.name].quantity(name)[1]
        span = f"{name} {fixed(np.nanmin(values))} to {fixed(np.nanmax(values))}" if len(values) else ""
        rows.append((e.name, type(e).__name__, _given(e), span))
    return Table("controllers", "Controllers", ("controller", "kind", "as written", "between"), tuple(rows))


def forces(result: Result) -> Table:
    """What forces act on, their constants and laws as written, and the largest that they gave."""
    rows = []
    for e in (*result.model.forces, *result.model.limits):
        curves = result[e.name].channels()
        sizes = [f"{fixed(np.nanmax(np.abs(v), initial=0.0))} {u}" for k, (u, v) in curves.items() if u in ("N", "N*m")]
        rows.append((e.name, type(e).__name__, between(e), _given(e), ", ".join(sizes).replace("N*m", "N m")))
    columns = ("force", "kind", "between", "as written", "largest component")
    return Table("forces", "Forces", columns, tuple(rows))


def _given(e: Any) -> str:
    """An element's own numbers and laws, as the user wrote them."""
    common = {"name", "body_i", "body_j", "body", "bodies", "joint", "at", "axis"}
    own = {f.name for f in fields(e)} - common
    return "; ".join(f"{k} = {_text(v)}" for k, v in written(e).items() if k in own)


def _text(value: Any) -> str:
    return "(" + ", ".join(map(_text, value)) + ")" if isinstance(value, (list, tuple)) else str(value)


def drivers(result: Result) -> Table:
    """Laws of drivers, the largest effort they needed, and the work they gave."""
    rows: list[Sequence[str]] = []
    for e in result.model.drivers:
        view = result[e.name]
        unit = view.channels()["effort"][0].replace("*", " ")
        effort = f"{fixed(np.nanmax(np.abs(view.effort), initial=0.0))} {unit}"
        rows.append((e.name, e.coordinate, str(e.law), effort, f"{fixed(view.work[-1])} J"))
    columns = ("driver", "coordinate", "law", "largest |effort|", "work given")
    return Table("drivers", "Drivers", columns, tuple(tuple(r) for r in rows))


def sensors(result: Result) -> Table:
    """What sensors measure, and between which values it stayed."""
    rows = []
    for e in result.model.sensors:
        for k, (unit, v) in result[e.name].channels().items():
            low, high = (fixed(x) for x in (np.nanmin(v), np.nanmax(v)))
            rows.append((e.name, type(e).__name__, between(e), k, low, high, unit.replace("*", " ")))
    return Table("sensors", "Sensors", ("sensor", "kind", "of", "curve", "least", "largest", "unit"), tuple(rows))
