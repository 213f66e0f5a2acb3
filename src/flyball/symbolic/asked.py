"""What `Mechanism.symbolic` does: the model with symbols in its numbers, assembled, in some coordinates."""

from __future__ import annotations

from dataclasses import replace

from ..analysis.linear.inputs import with_inputs
from ..analysis.motion.start import begin
from ..analysis.untouched import refuse_contact
from ..errors import AnalysisError, ModelError
from ..graph.node import Symbol
from ..model.model import Model, suggest
from .equations import Equations
from .numbers import Numbered
from .symbols import SymbolicOptions

NAMES = ("parameters", "all", "none")


def symbolic(model: Model, o: SymbolicOptions) -> Equations:
    """Equations of motion as expressions: see `Mechanism.symbolic`."""
    refuse_contact(model, "symbolic")
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
    wish = "joint" if o.coordinates == "auto" else o.coordinates
    why = "these make the fewest equations"
    try:
        start = begin(plain, 0.0, o.parameters, None, wish)
    except AnalysisError as error:  # friction that follows loads which joint coordinates do not know
        if o.coordinates != "auto":
            raise
        start, why = begin(plain, 0.0, o.parameters, None, "absolute"), str(error).partition(": ")[2]
    if o.coordinates == "auto":
        start = replace(start, coordinates=start.coordinates.replace("as asked for", why))
    out = Equations(plain, start, o, told)
    out.described = model.snapshot()
    return out
