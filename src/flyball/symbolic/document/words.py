"""Words for symbols and elements."""

from __future__ import annotations

from typing import Any

from ...graph.node import Symbol

KINDS = {
    "parameter": "parameter",
    "coordinate": "coordinate",
    "velocity": "velocity",
    "acceleration": "acceleration",
    "multiplier": "multiplier",
    "time": "time",
    "state": "state",
    "input": "input",
    "load": "what presses the surfaces together",
}
MEANINGS = {
    "angle": "angle",
    "displacement": "displacement",
    "x": "position of the reference point along x",
    "y": "position of the reference point along y",
    "z": "position of the reference point along z",
    "com_x": "position of the mass centre along x",
    "com_y": "position of the mass centre along y",
    "com_z": "position of the mass centre along z",
    "w_x": "angular velocity about its own x axis",
    "w_y": "angular velocity about its own y axis",
    "w_z": "angular velocity about its own z axis",
    "effort": "effort",
    **{f"e{k}": f"Euler parameter {k}" for k in range(4)},
}


def meaning(symbol: Symbol) -> str:
    """What a symbol means."""
    what = symbol.name.removeprefix(f"{symbol.element}.") if symbol.element else ""
    plain = what.rstrip("'")
    order = ("", "rate of the ", "second rate of the ")[min(len(what) - len(plain), 2)]
    if plain in MEANINGS:
        return f"{order}{MEANINGS[plain]} of {symbol.element}"
    kind = KINDS.get(symbol.kind, symbol.kind)
    return f"{kind} of {symbol.element}" if symbol.element else kind


def unit(text: str) -> str:
    """A unit as it is read."""
    return "" if text in ("", "1") else text.replace("*", " ").replace("^2", "²")


def between(e: Any) -> str:
    """What an element joins or acts on."""
    if hasattr(e, "body_i"):
        return f"{e.body_i} – {e.body_j}"
    if hasattr(e, "bodies"):
        return " – ".join(e.bodies)
    if hasattr(e, "law") and hasattr(e, "coordinate"):
        return f"{e.coordinate} = {e.law}"
    for name in ("body", "joint", "coordinate"):
        if isinstance(getattr(e, name, None), str):
            return f"on {getattr(e, name)}"
    coupled = getattr(e, "coupled", None)
    return ", ".join(coupled()) if callable(coupled) else ""


def moments(inertia: Any, planar: bool) -> list[Any]:
    """Moments of inertia, then products."""
    return [inertia[k] for k in ((8,) if planar else (0, 4, 8, 1, 2, 5))]
