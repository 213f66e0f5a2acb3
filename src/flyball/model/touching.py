"""What touches what in a model: names that contacts and materials refer to, and which contact holds for a pair."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from typing import TYPE_CHECKING

from ..constraints.modes import ELASTIC
from ..errors import ModelError
from .body import GROUND, Body
from .bulk import Bodies
from .contact import Contact
from .element import Element, field_with
from .ground import Ground
from .joint import Joint
from .material import Material, MaterialPair
from .words import listing, shortened, suggest

if TYPE_CHECKING:
    from .model import Model

Owner = Body | Bodies | Ground


def has_contact(model: Model) -> bool:
    """Whether there is something that only a motion by impulses knows: contacts, rigid stops, many bodies."""
    return bool(model.contacts or model.bulk or any(not e.acts() for e in model.limits))


def holds_at_times(model: Model) -> bool:
    """Whether something holds at times: the same, and what sticks, locks, latches or goes taut; or events."""
    held = any(w.kind != ELASTIC for e in model.elements() for w in e.switches())
    return has_contact(model) or held or any(e.category == "events" for e in model.elements())


def smooth_only(model: Model) -> list[Element]:
    """One-sided elements that steps by impulses do not know: latches, rigid play, ropes that do not stretch."""
    known = "Limit"
    return [e for e in (*model.forces, *model.limits) if not e.acts() and type(e).__name__ != known]


def nothing_touches(model: Model) -> tuple[str, ...]:
    """What to say of shapes that nothing can touch, for want of a contact, and of bodies that can touch nothing."""
    there: list[Owner] = [*model.ground, *model.bulk]
    if model.contacts or not any(s.touches for e in there for s in e.shapes()):
        return _shapeless(model)
    return (
        f"{there[0].title} touches nothing: {model.name!r} has no Contact; add Contact(friction=...), or give its "
        f"shapes looks=True",
    )


def _shapeless(model: Model) -> tuple[str, ...]:
    """Warns of bodies without a shape where a contact holds for everything: they fall through whatever is there.

    No warning where a chain of joints, drivers or forces with two ends connects a body to ground or to a shape: these
    carry it. A shape with ``looks=True`` says that a body is not to touch.
    """
    contact = next((c for c in model.contacts if c.between is None), None)
    bare = [b.name for b in model.bodies if not b.shapes()] if contact else []
    if not bare:
        return ()
    near: defaultdict[str, set[str]] = defaultdict(set)
    for connected in _connections(model):
        for name in connected:
            near[name] |= connected
    carried, ahead = set(), {GROUND} | {b.name for b in model.bodies} - set(bare)
    while ahead:
        carried |= ahead
        ahead = set().union(*(near[name] for name in ahead)) - carried
    lost = [repr(name) for name in bare if name not in carried]
    if not lost:
        return ()
    who = f"bodies {shortened(lost)} have no shape" if len(lost) > 1 else f"body {lost[0]} has no shape"
    return (
        f"{who} and no connection to ground or to a body with one: {contact.title} does not stop them, they pass "  # type: ignore[union-attr]
        f"through everything; give a shape (with looks=True if it is not to touch anything)",
    )


def _connections(model: Model) -> Iterator[set[str]]:
    """Bodies, and ground, that a joint, a driver or a force with two ends connects."""
    for e in (*model.joints, *model.forces, *model.limits):
        yield {model.carrier(name, e) for name in e.ends().values()} if hasattr(e, "ends") else set()
    along = ((e, text) for e in (*model.forces, *model.limits) for text in getattr(e, "along", tuple)())
    for e, text in (*along, *((d, d.coordinate) for d in model.drivers)):
        owner, _ = model.coordinate(text, e)
        if not isinstance(owner, Joint):
            yield {GROUND, getattr(owner, "body", owner.name)}


def owners(model: Model) -> list[Owner]:
    """All that may have shapes: parts of ground, bodies, many bodies."""
    return [*model.ground, *model.bodies, *model.bulk]


def check_touching(model: Model, e: Element) -> None:
    """Refuse names of materials and bodies that are not there, and contacts that hold for the same.

    Raises
    ------
    ModelError
        If a name is unknown or means something else.
    """
    if isinstance(e, MaterialPair):
        for name in (e.first, e.second):
            _material(model, name, e)
        _refuse_same_pair(model, e)
    elif isinstance(e, Contact):
        for name in named(e):
            _touching(model, name, e)
        _refuse_second(model, e)
        _refuse_overlap(model, e)
    elif isinstance(e, (Body, Bodies, Ground)):
        for material in (e.material, *(s.material for s in e.shapes())):
            if material is not None:
                _material(model, material, e)
        _refuse_idle(e)


def _refuse_idle(e: Owner) -> None:
    """Refuse materials of what touches nothing."""
    shapes = e.shapes()
    for s in shapes:
        if s.material is not None and not s.touches:
            raise ModelError(f"{e.title}: material of {s.title} has no effect, since it does not touch; leave it out")
    if e.material is not None and not any(s.touches and s.material is None for s in shapes):
        why = "its shapes name their own or do not touch" if shapes else "it has no shape"
        raise ModelError(f"{e.title}: material {e.material!r} has no effect, since {why}; leave it out")


def named(e: Contact) -> Iterator[str]:
    """Every name that a contact gives."""
    yield from e.between or ()
    yield from e.others or ()
    for pair in e.exclude:
        yield from pair


def _material(model: Model, name: str, e: Element) -> None:
    found = model.find(name)
    if not isinstance(found, Material):
        known = [x.name for x in model.materials]
        what = "" if found is None else f" ({name!r} is a {type(found).__name__})"
        hint = f"{what}{suggest(name, known)}; {listing(known)}"
        raise ModelError(f"{e.title}: {field_with(e, name)}there is no material named {name!r}{hint}")


def _touching(model: Model, name: str, e: Contact) -> None:
    found = model.find(name)
    if name == GROUND:
        if not model.ground:
            raise ModelError(f"{e.title}: ground has no shapes; add some by Ground('floor', shape=Plane())")
        return
    if not isinstance(found, (Body, Bodies, Ground)):
        known = [GROUND, *(x.name for x in owners(model))]
        what = "" if found is None else f" ({name!r} is a {type(found).__name__})"
        hint = f"{what}{suggest(name, known)}; {listing(known)}"
        raise ModelError(f"{e.title}: {_where(e, name)}there is no body named {name!r}{hint}")
    if not any(s.touches for s in found.shapes()):
        raise ModelError(f"{e.title}: {found.title} has no shape that touches; give it one, or leave it out")


def _where(e: Contact, name: str) -> str:
    """The field that names it."""
    return field_with(e, name) or "exclude: "


def _refuse_second(model: Model, e: Contact) -> None:
    """One contact for everything is enough."""
    other = next((c for c in model.contacts if c.name != e.name and c.between is None), None)
    if other is not None and e.between is None:
        raise ModelError(
            f"{e.title}: {other.title} holds for everything already; say between= what this one holds, or give them "
            f"materials"
        )


def _refuse_overlap(model: Model, e: Contact) -> None:
    """Two contacts that name bodies are about different ones."""
    for other in model.contacts:
        if other.name == e.name or other.between is None or e.between is None:
            continue
        mine, its = _sides(model, e), _sides(model, other)
        for a in sorted(mine[0] & its[0]):
            for b in sorted(mine[1] & its[1]):
                _refuse_common(model, e, other, a, b)
        for a in sorted(mine[0] & its[1]):
            for b in sorted(mine[1] & its[0]):
                _refuse_common(model, e, other, a, b)


def _sides(model: Model, e: Contact) -> tuple[set[str], set[str]]:
    """Names on either side of a contact, with the parts of ground in place of ground."""
    ground = {g.name for g in model.ground}
    first, second = (
        set(x) - {GROUND} | (ground if GROUND in x else set()) for x in (e.between or (), e.others or e.between or ())
    )
    return first, second


def _refuse_common(model: Model, e: Contact, other: Contact, a: str, b: str) -> None:
    if a != b or isinstance(model.find(a), Bodies):
        a, b = sorted((a, b))
        raise ModelError(
            f"{e.title}: {other.title} holds for {a!r} and {b!r} already; two contacts that name bodies must be about "
            f"different pairs"
        )


def _refuse_same_pair(model: Model, e: MaterialPair) -> None:
    for other in model.material_pairs:
        if other.name != e.name and {other.first, other.second} == {e.first, e.second}:
            raise ModelError(f"{e.title}: {other.title} is about the same two materials; leave one out")
