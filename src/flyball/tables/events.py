"""Events in tables: rows that actions lock and release, joints that may let go, what is watched."""

from __future__ import annotations

from ..constraints.modes import LOCK
from ..model.actions import Impulse, Lock, Release
from ..model.body import Body, Frame
from ..model.event import Event
from ..model.event_check import coordinate_of
from ..model.held import held_by
from ..model.joint import Joint
from ..model.model import Model
from ..model.switch import Switch
from .specs import Structure, TermSpec, frame
from .system import EITHER, FALLING, G_LAW, RISING
from .terms import coordinate_term

WAYS = {"rising": RISING, "falling": FALLING, "either": EITHER}


def locks(model: Model) -> list[tuple[Event, Switch]]:
    """A row for each coordinate that some event locks or releases: the first of these events has it."""
    out: dict[str, tuple[Event, Switch]] = {}
    for e in model.events:
        for a in e.do:
            if isinstance(a, (Lock, Release)):
                for text in held_by(model, e, a).coordinates:
                    out.setdefault(text, (e, Switch(LOCK, label=text, along=(text,))))
    return list(out.values())


def parting(model: Model) -> list[Joint]:
    """Joints that some event releases: their own rows let go, so that they cannot be tree joints."""
    found = [held_by(model, e, a).joint for e in model.events for a in e.do if isinstance(a, (Lock, Release))]
    return [model[name] for name in dict.fromkeys(found) if name]


def own_row(joint: Joint, k: int) -> str:
    """Name of the measured quantity that is the k-th row of a joint."""
    return f"{joint.name}:row {k}"


def quantities(s: Structure) -> None:
    """Measure what the rows of joints that may let go hold."""
    for joint in parting(s.model):
        F, M = frame(s, joint, "F"), frame(s, joint, "M")
        for k, row in enumerate(joint.rows(s.model.planar)):
            m = s.measured[own_row(joint, k)] = len(s.measured)
            term = TermSpec(m, F, M, row, 1.0, joint, measured=True)
            if hasattr(joint, "nearest"):
                term.hint = s.state(f"{joint.name}.place")
            s.terms.append(term)
            for what in row.plus:
                coordinate_term(s, f"{joint.name}.{what}", joint, m, measured=True)


def names(model: Model) -> dict[str, Event]:
    """Every name in expressions of events, coordinates that they strike too, and an event that uses it."""
    out: dict[str, Event] = {}
    for e in model.events:
        for where, law in e.laws():
            out |= dict.fromkeys(model.law(law, e.of, where).names, e)
        for a in e.do:
            if isinstance(a, Impulse) and not isinstance(model.find(a.on), (Body, Frame)):
                out[coordinate_of(model, e, a)] = e
    return out


def guards(s: Structure) -> None:
    """Watch the expressions of events; `Structure.events` says which guard is whose."""
    for e in s.model.events:
        if not e.at_start:
            s.events[len(s.guards)] = e
            at = s.law(s.model.law(e.law, e.of, f"when of {e.title}"), ())
            s.guards.append((G_LAW, at, WAYS[e.direction]))
