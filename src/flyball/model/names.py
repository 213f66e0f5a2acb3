"""Names with dots: ``"left.arm.angle"`` is the quantity ``angle`` of the part ``arm`` in the group ``left``.

The names of quantities have no dots, those of parts and parameters may have some: what precedes is the group. No part
has the name of a group, so that every name has one meaning.
"""

from __future__ import annotations

import keyword
from collections.abc import Container
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .model import Model


def curve_parts(name: str, parts: Container[str] = ()) -> tuple[str, str]:
    """Return the part and the quantity of a curve's name; the name and "" if it is in ``parts`` or has no dot."""
    owner, dot, what = name.rpartition(".")
    return (owner, what) if dot and name not in parts else (name, "")


def is_curve(model: Model, name: str) -> bool:
    """Return whether a name in a law is that of a curve such as ``A.angle``, not of a sensor or a parameter."""
    return "." in name and name not in model and name not in model.parameters


def groups_of(name: str) -> list[str]:
    """Return the groups of a name, outermost first: ``"car.left.arm"`` is in ``"car"`` and ``"car.left"``."""
    return [name[:k] for k, c in enumerate(name) if c == "."]


def is_plain(name: str) -> bool:
    """Return whether laws can read a name: words of letters, digits and _, with dots between."""
    return all(word.isidentifier() and not keyword.iskeyword(word) for word in name.split("."))
