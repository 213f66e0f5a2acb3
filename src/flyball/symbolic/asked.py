"""What `Mechanism.symbolic` does: the model with symbols in its numbers, in some coordinates."""

from __future__ import annotations

from ..analysis.linear.inputs import with_inputs
from ..analysis.untouched import SLIDING, refuse_contact
from ..errors import ModelError
from ..graph.node import Symbol
from ..model.model import Model, suggest
from .coordinates import chosen
from .equations import Equations
from .numbers import Numbered
from .symbols import SymbolicOptions

NAMES = ("parameters", "all", "none")


def symbolic(model: Model, o: SymbolicOptions) -> Equations:
    """Equations of motion as expressions: see `Mechanism.symbolic`."""
    refuse_contact(model, "symbolic", SLIDING)
    if o.names not in NAMES:
        raise ModelError(f"names is {o.names!r}{suggest(o.names, NAMES)}; must be one of {', '.join(NAMES)}")
    plain: Model = model.snapshot()
    told: dict[str, Symbol] = {}
    if o.names == "all":
        numbered = Numbered(plain)
        plain, told = numbered.model, numbered.symbols
    if o.inputs:
        plain, inputs = with_inputs(plain, o.inputs)
        told |= {i.parameter: Symbol(i.name, "input", unit=i.unit) for i in inputs if i.parameter != i.name}
    plain = plain.snapshot()
    out = Equations(plain, chosen(plain, o.parameters, o.coordinates), o, told)
    out.described = model.snapshot()
    return out
