"""What there is to say of each part besides its curves: what it is, and what it joins."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from ..results.result import Result


def facts(result: Result) -> dict[str, tuple[str, ...]]:
    """Lines about every part, by its name: its kind, what it joins, a body's mass."""
    out: dict[str, tuple[str, ...]] = {}
    for e in result.model.elements():
        if e.category == "bodies":
            mass = float(np.real(result.values.bodies[e.name].mass))
            out[e.name] = ("Body", f"{mass:.4g} kg")
        elif e.category != "initial":
            out[e.name] = tuple(x for x in (type(e).__name__, between(e)) if x)
    return out


def between(e: Any) -> str:
    """What an element joins or acts on, in words."""
    if hasattr(e, "body_i"):
        return f"{e.body_i} – {e.body_j}"
    if hasattr(e, "bodies"):
        return " – ".join(e.bodies)
    if hasattr(e, "body"):
        return f"on {e.body}"
    if hasattr(e, "law") and hasattr(e, "coordinate"):
        return f"{e.coordinate} = {e.law}"
    coupled = getattr(e, "coupled", None)
    if callable(coupled):
        return ", ".join(coupled())
    about = getattr(e, "joint", None) or getattr(e, "coordinate", None)
    if isinstance(about, str):
        return f"on {about}"
    measured = getattr(e, "of", None) or getattr(e, "frame", None)
    return f"of {measured}" if isinstance(measured, str) else ""
