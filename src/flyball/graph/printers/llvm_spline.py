"""The formula of `math/spline.py` for one number, in LLVM's language.

Which piece holds is looked for once for all orders of all splines with the same breaks (a profile's x and y); the
piece that held last is tried first, since what iterates stays near it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ...math.spline import BREAKS

Head = tuple[float, ...]
"""Period, number of breaks, breaks."""


def head(table: Sequence[float]) -> Head:
    """What of a spline's numbers says which piece holds."""
    return tuple(table[: BREAKS + int(table[1])])


def asked(data: Any) -> tuple[Sequence[float], int] | None:
    """Numbers of a spline and the order of its derivative; None if a function is none, or its numbers move."""
    told = getattr(data, "told", {})
    return (told["table"], told["order"]) if "table" in told and not told["moved"] else None


class Pieces:
    """The pieces that one procedure has found.

    Parameters
    ----------
    new : callable
        Writes an instruction, returns the name of its value.
    """

    def __init__(self, new: Any) -> None:
        self.new = new
        self.found: dict[tuple[Head, str], tuple[str, str]] = {}
        self.last: dict[Head, str] = {}
        self.read: dict[tuple[str, str], list[str]] = {}

    def value(self, table: tuple[str, Sequence[float]], order: int, x: str) -> str:
        """A derivative of the spline of that name and those numbers at the number of that name."""
        name, numbers = table
        breaks = head(numbers)
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
        """An operation on two numbers."""
        return self.new(f"{operation} double {a}, {b}")


PIECE = """define internal { i64, double } @piece(ptr %d, double %x, i64 %guess) nounwind {
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
