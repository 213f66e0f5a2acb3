"""Machine code of recursive dynamics for one mechanism: four states at a time, in lanes of vector registers.

The formulas of `engine.recursive_dynamics` run on expressions; masses, lengths and gravity are numbers in the code.
Every lane performs the operations of one state, so that a state's results do not depend on the others. Sines and
cosines of four arguments are computed together: Cody and Waite's reduction, and the polynomials of fdlibm (Sun
Microsystems, 1993).
"""

from __future__ import annotations

import contextlib
import ctypes
import hashlib
from collections.abc import Callable, Iterator, Sequence
from functools import lru_cache, partial
from typing import Any, NamedTuple

import numpy as np

from ..compiler.object_code import LoadedCode, object_code_of_text
from ..compiler.object_files import HASH_DIGITS, cache_folder, mark_used, read_object, remove_oldest, write_object
from ..engine.batch_dynamics import (
    FORWARD_DERIVATIVES,
    FORWARD_DYNAMICS,
    INVERSE_DERIVATIVES,
    INVERSE_DYNAMICS,
    MASS_MATRIX,
    perform_at_state,
)
from ..engine.entry_point import zero_work
from ..engine.recursive_dynamics import VelocityPaths, factor_mass_matrix, solve_mass_matrix, tree_dynamics
from ..errors import PerformanceNotice, warn_user
from ..expression_graph.graph import Graph, Node
from ..expression_graph.printers.llvm import (
    INFIX,
    Lines,
    Module,
    Place,
    Procedure,
    UnsupportedOperation,
    constant,
    ordered_operations,
)
from ..tables.structure_definition import Structure
from ..tables.table_definitions import System, named_arrays
from .machine_code import sources_digest, target_description

LANES = 4
TASKS = (INVERSE_DYNAMICS, MASS_MATRIX, FORWARD_DYNAMICS, INVERSE_DERIVATIVES, FORWARD_DERIVATIVES)
"""Tasks of `engine.batch_dynamics` that code is generated for."""
MAX_OPERATIONS = 120_000
"""Operations up to which code is generated: LLVM needs about a minute for these."""
SECONDS_PER_SQUARE = 7e-9
"""Seconds of compiling per operation squared, measured at 20,000 to 50,000 operations."""
LARGEST_ANGLE = 1e5
"""Angles [rad] up to which the reduction of arguments is exact enough; those of larger ones are not a number."""
VECTOR = f"<{LANES} x double>"
PAIR = f"{{ {VECTOR}, {VECTOR} }}"
FACTOR = "factor"
"""Base whose entries are vectors: the factor of the mass matrix."""
BASES = ("q", "v", "given", "first", "second", "third")
ARGUMENTS = ", ".join(f"ptr %{base}" for base in BASES)


class BatchCode:
    """Machine code of a task."""

    def __init__(self, code: bytes) -> None:
        self._loaded = LoadedCode(code)
        kind = ctypes.CFUNCTYPE(ctypes.c_int64, *[ctypes.c_void_p] * len(BASES), ctypes.c_int64)
        self._call = kind(self._loaded.address("batch"))

    def bound(self, states: Sequence[np.ndarray], results: Sequence[np.ndarray]) -> Callable[[], int]:
        """A call with these arrays: it returns the number of states before the first that fails, or its block."""
        padded = (*states, *[states[0]] * (3 - len(states)), *results, *[results[0]] * (3 - len(results)))
        call = partial(self._call, *[x.ctypes.data for x in padded], len(states[0]))
        call.in_memory = (self, padded)  # type: ignore[attr-defined]  # code and arrays, as long as the call exists
        return call


class ForwardDerivativesCode:
    """Derivatives of forward dynamics: accelerations, derivatives of inverse dynamics, solves with the mass matrix.

    These are three codes, since one for all would take LLVM too long.
    """

    def __init__(self, forward: BatchCode, inverse: BatchCode, solver: BatchCode) -> None:
        self._forward, self._inverse, self._solver = forward, inverse, solver

    def bound(self, states: Sequence[np.ndarray], results: Sequence[np.ndarray]) -> Callable[[], int]:
        """As `BatchCode.bound`."""
        q, v, _ = states
        a = np.empty_like(v)
        forward, inverse = self._forward.bound(states, [a]), self._inverse.bound([q, v, a], results)
        solve = self._solver.bound(states, results)

        def call() -> int:
            done = forward()
            if done == len(q):
                inverse()
                solve()
            return done

        return call


def batch_code(s: Structure, S: System, V: VelocityPaths, task: int) -> BatchCode | ForwardDerivativesCode | None:
    """Code of a task, from disk or generated now; None if the mechanism is too large."""
    if task == FORWARD_DERIVATIVES:
        parts = []
        for part in (FORWARD_DYNAMICS, INVERSE_DERIVATIVES, task):
            code = _single_code(s, S, V, part)
            if code is None:
                return None
            parts.append(code)
        return ForwardDerivativesCode(*parts)
    return _single_code(s, S, V, task)


def _single_code(s: Structure, S: System, V: VelocityPaths, task: int) -> BatchCode | None:
    path = None
    if (folder := cache_folder()) is not None:
        path = folder / f"batch-{_key(S, task)}.o"
        if (code := read_object(path)) is not None:
            mark_used(path)
            with contextlib.suppress(RuntimeError):  # LLVM's error for code of another machine
                return BatchCode(code)
    text = solver_text(V) if task == FORWARD_DERIVATIVES else batch_text(s, S, V, task)
    if text is None:
        return None
    code = object_code_of_text(text)
    if path is not None and folder is not None:
        with contextlib.suppress(OSError):  # a failure costs only time
            write_object(path, code)
            remove_oldest(folder)
    return BatchCode(code)


def _key(S: System, task: int) -> str:
    digest = hashlib.sha256(target_description().encode() + sources_digest() + f"{task} {LANES}".encode())
    for name, x in (*named_arrays(S.tree), *named_arrays(S.bodies), ("gravity", S.gravity)):
        digest.update(f"{name} {x.shape} {x.dtype}".encode() + np.ascontiguousarray(x).tobytes())
    return digest.hexdigest()[:HASH_DIGITS]


class _States(NamedTuple):
    """Arrays of expressions in place of `engine.batch_dynamics.BatchArrays`."""

    q: np.ndarray
    v: np.ndarray
    given: np.ndarray
    frame: None
    first: np.ndarray
    second: np.ndarray
    third: np.ndarray


def batch_text(s: Structure, S: System, V: VelocityPaths, task: int) -> str | None:
    """Code of a task as text; None if there are too many operations."""
    graph = Graph(rounded=True)
    widths = {"q": s.nq, "v": s.nv, "given": s.nv}
    reads: dict[int, Place] = {}

    def symbols(base: str) -> np.ndarray:
        out = np.zeros((1, widths[base]), object)
        for k in range(widths[base]):
            node = graph.symbol(f"{base}[{k}]")
            out[0, k], reads[node.index] = node, (base, k)
        return out

    square = task not in (INVERSE_DYNAMICS, FORWARD_DYNAMICS)
    results = [np.full((1, s.nv if square else 1, s.nv), 0.0, object) for _ in range(3)]
    bodies = type(S.bodies)(*(x.astype(object) for x in S.bodies))
    numbers = S._replace(bodies=bodies, gravity=S.gravity.astype(object))
    D = tree_dynamics(len(S.tree.parent), s.nq, s.nv, object)
    states = _States(symbols("q"), symbols("v"), symbols("given"), None, *results)
    perform_at_state(numbers, zero_work(s, S, np.dtype(object)), V, D, states, 0, task)
    count = 3 if task == INVERSE_DERIVATIVES else 1
    stores = [((base, k), x) for base, out in zip(BASES[3:], results[:count], strict=False)
              for k, x in enumerate(out.ravel())]  # fmt: skip
    granted, graph.granted = graph.granted, []
    procedure = Procedure("block", reads, stores, 0.0, [([x], what, 1.0) for x, what in granted])
    operations = len(ordered_operations(procedure.results, reads))
    if operations > MAX_OPERATIONS:
        return None
    if (seconds := SECONDS_PER_SQUARE * operations**2) > 2.0:
        what = f"generating code of recursive dynamics for {s.model.name!r}, once: about {round(seconds)} s"
        warn_user(what, PerformanceNotice)
    widths |= dict.fromkeys(BASES[3:], s.nv * (s.nv if square else 1))
    module = Module(f"{ARGUMENTS}, i64 %stride", partial(_lane_base, widths), _VectorLines)
    module.add(procedure)
    return "\n\n".join([str(module), sine_and_cosine(), _loop(widths)]) + "\n"


def solver_text(V: VelocityPaths) -> str:
    """Code that turns derivatives of forces and a mass matrix M into those of accelerations, -M^-1 times, and M^-1."""
    n = len(V.body)
    graph = Graph(rounded=True)
    D = tree_dynamics(0, 0, n, object)
    reads: dict[int, Place] = {}
    entries = [(d, e) for d in range(n) for e in _path(V, d)]
    for d, e in entries:
        D.mass[d, e] = graph.symbol(f"M[{d}, {e}]")
        reads[D.mass[d, e].index] = "x", d * n + e
    factor_mass_matrix(V, D)
    stores: list[tuple[Place, Any]] = [((FACTOR, k), D.mass[at]) for k, at in enumerate(entries)]
    stores += [(("x", k), x) for k, x in enumerate(-np.eye(n).ravel())]  # the solution of this is M^-1
    widths = {"x": n * n}
    module = Module("ptr %x, ptr %factor, i64 %stride", partial(_lane_base, widths), _VectorLines)
    module.add(Procedure("factor", reads, stores))
    X, reads = np.zeros((n, 1), object), {}
    for k, at in enumerate(entries):
        D.mass[at] = graph.symbol(f"L[{k}]")
        reads[D.mass[at].index] = FACTOR, k
    for d in range(n):
        X[d, 0] = graph.symbol(f"x[{d}]")
        reads[X[d, 0].index] = "x", d * n
    solve_mass_matrix(V, D, X, 0)
    module.add(Procedure("column", reads, [(("x", d * n), -x) for d, x in enumerate(X[:, 0])]))
    columns = [line for base in BASES[3:] for line in (
        f"  %{base}.c = getelementptr double, ptr %{base}, i64 %c",
        f"  call {VECTOR} @column(ptr %{base}.c, ptr %factor, i64 %stride)",
    )]  # fmt: skip
    block = "\n".join([
        f"define {VECTOR} @block({ARGUMENTS}, i64 %stride) nounwind {{",
        "entry:", f"  %factor = alloca {VECTOR}, i64 {len(entries)}",
        f"  call {VECTOR} @factor(ptr %third, ptr %factor, i64 %stride)", "  br label %head",
        "head:", "  %c = phi i64 [ 0, %entry ], [ %next, %body ]",
        f"  %more = icmp slt i64 %c, {n}", "  br i1 %more, label %body, label %done",
        "body:", *columns, "  %next = add i64 %c, 1", "  br label %head",
        "done:", f"  ret {VECTOR} zeroinitializer", "}",
    ])  # fmt: skip
    return "\n\n".join([str(module), block, _loop(dict.fromkeys(BASES, 0) | dict.fromkeys(BASES[3:], n * n))]) + "\n"


def _path(V: VelocityPaths, d: int) -> Iterator[int]:
    """A velocity and those on its path to ground."""
    while d >= 0:
        yield d
        d = int(V.previous[d])


def _lane_base(widths: dict[str, int], lane_of: str) -> list[str]:
    """Lines that compute the address of a lane's row; the factor has vectors, and no rows."""
    if lane_of == FACTOR:
        return []
    base, lane = lane_of.split(".")
    return [
        f"%{lane_of}.rows = mul i64 %stride, {int(lane) * widths[base]}",
        f"%{lane_of} = getelementptr double, ptr %{base}, i64 %{lane_of}.rows",
    ]


def _loop(widths: dict[str, int]) -> str:
    """The function over all states: blocks of `LANES` states, then single ones, in all lanes at a time."""
    rows = [line for base in BASES for line in (
        f"  %{base}.offset = mul i64 %i, {widths[base]}",
        f"  %{base}.at = getelementptr double, ptr %{base}, i64 %{base}.offset",
    )]  # fmt: skip
    given = ", ".join(f"ptr %{base}.at" for base in BASES)
    return "\n".join([
        f"define i64 @batch({ARGUMENTS}, i64 %n) nounwind {{",
        "entry:", "  br label %head",
        "head:", "  %i = phi i64 [ 0, %entry ], [ %next, %on ]",
        "  %left = sub i64 %n, %i", "  %more = icmp sgt i64 %left, 0", "  br i1 %more, label %body, label %done",
        "body:", f"  %full = icmp sge i64 %left, {LANES}",
        "  %stride = select i1 %full, i64 1, i64 0", f"  %count = select i1 %full, i64 {LANES}, i64 1",
        *rows, f"  %status = call {VECTOR} @block({given}, i64 %stride)",
        f"  %bad = fcmp one {VECTOR} %status, zeroinitializer",
        f"  %any = call i1 @llvm.vector.reduce.or.v{LANES}i1(<{LANES} x i1> %bad)",
        "  br i1 %any, label %done, label %on",
        "on:", "  %next = add i64 %i, %count", "  br label %head",
        "done:", "  ret i64 %i", "}",
        f"declare i1 @llvm.vector.reduce.or.v{LANES}i1(<{LANES} x i1>)",
    ])  # fmt: skip


class _VectorLines(Lines):
    """Lines that compute with vectors: lane k reads and writes at row k of each array, or all at row 0."""

    real = VECTOR
    condition = f"<{LANES} x i1>"

    def __init__(self, module: Module, reads: Any) -> None:
        super().__init__(module, reads)
        self.sine_cosine_calls: dict[str, str] = {}

    def number(self, x: float) -> str:
        """A number in all lanes."""
        return f"<{', '.join([f'double {constant(x)}'] * LANES)}>"

    def _vector_address(self, place: Place) -> str:
        self.used.add(FACTOR)
        return self.new(f"getelementptr inbounds {VECTOR}, ptr %{FACTOR}, i64 {place[1]}")

    def _lane_address(self, place: Place, lane: int) -> str:
        return self.address((f"{place[0]}.{lane}", place[1]))

    def read(self, place: Place) -> str:
        if place[0] == FACTOR:
            return self.new(f"load {VECTOR}, ptr {self._vector_address(place)}, {self.module.scope(FACTOR)}")
        out = "poison"
        for lane in range(LANES):
            x = self.new(f"load double, ptr {self._lane_address(place, lane)}, {self.module.scope(place[0])}")
            out = self.new(f"insertelement {VECTOR} {out}, double {x}, i64 {lane}")
        return out

    def put(self, place: Place, name: str) -> None:
        """Code that stores the lanes."""
        if place[0] == FACTOR:
            at = self._vector_address(place)
            self.lines.append(f"store {VECTOR} {name}, ptr {at}, {self.module.scope(FACTOR)}")
            return
        for lane in range(LANES):
            x = self.new(f"extractelement {VECTOR} {name}, i64 {lane}")
            at = self._lane_address(place, lane)
            self.lines.append(f"store double {x}, ptr {at}, {self.module.scope(place[0])}")

    def operation(self, x: Node) -> str:
        if x.op in ("sin", "cos"):
            angle = self.name(x.args[0])
            if angle not in self.sine_cosine_calls:
                self.sine_cosine_calls[angle] = self.new(f"call {PAIR} @sine_and_cosine({VECTOR} {angle})")
            return self.new(f"extractvalue {PAIR} {self.sine_cosine_calls[angle]}, {int(x.op == 'cos')}")
        if x.op == "sqrt":
            return self.new(f"call {VECTOR} @llvm.sqrt.v{LANES}f64({VECTOR} {self.name(x.args[0])})")
        if x.op not in INFIX:
            raise UnsupportedOperation(x.op)
        return super().operation(x)


HALF_PI = (1.57079632673412561417, 6.07710050630396597660e-11, 2.02226624871116645580e-21, 8.47842766036889956997e-32)
"""pi/2 in parts of 33 bits, whose products with whole numbers below 2^20 are exact; and the rest."""
SINE = (-1.66666666666666324348e-01, 8.33333333332248946124e-03, -1.98412698298579493134e-04,
        2.75573137070700676789e-06, -2.50507602534068634195e-08, 1.58969099521155010221e-10)  # fmt: skip
COSINE = (4.16666666666666019037e-02, -1.38888888888741095749e-03, 2.48015872894767294178e-05,
          -2.75573143513906633035e-07, 2.08757232129817482790e-09, -1.13596475577881948265e-11)  # fmt: skip
"""Coefficients of fdlibm's polynomials on [-pi/4, pi/4]."""


@lru_cache(maxsize=1)
class _Instructions:
    """Instructions on vectors of numbers, in static single assignment: each method returns the name of its result."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self.add, self.sub, self.mul = (partial(self._two, operation) for operation in ("fadd", "fsub", "fmul"))

    def new(self, text: str) -> str:
        self.lines.append(f"  %r{len(self.lines)} = {text}")
        return f"%r{len(self.lines) - 1}"

    def _two(self, operation: str, a: str, b: str) -> str:
        return self.new(f"{operation} {VECTOR} {a}, {b}")

    def exact_difference(self, a: str, b: str) -> tuple[str, str]:
        """a - b, rounded, and its rounding error (Knuth)."""
        s = self.sub(a, b)
        back = self.sub(s, a)
        return s, self.sub(self.sub(a, self.sub(s, back)), self.add(b, back))

    def polynomial(self, z: str, coefficients: Sequence[float]) -> str:
        """Polynomial in z by Horner's rule, the constant coefficient first."""
        total = _splat(coefficients[-1])
        for c in coefficients[-2::-1]:
            total = self.add(_splat(c), self.mul(z, total))
        return total

    def where(self, condition: str, a: str, b: str) -> str:
        return self.new(f"select <{LANES} x i1> {condition}, {VECTOR} {a}, {VECTOR} {b}")

    def compared(self, n: str, x: float, how: str = "oeq") -> str:
        return self.new(f"fcmp {how} {VECTOR} {n}, {_splat(x)}")


def _splat(x: float) -> str:
    """A vector with the same number in all lanes."""
    return f"<{', '.join([f'double {constant(x)}'] * LANES)}>"


def sine_and_cosine() -> str:
    """Function for the sines and cosines of a vector of angles up to `LARGEST_ANGLE`."""
    o = _Instructions()
    new, add, sub, mul, where = o.new, o.add, o.sub, o.mul, o.where
    k = new(f"call {VECTOR} @llvm.rint.v{LANES}f64({VECTOR} {mul('%x', _splat(2.0 / np.pi))})")
    first, second, third, rest = (mul(k, _splat(part)) for part in HALF_PI)
    r, error = o.exact_difference(sub("%x", first), second)
    y, tail = o.exact_difference(r, sub(third, error))
    tail = sub(tail, rest)
    z = mul(y, y)
    cube = mul(z, y)
    inner = sub(mul(_splat(0.5), tail), mul(cube, o.polynomial(z, SINE[1:])))
    sine = sub(y, sub(sub(mul(z, inner), tail), mul(cube, _splat(SINE[0]))))
    half = mul(_splat(0.5), z)
    w = sub(_splat(1.0), half)
    ends = sub(mul(z, mul(z, o.polynomial(z, COSINE))), mul(y, tail))
    cosine = add(w, add(sub(sub(_splat(1.0), w), half), ends))
    quarter = new(f"call {VECTOR} @llvm.floor.v{LANES}f64({VECTOR} {mul(k, _splat(0.25))})")
    n = sub(k, mul(_splat(4.0), quarter))  # 0, 1, 2, 3: the quadrant
    one, three = o.compared(n, 1.0), o.compared(n, 3.0)
    odd = new(f"or <{LANES} x i1> {one}, {three}")
    near = new(
        f"fcmp ole {VECTOR} {new(f'call {VECTOR} @llvm.fabs.v{LANES}f64({VECTOR} %x)')}, {_splat(LARGEST_ANGLE)}"
    )
    not_a_number = f"<{', '.join(['double 0x7FF8000000000000'] * LANES)}>"
    s, c = (where(near, a, not_a_number) for a in (where(odd, cosine, sine), where(odd, sine, cosine)))
    upper = o.compared(n, 2.0, "oge")
    middle = new(f"or <{LANES} x i1> {one}, {o.compared(n, 2.0)}")
    s = where(upper, new(f"fneg {VECTOR} {s}"), s)
    c = where(middle, new(f"fneg {VECTOR} {c}"), c)
    sine_only = new(f"insertvalue {PAIR} poison, {VECTOR} {s}, 0")
    pair = new(f"insertvalue {PAIR} {sine_only}, {VECTOR} {c}, 1")
    declared = "\n".join(
        f"declare {VECTOR} @llvm.{name}.v{LANES}f64({VECTOR})" for name in ("rint", "floor", "sqrt", "fabs")
    )
    head = f"define internal {PAIR} @sine_and_cosine({VECTOR} %x) nounwind {{"
    return "\n".join([declared, head, *o.lines, f"  ret {PAIR} {pair}", "}"])
