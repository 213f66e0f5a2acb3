"""What the head of an exported file says: whose functions these are, in which order and units, and how to call them."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from ...graph.printers.routine import Routine

if TYPE_CHECKING:
    from ..equations import Equations

EQUATIONS = "qdot = T v,  M vdot = f + G^T lam,  g = 0,  G v = nu,  G vdot = gamma"

CALLS = {
    "c": "Arguments and results are arrays of double, matrices row by row; results have to be there. Nothing is kept "
    "from one call to the next, so that threads may share them. Compile with a C99 compiler, link with -lm.",
    "python": "Arguments are numbers and sequences; arrays of states have the states' own axes first, and so have the "
    "results. NumPy is all that is needed.",
    "casadi": "Functions of SX; they take numbers, SX and MX. Matrices are matrices, several of them stand below one "
    "another. The files beside this one hold them.",
    "numba": "Arguments are floats and arrays of floats; one state at a time.",
}


def head(eq: Equations, language: str, routines: Sequence[Routine]) -> str:
    """Text of a head."""
    from ... import __version__

    told = [
        f"Functions of the mechanism {eq.model.name!r}, written by flyball {__version__}.",
        "",
        f"    {EQUATIONS}",
        "",
        *textwrap.wrap(
            "SI units and radians. World axes unless told otherwise. Velocities v are rates of the coordinates q, "
            "but for bodies that turn freely: unit quaternions e0 to e3 (scalar first) in q, angular velocities w_x, "
            "w_y, w_z along the body's own axes in v. Reactions are G^T lam.",
            105,
        ),
        *textwrap.wrap(CALLS[language], 105),
        "",
        f"Coordinates: {eq.coordinates}.",
    ]
    lists = {"q": eq.q.rows, "v": eq.v.rows, "lam": eq.lam.rows, "u": eq.inputs, "p": tuple(eq.parameters)}
    for name, items in lists.items():
        if items:
            told += textwrap.wrap(f"{name} ({len(items)}): {', '.join(items)}", 105, subsequent_indent="    ")
    told += [f"{r.name}: {r.operations} operations" for r in routines]
    return "\n".join(told)


def constants(eq: Equations, start: Mapping[str, np.ndarray]) -> dict[str, Sequence[object]]:
    """Names of the arguments' entries, and what they are at the start."""
    names = {"q": eq.q.rows, "v": eq.v.rows, "lam": eq.lam.rows, "u": eq.inputs, "p": tuple(eq.parameters)}
    named = {f"{k}_names": x for k, x in names.items() if x}
    return named | {
        f"{k}_start" if k != "p" else "p_values": x.tolist() for k, x in start.items() if k != "u" and len(x)
    }
