"""Adding a copy of a mechanism to another: what is asked for is checked, and nothing is added if it fails."""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import ModelError
from .body import GROUND, Frame
from .element import Element, python_data
from .expressions import number
from .geometry import oriented
from .messages import listing, suggest
from .names import is_plain
from .placement import Placement, rotation_of
from .subassembly_elements import Subassembly
from .validation import RESERVED

if TYPE_CHECKING:
    from .model import Model

GRAVITY_TOLERANCE = 1e-9  # relative


def add_subassembly(
    whole: Model,
    part: Model,
    prefix: Any,
    at: Any,
    orientation: Any,
    angle: Any,
    mirror: str | None,
    on: str,
    parameters: Mapping[str, Any] | None,
) -> Element | None:
    """Add a copy of a mechanism: see `Model.add`. Return the last part added."""
    place = _placement(whole, part, at, orientation, angle, mirror)
    who = f"the copy of {part.name!r}"
    if not isinstance(prefix, str) or not is_plain(prefix):
        raise ModelError(f"{who}: prefix is {prefix!r}; give one word of letters, digits and _, such as prefix='left'")
    if prefix in (*whole.groups, *whole.by_name, *RESERVED):
        found = whole.find(prefix)
        owner = found.title if found else "flyball" if prefix in RESERVED else "another group of parts"
        raise ModelError(f"{who}: prefix {prefix!r} is taken by {owner}; give another word")
    if on != GROUND:
        whole.body(on, Frame(prefix, on))
    unknown = [k for k in parameters or {} if k not in part.parameters]
    if unknown:
        known = list(part.parameters)
        raise ModelError(f"{who}: it has no parameter {unknown[0]!r}{suggest(unknown[0], known)}; {listing(known)}")
    _refuse_other_gravity(whole, part, who)
    saved = {k: (x, copy(x)) for k, x in vars(whole).items() if isinstance(x, (list, dict, set))}
    try:
        added = Subassembly(whole, part, prefix, on, place, parameters or {}).add()
    except BaseException:
        for current, before in saved.values():
            current.clear()
            (current.extend if isinstance(current, list) else current.update)(before)
        raise
    return added[-1] if added else None


def _refuse_other_gravity(whole: Model, part: Model, who: str) -> None:
    mine, its = whole.gravity_vector(), part.gravity_vector()
    if part.gravity_told and (np.abs(mine - its) > GRAVITY_TOLERANCE * np.abs(its).max()).any():
        raise ModelError(
            f"{who}: its gravity is {its.tolist()} m/s^2, and that of {whole.name!r} {mine.tolist()} m/s^2; one "
            "mechanism has one gravity: give both the same, or leave it out of the part"
        )


def _placement(whole: Model, part: Model, at: Any, orientation: Any, angle: Any, mirror: str | None) -> Placement:
    """Return where a copy is placed, checked."""
    who = f"the copy of {part.name!r}"
    if part is whole or part.planar != whole.planar:
        one, other = ("planar" if m.planar else "spatial" for m in (part, whole))
        why = "a mechanism is no part of itself" if part is whole else f"it is {one}, and that is {other}"
        raise ModelError(f"{who} cannot be added to {whole.name!r}: {why}")
    axes, n = ("xy", 2) if whole.planar else ("xyz", 3)
    if mirror is not None and mirror not in tuple(axes):
        raise ModelError(f"{who}: mirror is {mirror!r}; give the coordinate that changes its sign: {', '.join(axes)}")
    if (orientation if whole.planar else angle) is not None:
        wrong, right = ("orientation", "angle") if whole.planar else ("angle", "orientation")
        raise ModelError(
            f"{who}: give {right}=, not {wrong}=, for this is a {'planar' if n == 2 else 'spatial'} mechanism"
        )
    try:
        where = python_data((0.0,) * n if at is None else at)
        turned = None if orientation is None else oriented(orientation)
    except ValueError as error:
        raise ModelError(f"{who}: {error}") from None
    if not isinstance(where, tuple) or len(where) not in (n, 3):
        raise ModelError(f"{who}: at has {n} components, got {at!r}")
    for x in where:
        number(x, whole.environment(), "m", f"at of {who}")
    R = rotation_of(turned, angle or 0.0, f"orientation of {who}") if turned is not None or angle else np.eye(3)
    return Placement((*where, 0.0)[:3], R, mirror or "")
