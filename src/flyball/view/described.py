"""How a mechanism is shown inside a notebook."""

from __future__ import annotations

import html

import numpy as np

from ..errors import FlyballError
from ..model.model import Model
from ..model.summary import summary
from ..results.health import Health
from ..results.result import Result
from ..tables.structure import structure
from ..tables.values import values
from .animate import record
from .still import still


def described(model: Model) -> str:
    """What a mechanism consists of, with a picture of it as drawn, for ``_repr_html_``; compiles nothing.

    A description that is not finished, or cannot be drawn yet, is shown without a picture: what is wrong with it is
    for the analyses to say.
    """
    text = f'<pre style="line-height:1.35;overflow-x:auto">{html.escape(summary(model))}</pre>'
    try:
        with np.errstate(all="ignore"):
            picture = still(record(drawn(model), curves=False, told=False))
    except (FlyballError, ArithmeticError, ValueError, IndexError, np.linalg.LinAlgError):
        picture = ""
    return f"<div>{picture}{text}</div>"


# The mechanism as drawn, read like any result: for pictures before anything is computed.


def drawn(model: Model) -> Result:
    """The mechanism where it is drawn, at rest and without loads, as a result with one time.

    Nothing is assembled and nothing compiled: bodies are where the description puts them, joints may be open.

    Raises
    ------
    ModelError
        If the description cannot be made into tables.
    """
    model = model.snapshot()
    x = values(structure(model), model.environment())
    s = x.structure
    still, loads = np.zeros((1, s.nv)), np.zeros((1, len(s.rows) + len(s.prescribed)))
    health = Health(True, "as drawn", 0.0, 0.0, 0, 0, 0, 0, 0.0)
    return Result(model, x, np.zeros(1), x.q[None], still, np.zeros((1, len(s.states))), still, loads, health)
