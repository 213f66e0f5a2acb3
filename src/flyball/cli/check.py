"""``flyball check``: what can be said without simulating."""

from __future__ import annotations

from ..methods.freedom import Freedom
from .asking import Asked, command


@command(Freedom.check)
def check(asked: Asked) -> None:
    """Print the report."""
    asked.say(asked.answer())
