"""Expressions as LLVM code: straight-line code that reads numbers from memory and writes values of expressions.

The arguments of a function are addresses and the time. Values are read from and written to *places*: a base (an address
that is an argument, or that is stored where an argument points) and the index of a double there. Numba does not process
this code.

Operations are ordered so that several independent chains run in parallel and few registers are needed. The segment of a
spline is searched once for all splines with the same breakpoints, starting with the segment found last.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ...math.spline import BREAKS
from ..graph import ADD, DIVIDE, MULTIPLY, NUMBER, POWER, Node

PARALLEL_CHAINS = 4  # number of parallel chains that a long chain of comparisons is split into


def operands(x: Node) -> tuple[Node, ...]:
    """Operands of an operation as it is written."""
    return (x.op == "choose" and compared_pair(x)) or x.args


def compared_pair(x: Node) -> tuple[Node, Node] | None:
    """(a, b) if x is the larger of two, ``choose(a - b, a, b)``; else None."""
    by, a, b = x.args
    if by.op != ADD:
        return None
    for first, second in (by.args, by.args[::-1]):
        less = second.op == MULTIPLY and second.args[0].op == NUMBER and second.args[0].value == -1.0
        if first is a and (
            (less and second.args[1] is b) or (b.op == NUMBER == second.op and second.value == -b.value)
        ):
            return a, b
    return None


def ordered_operations(nodes: Iterable[Any], loaded: Collection[int]) -> list[Node]:
    """Operations and loads that these expressions need, in order of creation."""
    found: dict[int, Node] = {}
    to_see = [x for x in nodes if isinstance(x, Node)]
    while to_see:
        x = to_see.pop()
        if x.index not in found:
            found[x.index] = x
            if x.index not in loaded:
                to_see.extend(operands(x))
    return [found[k] for k in sorted(found)]


def depth_first(nodes: Iterable[Any], loaded: Collection[int]) -> list[Node]:
    """Like `ordered_operations`, but each right before its use, so that values stay in registers for less time."""
    seen: set[int] = set()
    order: list[Node] = []
    for root in sorted({x.index: x for x in nodes if isinstance(x, Node)}.values(), key=lambda x: x.index):
        stack = [(root, 0)]
        while stack:
            x, k = stack.pop()
            if x.index in seen:
                continue
            args = () if x.index in loaded else operands(x)
            if k < len(args):
                stack += [(x, k + 1), (args[k], 0)]
            else:
                seen.add(x.index)
                order.append(x)
    return order


def parallel_chains(order: Sequence[Node], loaded: Collection[int]) -> dict[int, tuple[Node | None, list[Node]]]:
    """Split long chains of comparisons into parallel chains.

    For each node in ``order`` that is the larger of two: an earlier one of its chain, or None, and its comparands.
    """
    larger = {x.index for x in order if x.index not in loaded and x.op == "choose" and compared_pair(x)}
    uses: dict[int, int] = {}
    for x in order:
        for a in () if x.index in loaded else operands(x):
            uses[a.index] = uses.get(a.index, 0) + 1
    behind: dict[int, list[Node]] = {}  # chain that ends at each node
    out: dict[int, tuple[Node | None, list[Node]]] = {}
    follows: set[int] = set()
    for x in order:
        if x.index in larger:
            first, second = operands(x)
            chain = behind.get(first.index, []) if first.index in larger and uses[first.index] == 1 else []
            follows |= {first.index} if chain else set()
            behind[x.index] = [*chain, x]
            out[x.index] = (None, [first, second])
    for end in [k for k in behind if k not in follows]:
        chain = behind[end]
        for k, x in enumerate(chain[1:-1], 1):
            previous = chain[k - PARALLEL_CHAINS] if k >= PARALLEL_CHAINS else None
            out[x.index] = (previous, [operands(x)[1]])
        if len(chain) > 1:
            others = chain[-1 - PARALLEL_CHAINS : -1]
            out[end] = (None, [*others, operands(chain[-1])[1]])
    return out


SearchKey = tuple[float, ...]
"""Period, number of breaks, breaks."""


def search_key(table: Sequence[float]) -> SearchKey:
    """Numbers of a spline that determine the segment of an argument."""
    return tuple(table[: BREAKS + int(table[1])])


def spline_of(data: Any) -> tuple[Sequence[float], int] | None:
    """Numbers of a spline and the order of its derivative; None if it is no spline or its numbers are not constant."""
    details = getattr(data, "details", {})
    return (details["table"], details["order"]) if "table" in details and not details["moved"] else None


class SplineSegments:
    """Spline segments found in one procedure.

    Parameters
    ----------
    new : callable
        Writes an instruction and returns the name of its value.
    """

    def __init__(self, new: Any) -> None:
        self.new = new
        self.found: dict[tuple[SearchKey, str], tuple[str, str]] = {}
        self.last: dict[SearchKey, str] = {}
        self.read: dict[tuple[str, str], list[str]] = {}

    def value(self, table: tuple[str, Sequence[float]], order: int, x: str) -> str:
        """Code for a derivative of a spline (name and numbers) at the value named x."""
        name, numbers = table
        breaks = search_key(numbers)
        if (breaks, x) not in self.found:
            guess = self.last.get(breaks, "0")
            both = self.new(f"call {{ i64, double }} @piece(ptr {name}, double {x}, i64 {guess})")
            k, s = (self.new(f"extractvalue {{ i64, double }} {both}, {n}") for n in range(2))
            self.found[breaks, x] = k, s
            self.last[breaks] = k
        k, s = self.found[breaks, x]
        if (name, k) not in self.read:
            at = self.new(f"getelementptr double, ptr {name}, i64 {len(breaks)}")
            at = self.new(f"getelementptr [4 x double], ptr {at}, i64 {k}")
            places = [self.new(f"getelementptr double, ptr {at}, i64 {n}") for n in range(4)]
            self.read[name, k] = [self.new(f"load double, ptr {place}, !invariant.load !0") for place in places]
        c = self.read[name, k]
        factors = [[1.0, 1.0, 1.0, 1.0], [1.0, 2.0, 3.0], [2.0, 6.0], [6.0]][order]
        terms = [a if f == 1.0 else self.two("fmul", a, f"{f:e}") for f, a in zip(factors, c[order:], strict=True)]
        total = terms.pop()
        while terms:
            total = self.two("fadd", terms.pop(), self.two("fmul", s, total))
        return total

    def two(self, operation: str, a: str, b: str) -> str:
        """Code for an operation on two values."""
        return self.new(f"{operation} double {a}, {b}")


PIECE_SEARCH = """define internal { i64, double } @piece(ptr %d, double %x, i64 %guess) nounwind {
entry:
  %at_n = getelementptr double, ptr %d, i64 1
  %m = load double, ptr %at_n
  %count = fptosi double %m to i64
  %period = load double, ptr %d
  %breaks = getelementptr double, ptr %d, i64 2
  %begin = load double, ptr %breaks
  %periodic = fcmp ogt double %period, 0.0
  %way = fsub double %x, %begin
  %rounds = fdiv double %way, %period
  %whole = call double @llvm.floor.f64(double %rounds)
  %turns = select i1 %periodic, double %whole, double 0.0
  %shift = fmul double %period, %turns
  %y = fsub double %x, %shift
  %before = sub i64 %guess, 1
  %within = sub i64 %count, 1
  %inside = icmp ult i64 %before, %within
  br i1 %inside, label %try, label %bisect
try:
  %at_from = getelementptr double, ptr %breaks, i64 %before
  %from = load double, ptr %at_from
  %at_to = getelementptr double, ptr %breaks, i64 %guess
  %to = load double, ptr %at_to
  %not_before = fcmp ole double %from, %y
  %not_behind = fcmp olt double %y, %to
  %still = and i1 %not_before, %not_behind
  br i1 %still, label %out, label %bisect
bisect:
  br label %loop
loop:
  %low = phi i64 [ 0, %bisect ], [ %low.next, %body ]
  %high = phi i64 [ %count, %bisect ], [ %high.next, %body ]
  %more = icmp slt i64 %low, %high
  br i1 %more, label %body, label %done
body:
  %sum = add i64 %low, %high
  %middle = ashr i64 %sum, 1
  %at_b = getelementptr double, ptr %breaks, i64 %middle
  %b = load double, ptr %at_b
  %below = fcmp ole double %b, %y
  %above = add i64 %middle, 1
  %low.next = select i1 %below, i64 %above, i64 %low
  %high.next = select i1 %below, i64 %high, i64 %middle
  br label %loop
done:
  %last = sub i64 %count, 1
  %at_l = getelementptr double, ptr %breaks, i64 %last
  %l = load double, ptr %at_l
  %is_l = fcmp oeq double %y, %l
  %is_c = icmp eq i64 %low, %count
  %end = and i1 %is_l, %is_c
  %k = select i1 %end, i64 %last, i64 %low
  %k1 = sub i64 %k, 1
  %first = icmp slt i64 %k1, 0
  %k0 = select i1 %first, i64 0, i64 %k1
  %at_o = getelementptr double, ptr %breaks, i64 %k0
  %start = load double, ptr %at_o
  br label %out
out:
  %piece = phi i64 [ %guess, %try ], [ %k, %done ]
  %o = phi double [ %from, %try ], [ %start, %done ]
  %origin = fadd double %o, %shift
  %s = fsub double %x, %origin
  %one = insertvalue { i64, double } undef, i64 %piece, 0
  %both = insertvalue { i64, double } %one, double %s, 1
  ret { i64, double } %both
}
"""


Place = tuple[str, int]
"""A base and the index of a double there."""

LIBRARY = {
    "sin": "llvm.sin.f64", "cos": "llvm.cos.f64", "sqrt": "llvm.sqrt.f64", "exp": "llvm.exp.f64", "log": "llvm.log.f64",
    "absolute": "llvm.fabs.f64", "tan": "tan", "asin": "asin", "acos": "acos", "atan": "atan", "sinh": "sinh",
    "cosh": "cosh", "tanh": "tanh",
}  # fmt: skip
"""Functions of one argument: intrinsics, and functions of the C library."""
TWO_ARGUMENTS = {POWER: "llvm.pow.f64", "atan2": "atan2"}
DECLARATIONS = "\n".join(
    [
        f"declare double @{name}(double) nounwind willreturn memory(none)"
        for name in {*LIBRARY.values(), "llvm.floor.f64"}
    ]
    + [f"declare double @{name}(double, double) nounwind willreturn memory(none)" for name in TWO_ARGUMENTS.values()]
)
INFIX = {ADD: "fadd", MULTIPLY: "fmul", DIVIDE: "fdiv"}


FAILED_CHECKS = {"positive": "ule", "nonzero": "ueq", "finite": "une"}  # compared with 0; "u": true also for NaN


class UnsupportedOperation(Exception):
    """An expression contains an operation that this printer does not support."""


def constant(x: float) -> str:
    """A number as an exact constant."""
    return f"0x{struct.unpack('<Q', struct.pack('<d', x))[0]:016X}"


@dataclass
class Procedure:
    """A function: it reads symbols from their places and stores expressions in theirs.

    Attributes
    ----------
    name : str
    inputs : mapping of node index to place
        Available values: symbols, and results of other procedures.
    stores : list of (place, expression)
    returned : node or number
    checks : list of (expressions, what, number)
        If an expression is not "positive", "nonzero" or "finite", the function returns the number of the
        first failed check.
    deep : bool
        Whether operations are written right before their store, or in order of creation.
    """

    name: str
    inputs: Mapping[int, Place]
    stores: list[tuple[Place, Any]]
    returned: Any = 0.0
    checks: list[tuple[list[Any], str, float]] = field(default_factory=list)
    deep: bool = True

    @property
    def results(self) -> list[Any]:
        """All requested expressions."""
        return [x for _, x in self.stores] + [self.returned] + [x for nodes, _, _ in self.checks for x in nodes]


class Module:
    """Procedures with the same arguments, as text.

    Parameters
    ----------
    arguments : str
        As in ``define double @name(arguments)``; ``%t`` is the base "t".
    based : callable
        Base -> lines that compute its address ``%base``; none if it is an argument.
    lines_of : subclass of Lines
        Of another type of numbers.
    """

    def __init__(
        self,
        arguments: str,
        based: Callable[[str], list[str]],
        lines_of: Callable[[Module, Mapping[int, Place]], Lines] | None = None,
    ) -> None:
        self.arguments, self.based, self.lines_of = arguments, based, lines_of or Lines
        self.texts: list[str] = []
        self.bases: list[str] = []
        self.tables: dict[bytes, Sequence[float]] = {}

    def table(self, numbers: Sequence[float]) -> str:
        """Name of the constant array of a table."""
        key = np.array(numbers, float).tobytes()
        self.tables.setdefault(key, numbers)
        return f"@table{list(self.tables).index(key)}"

    def scope(self, base: str) -> str:
        """Alias metadata: places of different bases do not overlap."""
        if base not in self.bases:
            self.bases.append(base)
        k = 3 * self.bases.index(base)
        return f"!alias.scope !{k + 2}, !noalias !{k + 3}"

    def add(self, p: Procedure) -> None:
        """Print a procedure."""
        out = self.lines_of(self, p.inputs)
        order = depth_first(p.results, p.inputs) if p.deep else ordered_operations(p.results, p.inputs)
        out.chains = parallel_chains(order, p.inputs)
        overwritten = {place for place, _ in p.stores}
        for x in order:  # values that will be overwritten are read first
            if p.inputs.get(x.index) in overwritten:
                out.value(x)
        waiting: dict[int, list[Place]] = {}
        for place, x in p.stores:
            if isinstance(x, Node) and x.op != NUMBER:
                waiting.setdefault(x.index, []).append(place)
            else:
                out.put(place, out.number(float(x)))
        for x in order:
            if x.op != NUMBER:
                name = out.value(x)
                for place in waiting.pop(x.index, ()):
                    out.put(place, name)
        out.end(p)
        head = [line for base in sorted(out.used) for line in self.based(base)]
        lines = [f"define {out.real} @{p.name}({self.arguments}) nounwind {{", *head, *out.lines, "}"]
        self.texts.append("\n".join(lines))

    def __str__(self) -> str:
        """The text."""
        n = range(len(self.bases))
        metadata = ["!0 = distinct !{!0}"] if self.bases else []
        for k in n:
            others = ", ".join(f"!{3 * i + 1}" for i in n if i != k)
            metadata += [f"!{3 * k + 1} = distinct !{{!{3 * k + 1}, !0}}", f"!{3 * k + 2} = !{{!{3 * k + 1}}}"]
            metadata += [f"!{3 * k + 3} = !{{{others}}}"]
        data = []
        for k, numbers in enumerate(self.tables.values()):
            listed = ", ".join(f"double {constant(x)}" for x in numbers)
            data.append(f"@table{k} = internal constant [{len(numbers)} x double] [{listed}]")
        spline = [PIECE_SEARCH] if self.tables else []
        return "\n\n".join([DECLARATIONS, *data, *spline, *self.texts, "\n".join(metadata)]) + "\n"


class Lines:
    """The lines of one function; a subclass may print for another type of numbers, with other reads and stores."""

    real = "double"
    condition = "i1"

    def __init__(self, module: Module, reads: Mapping[int, Place]) -> None:
        self.module, self.reads = module, reads
        self.lines: list[str] = []
        self.names: dict[int, str] = {}
        self.used: set[str] = set()
        self.chains: Mapping[int, tuple[Node | None, Sequence[Node]]] = {}
        self.pieces = SplineSegments(self.new)

    def new(self, text: str) -> str:
        """Write an instruction and return the name of its value."""
        name = f"%x{len(self.lines)}"
        self.lines.append(f"{name} = {text}")
        return name

    def address(self, place: Place) -> str:
        """Code for the address of a place."""
        self.used.add(place[0])
        return self.new(f"getelementptr inbounds double, ptr %{place[0]}, i64 {place[1]}")

    def read(self, place: Place) -> str:
        """Code that loads a value."""
        if place[0] == "t":
            return "%t"
        return self.new(f"load double, ptr {self.address(place)}, {self.module.scope(place[0])}")

    def put(self, place: Place, name: str) -> None:
        """Code that stores a value."""
        self.lines.append(f"store double {name}, ptr {self.address(place)}, {self.module.scope(place[0])}")

    def number(self, x: float) -> str:
        """A number as an exact constant."""
        return constant(x)

    def name(self, x: Any) -> str:
        """Name of a value, or a number as a constant."""
        if not isinstance(x, Node):
            return self.number(float(x))
        return self.number(x.value) if x.op == NUMBER else self.names[x.index]

    def value(self, x: Node) -> str:
        """Name of the value of an expression, which is loaded or computed if it was not yet."""
        if x.index not in self.names:
            found = self.reads.get(x.index)
            self.names[x.index] = self.operation(x) if found is None else self.read(found)
        return self.names[x.index]

    def operation(self, x: Node) -> str:
        """Code for an operation."""
        if x.index in self.chains:
            return self.largest(*self.chains[x.index])
        a = [self.name(y) for y in x.args]
        if x.op == MULTIPLY and x.args[0].op == NUMBER and x.args[0].value == -1.0:
            return self.new(f"fneg {self.real} {a[1]}")
        if x.op in INFIX:
            return self.new(f"{INFIX[x.op]} {self.real} {a[0]}, {a[1]}")
        if x.op in LIBRARY:
            return self.new(f"call double @{LIBRARY[x.op]}(double {a[0]})")
        if x.op in TWO_ARGUMENTS:
            return self.new(f"call double @{TWO_ARGUMENTS[x.op]}(double {a[0]}, double {a[1]})")
        if x.op in BRANCHING:
            return BRANCHING[x.op](self, *a)
        if (spline := spline_of(x.data)) is not None:
            numbers, order = spline
            return self.pieces.value((self.module.table(numbers), numbers), order, a[0])
        details = getattr(x.data, "details", {})
        if "constant" in details:
            return self.number(details["constant"])
        raise UnsupportedOperation(getattr(x.data, "name", x.op))

    def largest(self, started: Node | None, others: Sequence[Node]) -> str:
        """Code for the largest of several values; ``started`` is the largest of others already."""
        names = [self.name(y) for y in (*((started,) if started is not None else ()), *others)]
        while len(names) > 1:
            a, b = names.pop(0), names.pop(0)
            names.append(self.chosen(self.new(f"fcmp ogt {self.real} {a}, {b}"), a, b))
        return names[0]

    def chosen(self, condition: str, a: str, b: str) -> str:
        """Code for a where a condition is true, else b."""
        return self.new(f"select {self.condition} {condition}, {self.real} {a}, {self.real} {b}")

    def end(self, p: Procedure) -> None:
        """Code for the returned value and the checks."""
        value = self.name(p.returned)
        for nodes, what, number in reversed(p.checks):
            names = [self.name(x) for x in nodes]
            if what == "finite":  # x - x is 0 if x is
                names = [self.new(f"fsub {self.real} {x}, {x}") for x in names]
                while len(names) > 1:
                    pairs = zip(names[::2], names[1::2], strict=False)
                    names = [self.new(f"fadd {self.real} {x}, {y}") for x, y in pairs] + names[len(names) // 2 * 2 :]
            for x in names:
                bad = self.new(f"fcmp {FAILED_CHECKS[what]} {self.real} {x}, {self.number(0.0)}")
                value = self.chosen(bad, self.number(number), value)
        self.lines.append(f"ret {self.real} {value}")


def _minimum(o: Lines, a: str, b: str) -> str:
    first = o.new(f"fcmp ole {o.real} {a}, {b}")
    return o.chosen(o.new(f"or {o.condition} {first}, {o.new(f'fcmp uno {o.real} {a}, {a}')}"), a, b)


def _maximum(o: Lines, a: str, b: str) -> str:
    first = o.new(f"fcmp oge {o.real} {a}, {b}")
    return o.chosen(o.new(f"or {o.condition} {first}, {o.new(f'fcmp uno {o.real} {a}, {a}')}"), a, b)


def _sign(o: Lines, a: str) -> str:
    below = o.chosen(o.new(f"fcmp olt {o.real} {a}, {o.number(0.0)}"), o.number(-1.0), o.number(0.0))
    some = o.chosen(o.new(f"fcmp ogt {o.real} {a}, {o.number(0.0)}"), o.number(1.0), below)
    return o.chosen(o.new(f"fcmp uno {o.real} {a}, {a}"), a, some)


def _rounded(o: Lines, a: str) -> str:
    return o.new(f"call double @llvm.floor.f64(double {o.new(f'fadd {o.real} {a}, {o.number(0.5)}')})")


def _choose(o: Lines, x: str, a: str, b: str) -> str:
    return o.chosen(o.new(f"fcmp ogt {o.real} {x}, {o.number(0.0)}"), a, b)


BRANCHING: dict[str, Callable[..., str]] = {
    "minimum": _minimum, "maximum": _maximum, "sign": _sign, "rounded": _rounded, "choose": _choose,
}  # fmt: skip
"""Functions that select a value, as in `math/scalar.py`."""
