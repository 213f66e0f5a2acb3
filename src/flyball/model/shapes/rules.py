"""Rules that the numbers of several shapes must keep."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ...errors import ModelError

if TYPE_CHECKING:
    from .solid import Solid


def three_lengths(solid: Solid, field: str, value: Any) -> None:
    """Refuse anything but three lengths greater than zero."""
    if len(value) != 3 or any(isinstance(x, tuple) or not x.real > 0 for x in value):
        raise ModelError(f"{solid.title}: {field} must be three lengths greater than 0, got {value}")


def smaller(solid: Solid, field: str, value: Any, other: str, limit: Any) -> None:
    """Refuse a length that is not smaller than another."""
    if not value.real < limit.real:
        raise ModelError(f"{solid.title}: {field} is {value:g} m; it must be smaller than its {other}, {limit:g} m")
