"""Which names parts may have: unique, and where laws read them words that the language of laws leaves free."""

from __future__ import annotations

import keyword
import unicodedata
from typing import TYPE_CHECKING

from ..errors import ModelError
from .body import GROUND, Initial
from .controller import Controller
from .element import Element
from .grammar import CONSTANTS, FUNCTIONS
from .sensor import Sensor
from .table import Table

if TYPE_CHECKING:
    from .model import Model

RESERVED = (GROUND, "energy", "t", "time")


def check_name(model: Model, e: Element) -> None:
    """Refuse a name that is taken, or that results or laws could not use.

    Laws read sensors, tables and controllers by their bare names; of a sensor whose name is no plain word, such as
    ``"front wheel"``, only results speak. All else they read with a dot behind it, which no constant has.
    """
    if isinstance(e, Initial):
        if any(i.name == e.name for i in model.initial):
            raise ModelError(f"{e.title}: there is an initial condition for {e.name!r} already")
        return
    if not e.name or "." in e.name or e.name != e.name.strip():
        raise ModelError(f"{type(e).__name__}: {e.name!r} is no good name; it must not be empty or contain '.'")
    if e.name in RESERVED:
        raise ModelError(f"{e.title}: the name {e.name!r} is reserved")
    if isinstance(e, (Sensor, Controller)):
        _check_read(e)
    if isinstance(e, (Sensor, Table, Controller)) and e.name in model.parameters:
        raise ModelError(f"{e.title}: the name {e.name!r} is a parameter's, and laws use both; rename one of them")
    if e.name in model.by_name:
        raise ModelError(f"{e.title}: the name is taken by {model.by_name[e.name].title}; names must be unique")


def _check_read(e: Element) -> None:
    """Refuse names that laws would read as something else, or, of a controller, not at all."""
    other = f"{type(e).__name__.lower()}_{e.name}"
    if e.name in FUNCTIONS or e.name in CONSTANTS:
        what = f"the function {e.name}" if e.name in FUNCTIONS else f"the number {CONSTANTS[e.name]:.6g}"
        raise ModelError(f"{e.title}: laws read {e.name!r} as {what}; rename it, {other!r} for instance")
    if not isinstance(e, Controller):
        return
    if not e.name.isidentifier() or keyword.iskeyword(e.name):
        raise ModelError(f"{e.title}: laws name a controller by its name; use letters, digits and _, no digit first")
    read = unicodedata.normalize("NFKC", e.name)
    if read != e.name:
        raise ModelError(f"{e.title}: laws read {e.name!r} as {read!r}, another letter; call it {read!r}")
