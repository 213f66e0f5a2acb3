"""A mechanism in a notebook: its parts, and a picture of the reference configuration.

That configuration is drawn without assembling or compiling anything.
"""

from __future__ import annotations

import html

import numpy as np

from ..errors import FlyballError
from ..model.messages import summary
from ..model.model import Model
from ..results.health import Health
from ..results.result import Result
from ..tables.structure import structure
from ..tables.values import values
from .animation import record_motion
from .still_picture import still_svg


def mechanism_html(model: Model) -> str:
    """The parts of a mechanism and a picture of the reference configuration, for ``_repr_html_``; nothing is compiled.

    An incomplete description that cannot be drawn yet is shown without a picture; analyses report its errors.
    """
    text = f'<pre style="line-height:1.35;overflow-x:auto">{html.escape(summary(model))}</pre>'
    return f"<div>{reference_svg(model)}{text}</div>"


def reference_svg(model: Model) -> str:
    """Return a picture of the reference configuration, as the text of an SVG element; empty if it cannot be drawn."""
    try:
        with np.errstate(all="ignore"):
            return still_svg(record_motion(reference_result(model), curves=False, with_notes=False))
    except (FlyballError, ArithmeticError, ValueError, IndexError, np.linalg.LinAlgError):
        return ""


# The reference configuration, read like any result, for pictures before anything is computed.


def reference_result(model: Model) -> Result:
    """Return the reference configuration, at rest and without loads, as a result with one time.

    Nothing is assembled or compiled: bodies have their described poses, joints may be open.

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
