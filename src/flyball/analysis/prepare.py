"""A mechanism prepared: coordinates chosen, tables filled in, handed out as functions of plain arrays."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from ..model.model import Model
from .motion.start import begin
from .options import Options
from .prepared import Prepared
from .untouched import SLIDING, refuse_contact


@dataclass(frozen=True, kw_only=True)
class PrepareOptions(Options):
    """What `Mechanism.prepare` is asked."""

    coordinates: str
    parameters: Mapping[str, float] | None


def prepare(model: Model, o: PrepareOptions) -> Prepared:
    """A mechanism made ready: see `Mechanism.prepare`."""
    refuse_contact(model, "prepare", SLIDING)
    return Prepared(begin(model.snapshot(), 0.0, o.parameters, None, o.coordinates))
