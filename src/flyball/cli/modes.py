"""``flyball modes``: frequencies, damping and shapes of natural motions."""

from __future__ import annotations

from ..methods.statics import Statics
from .asking import Asked, command
from .common import Page, Plot, Resting, Turning


@command(Statics.modes)
def modes(
    asked: Asked, *, equilibrium: Resting = False, turning: Turning = None, out: Page = None, plot: Plot = None
) -> None:
    """Print a table; --out shows how they move, --plot draws the eigenvalues."""
    asked.rest(equilibrium, turning)
    found = asked.answer()
    asked.write(out, found.to_html)
    asked.write(plot, found.plot)
    asked.say(found, {"name": asked.mechanism.name} | found.as_dict())
