"""Pairs of bodies that may touch, and the contact properties of every pair of surfaces.

Owners of shapes with the same contact partners form a group; a contact applies to each pair of groups. Friction,
restitution and compliance of two surfaces come from a contact that names bodies, else from a pair of materials, else
from both materials and the contact for everything.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np

from ..collision import shape_kinds
from ..collision import tables as ct
from ..errors import ModelError
from ..model.body import GROUND, Body
from ..model.contact import DEFAULT_EXPONENT, HARD, LINEAR, Contact, Material, Owner, friction_pair
from ..model.model import Model
from . import table_definitions as su
from .element_numbers import ElementNumbers

MAX_GROUPS = 62  # maximum number of groups: each is one bit of an integer


@dataclass(frozen=True)
class ContactGroups:
    """Owners of shapes, grouped by what they may touch.

    Attributes
    ----------
    of : dict
        Owner -> its group.
    holds : dict
        Pair of groups -> the contact that applies to them; pairs that do not touch are not in it.
    excluded_pairs : set
        Pairs of single bodies, the first the smaller, that are nevertheless excluded.
    """

    of: Mapping[str, int]
    holds: Mapping[tuple[int, int], Contact]
    excluded_pairs: frozenset[tuple[str, str]]

    def meets(self, group: int) -> int:
        """Groups that a group may touch, as bits."""
        return sum(1 << b for a, b in self.holds if a == group)


def contact_groups(model: Model, owners: Iterable[Owner]) -> ContactGroups:
    """Group the owners of shapes.

    Raises
    ------
    ModelError
        If there are too many groups.
    """
    owners = list(owners)
    out = _Exclusions(model)
    every = {g.name for g in model.ground}
    lists = [(c, _with_ground_parts(c.between, every), _with_ground_parts(c.others, every)) for c in model.contacts]
    signature = {
        e.name: (
            tuple((b is None or e.name in b, o is not None and e.name in o) for _, b, o in lists),
            e.name if e.name in out.coarse and not isinstance(e, Body) else "",
            out.met_by(e.name) if isinstance(e, Body) else frozenset(),
        )
        for e in owners
    }
    number = {s: k for k, s in enumerate(dict.fromkeys(signature.values()))}
    if len(number) > MAX_GROUPS:
        raise ModelError(
            f"the contacts of {model.name!r} distinguish {len(number)} groups of bodies; {MAX_GROUPS} are possible. "
            "Name fewer bodies in between=, others= and exclude=, and give them materials where only friction differs"
        )
    holds = {}
    for s, a in number.items():
        for t, b in number.items():
            c = _contact_for(lists, s[0], t[0])
            if c is not None and t[1] not in out.of(s[1]) and not (t[1] in s[2] or s[1] in t[2]):
                holds[a, b] = c
    of = {name: number[s] for name, s in signature.items()}
    return ContactGroups(of, holds, _excluded_pairs(model, of, holds, out))


def _with_ground_parts(names: tuple[str, ...] | None, every: set[str]) -> set[str] | None:
    """Names, with ground replaced by its parts."""
    if names is None:
        return None
    return set(names) - {GROUND} | (every if GROUND in names else set())


def _contact_for(lists: list, s: tuple, t: tuple) -> Contact | None:
    """Contact that applies to two signatures: one that names them before one for everything."""
    found = None
    for k, (c, between, others) in enumerate(lists):
        if between is None:
            found = found or c
        elif others is None:
            if s[k][0] and t[k][0]:
                return c
        elif (s[k][0] and t[k][1]) or (s[k][1] and t[k][0]):
            return c
    return found


class _Exclusions:
    """Excluded pairs: of single bodies one by one, of ground and many bodies by groups."""

    def __init__(self, model: Model) -> None:
        every = [g.name for g in model.ground]
        self.single: set[tuple[str, str]] = set()
        self._with: dict[str, set[str]] = {}
        for c in model.contacts:
            for pair in c.exclude:
                first, second = (every if x == GROUND else [x] for x in pair)
                for a in first:
                    for b in second:
                        if isinstance(model.find(a), Body) and isinstance(model.find(b), Body):
                            self.single.add((min(a, b), max(a, b)))
                        else:
                            self._with.setdefault(a, set()).add(b)
                            self._with.setdefault(b, set()).add(a)
        self.coarse = set(self._with)

    def of(self, name: str) -> set[str]:
        """Owners that ``name`` does not touch."""
        return self._with.get(name, set())

    def met_by(self, name: str) -> frozenset[str]:
        """The same as a frozen set, as part of a signature."""
        return frozenset(self.of(name))


def _excluded_pairs(
    model: Model, of: Mapping[str, int], holds: Mapping, out: _Exclusions
) -> frozenset[tuple[str, str]]:
    """Single bodies that are excluded, or connected by a joint where the contact excludes such pairs."""
    found = set(out.single)
    for j in model.joints:
        a, b = sorted((model.carrier(j.body_i, j), model.carrier(j.body_j, j)))
        if a in of and b in of:
            c = holds.get((of[a], of[b]))
            if c is not None and not c.joined:
                found.add((a, b))
    return frozenset(p for p in found if p[0] in of and p[1] in of)


FLAT_KINDS = (shape_kinds.PLANE, shape_kinds.BOX, shape_kinds.HULL, shape_kinds.FIELD)


def add_compliance(row: np.ndarray, who: tuple, sources: Sequence[Any], materials: Sequence[Any]) -> None:
    """Compliance of a pair: from a contact that names bodies, else a pair of materials, else the contact for all.

    Without an explicit stiffness: 4/3 E*, 1/E* = (1 - nu_1^2) / E_1 + (1 - nu_2^2) / E_2 (Johnson 1985, equation 4.24).

    Raises
    ------
    ModelError
        If no source gives the stiffness.
    """
    n = next((x for x in sources if x.law is not None), None)
    if n is None or n.law == HARD:
        return
    row[su.RESTITUTION] = 0.0
    row[su.EXPONENT] = 1.0 if n.law == LINEAR else DEFAULT_EXPONENT if n.exponent is None else np.real(n.exponent)
    row[su.DISSIPATION], row[su.DAMPING] = (0.0 if x is None else np.real(x) for x in (n.dissipation, n.damping))
    if n.stiffness is not None:
        row[su.STIFFNESS] = np.real(n.stiffness)
        return
    known = [x for x in materials if x.youngs_modulus is not None]
    if len(known) < 2 or row[su.EXPONENT] != DEFAULT_EXPONENT:
        exponent = row[su.EXPONENT]
        why = (
            f"Hertz' law has the exponent 1.5, not {exponent:g}"
            if exponent != DEFAULT_EXPONENT
            else "that follows only from youngs_modulus and poissons_ratio of both materials"
        )
        raise ModelError(
            f"{who[0].title}: law={n.law!r} does not define the stiffness of {who[3]}, and {why}; give stiffness=... "
            f"[N/m^{exponent:g}]"
        )
    give = sum((1.0 - np.real(x.poissons_ratio) ** 2) / np.real(x.youngs_modulus) for x in known)
    row[su.MODULUS] = 4.0 / 3.0 / give


def check_curvature(G: ct.Geometry, pair: np.ndarray, materials: Sequence[str], planar: bool) -> None:
    """Refuse stiffness from elastic constants between shapes whose curvatures do not determine it.

    Raises
    ------
    ModelError
        If two shapes of the pair are not a sphere and a sphere or something flat.
    """
    of = [set(G.shape.kind[G.shape.material[:] == k].tolist()) for k in range(len(pair))]
    balls = {shape_kinds.SPHERE}
    for a, b in np.argwhere(pair[:, :, su.MODULUS] > 0.0):
        if planar or balls not in (of[a], of[b]) or not of[a] | of[b] <= {*balls, *FLAT_KINDS}:
            raise ModelError(
                f"contact of {materials[a]!r} and {materials[b]!r}: its stiffness follows from youngs_modulus only "
                "for spheres on spheres or on flat shapes, in space; give stiffness=... for others"
            )


Surface = tuple[int, str | None]  # group, material

UNSPECIFIED = SimpleNamespace(
    friction=None,
    static_friction=None,
    restitution=None,
    rolling_friction=None,
    spinning_friction=None,
    law=None,
    youngs_modulus=None,
)


def surface_pairs(
    model: Model, given: ElementNumbers, groups: ContactGroups, known: Mapping[Surface, set[str]]
) -> np.ndarray:
    """Properties of all pairs of surfaces (`Surfaces.pair`), given the carriers of each; nan: they never touch.

    Raises
    ------
    ModelError
        If the friction of a pair is not given, or both sides have a grain.
    """
    out = np.full((len(known), len(known), su.SURFACE_COLUMNS), np.nan)
    told = {frozenset((x.first, x.second)): given.of[x.name] for x in model.material_pairs}
    plain = next((given.of[c.name] for c in model.contacts if c.between is None), UNSPECIFIED)
    for i, ((a, first), on) in enumerate(known.items()):
        for j, ((b, second), by) in enumerate(known.items()):
            contact = groups.holds.get((a, b))
            if contact is None or j < i or (len(on) == 1 and on == by):
                continue
            sides = [given.of[name] if name else UNSPECIFIED for name in (first, second)]
            named = UNSPECIFIED if contact.between is None else given.of[contact.name]
            special = told.get(frozenset((first, second)), UNSPECIFIED)  # type: ignore[arg-type]
            out[i, j] = out[j, i] = _pair_row(
                (contact, first, second, _example(on, by)), (named, special, plain), sides
            )
    return out


def _example(on: set[str], by: set[str]) -> str:
    """Two carriers of a pair of surfaces, for messages."""
    a, b = next((a, b) for a in sorted(on) for b in sorted(by) if a != b)
    return f"{a!r} on {b!r}"


def _pair_row(who: tuple, sources: Sequence[Any], materials: Sequence[Any]) -> np.ndarray:
    """Properties of one pair: from a contact that names bodies, else a pair of materials, else both materials."""
    row = np.zeros(su.SURFACE_COLUMNS)
    _friction(row, who, sources, materials)
    row[su.RESTITUTION] = _combined("restitution", sources, materials, lambda a, b: np.sqrt(a * b))
    row[su.ROLLING] = _combined("rolling_friction", sources, materials, max)
    row[su.SPINNING] = _combined("spinning_friction", sources, materials, max)
    add_compliance(row, who, sources, materials)
    return row


def _friction(row: np.ndarray, who: tuple, sources: Sequence[Any], materials: Sequence[Any]) -> None:
    """Set static and kinetic friction along the grain, and the ratio of friction across it."""
    row[su.ACROSS] = 1.0
    direct = next((x for x in sources[:2] if x.friction is not None), None)
    if direct is not None:
        row[[su.STATIC, su.KINETIC]] = np.real([_static_friction(direct), direct.friction])
        return
    found = _from_both("friction", sources[2], materials)
    if found is None:
        raise ModelError(
            f"{who[0].title}: the friction of {who[3]} is not given; give the contact friction=... (0 is smooth), or "
            "one of them a material with friction"
        )
    if all(isinstance(x.friction, tuple) for x in materials):
        raise ModelError(
            f"{who[0].title}: materials {who[1]!r} and {who[2]!r} both have a grain, and no rule combines their "
            f"friction; give it by MaterialPair({who[1]!r}, {who[2]!r}, friction=...)"
        )
    along, across = (np.sqrt(np.prod([np.real(friction_pair(x.friction)[k]) for x in found])) for k in (0, 1))
    row[su.STATIC] = np.sqrt(np.prod([np.real(_static_friction(x)) for x in found]))
    row[su.KINETIC] = along
    row[su.ACROSS] = across / along if along > 0.0 else 1.0


def _static_friction(x: Any) -> Any:
    return friction_pair(x.friction)[0] if x.static_friction is None else x.static_friction


def _from_both(field: str, default: Any, materials: Sequence[Any]) -> list[Any] | None:
    """Source of a field on either side: the material, else the contact for all, else the other side.

    None if none of them has it.
    """
    known = [x if getattr(x, field) is not None else default for x in materials]
    said = [x for x in known if getattr(x, field) is not None]
    return [x if getattr(x, field) is not None else said[0] for x in known] if said else None


def _combined(
    field: str, sources: Sequence[Any], materials: Sequence[Any], rule: Callable[[float, float], float]
) -> float:
    """Value of a field: that of the pair itself, else combined from both sides by the rule."""
    direct = next((x for x in sources[:2] if getattr(x, field) is not None), None)
    if direct is not None:
        return float(np.real(getattr(direct, field)))
    found = _from_both(field, sources[2], materials)
    return float(rule(*(np.real(getattr(x, field)) for x in found))) if found else 0.0


def surface_motion(material: Material | None, of: Mapping[str, SimpleNamespace]) -> np.ndarray:
    """Surface velocity and direction of grain (2, 3), in the axes of the body's reference frame."""
    out = np.zeros((2, 3))
    if material is not None:
        n = of[material.name]
        for row, value in zip(out, (n.surface_velocity, n.grain), strict=True):
            row[: len(value or ())] = np.real(value or ())
        size = np.sqrt(out[1] @ out[1])
        out[1] /= size if size > 0.0 else 1.0
    return out
