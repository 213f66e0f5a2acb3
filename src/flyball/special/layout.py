"""How many dimensions the arrays of `System` and `Work` have, in their order: where compiled code finds them."""

from __future__ import annotations

from ..numerics.ldl import Pattern
from ..tables.system import System, Work

WIDE = {"body_i", "body_x", "frame_x", "term_i", "term_x", "seg_i", "row_i", "mix_i", "force_i", "force_x", "angle_i"}
WIDE |= {"load_i", "mass_i", "pair_i", "block_i", "BK", "FK", "X", "O", "FB", "IC", "T", "row", "vel", "sensed"}
WIDE |= {"D", "stack", "y", "switch_i", "switch_x", "guard_i", "control_i", "switch"}
"""Arrays of two dimensions; all others have one."""


def _listed(of: type) -> list[tuple[str, int]]:
    out = []
    for name in of._fields:  # type: ignore[attr-defined]
        if name == "ldl":
            out += [(f"ldl_{inner}", 1) for inner in Pattern._fields]
        else:
            out.append((name, 2 if name in WIDE else 1))
    return out


DIMENSIONS = {of.__name__: _listed(of) for of in (System, Work)}
