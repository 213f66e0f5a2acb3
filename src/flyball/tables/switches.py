"""Rows with modes: what stops, holds, locks and latches, as rows of the fixed pattern; and what is watched of them.

Only the tables of a motion have them (`Choices.switches`): to all that is asked of a position they are no constraints.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..constraints.modes import BRANCH, EDGE, ELASTIC, FRICTION, LOCK, ONE_WAY, RATCHET, SLIP, STOP
from ..model.element import Element
from ..model.model import Model
from ..model.switch import Switch
from . import events
from .specs import RowSpec, Structure, frame, integers
from .system import (
    FALLING,
    G_ASTRAY,
    G_BACK,
    G_CONE,
    G_CORNER,
    G_HOLDS,
    G_LOWER,
    G_PRESS_LOWER,
    G_PRESS_UPPER,
    G_PULL,
    G_SHARED,
    G_SLIDES,
    G_TURNS,
    G_UPPER,
    Guards,
    Switches,
    SwitchNumbers,
)
from .terms import coordinate_term, measured_term

GUARDS = {
    STOP: (G_LOWER, G_UPPER, G_PULL),
    FRICTION: (G_HOLDS, G_SLIDES),
    ONE_WAY: (G_BACK, G_PULL),
    ELASTIC: (G_PRESS_LOWER, G_PRESS_UPPER),
    RATCHET: (G_LOWER, G_SLIDES, G_PULL),
    BRANCH: (G_CORNER,),
    SLIP: (G_CONE, G_TURNS),
    EDGE: (G_ASTRAY,),
}
"""What is watched of each kind of switch."""


@dataclass
class SwitchSpec:
    """One switch of a structure."""

    element: Element
    switch: Switch
    row: int = -1
    measured: int = -1
    force: int = -1
    law: int = -1
    other: int = -1
    partner: int = -1
    held: bool = False  # from the start


def declared(model: Model) -> list[tuple[Element, Switch]]:
    """All that the model's elements declare."""
    return [*((e, w) for e in model.elements() for w in e.switches()), *events.locks(model)]


def quantity(e: Element, w: Switch) -> str:
    """Name of the quantity that a switch acts along, among what is measured."""
    if w.along and not w.summed:
        return w.along[0]
    return f"{e.name}:{w.label or 'length'}"


def quantities(s: Structure) -> None:
    """Number the quantities that switches act along, before those of forces."""
    for e, w in declared(s.model):
        key = quantity(e, w)
        if key in s.measured:
            continue
        m = s.measured[key] = len(s.measured)
        for k, text in enumerate(w.along):
            coordinate_term(s, text, e, m, measured=True).index = k
            s.terms[-1].switch = w.label if w.summed else None
        for a, b, formula in w.seen or w.path:
            measured_term(s, m, frame(s, e, a), frame(s, e, b), formula, 1.0, e)


def rows(s: Structure) -> None:
    """The rows, behind all others."""
    for e, w in declared(s.model):
        if w.kind in (ELASTIC, EDGE):
            s.switches.append(SwitchSpec(e, w, -1, s.measured[quantity(e, w)]))
            continue
        row, first = len(s.rows), len(s.rows)
        for k, text in enumerate(w.along):
            coordinate_term(s, text, e, row, counted=True).index = k
            s.terms[-1].switch = w.label if w.summed else None
        for a, b, formula in w.path:
            measured_term(s, row, frame(s, e, a), frame(s, e, b), formula, 1.0, e)
            s.terms[-1].measured = False
        s.rows.append(RowSpec(e, w.label or "switch", holonomic=all(x.holonomic for _, _, x in w.path)))
        s.slices[e.name] = slice(s.slices[e.name].start if e.name in s.slices else first, len(s.rows))
        s.switches.append(SwitchSpec(e, w, row, s.measured[quantity(e, w)]))
    for k, spec in enumerate(s.switches):
        if spec.switch.other:
            one = [i for i, x in enumerate(s.switches) if x.element is spec.element]
            spec.other = next(i for i in one if s.switches[i].switch.label == spec.switch.other)
            like = [i for i in one if i != k and s.switches[i].switch.kind == spec.switch.kind == SLIP]
            spec.partner = like[0] if like else -1

    for joint in events.parting(s.model):
        at = s.slices[joint.name]
        for k, row in enumerate(range(at.start, at.stop)):
            spec = SwitchSpec(joint, Switch(LOCK, f"row {k}"), row, s.measured[events.own_row(joint, k)])
            spec.held = True
            s.switches.append(spec)


def table(s: Structure) -> None:
    """The integers of switches and guards, when forces are numbered."""
    for k, spec in enumerate(s.switches):
        if spec.switch.slides:
            spec.force = next(i for i, f in enumerate(s.forces) if f is spec.element)
            s.tables["forces"].switch[spec.force] = k
        s.guards += [(kind, k, FALLING) for kind in _watched(k, spec)]
    if _may_share(s):
        s.guards.append((G_SHARED, 0, FALLING))
    s.tables["switches"] = integers(
        Switches, [(x.row, x.measured, x.switch.kind, x.force, x.law, x.partner, x.other) for x in s.switches]
    )
    s.tables["guards"] = integers(Guards, s.guards)


def _may_share(s: Structure) -> bool:
    """Whether what holds by friction may have company: then how they share what they hold can be open."""
    gaps = {x.other for x in s.switches if x.switch.kind == SLIP}
    holding = [x for k, x in enumerate(s.switches) if x.row >= 0 and k not in gaps and not -1 < x.partner < k]
    return len(holding) > 1 and any(x.switch.kind in (FRICTION, SLIP) for x in holding)


def _watched(k: int, x: SwitchSpec) -> tuple[int, ...]:
    """What is watched of a switch: of two tangents of a place, the first is watched for both."""
    if x.switch.kind == SLIP and -1 < x.partner < k:
        return ()
    return GUARDS.get(x.switch.kind, ())


FIELDS = {SLIP: ("static_friction", "kinetic_friction"), RATCHET: ("tooth", "pitch", "restitution")}
"""Which of `SwitchNumbers` an element's ``switched`` gives, by the kind of switch; others: the first of them."""


def numbers(s: Structure, of: Any, table: SwitchNumbers, asks: Any, apart: Any) -> None:
    """Numbers of the switches, from those of their elements; ``apart``: how far points of each are apart."""
    for k, spec in enumerate(s.switches):
        kind = spec.switch.kind
        if kind != BRANCH and not asks(spec.element):
            continue
        given = (
            ()
            if kind == BRANCH
            else spec.element.switched(of[spec.element.name], spec.switch.label, apart(spec.element))
        )
        named = dict(zip(FIELDS.get(kind, SwitchNumbers._fields), given, strict=False))
        if kind == RATCHET:  # it begins between these teeth
            named |= {"lower": named["tooth"], "upper": named["tooth"] + named["pitch"]}
        for name, column in zip(table._fields, table, strict=True):
            column[k] = named.get(name, {"lower": -np.inf, "upper": np.inf}.get(name, 0.0))
