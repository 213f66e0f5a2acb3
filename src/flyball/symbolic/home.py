"""What expressions need to know of where they come from: the graph, and its symbols by name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

from ..errors import ModelError
from ..graph.node import Graph, Node
from ..graph.operations import SYMBOL
from ..graph.printers.sympy import SympyPrinter
from ..model.words import listing, suggest


class Home:
    """Symbols by name, and what is made of expressions of them."""

    graph: Graph

    @property
    def title(self) -> str:
        """Whose expressions they are, for messages."""
        raise NotImplementedError

    @property
    def named(self) -> dict[str, Node]:
        """Every symbol by its name."""
        raise NotImplementedError

    @property
    def units(self) -> Sequence[Sequence[Node]]:
        """Symbols of each quaternion: their squares add up to one."""
        return ()

    @cached_property
    def printer(self) -> SympyPrinter:
        """The one that makes SymPy expressions; it knows which node a SymPy symbol stands for."""
        return SympyPrinter()

    def symbol(self, x: Any) -> Node:
        """The node of a symbol, by its name, or as an expression that is one.

        Raises
        ------
        ModelError
            If there is none of that name.
        """
        x = getattr(x, "nodes", x)
        x = x[()] if getattr(x, "shape", None) == () else x
        if isinstance(x, Node) and x.op == SYMBOL:
            return x
        named = self.named
        if not isinstance(x, str) or x not in named:
            raise ModelError(f"{self.title} has no symbol {x!r}{suggest(str(x), named)}; {listing(list(named))}")
        return named[x]

    def checked(self, values: Mapping[str, Any], wanted: Mapping[str, Node]) -> dict[str, Any]:
        """Values of symbols, refused by name where wrong or missing."""
        named = self.named
        for name in values:
            if name not in named:
                raise ModelError(f"{self.title} has no symbol {name!r}{suggest(str(name), named)}")
        lacking = [k for k, x in wanted.items() if x.moving and k not in values]
        if lacking:
            raise ModelError(f"no value is given for {', '.join(lacking)}")
        return dict(values)
