"""``flyball sensitivity``: derivatives by parameters."""

from __future__ import annotations

from ..methods.design import Design
from .asking import DERIVATIVES, Asked, command
from .common import Plot


@command(Design.sensitivity, kernels=DERIVATIVES)
def sensitivity(asked: Asked, *, plot: Plot = None) -> None:
    """Print the derivatives."""
    found = asked.answer()
    asked.write(plot, found.plot)
    asked.say(found)
