"""States at which formulas are tested, and formulas as functions of one array of numbers."""

from __future__ import annotations

import ctypes
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..compiler.by_address import Form, FormulaCode
from ..forces import FORMS
from ..model.force import CoordinateForce, Force
from .frames import Frame, random_motion, record

LAWS = (1.0, -2.0, 0.5)
INPUTS, WRENCH, EFFORT, _ = FORMS


@dataclass(frozen=True)
class State:
    """Arguments of a formula: nested tuples of numbers."""

    form: Form
    function: Any
    arguments: tuple[Any, ...]
    frames: tuple[Frame, Frame] | None = None

    def at(self, x: Sequence[Any]) -> np.ndarray:
        """The formula's numbers for other numbers in its arguments."""
        return np.array(list(flat(self.function(*nest(self.form.shapes, iter(x))))))

    @property
    def numbers(self) -> np.ndarray:
        """The numbers in its arguments."""
        return np.array(list(flat(self.arguments)), float)

    def compiled(self, x: np.ndarray, first_order: bool) -> np.ndarray:
        """The same as `at`, by the code that kernels call."""
        code = FormulaCode(self.function, first_order, self.form)
        dtype = complex if first_order else float
        given, out = np.ascontiguousarray(x, dtype), np.zeros(len(list(flat(shape(self.form.result)))), dtype)
        ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)(code.address)(given.ctypes.data, out.ctypes.data)
        return out


def flat(x: Any) -> Iterator[Any]:
    """The numbers in nested tuples."""
    if isinstance(x, tuple):
        for part in x:
            yield from flat(part)
    else:
        yield x


def nest(shapes: Any, numbers: Iterator[Any]) -> Any:
    """Nested tuples of numbers: lengths as in a `Form`."""
    if isinstance(shapes, tuple):
        return tuple(nest(s, numbers) for s in shapes)
    return tuple(next(numbers) for _ in range(shapes)) if shapes else next(numbers)


def shape(lengths: Any) -> Any:
    """Nested tuples of zeros."""
    return nest(lengths, iter(lambda: 0.0, None))


def states(e: Force, par: Sequence[float], seeds: int = 4) -> list[State]:
    """States of the formulas of an element with these parameters."""
    par = (*par, *(0.0,) * (16 - len(par)))
    laws = tuple(x if law is not None else 0.0 for x, law in zip(LAWS, (*e.laws(), None, None, None), strict=False))
    out = []
    for seed in range(seeds):
        if isinstance(e, CoordinateForce):
            x, rate, load = np.random.default_rng(seed).normal(size=3).tolist()
            told = (abs(laws[0]), 0.0, float(np.sign(rate)))
            out.append(State(EFFORT, type(e).effort, (par, x, rate, told, abs(load))))
            continue
        F, M = random_motion(seed)
        f, m = record(F), record(M)
        out.append(State(INPUTS, type(e).inputs, (par, f, m), (F, M)))
        values = tuple(float(x) for x in e.inputs(par, f, m))
        out.append(State(WRENCH, type(e).wrench, (par, f, m, laws, values), (F, M)))
    return out
