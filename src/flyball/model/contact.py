"""Contact between bodies: which bodies may touch, surface materials, laws of the normal force.

Materials define friction, restitution, rolling resistance and surface velocity; a pair of materials may override them.
`Contact` defines which bodies may touch, and their contact law.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import field
from types import SimpleNamespace
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from pydantic import BeforeValidator, WithJsonSchema

from ..errors import ModelError
from .body import GROUND, Bodies, Body, Ground
from .element import (
    Damping,
    Direction,
    Element,
    Flag,
    Length,
    Name,
    Number,
    Ratio,
    Unit,
    Velocity,
    element,
    field_with,
    nonnegative,
    positive,
    python_data,
)
from .joint import Joint
from .messages import listing, shortened_list, suggest
from .units import split_quantity, to_si

if TYPE_CHECKING:
    from .model import Model


HARD, LINEAR, HERTZ, HUNT_CROSSLEY = "hard", "linear", "hertz", "hunt-crossley"
LAW_NUMBERS = {  # parameters of each law
    HARD: (),
    LINEAR: ("stiffness", "damping"),
    HERTZ: ("stiffness",),
    HUNT_CROSSLEY: ("stiffness", "exponent", "dissipation"),
}
ALL_LAW_NUMBERS = ("stiffness", "exponent", "dissipation", "damping")
DEFAULT_EXPONENT = 1.5  # exponent of Hertz' law


def _law(value: Any) -> Any:
    if not isinstance(value, str) or value not in LAW_NUMBERS:
        raise ValueError(f"give one of {', '.join(LAW_NUMBERS)}")
    return value


NormalLaw = Annotated[str, BeforeValidator(_law), WithJsonSchema({"type": "string", "enum": list(LAW_NUMBERS)})]
NormalStiffness = Annotated[Number, Unit(None)]
Dissipation = Annotated[Number, Unit("s/m")]
Pressure = Annotated[Number, Unit("Pa")]


def check_law(e: Element, n: SimpleNamespace) -> None:
    """Refuse laws of the normal force without their parameters, and parameters without their law.

    Raises
    ------
    ModelError
        If a number is missing, belongs to another law, is out of its range or has another unit.
    """
    for name in ALL_LAW_NUMBERS:
        if getattr(n, name) is not None and (n.law is None or name not in LAW_NUMBERS[n.law]):
            laws = [law for law, names in LAW_NUMBERS.items() if name in names]
            raise ModelError(
                f"{e.title}: {name} has no effect with law={n.law or HARD!r}; it is a number of {', '.join(laws)}"
            )
    if n.law in (None, HARD):
        return
    positive(e, n, "stiffness", "exponent")
    nonnegative(e, n, "damping", "dissipation")
    if n.exponent is not None and not 1.0 <= n.exponent.real <= 4.0:
        raise ModelError(f"{e.title}: exponent is {n.exponent:g}; it must be from 1 (linear) to 4; 1.5 is Hertz'")
    if n.law == LINEAR and n.stiffness is None:
        raise ModelError(f"{e.title}: law='linear' needs stiffness=..., a number in N/m")
    if getattr(n, "restitution", None) is not None:
        how = {LINEAR: "damping=", HUNT_CROSSLEY: "dissipation="}.get(n.law)
        remedy = f"give the losses by {how}" if how else "take law='hunt-crossley', which loses some"
        raise ModelError(f"{e.title}: restitution is of hard contact; with law={n.law!r} {remedy}")
    _check_unit(e, unit_of_stiffness(n))


def unit_of_stiffness(n: SimpleNamespace) -> str:
    """Return the unit of stiffness: N over the metre to the law's power."""
    power = 1.0 if n.law == LINEAR else DEFAULT_EXPONENT if n.exponent is None else float(n.exponent.real)
    return "N/m" if power == 1.0 else f"N/m^{power:g}"


def _check_unit(e: Element, unit: str) -> None:
    """Check that the unit of stiffness fits the exponent."""
    given = e.stiffness  # type: ignore[attr-defined]
    if isinstance(given, str):
        parts = split_quantity(given)
        if parts is not None and parts[1]:
            try:
                to_si(given, unit)
            except ModelError as error:
                raise type(error)(f"{e.title}: stiffness: {error}") from None


def check_elasticity(e: Element, n: SimpleNamespace) -> None:
    """Refuse elastic constants that are impossible for an isotropic solid, and one without the other.

    Raises
    ------
    ModelError
        If Young's modulus is not positive or Poisson's ratio not above -1 and at most 1/2.
    """
    positive(e, n, "youngs_modulus")
    if (n.youngs_modulus is None) != (n.poissons_ratio is None):
        names = ("youngs_modulus", "poissons_ratio")
        given, other = names if n.poissons_ratio is None else names[::-1]
        raise ModelError(f"{e.title}: {given} needs {other} as well: the stiffness of a surface follows from both")
    if n.poissons_ratio is not None and not -1.0 < n.poissons_ratio.real <= 0.5:
        raise ModelError(
            f"{e.title}: poissons_ratio is {n.poissons_ratio:g}; it must be above -1 and at most 0.5, as 0.3 of steel"
        )


Friction = Annotated[float | str | tuple[float | str, ...], BeforeValidator(python_data), Unit("1")]
SURFACE_NUMBERS = ("friction", "static_friction", "restitution", "rolling_friction", "spinning_friction")


def check_restitution(e: Element, n: SimpleNamespace) -> None:
    """Refuse a restitution outside 0 to 1."""
    nonnegative(e, n, "restitution")
    if n.restitution is not None and not n.restitution.real <= 1.0:
        raise ModelError(
            f"{e.title}: restitution is {n.restitution:g}; it must be from 0 to 1, since no impact makes energy"
        )


def check_surface(e: Element, n: SimpleNamespace) -> None:
    """Refuse impossible surface properties.

    Raises
    ------
    ModelError
        If friction or a length is negative, restitution not from 0 to 1, or static friction below that of sliding.
    """
    nonnegative(e, n, "static_friction", "rolling_friction", "spinning_friction")
    check_restitution(e, n)
    for x in friction_pair(n.friction):
        if x is not None and not x.real >= 0.0:
            raise ModelError(f"{e.title}: friction is {x:g}; it must be zero or greater")
    if n.static_friction is not None:
        if n.friction is None:
            raise ModelError(f"{e.title}: static_friction needs friction, that of sliding, which is not greater")
        sliding = friction_pair(n.friction)[0]
        if n.static_friction.real < sliding.real:
            raise ModelError(
                f"{e.title}: static_friction is {n.static_friction:g}, below friction (that of sliding), {sliding:g}; "
                f"what slides would stop and what rests would slide"
            )


def friction_pair(x: Any) -> tuple[Any, Any]:
    """Return friction along the grain and across it."""
    return (x[0], x[1]) if isinstance(x, tuple) else (x, x)


@element
class Material(Element):
    """A surface, as bodies and shapes name it: ``Body(..., material="rubber")``.

    A contact combines two materials. Friction and restitution are the geometric means of both, so that a zero on one
    side gives zero (as in Box2D and Jolt); the lengths of rolling and spinning friction are the greater ones, since the
    softer body deforms (as in MuJoCo); surface velocities are added. Properties that a material leaves out are those of
    the `Contact`, or else those of the other side. Measured properties of a pair are given by a `MaterialPair`.

    Parameters
    ----------
    name : str
    friction : number, or two numbers [1]
        Coefficient of sliding friction. Two: along the grain (greater than 0) and across it.
    static_friction : number [1]
        Coefficient of static friction, not smaller; equal to ``friction`` if not given. With a grain: along it; across
        it in the ratio of ``friction``.
    restitution : number [1]
        From 0 (no rebound) to 1 (elastic); 0 if given nowhere.
    rolling_friction : number [m]
        Lever arm of the rolling resistance: the greatest torque divided by the normal force.
    spinning_friction : number [m]
        The same about the normal: about two thirds of friction times the radius of the contact patch.
    grain : direction
        Direction of the first of two friction coefficients, in the reference frame of the body; if it is normal to the
        surface, the second coefficient applies in all directions.
    surface_velocity : vector [m/s]
        Velocity of the surface relative to the body (conveyor belt), in the body's reference frame. Only its tangential
        component is used.
    youngs_modulus : number [Pa]
        Of the solid, for a `Contact` with the ``law`` of Hertz or of Hunt and Crossley without a given stiffness.
    poissons_ratio : number [1]
        As ``youngs_modulus``; both or none.
    """

    friction: Friction | None = None
    static_friction: Ratio | None = None
    restitution: Ratio | None = None
    rolling_friction: Length | None = None
    spinning_friction: Length | None = None
    grain: Direction | None = None
    surface_velocity: Velocity | None = None
    youngs_modulus: Pressure | None = None
    poissons_ratio: Ratio | None = None

    category: ClassVar[str] = "materials"
    local: ClassVar[tuple[str, ...]] = ("grain", "surface_velocity")

    def check(self, n: SimpleNamespace) -> None:
        """Require valid surface properties; a grain if, and only if, two friction coefficients are given."""
        two = isinstance(n.friction, tuple)
        if two and (len(n.friction) != 2 or any(isinstance(x, tuple) for x in n.friction)):
            raise ModelError(
                f"{self.title}: friction must be one number, or two, along the grain and across it; got {n.friction}"
            )
        check_surface(self, n)
        check_elasticity(self, n)
        if two and not n.friction[0].real > 0.0:
            raise ModelError(
                f"{self.title}: friction along the grain is 0; it must be greater than 0. For a surface that is "
                "smooth in one direction, swap the numbers and turn the grain by a right angle"
            )
        if two != (n.grain is not None):
            raise ModelError(
                f"{self.title}: friction has two numbers; give the direction of the first: grain=(1, 0, 0)"
                if two
                else f"{self.title}: grain has no effect, since friction is one number; leave it out"
            )
        if two and not any(abs(x) > 0.0 for x in n.grain):
            raise ModelError(f"{self.title}: grain has no length; a direction must not be zero")


@element
class MaterialPair(Element):
    """Properties of a pair of materials, in place of those combined from both.

    Parameters
    ----------
    first, second : str
        Names of the materials; both may be the same.
    friction, static_friction, restitution : number [1]
        As for `Material`; properties that are not given follow from the materials.
    rolling_friction, spinning_friction : number [m]
    law, stiffness, exponent, dissipation, damping : as for `Contact`
        Compliant contact law; restitution applies to hard contact only.
    name : str
        Composed of the materials' names if not given.
    """

    name: str = field(default="", kw_only=True)
    first: Name = field(kw_only=False)
    second: Name = field(kw_only=False)
    friction: Ratio | None = None
    static_friction: Ratio | None = None
    restitution: Ratio | None = None
    rolling_friction: Length | None = None
    spinning_friction: Length | None = None
    law: NormalLaw | None = None
    stiffness: NormalStiffness | None = None
    exponent: Ratio | None = None
    dissipation: Dissipation | None = None
    damping: Damping | None = None

    category: ClassVar[str] = "material_pairs"

    def __post_init__(self) -> None:
        """Set the default name."""
        if not self.name:
            object.__setattr__(self, "name", f"{self.first} on {self.second}")

    def check(self, n: SimpleNamespace) -> None:
        """Require valid surface properties, at least one."""
        check_surface(self, n)
        check_law(self, n)
        if all(getattr(n, k) is None for k in (*SURFACE_NUMBERS, "law")):
            raise ModelError(
                f"{self.title}: it has no effect; give friction=, restitution= or another of {SURFACE_NUMBERS}"
            )


def _names(value: Any) -> Any:
    """Convert a name, or several, to a tuple."""
    value = python_data(value)
    if isinstance(value, str):
        value = (value,)
    if not isinstance(value, tuple) or not value or not all(isinstance(x, str) and x for x in value):
        raise ValueError("give a name or a list of names")
    if len(set(value)) < len(value):
        raise ValueError("give each name once")
    return value


def _pairs(value: Any) -> Any:
    """Convert to pairs of names."""
    value = python_data(value)
    if isinstance(value, tuple) and len(value) == 2 and all(isinstance(x, str) for x in value):
        value = (value,)
    good = isinstance(value, tuple) and all(
        isinstance(p, tuple) and len(p) == 2 and all(isinstance(x, str) and x for x in p) for p in value
    )
    if not good:
        raise ValueError('give pairs of names, such as [("arm", "floor"), ("arm", "stand")]')
    return value


Names = Annotated[tuple[str, ...], BeforeValidator(_names, json_schema_input_type=str | tuple[str, ...])]
Pair = tuple[str, str]
Pairs = Annotated[tuple[Pair, ...], BeforeValidator(_pairs, json_schema_input_type=Pair | tuple[Pair, ...])]


@element
class Contact(Element):
    """Contact between bodies with shapes, with Coulomb friction; hard, unless ``law`` is compliant.

    ``m.add(fb.Contact(friction=0.3))`` applies to all pairs of things with shapes: bodies, `Bodies` and `Ground`.
    Bodies that a joint connects are left out. A further `Contact` that names bodies replaces the first for these.

    Parameters
    ----------
    name : str
    between : name or list of names
        Bodies, `Bodies`, parts of ground (``"ground"``: all of them) that may touch each other; everything if not
        given.
    others : name or list of names
        If given, members of ``between`` may touch these, but not each other.
    friction : number [1]
        Coefficient of sliding friction for surfaces whose `Material` gives none; with ``between``, for all its pairs. 0
        is frictionless. Belts, grain and the like are defined by a `Material`.
    static_friction : number [1]
        Coefficient of static friction, not smaller; equal to ``friction`` if not given.
    restitution : number [1]
        From 0 (no rebound) to 1 (elastic); 0 if given nowhere.
    rolling_friction, spinning_friction : number [m]
        Lever arms of the resistance to rolling and to spinning about the normal (see `Material`); 0 if given nowhere.
    law : {"hard", "linear", "hertz", "hunt-crossley"}
        Normal force as a function of the overlap d: hard (no overlap; the default); k d + damping ddot; k d^(3/2)
        (Hertz 1881); k d^n (1 + dissipation ddot) (Hunt and Crossley 1975). It never pulls. Friction is the same for
        all laws.
    stiffness : number [N/m^n]
        k, for each contact point: in N/m for ``"linear"``, N/m^1.5 for Hertz' exponent. If not given, that of spheres
        on each other or on flat shapes, by Young's moduli and Poisson's ratios of their materials.
    exponent : number [1]
        n of ``"hunt-crossley"``; 1.5 if not given.
    dissipation : number [s/m]
        Of ``"hunt-crossley"``: the restitution at a small impact speed v is 1 - 2/3 dissipation v. 0 if not given.
    damping : number [N s/m]
        Of ``"linear"``. 0 if not given.
    joined : bool
        Include bodies that a joint connects. Bodies joined to ground can touch ground in any case.
    exclude : list of pairs of names
        Pairs that do not touch.
    """

    name: str = field(default="contact", kw_only=False)
    between: Names | None = None
    others: Names | None = None
    friction: Ratio | None = None
    static_friction: Ratio | None = None
    restitution: Ratio | None = None
    rolling_friction: Length | None = None
    spinning_friction: Length | None = None
    law: NormalLaw | None = None
    stiffness: NormalStiffness | None = None
    exponent: Ratio | None = None
    dissipation: Dissipation | None = None
    damping: Damping | None = None
    joined: Flag = False
    exclude: Pairs = ()

    category: ClassVar[str] = "contacts"

    def check(self, n: SimpleNamespace) -> None:
        """Require valid surface properties, and the names that ``others`` and ``exclude`` depend on."""
        check_surface(self, n)
        check_law(self, n)
        if self.others is not None and self.between is None:
            raise ModelError(f"{self.title}: others= needs between=, the bodies that they touch; give between=...")
        for a, b in self.exclude:
            if a == b:
                raise ModelError(f"{self.title}: exclude names {a!r} twice; a body does not touch itself")


Owner = Body | Bodies | Ground


def has_contact(model: Model) -> bool:
    """Return whether the mechanism has elements for motions with impulses only: contacts, rigid stops, many bodies."""
    return bool(model.contacts or model.bulk or any(not e.acts() for e in model.limits))


def has_switching_elements(model: Model) -> bool:
    """Return whether any element switches: these, or friction, locks, latches, inextensible ropes; or events."""
    return holds_or_touches(model) or any(e.category == "events" for e in model.elements())


def holds_or_touches(model: Model) -> bool:
    """Return whether any element switches, besides events."""
    return has_contact(model) or any(not w.kind.elastic for e in model.elements() for w in e.switches())


def not_for_impulse_stepping(model: Model) -> list[Element]:
    """The one-sided elements that impulse time stepping does not support: latches, rigid play, inextensible ropes."""
    known = "Limit"
    return [e for e in (*model.forces, *model.limits) if not e.acts() and type(e).__name__ != known]


def contact_warnings(model: Model) -> tuple[str, ...]:
    """Return warnings on shapes that nothing can touch for want of a contact, and on bodies that can touch nothing."""
    there: list[Owner] = [*model.ground, *model.bulk]
    if model.contacts or not any(s.touches for e in there for s in e.shapes()):
        return _shapeless(model)
    return (
        f"{there[0].title} touches nothing: {model.name!r} has no Contact; add Contact(friction=...), or give its "
        f"shapes looks=True",
    )


def _shapeless(model: Model) -> tuple[str, ...]:
    """Warn of bodies without a shape if a contact applies to everything: they fall through other bodies.

    There is no warning if a chain of joints, drivers or two-ended forces connects a body to ground or to a body with a
    shape, which supports it. A shape with ``looks=True`` excludes a body from contact on purpose.
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
    who = f"bodies {shortened_list(lost)} have no shape" if len(lost) > 1 else f"body {lost[0]} has no shape"
    return (
        f"{who} and no connection to ground or to a body with one: {contact.title} does not stop them, they pass "  # type: ignore[union-attr]
        f"through everything; give a shape (with looks=True if it is not to touch anything)",
    )


def _connections(model: Model) -> Iterator[set[str]]:
    """Return the bodies, and ground, that a joint, a driver or a two-ended force connects."""
    for e in (*model.joints, *model.forces, *model.limits):
        yield {model.carrier(name, e) for name in e.ends().values()} if hasattr(e, "ends") else set()
    along = ((e, text) for e in (*model.forces, *model.limits) for text in getattr(e, "along", tuple)())
    for e, text in (*along, *((d, d.coordinate) for d in model.drivers)):
        owner, _ = model.coordinate(text, e)
        if not isinstance(owner, Joint):
            yield {GROUND, getattr(owner, "body", owner.name)}


def shape_owners(model: Model) -> list[Owner]:
    """Return everything that may have shapes: parts of ground, bodies, sets of bodies."""
    return [*model.ground, *model.bodies, *model.bulk]


def check_touching(model: Model, e: Element) -> None:
    """Refuse unknown names of materials and bodies, and contacts for the same pairs.

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
        for name in contact_names(e):
            _touching(model, name, e)
        _refuse_second(model, e)
        _refuse_overlap(model, e)
    elif isinstance(e, (Body, Bodies, Ground)):
        for material in (e.material, *(s.material for s in e.shapes())):
            if material is not None:
                _material(model, material, e)
        _refuse_idle(e)


def _refuse_idle(e: Owner) -> None:
    """Refuse materials of bodies that cannot touch anything."""
    shapes = e.shapes()
    for s in shapes:
        if s.material is not None and not s.touches:
            raise ModelError(f"{e.title}: material of {s.title} has no effect, since it does not touch; leave it out")
    if e.material is not None and not any(s.touches and s.material is None for s in shapes):
        why = "its shapes name their own or do not touch" if shapes else "it has no shape"
        raise ModelError(f"{e.title}: material {e.material!r} has no effect, since {why}; leave it out")


def contact_names(e: Contact) -> Iterator[str]:
    """Return every name in a contact."""
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
        known = [GROUND, *(x.name for x in shape_owners(model))]
        what = "" if found is None else f" ({name!r} is a {type(found).__name__})"
        hint = f"{what}{suggest(name, known)}; {listing(known)}"
        raise ModelError(f"{e.title}: {_where(e, name)}there is no body named {name!r}{hint}")
    if not any(s.touches for s in found.shapes()):
        raise ModelError(f"{e.title}: {found.title} has no shape that touches; give it one, or leave it out")


def _where(e: Contact, name: str) -> str:
    """Return the field that contains a name."""
    return field_with(e, name) or "exclude: "


def _refuse_second(model: Model, e: Contact) -> None:
    """Refuse a second contact for everything."""
    other = next((c for c in model.contacts if c.name != e.name and c.between is None), None)
    if other is not None and e.between is None:
        raise ModelError(
            f"{e.title}: {other.title} already applies to all bodies; name with between= those of this one, or give "
            "them materials"
        )


def _refuse_overlap(model: Model, e: Contact) -> None:
    """Refuse two contacts that name the same pairs of bodies."""
    for other in model.contacts:
        if other.name == e.name or other.between is None or e.between is None:
            continue
        mine, its = _contact_partners(model, e), _contact_partners(model, other)
        for a in sorted(mine[0] & its[0]):
            for b in sorted(mine[1] & its[1]):
                _refuse_common(model, e, other, a, b)
        for a in sorted(mine[0] & its[1]):
            for b in sorted(mine[1] & its[0]):
                _refuse_common(model, e, other, a, b)


def _contact_partners(model: Model, e: Contact) -> tuple[set[str], set[str]]:
    """Return the names on either side of a contact, with the parts of ground in place of ground."""
    ground = {g.name for g in model.ground}
    first, second = (
        set(x) - {GROUND} | (ground if GROUND in x else set()) for x in (e.between or (), e.others or e.between or ())
    )
    return first, second


def _refuse_common(model: Model, e: Contact, other: Contact, a: str, b: str) -> None:
    if a != b or isinstance(model.find(a), Bodies):
        a, b = sorted((a, b))
        raise ModelError(
            f"{e.title}: {other.title} already applies to {a!r} and {b!r}; two contacts that name bodies must name "
            "different pairs"
        )


def _refuse_same_pair(model: Model, e: MaterialPair) -> None:
    for other in model.material_pairs:
        if other.name != e.name and {other.first, other.second} == {e.first, e.second}:
            raise ModelError(f"{e.title}: {other.title} is about the same two materials; leave one out")
