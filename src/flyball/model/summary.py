"""What a mechanism consists of, in a few lines."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from .words import shortened

if TYPE_CHECKING:
    from .model import Model

WORDS = 100  # letters of a line


def lines(model: Model) -> list[tuple[str, str]]:
    """Labels and texts for people: how many parts of each kind there are, and their names."""
    gravity = ", ".join(str(x) for x in model.gravity)
    head = ("planar" if model.planar else "spatial") + (f", gravity ({gravity})" if model.gravity_told else "")
    out = [("mechanism", f"{model.name!r}, {head}")]
    out += _line("ground", (e.name for e in model.ground))
    out += _line("bodies", (e.name for e in model.bodies))
    out += _line("bulk", (f"{e.count} {e.name}" for e in model.bulk))
    out += _line("frames", (e.name for e in model.frames))
    for category in ("joints", "couplings", "controllers", "forces"):
        kinds: dict[str, list[str]] = {}
        for e in getattr(model, category):
            kinds.setdefault(type(e).__name__, []).append(e.name)
        out += _line(
            category, (f"{kind} {shortened(names)}" for kind, names in kinds.items()), len(getattr(model, category))
        )
    out += _line("drivers", (f"{d.name} ({d.coordinate} = {d.law})" for d in model.drivers))
    for category in ("sensors", "tables", "initial", "materials", "contacts", "limits"):
        out += _line(category, (e.name for e in getattr(model, category)))
    out += _line("events", (f"{e.name} ({e.when})" for e in model.events))
    return out + _line("parameters", (f"{k} = {v}" for k, v in model.parameters.items()))


def _line(label: str, texts: Iterable[str], count: int | None = None) -> list[tuple[str, str]]:
    """One line, cut where it gets long; nothing where there is nothing."""
    every = list(texts)
    text = "; ".join(every) if count is not None else shortened(every, WORDS)
    return [(label, f"{len(every) if count is None else count}: {text}")] if every else []


def summary(model: Model) -> str:
    """The lines as a text."""
    return "\n".join(f"{label:<10} {text}" for label, text in lines(model))
