"""What happens at an instant."""

from __future__ import annotations

from collections.abc import Sequence

from .here import Here


def begin(here: Here) -> None:
    """As the motion begins."""


def happen(here: Here, fired: Sequence[int]) -> None:
    """Where guards fired."""
