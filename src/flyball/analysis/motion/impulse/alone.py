"""The mechanism without the free bodies and without contact: a model of its own, whose stops are forces of no effect.

A stop of a coordinate needs its value and its gradient; a spring of no stiffness along it has them made.
"""

from __future__ import annotations

from collections.abc import Sequence

from ....forces.coordinate_spring import measuring
from ....forces.limit import Limit
from ....model.model import Model
from ....tables.contact.stops import stops
from ....tables.values import Values
from .mechanism import Stop


def with_stops(model: Model) -> Model:
    """A copy in which springs of no stiffness stand for stops."""
    out = model.copy()
    rigid = [e for e in out.limits if isinstance(e, Limit) and not e.acts()]
    out.limits = [e for e in out.limits if e.acts()]
    for e in rigid:
        del out.by_name[e.name]
        out.add(measuring(e.name, e.coordinate))
    return out.snapshot()


def stops_of(model: Model, values: Values) -> dict[str, Stop]:
    """Stops by name."""
    return {s.element.name: (s.lower, s.upper, s.restitution) for s in stops(model, values.given)}


def alone(model: Model, held: Sequence[str]) -> Model:
    """What of a model with its stops as springs concerns the bodies ``held``, without shapes that touch."""
    out = model.copy()
    gone = {b.name for b in out.bodies} - set(held)
    gone |= {f.name for f in out.frames if f.body in gone}
    for name in ("contacts", "bulk", "ground", "materials", "material_pairs"):
        gone |= {e.name for e in getattr(out, name)}
        setattr(out, name, [])
    out.bodies = [b for b in out.bodies if b.name not in gone]
    out.frames = [f for f in out.frames if f.name not in gone]
    out.initial = [e for e in out.initial if e.name.partition(".")[0] not in gone]
    lost = [s for s in out.sensors if any(body in gone for body in _bodies(s))]
    out.sensors = [s for s in out.sensors if s not in lost]
    for name in (*gone, *(s.name for s in lost)):
        out.by_name.pop(name, None)
    return out.snapshot()


def _bodies(sensor) -> list[str]:
    """Names that a sensor measures something of."""
    texts = [getattr(sensor, k, None) for k in ("of", "frame")]
    return [t.partition(".")[0] for t in texts if isinstance(t, str)]
