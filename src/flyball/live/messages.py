"""Checks of what the messages of a page contain."""

from __future__ import annotations

import math
from typing import Any

from ..errors import ModelError


class InvalidMessage(ModelError):
    """A message that the page does not send: another program sent it, or the page is of another version."""


def finite_number(value: Any, what: str, low: float = -math.inf, high: float = math.inf) -> float:
    """Return a number of a message.

    Raises
    ------
    InvalidMessage
        If it is no finite number between the bounds, which are excluded.
    """
    try:
        number = math.nan if isinstance(value, bool) or not isinstance(value, int | float) else float(value)
    except OverflowError:  # a whole number beyond the range of floats
        number = math.inf
    if not (math.isfinite(number) and low < number < high):
        bounds = "" if math.isinf(high) else f" between {low:g} and {high:g}"
        raise InvalidMessage(f"{what} is {str(value)[:40]!r}; it must be a finite number{bounds}")
    return number
