"""What surfaces are to each other: friction and the like of every pair, from materials and contacts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np

from ...contact import surfaces as su
from ...errors import ModelError
from ...model.contact import Contact
from ...model.material import Material, pair
from ...model.model import Model
from ..numbers import Numbers
from .groups import Groups

Surface = tuple[int, str | None]  # group, material

NOTHING = SimpleNamespace(
    friction=None, static_friction=None, restitution=None, rolling_friction=None, spinning_friction=None
)


def pairs(model: Model, given: Numbers, groups: Groups, known: Sequence[Surface]) -> np.ndarray:
    """Numbers of each two surfaces (`Surfaces.pair`); nan where they do not touch.

    Raises
    ------
    ModelError
        If nothing says the friction of a pair, or both sides have a grain.
    """
    out = np.full((len(known), len(known), 8), np.nan)
    told = {frozenset((x.first, x.second)): x for x in model.material_pairs}
    for i, (a, first) in enumerate(known):
        for j, (b, second) in enumerate(known):
            contact = groups.holds.get((a, b))
            if contact is None or j < i:
                continue
            sides = [given.of[name] if name else NOTHING for name in (first, second)]
            special = told.get(frozenset((first, second)))  # type: ignore[arg-type]
            who = contact, first, second
            row = _row(who, given.of[contact.name], given.of[special.name] if special else NOTHING, sides)
            out[i, j] = out[j, i] = row
            if row[su.GRAIN] != su.NO_GRAIN:
                out[j, i, su.GRAIN] = su.GRAIN_1 + su.GRAIN_2 - row[su.GRAIN]
    return out


def _row(who: tuple, contact: Any, special: Any, sides: Sequence[Any]) -> np.ndarray:
    """Numbers of one pair: what a contact says that names bodies, else a pair of materials, else both materials."""
    named = contact if who[0].between is not None else NOTHING
    plain = contact if who[0].between is None else NOTHING
    row = np.zeros(8)
    _friction(row, who, (named, special, plain), sides)
    row[su.RESTITUTION] = _mean("restitution", (named, special, plain), sides)
    for column, field in ((su.ROLLING, "rolling_friction"), (su.SPINNING, "spinning_friction")):
        row[column] = _greater(field, (named, special, plain), sides)
    return row


def _friction(row: np.ndarray, who: tuple, told: Sequence[Any], sides: Sequence[Any]) -> None:
    """Of sliding and of rest, along the grain and across it."""
    direct = next((x for x in told[:2] if x.friction is not None), None)
    if direct is not None:
        k = [np.real(x) for x in pair(direct.friction)]
        s = k if direct.static_friction is None else [np.real(x) for x in pair(direct.static_friction)]
        row[[su.MU, su.STATIC, su.ACROSS, su.STATIC_ACROSS]] = k[0], s[0], k[1], s[1]
        return
    found = []
    for side, material in zip(sides, who[1:], strict=True):
        x = side if side.friction is not None else told[2]
        if x.friction is None:
            raise ModelError(_unsaid(who[0], material))
        k = pair(x.friction)
        found.append((x, k, k if x.static_friction is None else pair(x.static_friction)))
    grained = [isinstance(x.friction, tuple) or isinstance(x.static_friction, tuple) for x, _, _ in found]
    if all(grained):
        raise ModelError(
            f"{who[0].title}: materials {who[1]!r} and {who[2]!r} both have a grain, and no law says what their "
            f"friction is; say it by MaterialPair({who[1]!r}, {who[2]!r}, friction=...)"
        )
    (_, k1, s1), (_, k2, s2) = found
    for column, a, b in ((su.MU, k1, k2), (su.STATIC, s1, s2)):
        row[column] = np.sqrt(np.real(a[0]) * np.real(b[0]))
        row[column + su.ACROSS - su.MU] = np.sqrt(np.real(a[1]) * np.real(b[1]))
    row[su.GRAIN] = su.GRAIN_1 if grained[0] else su.GRAIN_2 if grained[1] else su.NO_GRAIN


def _unsaid(contact: Contact, material: str | None) -> str:
    who = f"material {material!r} does not say it" if material else "some of what it holds for has no material"
    return f"{contact.title}: nothing says the friction: {who}; give the contact friction=... (0 is smooth)"


def _mean(field: str, told: Sequence[Any], sides: Sequence[Any]) -> float:
    """Geometric mean of both sides, unless somebody says it of the pair."""
    for x in told[:2]:
        if getattr(x, field) is not None:
            return float(np.real(getattr(x, field)))
    plain = getattr(told[2], field) or 0.0
    a, b = (plain if getattr(x, field) is None else getattr(x, field) for x in sides)
    return float(np.sqrt(np.real(a) * np.real(b)))


def _greater(field: str, told: Sequence[Any], sides: Sequence[Any]) -> float:
    """The greater of both sides, unless somebody says it of the pair."""
    for x in told[:2]:
        if getattr(x, field) is not None:
            return float(np.real(getattr(x, field)))
    plain = getattr(told[2], field) or 0.0
    return max(float(np.real(plain if getattr(x, field) is None else getattr(x, field))) for x in sides)


def own(material: Material | None, of: Mapping[str, SimpleNamespace]) -> np.ndarray:
    """Velocity and grain of a surface (6), in the axes of the body's reference frame."""
    out = np.zeros(6)
    if material is None:
        return out
    n = of[material.name]
    for column, value in ((su.MOVES, n.surface_velocity), (su.ALONG, n.grain)):
        if value is not None:
            out[column : column + len(value)] = np.real(value)
    size = np.sqrt((out[su.ALONG :] ** 2).sum())
    out[su.ALONG :] /= size if size > 0.0 else 1.0
    return out
