"""The page of an equilibrium: the mechanism where it rests, and what was found of it in place of a motion's health."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from .animate import record
from .page import page

if TYPE_CHECKING:
    from ..results.equilibrium import Equilibrium


def resting(found: Equilibrium) -> str:
    """The page's text."""
    notes: dict[str, str] = {}
    for label, text in found.lines():
        notes[label] = f"{notes[label]}; {text}" if label in notes else text
    return page(replace(record(found.result), notes=notes))
