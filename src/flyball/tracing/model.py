"""A model's equations as expressions of its parameters: the tables are filled in by the same code, run on symbols."""

from __future__ import annotations

from typing import Any

from ..graph.node import Graph, Node, Symbol
from ..model.expressions import is_number_text
from ..model.model import Model
from ..tables.structure import Choices, structure
from ..tables.values import values
from .trace import Names, Traced, plain, traced


def parameters(model: Model, graph: Graph) -> dict[str, Node]:
    """Symbols of the parameters that have a value of their own; the others are expressions of these."""
    told = model.environment()
    own = [k for k, x in model.parameters.items() if not isinstance(x, str) or is_number_text(x)]
    return {k: graph.symbol(Symbol(k, "parameter"), told[k]) for k in own}


def expressed(model: Model, tree: tuple[str, ...] = (), symbols: bool = True, names: Names | None = None) -> Traced:
    """Trace a model in absolute coordinates, or in those of a forest.

    Parameters
    ----------
    model : Model
    tree : tuple of str
        Names of the tree joints; none for absolute coordinates.
    symbols : bool
        Whether parameters are symbols; else they are numbers.
    names : Names, optional
        Symbols of the state.
    """
    model = model.snapshot()
    graph = Graph()
    given: dict[str, Any] = dict(parameters(model, graph)) if symbols else {}
    s = structure(model, Choices(tree=tuple(tree), coupled=bool(tree)))
    S = values(s, given).system
    return traced(s, S if given else plain(S), graph, names)
