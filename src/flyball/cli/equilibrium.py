"""``flyball equilibrium``, ``flyball equilibria``: where a mechanism rests, and whether it is stable there."""

from __future__ import annotations

from ..methods.statics import Statics
from .asking import Asked, command
from .common import Page, Plot


@command(Statics.equilibrium, without=("start",))
def equilibrium(asked: Asked, *, out: Page = None) -> None:
    """Print where it is; --out shows it."""
    found = asked.answer()
    asked.write(out, found.result.to_html)
    asked.say(found)


@command(Statics.equilibria, without=("start",))
def equilibria(asked: Asked, *, plot: Plot = None) -> None:
    """Print the series and where it jumps."""
    found = asked.answer()
    asked.write(plot, lambda path: found.plot(path=path))
    asked.say(found)
