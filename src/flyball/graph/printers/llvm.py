"""LLVM's language: straight-line code that reads numbers from memory and writes what expressions make of them.

A function takes addresses and the time. What is read and written are *places*: a base (an address that the function is
given, or that stands where it is given one) and the number of the double there. No pass of Numba sees this code.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..node import Node
from ..operations import ADD, DIVIDE, MULTIPLY, NUMBER, POWER
from .llvm_order import chains, depth_first, operations
from .llvm_spline import PIECE, Pieces, asked

Place = tuple[str, int]
"""A base and the number of the double there."""

LIBRARY = {
    "sin": "llvm.sin.f64", "cos": "llvm.cos.f64", "sqrt": "llvm.sqrt.f64", "exp": "llvm.exp.f64", "log": "llvm.log.f64",
    "absolute": "llvm.fabs.f64", "tan": "tan", "asin": "asin", "acos": "acos", "atan": "atan", "sinh": "sinh",
    "cosh": "cosh", "tanh": "tanh",
}  # fmt: skip
"""Functions of one argument: intrinsics, and those of C's library."""
TWO = {POWER: "llvm.pow.f64", "atan2": "atan2"}
DECLARED = "\n".join(
    [
        f"declare double @{name}(double) nounwind willreturn memory(none)"
        for name in {*LIBRARY.values(), "llvm.floor.f64"}
    ]
    + [f"declare double @{name}(double, double) nounwind willreturn memory(none)" for name in TWO.values()]
)
INFIX = {ADD: "fadd", MULTIPLY: "fmul", DIVIDE: "fdiv"}


BAD = {"positive": "ule", "nonzero": "ueq", "finite": "une"}  # against 0; "u": or no number


class Unprintable(Exception):
    """An expression has something in it that this language has no word for."""


def constant(x: float) -> str:
    """A number, to the last bit."""
    return f"0x{struct.unpack('<Q', struct.pack('<d', x))[0]:016X}"


@dataclass
class Procedure:
    """What a function does: it reads symbols at their places and puts expressions into theirs.

    Attributes
    ----------
    name : str
    reads : mapping of node number to place
        What is there already: symbols, and what others have left.
    stores : list of (place, expression)
    returned : node or number
    checks : list of (expressions, what, number)
        Where one of these is not "positive", "nonzero" or "finite" the function returns that number, the first such.
    deep : bool
        Whether what goes into a store stands next to it, or in the order in which it was made.
    """

    name: str
    reads: Mapping[int, Place]
    stores: list[tuple[Place, Any]]
    returned: Any = 0.0
    checks: list[tuple[list[Any], str, float]] = field(default_factory=list)
    deep: bool = True

    @property
    def results(self) -> list[Any]:
        """All that is asked for."""
        return [x for _, x in self.stores] + [self.returned] + [x for nodes, _, _ in self.checks for x in nodes]


class Module:
    """Procedures of one kind, as text.

    Parameters
    ----------
    arguments : str
        As in ``define double @name(arguments)``; ``%t`` is the base "t".
    based : callable
        Base -> lines that leave its address in ``%base``; none where it is an argument.
    """

    def __init__(self, arguments: str, based: Callable[[str], list[str]]) -> None:
        self.arguments, self.based = arguments, based
        self.texts: list[str] = []
        self.bases: list[str] = []
        self.tables: dict[bytes, Sequence[float]] = {}

    def table(self, numbers: Sequence[float]) -> str:
        """The name of a table's numbers."""
        key = np.array(numbers, float).tobytes()
        self.tables.setdefault(key, numbers)
        return f"@table{list(self.tables).index(key)}"

    def scope(self, base: str) -> str:
        """What tells LLVM that places of other bases are others."""
        if base not in self.bases:
            self.bases.append(base)
        k = 3 * self.bases.index(base)
        return f"!alias.scope !{k + 2}, !noalias !{k + 3}"

    def add(self, p: Procedure) -> None:
        """Print a procedure."""
        out = _Lines(self, p.reads)
        order = depth_first(p.results, p.reads) if p.deep else operations(p.results, p.reads)
        out.chains = chains(order, p.reads)
        overwritten = {place for place, _ in p.stores}
        for x in order:  # what is overwritten is read first
            if p.reads.get(x.index) in overwritten:
                out.value(x)
        waiting: dict[int, list[Place]] = {}
        for place, x in p.stores:
            if isinstance(x, Node) and x.op != NUMBER:
                waiting.setdefault(x.index, []).append(place)
            else:
                out.put(place, constant(float(x)))
        for x in order:
            if x.op != NUMBER:
                name = out.value(x)
                for place in waiting.pop(x.index, ()):
                    out.put(place, name)
        out.end(p)
        head = [line for base in sorted(out.used) for line in self.based(base)]
        lines = [f"define double @{p.name}({self.arguments}) nounwind {{", *head, *out.lines, "}"]
        self.texts.append("\n".join(lines))

    def __str__(self) -> str:
        """The text."""
        n = range(len(self.bases))
        told = ["!0 = distinct !{!0}"] if self.bases else []
        for k in n:
            others = ", ".join(f"!{3 * i + 1}" for i in n if i != k)
            told += [f"!{3 * k + 1} = distinct !{{!{3 * k + 1}, !0}}", f"!{3 * k + 2} = !{{!{3 * k + 1}}}"]
            told += [f"!{3 * k + 3} = !{{{others}}}"]
        data = []
        for k, numbers in enumerate(self.tables.values()):
            listed = ", ".join(f"double {constant(x)}" for x in numbers)
            data.append(f"@table{k} = internal constant [{len(numbers)} x double] [{listed}]")
        spline = [PIECE] if self.tables else []
        return "\n\n".join([DECLARED, *data, *spline, *self.texts, "\n".join(told)]) + "\n"


class _Lines:
    """The lines of one function."""

    def __init__(self, module: Module, reads: Mapping[int, Place]) -> None:
        self.module, self.reads = module, reads
        self.lines: list[str] = []
        self.names: dict[int, str] = {}
        self.used: set[str] = set()
        self.chains: Mapping[int, tuple[Node | None, Sequence[Node]]] = {}
        self.pieces = Pieces(self.new)

    def new(self, text: str) -> str:
        name = f"%x{len(self.lines)}"
        self.lines.append(f"{name} = {text}")
        return name

    def address(self, place: Place) -> str:
        self.used.add(place[0])
        return self.new(f"getelementptr inbounds double, ptr %{place[0]}, i64 {place[1]}")

    def read(self, place: Place) -> str:
        if place[0] == "t":
            return "%t"
        return self.new(f"load double, ptr {self.address(place)}, {self.module.scope(place[0])}")

    def put(self, place: Place, name: str) -> None:
        self.lines.append(f"store double {name}, ptr {self.address(place)}, {self.module.scope(place[0])}")

    def name(self, x: Any) -> str:
        if not isinstance(x, Node):
            return constant(float(x))
        return constant(x.value) if x.op == NUMBER else self.names[x.index]

    def value(self, x: Node) -> str:
        if x.index not in self.names:
            found = self.reads.get(x.index)
            self.names[x.index] = self.operation(x) if found is None else self.read(found)
        return self.names[x.index]

    def operation(self, x: Node) -> str:
        if x.index in self.chains:
            return self.largest(*self.chains[x.index])
        a = [self.name(y) for y in x.args]
        if x.op == MULTIPLY and x.args[0].op == NUMBER and x.args[0].value == -1.0:
            return self.new(f"fneg double {a[1]}")
        if x.op in INFIX:
            return self.new(f"{INFIX[x.op]} double {a[0]}, {a[1]}")
        if x.op in LIBRARY:
            return self.new(f"call double @{LIBRARY[x.op]}(double {a[0]})")
        if x.op in TWO:
            return self.new(f"call double @{TWO[x.op]}(double {a[0]}, double {a[1]})")
        if x.op in DECIDING:
            return DECIDING[x.op](self, *a)
        if (spline := asked(x.data)) is not None:
            numbers, order = spline
            return self.pieces.value((self.module.table(numbers), numbers), order, a[0])
        told = getattr(x.data, "told", {})
        if "constant" in told:
            return constant(told["constant"])
        raise Unprintable(getattr(x.data, "name", x.op))

    def largest(self, begun: Node | None, others: Sequence[Node]) -> str:
        """The largest of some, one of which may be the largest of others already."""
        names = [self.name(y) for y in (*((begun,) if begun is not None else ()), *others)]
        while len(names) > 1:
            a, b = names.pop(0), names.pop(0)
            names.append(self.chosen(self.new(f"fcmp ogt double {a}, {b}"), a, b))
        return names[0]

    def chosen(self, condition: str, a: str, b: str) -> str:
        return self.new(f"select i1 {condition}, double {a}, double {b}")

    def end(self, p: Procedure) -> None:
        value = self.name(p.returned)
        for nodes, what, number in reversed(p.checks):
            names = [self.name(x) for x in nodes]
            if what == "finite":  # x - x is 0 if x is
                names = [self.new(f"fsub double {x}, {x}") for x in names]
                while len(names) > 1:
                    pairs = zip(names[::2], names[1::2], strict=False)
                    names = [self.new(f"fadd double {x}, {y}") for x, y in pairs] + names[len(names) // 2 * 2 :]
            for x in names:
                bad = self.new(f"fcmp {BAD[what]} double {x}, {constant(0.0)}")
                value = self.chosen(bad, constant(number), value)
        self.lines.append(f"ret double {value}")


def _minimum(o: _Lines, a: str, b: str) -> str:
    first = o.new(f"fcmp ole double {a}, {b}")
    return o.chosen(o.new(f"or i1 {first}, {o.new(f'fcmp uno double {a}, {a}')}"), a, b)


def _maximum(o: _Lines, a: str, b: str) -> str:
    first = o.new(f"fcmp oge double {a}, {b}")
    return o.chosen(o.new(f"or i1 {first}, {o.new(f'fcmp uno double {a}, {a}')}"), a, b)


def _sign(o: _Lines, a: str) -> str:
    below = o.chosen(o.new(f"fcmp olt double {a}, {constant(0.0)}"), constant(-1.0), constant(0.0))
    some = o.chosen(o.new(f"fcmp ogt double {a}, {constant(0.0)}"), constant(1.0), below)
    return o.chosen(o.new(f"fcmp uno double {a}, {a}"), a, some)


def _rounded(o: _Lines, a: str) -> str:
    return o.new(f"call double @llvm.floor.f64(double {o.new(f'fadd double {a}, {constant(0.5)}')})")


def _choose(o: _Lines, x: str, a: str, b: str) -> str:
    return o.chosen(o.new(f"fcmp ogt double {x}, {constant(0.0)}"), a, b)


DECIDING: dict[str, Callable[..., str]] = {
    "minimum": _minimum, "maximum": _maximum, "sign": _sign, "rounded": _rounded, "choose": _choose,
}  # fmt: skip
"""Functions that choose, as in `math/scalar.py`."""
