"""What may touch what."""

from __future__ import annotations

from dataclasses import field
from types import SimpleNamespace
from typing import Annotated, Any, ClassVar

from pydantic import BeforeValidator

from ..errors import ModelError
from .element import Damping, Element, Flag, Length, Ratio, element, plain
from .material import check_surface
from .penalty import Dissipation, NormalLaw, NormalStiffness, check_law


def _names(value: Any) -> Any:
    """A name, or several, as a tuple."""
    value = plain(value)
    if isinstance(value, str):
        value = (value,)
    if not isinstance(value, tuple) or not value or not all(isinstance(x, str) and x for x in value):
        raise ValueError("give a name or a list of names")
    if len(set(value)) < len(value):
        raise ValueError("give each name once")
    return value


def _pairs(value: Any) -> Any:
    """Pairs of names."""
    value = plain(value)
    if isinstance(value, tuple) and len(value) == 2 and all(isinstance(x, str) for x in value):
        value = (value,)
    good = isinstance(value, tuple) and all(
        isinstance(p, tuple) and len(p) == 2 and all(isinstance(x, str) and x for x in p) for p in value
    )
    if not good:
        raise ValueError('give pairs of names, such as [("arm", "floor"), ("arm", "stand")]')
    return value


Names = Annotated[tuple[str, ...], BeforeValidator(_names)]
Pairs = Annotated[tuple[tuple[str, str], ...], BeforeValidator(_pairs)]


@element
class Contact(Element):
    """Bodies touch, by their shapes: with Coulomb friction, and hard, unless ``law`` says how they give way.

    ``m.add(fb.Contact(friction=0.3))`` lets everything that has a shape touch everything else: bodies, `Bodies`, what
    stands on `Ground`. Bodies that a joint connects are left out. A further `Contact` that names bodies holds for these
    in place of the first.

    Parameters
    ----------
    name : str
    between : name or list of names
        Bodies, `Bodies`, parts of ground (``"ground"``: all of them) that touch each other; everything if not given.
    others : name or list of names
        If given, ``between`` touches these, and neither touches its own kind.
    friction : number [1]
        Coefficient of sliding friction of what has no `Material` that says it; of a contact with ``between``, of all
        that it holds for. 0 is smooth. A belt, a grain and the like are told by a `Material`.
    static_friction : number [1]
        Of what sticks, not less; the same as ``friction`` if not given.
    restitution : number [1]
        From 0 (dead) to 1 (elastic); 0 if nothing says it.
    rolling_friction, spinning_friction : number [m]
        Lever arms of the resistance to rolling and to spinning about the normal (see `Material`); 0 if nothing says it.
    law : {"hard", "linear", "hertz", "hunt-crossley"}
        Normal force over the overlap d: none may be (hard, if nothing says it); k d + damping ddot; k d^(3/2) (Hertz
        1881); k d^n (1 + dissipation ddot) (Hunt and Crossley 1975). It never pulls. Friction is the same for all.
    stiffness : number [N/m^n]
        k, of each point that touches: in N/m for ``"linear"``, N/m^1.5 for Hertz' exponent. If not given, that of
        spheres on each other or on flat shapes, by Young's moduli and Poisson's ratios of their materials.
    exponent : number [1]
        n of ``"hunt-crossley"``; 1.5 if not given.
    dissipation : number [s/m]
        Of ``"hunt-crossley"``: an impact at a small speed v gives back 1 - 2/3 dissipation v of it. 0 if not given.
    damping : number [N s/m]
        Of ``"linear"``. 0 if not given.
    joined : bool
        Bodies that a joint connects touch too. What is joined to ground touches the shapes of ground in any case.
    exclude : list of pairs of names
        What does not touch.
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
        """Numbers that surfaces can have, and others only beside something."""
        check_surface(self, n)
        check_law(self, n)
        if self.others is not None and self.between is None:
            raise ModelError(f"{self.title}: others says what between touches; give between=...")
        for a, b in self.exclude:
            if a == b:
                raise ModelError(f"{self.title}: exclude names {a!r} twice; a body does not touch itself")
