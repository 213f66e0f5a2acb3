"""``flyball sensitivity``: derivatives by parameters."""

from __future__ import annotations

from ..methods.design import Design
from .asking import Asked, command
from .common import Plot


@command(Design.sensitivity)
def sensitivity(asked: Asked, *, plot: Plot = None) -> None:
    """Print the derivatives."""
    found = asked.answer()
    asked.write(plot, found.plot)
    asked.say(found)
