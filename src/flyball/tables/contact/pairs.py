"""What surfaces are to each other: friction and the like of every pair, from materials and contacts."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np

from ...contact import surfaces as su
from ...errors import ModelError
from ...model.material import Material, pair
from ...model.model import Model
from ..numbers import Numbers
from .groups import Groups
from .penalty import give_way

Surface = tuple[int, str | None]  # group, material

NOTHING = SimpleNamespace(
    friction=None,
    static_friction=None,
    restitution=None,
    rolling_friction=None,
    spinning_friction=None,
    law=None,
    youngs_modulus=None,
)


def pairs(model: Model, given: Numbers, groups: Groups, known: Mapping[Surface, set[str]]) -> np.ndarray:
    """Numbers of each two surfaces (`Surfaces.pair`), of which it is known what carries them; nan: they never touch.

    Raises
    ------
    ModelError
        If nothing says the friction of a pair, or both sides have a grain.
    """
    out = np.full((len(known), len(known), su.WIDTH), np.nan)
    told = {frozenset((x.first, x.second)): given.of[x.name] for x in model.material_pairs}
    plain = next((given.of[c.name] for c in model.contacts if c.between is None), NOTHING)
    for i, ((a, first), on) in enumerate(known.items()):
        for j, ((b, second), by) in enumerate(known.items()):
            contact = groups.holds.get((a, b))
            if contact is None or j < i or (len(on) == 1 and on == by):
                continue
            sides = [given.of[name] if name else NOTHING for name in (first, second)]
            named = NOTHING if contact.between is None else given.of[contact.name]
            special = told.get(frozenset((first, second)), NOTHING)  # type: ignore[arg-type]
            out[i, j] = out[j, i] = _row((contact, first, second, _two(on, by)), (named, special, plain), sides)
    return out


def _two(on: set[str], by: set[str]) -> str:
    """Two of what bears two surfaces, for messages."""
    a, b = next((a, b) for a in sorted(on) for b in sorted(by) if a != b)
    return f"{a!r} on {b!r}"


def _row(who: tuple, told: Sequence[Any], sides: Sequence[Any]) -> np.ndarray:
    """Numbers of one pair: what a contact says that names bodies, else a pair of materials, else both materials."""
    row = np.zeros(su.WIDTH)
    _friction(row, who, told, sides)
    row[su.RESTITUTION] = _combined("restitution", told, sides, lambda a, b: np.sqrt(a * b))
    row[su.ROLLING] = _combined("rolling_friction", told, sides, max)
    row[su.SPINNING] = _combined("spinning_friction", told, sides, max)
    give_way(row, who, told, sides)
    return row


def _friction(row: np.ndarray, who: tuple, told: Sequence[Any], sides: Sequence[Any]) -> None:
    """Of rest and of sliding along the grain, and how much greater across it."""
    row[su.ACROSS] = 1.0
    direct = next((x for x in told[:2] if x.friction is not None), None)
    if direct is not None:
        row[[su.STATIC, su.KINETIC]] = np.real([_at_rest(direct), direct.friction])
        return
    found = _both("friction", told[2], sides)
    if found is None:
        raise ModelError(
            f"{who[0].title}: nothing says the friction of {who[3]}; give the contact friction=... (0 is smooth), or "
            f"one of them a material that says it"
        )
    if all(isinstance(x.friction, tuple) for x in sides):
        raise ModelError(
            f"{who[0].title}: materials {who[1]!r} and {who[2]!r} both have a grain, and no law says what their "
            f"friction is; say it by MaterialPair({who[1]!r}, {who[2]!r}, friction=...)"
        )
    along, across = (np.sqrt(np.prod([np.real(pair(x.friction)[k]) for x in found])) for k in (0, 1))
    row[su.STATIC] = np.sqrt(np.prod([np.real(_at_rest(x)) for x in found]))
    row[su.KINETIC] = along
    row[su.ACROSS] = across / along if along > 0.0 else 1.0


def _at_rest(x: Any) -> Any:
    return pair(x.friction)[0] if x.static_friction is None else x.static_friction


def _both(field: str, plain: Any, sides: Sequence[Any]) -> list[Any] | None:
    """Who says it on either side: the material, or the contact for all, or the other side; None if nobody does."""
    known = [x if getattr(x, field) is not None else plain for x in sides]
    said = [x for x in known if getattr(x, field) is not None]
    return [x if getattr(x, field) is not None else said[0] for x in known] if said else None


def _combined(field: str, told: Sequence[Any], sides: Sequence[Any], rule: Callable[[float, float], float]) -> float:
    """A number of a pair: what is said of the pair itself, else by the rule from both sides."""
    direct = next((x for x in told[:2] if getattr(x, field) is not None), None)
    if direct is not None:
        return float(np.real(getattr(direct, field)))
    found = _both(field, told[2], sides)
    return float(rule(*(np.real(getattr(x, field)) for x in found))) if found else 0.0


def own_of(material: Material | None, of: Mapping[str, SimpleNamespace]) -> np.ndarray:
    """Velocity of a surface and its grain (2, 3), in the axes of the body's reference frame."""
    out = np.zeros((2, 3))
    if material is not None:
        n = of[material.name]
        for row, value in zip(out, (n.surface_velocity, n.grain), strict=True):
            row[: len(value or ())] = np.real(value or ())
        size = np.sqrt(out[1] @ out[1])
        out[1] /= size if size > 0.0 else 1.0
    return out
