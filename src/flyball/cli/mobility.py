"""``flyball mobility``: freedoms, and constraints that depend on one another."""

from __future__ import annotations

from ..methods.freedom import Freedom
from .asking import Asked, command


@command(Freedom.mobility)
def mobility(asked: Asked) -> None:
    """Print freedoms and sets."""
    asked.say(asked.answer())
