"""Tables of model files that stand for several parts: copies of other mechanisms, and tables with ``repeat``."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import field
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator

from ..errors import ModelError
from .body import GROUND
from .element import ElementType, Name, Number, Point, element, python_data
from .expressions import Expression
from .geometry import Orientation

ASSEMBLIES, DEFINITIONS = "assemblies", "definitions"
REPEAT = "repeat"
MAX_REPEATED = 100_000  # tables that one with ``repeat`` stands for, at most
_BRACES = re.compile(r"\{([^{}]*)\}")

Values = Annotated[dict[str, Number], BeforeValidator(lambda x: {k: python_data(v) for k, v in x.items()})]


@element
class AssemblyTable(metaclass=ElementType):
    """A copy of another mechanism: all its parts, with names that begin with the prefix.

    Parameters
    ----------
    prefix : str
        Of the names of all its parts and parameters: ``"left"`` makes ``"left.arm"`` of its ``"arm"``.
    file : str
        Model file of the mechanism (TOML), relative to the folder of this file.
    of : str
        In place of a file: the name of a mechanism that is described in this file, under ``definitions``.
    at : point [m]
        Where the origin of its world comes to be.
    orientation : quaternion, Bryant angles [rad] or matrix
        In space: axes of its world. They do not depend on parameters.
    angle : number [rad]
        In the plane.
    mirror : ``"x"``, ``"y"`` or ``"z"``
        The coordinate of its world that changes its sign before that.
    on : str
        The body to which it is attached with all that stands on ground in it.
    parameters : dict
        Values of its parameters in the copy, or expressions of this mechanism's.
    """

    prefix: Name
    file: Name | None = None
    of: Name | None = None
    at: Point | None = None
    orientation: Orientation | None = None
    angle: Number | None = None
    mirror: Literal["x", "y", "z"] | None = None
    on: Name = GROUND
    parameters: Values = field(default_factory=dict)


def repeated(table: Mapping[str, Any], named: str) -> list[dict[str, Any]]:
    """Return the tables that one stands for: several if it has a ``repeat``, with ``{...}`` replaced in its texts.

    Braces contain a formula of ``i``, the number of the table from 0. The name gets ``_{i}`` if it has no braces.

    Parameters
    ----------
    table : mapping
    named : str
        The field of the name.

    Raises
    ------
    ModelError
        If the count is none, or braces contain something else.
    """
    fields = dict(table)
    count = fields.pop(REPEAT, None)
    if count is None:
        return [fields]
    if isinstance(count, bool) or not isinstance(count, int) or not 1 <= count <= MAX_REPEATED:
        raise ModelError(f"repeat is {count!r}; give a whole number from 1 to {MAX_REPEATED}")
    name = fields.get(named)
    if isinstance(name, str) and not _BRACES.search(name):
        fields[named] = f"{name}_{{i}}"
    return [_filled(fields, i) for i in range(count)]


def _filled(value: Any, i: int) -> Any:
    """Return plain data with the formulas in braces replaced by their values."""
    if isinstance(value, Mapping):
        return {k: _filled(x, i) for k, x in value.items()}
    if isinstance(value, list):
        return [_filled(x, i) for x in value]
    return _BRACES.sub(lambda match: _index_text(match[1], i), value) if isinstance(value, str) else value


def _index_text(formula: str, i: int) -> str:
    value = Expression.parse(formula).evaluate({"i": i})
    return str(int(value)) if value == int(value) else repr(float(value))
