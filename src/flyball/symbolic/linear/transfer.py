"""Transfer functions whose coefficients are expressions of the parameters."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from ...errors import ModelError, optional
from ...graph.node import Node
from ...graph.values import evaluate
from ...model.words import listing, suggest
from ...results.numbers import with_unit
from .validity import Validity


@dataclass
class TransferFunction:
    """G(s) = num(s) / den(s) from an input to an output.

    Attributes
    ----------
    name : str
        The mechanism's.
    input, output, input_unit, output_unit : str
    s : sympy.Symbol
    num, den : tuple of sympy.Expr
        Coefficients, of the highest power first. What numerator and denominator have in common for all values of the
        parameters is left out.
    cancelled : sympy.Expr
        That common factor, where it has s in it (1 if not): its zeros are eigenvalues of the mechanism that this input
        does not move or this output does not see.
    parameters : dict
        Name -> value.
    balanced_by : dict
        Parameter -> the expression (`Node`) that it stands for, since equilibrium asks for it.
    """

    name: str
    input: str
    output: str
    input_unit: str
    output_unit: str
    s: Any
    num: tuple[Any, ...]
    den: tuple[Any, ...]
    cancelled: Any
    parameters: dict[str, float]
    balanced_by: dict[str, Node] = field(default_factory=dict)
    nodes: tuple[list[Any], list[Any]] = field(default=([], []), repr=False)  # of num and den
    validity: Validity = field(default=Validity(), repr=False)

    @property
    def expression(self) -> Any:
        """num / den as one SymPy expression in s."""
        return self._polynomial(self.num) / self._polynomial(self.den)

    def _polynomial(self, coefficients: Sequence[Any]) -> Any:
        n = len(coefficients) - 1
        return sum((c * self.s ** (n - k) for k, c in enumerate(coefficients)), 0 * self.s)

    def at(self, **parameters: float) -> tuple[np.ndarray, np.ndarray]:
        """Coefficients of numerator and denominator in numbers, that of the denominator's highest power being 1.

        Raises
        ------
        ModelError
            If there is no such parameter, equilibrium says what it is, or the point is no equilibrium with it.
        """
        told = checked(self, parameters)
        num, den = (np.array(evaluate(x, told), float) for x in self.nodes)
        return num / den[0], den / den[0]

    def zeros(self, **parameters: float) -> np.ndarray:
        """Zeros [1/s]."""
        return np.roots(self.at(**parameters)[0])

    def poles(self, **parameters: float) -> np.ndarray:
        """Poles [1/s]."""
        return np.roots(self.at(**parameters)[1])

    def response_at(self, omega: Sequence[float], **parameters: float) -> np.ndarray:
        """Frequency response G(i omega) at angular frequencies [rad/s], complex."""
        num, den = self.at(**parameters)
        s = 1j * np.atleast_1d(np.asarray(omega, float))
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.polyval(num, s) / np.polyval(den, s)

    # -- what pictures of linear models ask

    large = False
    period = None  # in s, not in z

    @cached_property
    def inputs(self) -> tuple[str, ...]:
        """The input."""
        return (self.input,)

    @cached_property
    def outputs(self) -> tuple[str, ...]:
        """The output."""
        return (self.output,)

    @property
    def input_units(self) -> tuple[str, ...]:
        """Its unit."""
        return (self.input_unit,)

    @property
    def output_units(self) -> tuple[str, ...]:
        """Its unit."""
        return (self.output_unit,)

    @property
    def eigenvalues(self) -> np.ndarray:
        """The poles."""
        return self.poles()

    def input_index(self, name: str | None) -> int:
        """Zero, if that is the input."""
        return self._only("input", self.input, name)

    def output_index(self, name: str | None) -> int:
        """Zero, if that is the output."""
        return self._only("output", self.output, name)

    def _only(self, what: str, own: str, name: str | None) -> int:
        if name not in (None, own):
            raise ModelError(f"there is no {what} {name!r}: this transfer function's is {own!r}")
        return 0

    def transfer(self, input: str | None = None, output: str | None = None) -> tuple[np.ndarray, np.ndarray, float]:
        """Zeros, poles [1/s] and gain: G(s) = gain prod(s - zeros) / prod(s - poles)."""
        self.input_index(input), self.output_index(output)
        num, den = self.at()
        return np.roots(num), np.roots(den), float(num[0])

    def response(self, omega: Sequence[float], input: str | None = None, output: str | None = None) -> np.ndarray:
        """As `response_at`, with the parameters' own values."""
        self.input_index(input), self.output_index(output)
        return self.response_at(omega)

    def bode(self, omega: Sequence[float] | None = None, path: str | os.PathLike | None = None) -> Any:
        """Bode plot with the parameters' own values; returns the Matplotlib figure, or writes it to ``path``."""
        from ...view.linear import bode

        return bode(self, None, None, omega, path)  # type: ignore[arg-type]

    def to_control(self, **parameters: float) -> Any:
        """As ``control.TransferFunction``, in numbers.

        Raises
        ------
        ImportError
            If the package ``control`` is not installed.
        """
        control = optional("control", "control")
        names = {"inputs": [_plain(self.input)], "outputs": [_plain(self.output)], "name": _plain(self.name)}
        return control.tf(*self.at(**parameters), **names)

    # -- shown

    def lines(self) -> list[tuple[str, str]]:
        """Labels and texts for people."""
        out = [("from", with_unit(self.input, self.input_unit)), ("to", with_unit(self.output, self.output_unit))]
        if all(c == 0 for c in self.num):
            return [*out, ("transfer function", "0: to first order the output does not answer to this input")]
        out += [("numerator", written(self._terms(self.num))), ("denominator", written(self._terms(self.den)))]
        if self.cancelled != 1:
            out.append(("cancelled", f"{self.cancelled}: eigenvalues that are not between this input and this output"))
        out += [("equilibrium", f"{k} is the value that balances") for k in self.balanced_by]
        return out

    def _terms(self, coefficients: Sequence[Any]) -> list[tuple[str, str]]:
        n = len(coefficients) - 1
        return [(str(c), _power(n - k)) for k, c in enumerate(coefficients) if c != 0]

    def latex(self) -> str:
        """G(s) as LaTeX."""
        above, below = (self._latex(x) for x in (self.num, self.den))
        return rf"G(s) = \frac{{{above}}}{{{below}}}"

    def _latex(self, coefficients: Sequence[Any]) -> str:
        from sympy import Add, latex

        n = len(coefficients) - 1
        parts = []
        for k, c in enumerate(coefficients):
            if c == 0:
                continue
            power = "" if n == k else "s" if n - k == 1 else f"s^{{{n - k}}}"
            text = latex(c)
            if c == 1 and power:
                text = ""
            elif c == -1 and power:
                text = "-"
            elif isinstance(c, Add) and power:
                text = rf"\left({text}\right)"
            parts.append(f"{text} {power}".strip())
        return " + ".join(parts).replace("+ -", "- ") or "0"

    def _repr_latex_(self) -> str:
        return f"$\\displaystyle {self.latex()}$"

    def __repr__(self) -> str:
        return "\n".join(f"{a}: {b}" for a, b in self.lines())


def checked(f: Any, parameters: Mapping[str, float]) -> dict[str, float]:
    """Values by name; refuses parameters that there are not, those that equilibrium tells, and another point."""
    for name in parameters:
        if name in f.balanced_by:
            raise ModelError(f"{name!r} has the value with which the mechanism is in equilibrium")
        if name not in f.parameters:
            known = list(f.parameters)
            raise ModelError(f"{f.name!r} has no parameter {name!r}{suggest(name, known)}; {listing(known)}")
    values = {k: float(x) for k, x in parameters.items()}
    f.validity.refuse(f.name, values)
    return values


def written(terms: Sequence[tuple[str, str]]) -> str:
    """A polynomial in s: (coefficient, power) terms."""
    out = ""
    for c, power in terms:
        sign, c = ("-", c[1:]) if c.startswith("-") and not _is_sum(c) else ("+", c)
        c = f"({c})" if _is_sum(c) and power else c
        text = power if c == "1" and power else f"{c}*{power}" if power else c
        out += f" {sign} {text}" if out else f"-{text}" if sign == "-" else text
    return out or "0"


def _is_sum(text: str) -> bool:
    """Whether there is a sum outside of brackets."""
    depth = 0
    for k, c in enumerate(text):
        depth += (c == "(") - (c == ")")
        if depth == 0 and k and c in "+-" and text[k - 1] == " ":
            return True
    return False


def _power(n: int) -> str:
    return "" if n == 0 else "s" if n == 1 else f"s**{n}"


def _plain(name: str) -> str:
    return "".join(c if c.isalnum() else "_" for c in name)
