"""Lookup tables of two arguments, called by name in laws: sums of products of tables of one argument."""

from __future__ import annotations

from functools import cached_property, reduce
from types import SimpleNamespace
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import BeforeValidator

from ..errors import ModelError
from .element import Element, element, python_data
from .expression_parser import SyntaxNode
from .table import Column, Table, check_table_name

Rows = Annotated[tuple[tuple[float, ...], ...], BeforeValidator(python_data)]


@element
class Table2D(Element):
    """A function of two numbers, given on a grid; laws call it by its name: ``"torque(A.rate, throttle)"``.

    With the values z_ij at (x_i, y_j), it is the sum of L_i(x) z_i(y): z_i interpolates row i, and L_i is the function
    of the same kind that is 1 at x_i and 0 at the others. So it has the derivatives of a `Table` of that kind (de Boor,
    *A Practical Guide to Splines*, 1978, chapter XVII).

    Parameters
    ----------
    name : str
        A plain name, since expressions use it.
    x, y : numbers
        The grid; both ascend.
    z : list of lists of numbers
        ``z[i][j]`` is the value at ``x[i]`` and ``y[j]``.
    interpolation : ``"cubic"`` or ``"linear"``
        Bicubic, with two continuous derivatives (not-a-knot at the ends); or bilinear between the points, with kinks.
    beyond : ``"refuse"``, ``"hold"`` or ``"line"``
        Beyond the grid: undefined, and a motion that gets there stops; the value of the edge; straight on with the
        slope of the edge.
    x_unit, y_unit, z_unit : str
        Units in which x, y and z are written; SI if not given.
    """

    x: Column
    y: Column
    z: Rows
    interpolation: Literal["cubic", "linear"] = "cubic"
    beyond: Literal["refuse", "hold", "line"] = "refuse"
    x_unit: str = ""
    y_unit: str = ""
    z_unit: str = ""

    category: ClassVar[str] = "tables"
    arguments: ClassVar[tuple[str, ...]] = ("x", "y")

    def check(self, n: SimpleNamespace) -> None:
        """Refuse grids with wrong sizes, invalid points, and a name that expressions could not use."""
        check_table_name(self)
        sizes = {len(row) for row in self.z}
        if len(self.z) != len(self.x) or sizes != {len(self.y)}:
            raise ModelError(
                f"{self.title}: x has {len(self.x)} and y {len(self.y)} numbers, so z must have {len(self.x)} rows of "
                f"{len(self.y)}; it has {len(self.z)} of {' or '.join(map(str, sorted(sizes)))}"
            )
        for table in self.curves().values():
            table.check(n)

    def curves(self) -> dict[str, Table]:
        """Return the tables of one argument that it is composed of, by name."""
        return {t.name: t for pair in self._factors for t in pair}

    def called(self, node: SyntaxNode) -> SyntaxNode:
        """Return the sum of products in place of a call."""

        def made(kind: str, args: tuple[SyntaxNode, ...], value: Any = None) -> SyntaxNode:
            return SyntaxNode(kind, args, value, node.start, node.stop)

        x, y = node.args if len(self.x) <= len(self.y) else node.args[::-1]
        terms = [made("*", (made("table", (x,), a.name), made("table", (y,), b.name))) for a, b in self._factors]
        return reduce(lambda total, term: made("+", (total, term)), terms)

    @cached_property
    def _factors(self) -> list[tuple[Table, Table]]:
        """The pairs of tables whose products are summed, along the argument with fewer points."""
        first, second, z = ("x", "y", self.z) if len(self.x) <= len(self.y) else ("y", "x", tuple(zip(*self.z)))
        options: Any = {"interpolation": self.interpolation, "beyond": self.beyond}
        out = []
        for i, one in enumerate(tuple(map(tuple, np.eye(len(z)).tolist()))):
            weight = Table(
                f"{self.name}_{first}{i}",
                x=getattr(self, first),
                y=one,
                x_unit=getattr(self, f"{first}_unit"),
                **options,
            )
            row = Table(
                f"{self.name}_{second}{i}", x=getattr(self, second), y=z[i], x_unit=getattr(self, f"{second}_unit"),
                y_unit=self.z_unit, **options,
            )  # fmt: skip
            out.append((weight, row))
        return out


def separate_tables(node: SyntaxNode, tables: dict[str, Any]) -> SyntaxNode:
    """Return a tree in which sums of products replace calls of tables of two arguments."""
    args = tuple(separate_tables(arg, tables) for arg in node.args)
    made = SyntaxNode(node.kind, args, node.value, node.start, node.stop)
    table = tables.get(str(node.value)) if node.kind == "table" else None
    return table.called(made) if isinstance(table, Table2D) else made
