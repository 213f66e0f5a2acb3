"""What is printed: a function of named arguments with named results, and how long it is."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ...errors import ModelError
from ..function import Function
from ..node import CALL, MULTIPLY, NUMBER, SYMBOL, Node
from ..values import reached

MANY = 200_000  # operations from which on nothing is printed: compilers need minutes and gigabytes for more


@dataclass(frozen=True)
class Argument:
    """A number or an array of numbers that a function is given.

    Parameters
    ----------
    name : str
    symbols : Node or sequence of Node
        One symbol for a number, several for an array.
    meaning : str
    values : tuple of float
        What stands for it if it is left out; none if it has to be given.
    """

    name: str
    symbols: Any
    meaning: str = ""
    values: tuple[float, ...] | None = None

    @property
    def single(self) -> bool:
        """Whether it is one number and no array."""
        return isinstance(self.symbols, Node)

    @property
    def nodes(self) -> list[Node]:
        """Its symbols."""
        return [self.symbols] if self.single else list(self.symbols)

    def described(self) -> list[str]:
        """Name and unit of each of its numbers."""
        return [f"{x.data.name} [{x.data.unit}]" if x.data.unit else x.data.name for x in self.nodes]


@dataclass(frozen=True)
class Routine:
    """A function to print.

    Parameters
    ----------
    name : str
    arguments : sequence of Argument
    results : mapping of str to Node, number or array of these
        Scalars, vectors and matrices by name.
    meaning : str
    meanings : mapping of str to str
        What each result is, with shape and unit.
    """

    name: str
    arguments: Sequence[Argument]
    results: dict[str, Any]
    meaning: str = ""
    meanings: dict[str, str] = field(default_factory=dict)

    @property
    def arrays(self) -> dict[str, np.ndarray]:
        """Results as arrays of objects."""
        found = {}
        for name, x in self.results.items():
            found[name] = np.empty(np.shape(x), object)
            found[name][...] = x
        return found

    @property
    def nodes(self) -> list[Any]:
        """All numbers of all results, row by row."""
        return [x for a in self.arrays.values() for x in a.ravel()]

    @property
    def operations(self) -> int:
        """How many operations it takes: what is neither a symbol nor a number nor a mere change of sign."""
        return count(self.nodes)

    def used(self) -> list[Function]:
        """Functions that it calls and that are known by name only."""
        return list({id(x.data): x.data for x in reached(self.nodes) if x.op == CALL}.values())

    def check(self) -> None:
        """Refuse what nobody could print.

        Raises
        ------
        ModelError
            If a symbol is no argument, or there are too many operations.
        """
        given = {x.index for a in self.arguments for x in a.nodes}
        foreign = [x.data.name for x in reached(self.nodes) if x.op == SYMBOL and x.index not in given]
        if foreign:
            raise ModelError(f"{self.name} depends on {', '.join(foreign[:5])}, which is no argument of it")
        refuse_long(self.name, self.operations)


def refuse_long(name: str, operations: int) -> None:
    """Refuse code that is too long.

    Raises
    ------
    ModelError
        With how long it would be.
    """
    if operations > MANY:
        raise ModelError(
            f"{name} takes {operations} operations, and straight-line code is written up to {MANY}: try the other "
            "coordinates (absolute ones make long chains short), export functions that need less (M, f, G and gamma "
            "rather than right_hand_side), or simulate it here, where loops over its elements are compiled"
        )


def count(nodes: Iterable[Any]) -> int:
    """Operations in expressions, those in common counted once, changes of sign not at all."""
    return sum(x.op not in (NUMBER, SYMBOL) and not negated(x) for x in reached(nodes))


def negated(x: Node) -> bool:
    """Whether it is -1 times something."""
    return x.op == MULTIPLY and x.args[0].op == NUMBER and x.args[0].value == -1.0
