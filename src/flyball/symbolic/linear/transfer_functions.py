"""Transfer functions whose coefficients are expressions of the parameters, by Cramer's rule without division.

With the changes x(s) of positions, u = (s - N) x of velocities, z of the controller states, l of the multipliers, w of
the inputs,

    [(M s + D)(s - N) + K    r_z      R] [x]     [r_w]
    [s_u (s - N) + s_x       s_z - s  0] [z] = - [s_w] w,    y = (y_a s + y_v)(s - N) x + y_x x + y_z z + y_l l + y_w w
    [G, or G (s - N) + V     0        0] [l]     [g_w, n_w]

The transfer function is y / w = det [P b; c d] / det P. The determinant of P is the characteristic polynomial, times a
without s.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from ...derivatives.linearized_equations import product
from ...errors import ModelError, import_optional
from ...expression_graph.graph import Node, evaluate, zero_objects
from ...model.messages import listing, suggest
from ...results.wording import with_unit
from .operating_point import Validity
from .polynomials import PolynomialRing, determinant
from .state_matrices import Freedoms, Perturbed, TracedMechanism, replaced


@dataclass
class PolynomialPencil:
    """The polynomial matrix P(s) with a column for every input and a row for every output, as rows of polynomials."""

    ring: PolynomialRing
    P: list[list[Any]]  # (n, n + inputs)
    y: list[list[Any]]  # (outputs, n + inputs), times their denominators
    below: list[Any]  # denominators of the outputs
    what: str

    def characteristic(self) -> Any:
        """Determinant of P."""
        n = len(self.P)
        return determinant([row[:n] for row in self.P], self.ring, self.what)

    def numerator(self, i: int, k: int) -> Any:
        """Numerator of the transfer function from input i to output k, times the denominator of the output."""
        n = len(self.P)
        rows = [[*row[:n], row[n + i]] for row in [*self.P, self.y[k]]]
        return determinant(rows, self.ring, self.what)


def polynomial_pencil(m: TracedMechanism, p: Perturbed, f: Freedoms, positive: list[str]) -> PolynomialPencil:
    """Convert linear equations to polynomials, with independent constraint rows only."""
    kept = np.setdiff1d(np.arange(len(m.names)), f.held)
    ring = PolynomialRing(_powers(p, f, kept, m), m.model.name, positive)
    s = ring.s_element
    P, below = [], []
    p0, p1, p2, y0, y1, y2 = ring.matrices
    for row in (*(p0 + p1 * s + p2 * (s * s)), *(y0 + y1 * s + y2 * (s * s))):
        common = ring.ring.one
        for x in row:
            common = common.lcm(x.denom)
        below.append(common)
        P.append(ring.cleared(list(row)))
    n = len(p0)
    return PolynomialPencil(ring, P[:n], P[n:], below[n:], m.model.name)


def _powers(p: Perturbed, f: Freedoms, independent: np.ndarray, m: TracedMechanism) -> list[np.ndarray]:
    """Coefficients of the powers of s in all equations (of motion, of controllers, constraints) and in the outputs."""
    by, l, nz = p.by, f.rows_v, len(m.s)
    holonomic = m.holonomic[l][:, None]
    on_positions = {"v": zero_objects(*by["nv"].shape), "x": by["nv"], "w": by["gw"]}

    def equations(column: str) -> np.ndarray:
        n = np.where(holonomic, on_positions.get(column, by[f"n{column}"])[l], by[f"n{column}"][l])
        return np.vstack([by[f"r{column}"][independent], by[f"s{column}"], n])

    def powers(a: np.ndarray, v: np.ndarray, x: np.ndarray, *others: np.ndarray) -> list[np.ndarray]:
        """Coefficients of (a s + v) (s - N) + x, followed by columns of states, multipliers and inputs."""
        z, lam, w = others
        more = np.hstack([z, lam[:, l], w])
        first, zeroth = v - product(a, p.N), x - product(v, p.N)
        none = zero_objects(*more.shape)
        return [np.hstack([X[:, independent], last]) for X, last in ((zeroth, more), (first, none), (a, none))]

    P = powers(*map(equations, "avxzlw"))
    rates = len(independent) + np.arange(nz)
    P[1][rates, rates] = P[1][rates, rates] - 1.0
    return [replaced(X, [(s, 0.0) for s in m.added]) for X in (*P, *powers(*(by[f"y{c}"] for c in "avxzlw")))]


@dataclass
class TransferFunction:
    """G(s) = num(s) / den(s) from an input to an output.

    Attributes
    ----------
    name : str
        Name of the mechanism.
    input, output, input_unit, output_unit : str
    s : sympy.Symbol
    num, den : tuple of sympy.Expr
        Coefficients, the highest power first, without common factors of numerator and denominator (for all parameter
        values).
    cancelled : sympy.Expr
        The common factor if it contains s, else 1. Its zeros are eigenvalues of the mechanism that this input does not
        excite or that do not affect this output.
    parameters : dict
        Name -> value.
    balanced_by : dict
        Parameter -> expression (`Node`) of the others, solved from the conditions of equilibrium.
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
    nodes: tuple[list[Any], list[Any]] = field(default=([], []), repr=False)  # coefficients of num and den
    validity: Validity = field(default=Validity(), repr=False)

    @property
    def expression(self) -> Any:
        """num / den as one SymPy expression in s."""
        return self._polynomial(self.num) / self._polynomial(self.den)

    def _polynomial(self, coefficients: Sequence[Any]) -> Any:
        n = len(coefficients) - 1
        return sum((c * self.s ** (n - k) for k, c in enumerate(coefficients)), 0 * self.s)

    def at(self, **parameters: float) -> tuple[np.ndarray, np.ndarray]:
        """Numerical coefficients of numerator and denominator; the denominator's highest one is 1.

        Raises
        ------
        ModelError
            If a parameter is unknown or determined by equilibrium, or the point is no equilibrium with it.
        """
        told = checked_values(self, parameters)
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

    # -- interface of the plots of linear models

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
        """Unit of the input."""
        return (self.input_unit,)

    @property
    def output_units(self) -> tuple[str, ...]:
        """Unit of the output."""
        return (self.output_unit,)

    @property
    def eigenvalues(self) -> np.ndarray:
        """The poles."""
        return self.poles()

    def input_index(self, name: str | None) -> int:
        """Index of the input, 0; refuses other names."""
        return self._only("input", self.input, name)

    def output_index(self, name: str | None) -> int:
        """Index of the output, 0; refuses other names."""
        return self._only("output", self.output, name)

    def _only(self, what: str, single: str, name: str | None) -> int:
        if name not in (None, single):
            raise ModelError(f"there is no {what} {name!r}: this transfer function's is {single!r}")
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
        from ...view.linear_plots import bode_plot

        return bode_plot(self, None, None, omega, path)  # type: ignore[arg-type]

    def to_control(self, **parameters: float) -> Any:
        """Numerical ``control.TransferFunction``.

        Raises
        ------
        ImportError
            If the package ``control`` is not installed.
        """
        control = import_optional("control", "control")
        names = {
            "inputs": [_identifier(self.input)],
            "outputs": [_identifier(self.output)],
            "name": _identifier(self.name),
        }
        return control.tf(*self.at(**parameters), **names)

    # -- display

    def lines(self) -> list[tuple[str, str]]:
        """Labels and texts of the report."""
        out = [("from", with_unit(self.input, self.input_unit)), ("to", with_unit(self.output, self.output_unit))]
        if all(c == 0 for c in self.num):
            return [*out, ("transfer function", "0: to first order the output does not depend on this input")]
        out += [
            ("numerator", polynomial_text(self._terms(self.num))),
            ("denominator", polynomial_text(self._terms(self.den))),
        ]
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


def checked_values(f: Any, parameters: Mapping[str, float]) -> dict[str, float]:
    """Check values by name; refuses unknown parameters, those determined by equilibrium, and other points."""
    for name in parameters:
        if name in f.balanced_by:
            raise ModelError(f"{name!r} has the value with which the mechanism is in equilibrium")
        if name not in f.parameters:
            known = list(f.parameters)
            raise ModelError(f"{f.name!r} has no parameter {name!r}{suggest(name, known)}; {listing(known)}")
    values = {k: float(x) for k, x in parameters.items()}
    f.validity.refuse(f.name, values)
    return values


def polynomial_text(terms: Sequence[tuple[str, str]]) -> str:
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


def _identifier(name: str) -> str:
    return "".join(c if c.isalnum() else "_" for c in name)
