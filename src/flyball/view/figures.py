"""Figures as data: curves grouped into panels by unit, independent of the drawing library."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..model.snapshot import hidden_parts
from .recording import Channel, Figure, Panel

if TYPE_CHECKING:
    from ..results.result import Result

MAX_PANEL_CURVES = 12  # number of curves in one panel
MAX_HEIGHT_RATIO = 15.0  # largest ratio of a panel's height to the variation of a curve in it
FLAT_PART = 2e-3  # a curve with a smaller relative variation is a straight line anyway
MIN_WORK_PART = 1e-3  # relative to the energies: smaller works need not be shown
HIDING_PART = 0.006  # relative to the panel's height: closer curves hide one another
UNIT_LABELS = {
    "J": "energy",
    "N": "force",
    "N*m": "torque",
    "W": "power",
    "rad": "angle",
    "rad/s": "angular velocity",
    "rad/s^2": "angular acceleration",
    "m": "length",
    "m/s": "velocity",
    "m/s^2": "acceleration",
    "s": "time",
}


def standard_figures(result: Result) -> list[Figure]:
    """Return energies with their balance, coordinates, positions, reactions, efforts, sensors and controllers.

    Empty figures are left out; of many parts evenly chosen ones are shown.
    """
    if not len(result.t):
        return []
    makers: Sequence[Callable[[Result], Figure | None]]
    makers = (energies, coordinates, positions, contacts, reactions, actuation, sensors, controllers)
    return [figure for make in makers if (figure := make(result)) is not None]


def energies(result: Result) -> Figure:
    """Kinetic, potential and total energy, the work done, and the error of the balance."""
    e = result.energy
    curves = [Channel(k, "J", np.asarray(getattr(e, k))) for k in ("kinetic", "potential", "total")]
    work = np.asarray(sum(e.work.values(), np.zeros(len(result.t))))
    if np.ptp(work) > MIN_WORK_PART * max(float(np.ptp(c.values)) for c in curves):
        curves.append(Channel("work put in", "J", work))
    note = f"largest deviation {e.drift:.2g} J"
    balance = Panel("balance", (Channel("balance", "J", np.asarray(e.balance)),), note)
    panel = Panel("energy", tuple(curves))
    parts = [panel] if _comparable(curves[:2]) else split_panel(panel)
    return Figure("energy", "Energy", (*parts, balance))


def coordinates(result: Result) -> Figure | None:
    """Relative coordinates of the joints; those with small variation in a panel of their own."""
    hidden = hidden_parts(result.model)
    joints = [e for e in result.model.joints if e.name not in hidden]
    every = [(e, what, e.coordinates[what].unit) for e in joints for what in e.independent(result.planar)]
    units = dict.fromkeys(unit for _, _, unit in every)
    chosen = [c for unit in units for c in evenly_chosen([c for c in every if c[2] == unit])]
    known = {e.name: result[e.name].channels() for e, _, _ in chosen}
    curves = [
        Channel(f"{e.name}.{what}", unit, np.asarray(known[e.name][what][1]))
        for e, what, unit in chosen
        if what in known[e.name]
    ]
    parts = [p for panel in panels_by_unit(curves) for p in split_panel(panel)]
    return Figure("coordinates", "Joint coordinates", tuple(parts)) if parts else None


def positions(result: Result) -> Figure | None:
    """Centres of mass of spatial bodies, axis by axis."""
    if result.planar:
        return None
    every = moving_bodies(result)
    bodies = evenly_chosen(every)
    points = {name: centre(result, name) for name in bodies}
    parts = [Panel(axis, tuple(Channel(k, "m", p[:, i]) for k, p in points.items())) for i, axis in enumerate("xyz")]
    return Figure("positions", "Centres of mass", tuple(parts), count_note(len(bodies), len(every), "bodies"))


def reactions(result: Result) -> Figure | None:
    """Magnitudes of the joints' reaction forces, and of their torques if there are any."""
    sizes: dict[str, list[Channel]] = {"N": [], "N*m": []}
    every = [e for e in result.model.joints if e.blocks]
    joints = evenly_chosen(every)
    for e in joints:
        view = result[e.name]
        name = f"{e.name}*" if view.undetermined else e.name
        for what, unit in (("force", "N"), ("torque", "N*m")):
            a = np.asarray(getattr(view, what))
            sizes[unit].append(Channel(name, unit, np.abs(a) if a.ndim == 1 else np.sqrt((a**2).sum(axis=1))))
    force, torque = (max((float(np.nanmax(c.values, initial=0.0)) for c in x), default=0.0) for x in sizes.values())
    least = 1e-9 * max(torque, force * result.values.length)  # smaller values are rounding errors
    sizes["N*m"] = [c for c in sizes["N*m"] if np.nanmax(c.values, initial=0.0) > least]
    parts = [Panel(f"|{UNIT_LABELS[unit]}|", tuple(curves)) for unit, curves in sizes.items() if curves]
    if not parts:
        return None
    notes = [count_note(len(joints), len(every), "joints")]
    if any(c.name.endswith("*") for p in parts for c in p.curves):
        notes.append("* redundancy leaves some components undetermined")
    return Figure("reactions", "Joint reactions", tuple(parts), "; ".join(n for n in notes if n))


def actuation(result: Result) -> Figure | None:
    """Efforts of drivers, couplings and force elements."""
    curves: list[Channel] = []
    for e in (*result.model.drivers, *result.model.couplings, *result.model.forces, *result.model.limits):
        channels = result[e.name].channels()
        curves += [Channel(f"{e.name}.{k}", u, np.asarray(v)) for k, (u, v) in channels.items() if u in ("N", "N*m")]
    parts = panels_by_unit(curves)
    return Figure("actuation", "Drivers and forces", tuple(parts)) if parts else None


def sensors(result: Result) -> Figure | None:
    """Values of sensors."""
    curves = []
    for e in result.model.sensors:
        channels = result[e.name].channels()
        for k, (unit, values) in channels.items():
            name = e.name if len(channels) == 1 else f"{e.name}.{k}"
            curves.append(Channel(name, unit, np.asarray(values)))
    parts = [p for panel in panels_by_unit(curves) for p in split_panel(panel)]
    return Figure("sensors", "Sensors", tuple(parts)) if parts else None


def controllers(result: Result) -> Figure | None:
    """Outputs of controllers, after their references and responses."""
    every = result.model.controllers
    chosen, parts = evenly_chosen(every), []

    def curves(e: Any, names: Sequence[str]) -> list[Channel]:
        return [Channel(f"{e.name}.{k}", *result[e.name].quantity(k)) for k in names]

    for e in chosen:
        parts += [p for panel in panels_by_unit(curves(e, e.compared)) for p in split_panel(panel)]
    said = [c for e in chosen for c in curves(e, e.output_names)]
    parts += [p for panel in panels_by_unit(said) for p in split_panel(panel)]
    note = count_note(len(chosen), len(every), "controllers")
    return Figure("controllers", "Controllers", tuple(parts), note) if parts else None


def panels_by_unit(curves: Sequence[Channel], most: int = MAX_PANEL_CURVES) -> list[Panel]:
    """Return one panel for each unit, with its first curves if there are too many."""
    groups: dict[str, list[Channel]] = {}
    for c in curves:
        groups.setdefault(c.unit, []).append(c)
    return [
        Panel(panel_label(g), tuple(g[:most]), count_note(min(most, len(g)), len(g), "curves")) for g in groups.values()
    ]


def panel_label(curves: Sequence[Channel]) -> str:
    """Return an axis label: the common name of all its curves, else the quantity of their unit."""
    names = {c.name.rpartition(".")[2] for c in curves}
    own = names.pop() if len(names) == 1 and all("." in c.name for c in curves) else ""
    return own if len(own) > 2 else UNIT_LABELS.get(curves[0].unit, own)


def split_panel(panel: Panel) -> list[Panel]:
    """Return the panel, or several if a curve would look constant beside others."""
    groups: list[list[Channel]] = []
    for c in panel.curves:
        home = next((g for g in groups if _comparable([*g, c])), None)
        if home is None:
            groups.append([c])
        else:
            home.append(c)
    return [Panel(panel.label, tuple(g), "" if k else panel.note) for k, g in enumerate(groups)]


def _comparable(curves: Sequence[Channel]) -> bool:
    """Return whether no curve varies much less than the height of the common panel."""
    finite = [v for c in curves if len(v := c.values[np.isfinite(c.values)])]
    if not finite:
        return True
    low, high = min(v.min() for v in finite), max(v.max() for v in finite)
    least = [max(FLAT_PART * np.abs(v).max(), 1e-9 * max(abs(low), abs(high))) for v in finite]
    spans = [s for v, at_least in zip(finite, least, strict=True) if (s := np.ptp(v)) > at_least]
    return not spans or bool(high - low <= MAX_HEIGHT_RATIO * min(spans))


def hidden_counts(curves: Sequence[np.ndarray]) -> list[int]:
    """Return for each curve how many earlier ones it would hide; it is drawn dashed to show them."""
    finite = [v[np.isfinite(v)] for v in curves]
    values = np.concatenate([*finite, np.zeros(0)])
    if not len(values):
        return [0] * len(curves)
    near = max(HIDING_PART * float(np.ptp(values)), 1e-12 * float(np.abs(values).max()), 1e-300)
    out = []
    for k, v in enumerate(curves):
        gaps = [np.abs(v - earlier) for earlier in curves[:k]]
        out.append(sum(bool(np.isfinite(g).any() and np.nanmax(g) <= near) for g in gaps))
    return out


MAX_INITIAL = 2  # coordinates of one unit that a page shows when it opens
STEADY_PART = 1e-3  # a coordinate that varies less, relative to the largest variation of its unit, does not move
TRAVEL_PART = 0.9  # a coordinate whose end is this far from its start, relative to its variation, travels


def initial_channels(result: Result, channels: Sequence[Channel]) -> tuple[str, ...]:
    """Return the curves shown when a page opens, of those that it has.

    They are sensors; reference, response and output of controllers; efforts of drivers; of each unit two coordinates of
    joints (without joints: of bodies) that move; energies. Of coordinates that swing those of initial conditions come
    first. One that travels is shown where none of its unit swings, a driven one that travels where nothing else moves.
    """
    m, curves = result.model, {c.name: c for c in channels}
    measured = [f"{s.name}.value" for s in m.sensors][:2]
    compared = [f"{c.name}.{k}" for c in m.controllers[:1] for k in c.compared]
    sources = {str(getattr(c, k)) for c in m.controllers[:1] for k in c.compared}
    outputs = [f"{c.name}.{c.output_names[0]}" for c in m.controllers][:2]
    efforts = [k for d in m.drivers if (k := f"{d.name}.effort") in curves][:1]
    joints = [f"{j.name}.{k}" for j in m.joints for k in j.coordinates]
    own = [f"{b.name}.{k}" for b in m.bodies for k in ("x", "y", "z", "angle", "roll", "pitch", "yaw")]
    usable = [[curves[k] for k in names if k in curves and k not in sources] for names in (joints, own)]
    asked = {e.name for e in m.elements() if e.category == "initial"}
    driven = {d.coordinate for d in m.drivers}
    moving = _moving_coordinates(usable[0] or usable[1], asked, driven)
    energies = ("energy.kinetic", "energy.potential", "energy.total")
    return tuple(k for k in (*measured, *compared, *outputs, *efforts, *moving, *energies) if k in curves)


def _moving_coordinates(curves: Sequence[Channel], asked: set[str], driven: set[str]) -> list[str]:
    """Return the coordinates of each unit that say most about the motion: the best of one rank."""
    out: list[tuple[int, list[str]]] = []
    for unit in dict.fromkeys(c.unit for c in curves):
        own = [c for c in curves if c.unit == unit and np.isfinite(c.values).any()]
        spans = {c.name: float(np.nanmax(c.values) - np.nanmin(c.values)) for c in own}
        largest = max(spans.values(), default=0.0)
        ranks: dict[int, list[str]] = {}
        for c in own:
            span = spans[c.name]
            if span > STEADY_PART * largest:
                travels = abs(c.values[-1] - c.values[0]) > TRAVEL_PART * span
                ranks.setdefault(2 + (c.name in driven) if travels else c.name not in asked, []).append(c.name)
        if ranks:
            best = sorted(ranks[min(ranks)], key=lambda k: -round(2.0 * np.log10(spans[k])))
            out.append((min(ranks), best[:MAX_INITIAL]))
    first = min((rank for rank, _ in out), default=0)
    return [k for rank, names in out if rank == first or rank < 3 for k in names]


def moving_bodies(result: Result) -> list[str]:
    """Names of all bodies; if there are sets only, those of their members."""
    names = [b.name for b in result.model.bodies]
    return names or [f"{name}[{k}]" for name, own in result.bulk.items() for k in evenly_chosen(range(len(own)))]


def contacts(result: Result) -> Figure | None:
    """Number of contacts, dissipated power, deepest overlap, and largest normal force."""
    c = result.contacts
    if c is None or not len(c):
        return None
    rows = len(result.t)
    overlap, force = np.zeros(rows), np.zeros(rows)
    np.maximum.at(overlap, c.when, -c.gap)
    np.maximum.at(force, c.when, c.normal_force)
    lost = [Channel(k, "J", np.asarray(v)) for k, v in result.exchanged.items() if np.any(v)]
    parts = [Panel("contacts", (Channel("contacts", "1", c.count.astype(float)),))]
    parts += [Panel("exchanged since the start", tuple(lost))] if lost else []
    parts += [Panel("largest normal force", (Channel("normal force", "N", force),))]
    parts += [Panel("deepest overlap", (Channel("overlap", "m", overlap),))]
    return Figure("contacts", "Contacts", tuple(parts))


def centre(result: Result, name: str) -> np.ndarray:
    """Centre of mass of a body over time (n, 3) [m]."""
    if name not in result.values.structure.place:
        return np.asarray(result[name].position) @ np.eye(3)[: result[name].position.shape[1]]
    p = result.records.body(result.values.structure.place[name])[0]
    return np.stack([np.broadcast_to(c, len(result.t)) for c in p], axis=1)


def count_note(shown: int, there: int, what: str) -> str:
    """Return a note if not all are shown."""
    return f"{shown} of {there} {what}" if shown < there else ""


def evenly_chosen(parts: Sequence[Any], most: int = MAX_PANEL_CURVES) -> list[Any]:
    """Return evenly chosen parts, including first and last."""
    if len(parts) <= most:
        return list(parts)
    return [parts[i] for i in np.linspace(0, len(parts) - 1, most).round().astype(int)]
