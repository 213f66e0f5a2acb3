"""A model as expressions, with where it starts."""

from __future__ import annotations

from collections.abc import Sequence

from ...analysis.linear.inputs import with_inputs
from ...analysis.motion.start import begin
from ...errors import ModelError
from ...graph.node import Node
from ...model.model import Model
from ...tracing.model import expressed, parameters
from ...tracing.trace import Names, Traced
from .explicit import Start


def asked(
    model: Model, inputs: Sequence[str], coordinates: str = "auto", names: Names | None = None
) -> tuple[Traced, Start, dict[str, Node]]:
    """The same with inputs by name, as `Mechanism.linearize` has them: what is added to laws, or parameters.

    Returns
    -------
    (Traced, Start, dict)
        The last from each input to its symbol.

    Raises
    ------
    ModelError
        If there is no such input; the message lists what there is.
    """
    if isinstance(inputs, str):
        inputs = [inputs]
    copy, found = with_inputs(model, inputs)
    x, start = begun(copy, coordinates, True, names)
    known = parameters(copy.snapshot(), x.graph)
    derived = [i.name for i in found if i.parameter not in known]
    if derived:
        raise ModelError(f"{derived[0]!r} follows from other parameters: no input; there are {', '.join(known)}")
    return x, start, {i.name: known[i.parameter] for i in found}


def begun(
    model: Model, coordinates: str = "auto", symbols: bool = True, names: Names | None = None
) -> tuple[Traced, Start]:
    """Trace a model, and assemble it as drawn.

    Parameters
    ----------
    model : Model
    coordinates : {"auto", "joint", "absolute"}
    symbols : bool
        Whether parameters are symbols; else they are numbers.
    names : Names, optional
        Symbols of the state.
    """
    b = begin(model.snapshot(), 0.0, None, None, coordinates)
    c, a = b.assembly.compiled, b.assembly
    x = expressed(model, c.structure.tree, symbols, names)
    return x, Start(0.0, a.q.tolist(), a.v.tolist(), c.z.tolist())
