"""How a mechanism is shown inside a notebook."""

from __future__ import annotations

import html

import numpy as np

from ..errors import FlyballError
from ..model.model import Model
from ..model.summary import summary
from ..results.drawn import drawn
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
