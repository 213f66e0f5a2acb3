"""States at which formulas are tested, and formulas as functions of one array of numbers."""

from __future__ import annotations

import ctypes
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..compiler.by_address import FormulaCode, Signature
from ..constraints.blocks import ConstraintRow
from ..constraints.registry import SIGNATURES as ROWS
from ..forces import SIGNATURES
from ..model.force import CoordinateForce, Force
from .frames import Frame, random_motion, record

LAWS = (1.0, -2.0, 0.5)
SEEDS = range(4)
INPUTS, WRENCH, EFFORT, _ = SIGNATURES
(ROW,) = ROWS


@dataclass(frozen=True)
class State:
    """A formula and its arguments, nested tuples of numbers.

    Attributes
    ----------
    signature : Signature
    function : function
    arguments : tuple
    frames : tuple of Frame, optional
        The frames F and M that the arguments were made from.
    row : ConstraintRow, optional
        The row that the formula is of.
    """

    signature: Signature
    function: Any
    arguments: tuple[Any, ...]
    frames: tuple[Frame, Frame] | None = None
    row: ConstraintRow | None = None

    def at(self, x: Sequence[Any]) -> np.ndarray:
        """All numbers of the result, with other numbers in the arguments."""
        return np.array(list(flat(self.function(*nest(self.signature.lengths, iter(x))))))

    @property
    def numbers(self) -> np.ndarray:
        """All numbers in the arguments."""
        return np.array(list(flat(self.arguments)), float)

    def compiled(self, x: np.ndarray, first_order: bool) -> np.ndarray:
        """The same as `at`, computed by the machine code that kernels call."""
        code = FormulaCode(self.function, first_order, self.signature)
        dtype = complex if first_order else float
        given, out = np.ascontiguousarray(x, dtype), np.zeros(len(list(flat(zeros(self.signature.result)))), dtype)
        ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)(code.address)(given.ctypes.data, out.ctypes.data)
        return out


def flat(x: Any) -> Iterator[Any]:
    """The numbers in nested tuples."""
    if isinstance(x, tuple):
        for part in x:
            yield from flat(part)
    else:
        yield x


def nest(lengths: Any, numbers: Iterator[Any]) -> Any:
    """Nested tuples of numbers, with lengths as in a `Signature`."""
    if isinstance(lengths, tuple):
        return tuple(nest(n, numbers) for n in lengths)
    return tuple(next(numbers) for _ in range(lengths)) if lengths else next(numbers)


def zeros(lengths: Any) -> Any:
    """Nested tuples of zeros."""
    return nest(lengths, iter(lambda: 0.0, None))


def force_states(e: Force, par: Sequence[float]) -> list[State]:
    """States of the formulas of a force with these parameters."""
    par = (*par, *(0.0,) * (16 - len(par)))
    laws = tuple(x if law is not None else 0.0 for x, law in zip(LAWS, (*e.laws(), None, None, None), strict=False))
    out = []
    for seed in SEEDS:
        if isinstance(e, CoordinateForce):
            x, rate, load = np.random.default_rng(seed).normal(size=3).tolist()
            given = (abs(laws[0]), 0.0, float(np.sign(rate)))
            out.append(State(EFFORT, type(e).effort, (par, x, rate, given, abs(load))))
            continue
        F, M = random_motion(seed)
        f, m = record(F), record(M)
        out.append(State(INPUTS, type(e).inputs, (par, f, m), (F, M)))
        values = tuple(float(x) for x in e.inputs(par, f, m))
        out.append(State(WRENCH, type(e).wrench, (par, f, m, laws, values), (F, M)))
    return out


def row_states(row: ConstraintRow, par: Sequence[float]) -> list[State]:
    """States of the formula of a constraint row with these parameters."""
    pairs = [random_motion(seed) for seed in SEEDS]
    return [State(ROW, type(row).row, (tuple(par), record(F), record(M)), (F, M), row) for F, M in pairs]
