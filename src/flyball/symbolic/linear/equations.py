"""Linear equations of a mechanism with expressions of its parameters in them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from ...errors import AnalysisError, ModelError
from ...graph.node import Node
from ...graph.values import evaluate, symbols
from ...model.words import listing, suggest
from ...results.numbers import with_unit
from ..expressions import Expressions
from ..home import Home
from .derivatives import Perturbed
from .free import Free
from .matrices import Matrices
from .pencil import Pencil, pencil
from .quotient import cancelled, coefficients, scaled
from .routh import StabilityConditions, stability
from .traced import Mechanics
from .transfer import TransferFunction, checked
from .validity import Validity

FACTORED = 300  # operations


@dataclass
class LinearEquations(Home):
    """Linear equations x' = A x + B u, y = C x + D u whose entries are expressions of the mechanism's parameters.

    The states are changes of as many coordinates as there are freedoms, then changes of their rates, as those of
    `LinearModel`.

    Attributes
    ----------
    name : str
    parameters : dict
        Name -> value of the parameters that have one of their own.
    matrices : Matrices
        What the properties tell, as arrays of nodes.
    conditions : list of Node
        What has to vanish for the point to be an equilibrium, where it does not by itself: the equations hold for
        parameters with which it does, and numbers with which it does not are refused.
    balanced_by : dict
        Parameter -> the expression of the others that it stands for, since equilibrium asks for it.
    found : tuple of str
        Coordinates that are numbers at the point, whatever the parameters: loops were closed numerically.
    """

    name: str
    parameters: dict[str, float]
    matrices: Matrices
    conditions: list[Node]
    balanced_by: dict[str, Node]
    found: tuple[str, ...]
    at: Perturbed = field(repr=False)
    free: Free = field(repr=False)
    mechanics: Mechanics = field(repr=False)
    validity: Validity = field(default=Validity(), repr=False)

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the states x."""
        return self.matrices.states

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of the inputs u."""
        return self.matrices.inputs

    @property
    def outputs(self) -> tuple[str, ...]:
        """Names of the outputs y."""
        return self.matrices.outputs

    @property
    def A(self) -> Expressions:
        """In x' = A x + B u, (n, n)."""
        return self._told(self.matrices.A, self.states, self.states)

    @property
    def B(self) -> Expressions:
        """In x' = A x + B u, (n, inputs); errors as `C`."""
        return self._proper(self.matrices.B, self.states, self.inputs)

    @property
    def C(self) -> Expressions:
        """In y = C x + D u, (outputs, n).

        Raises
        ------
        AnalysisError
            If an output follows the rate of an input.
        """
        return self._proper(self.matrices.C, self.outputs, self.states)

    @property
    def D(self) -> Expressions:
        """In y = C x + D u, (outputs, inputs); errors as `C`."""
        return self._proper(self.matrices.D, self.outputs, self.inputs)

    @property
    def mass(self) -> Expressions | None:
        """M of M a'' + D a' + K a = 0 in the first f states, (f, f); None with constraints on velocities only."""
        return self._second(self.matrices.mass)

    @property
    def damping(self) -> Expressions | None:
        """D of the same."""
        return self._second(self.matrices.damping)

    @property
    def stiffness(self) -> Expressions | None:
        """K of the same."""
        return self._second(self.matrices.stiffness)

    def _second(self, X: np.ndarray | None) -> Expressions | None:
        return None if X is None else self._told(X, self.states[: len(X)], self.states[: len(X)])

    def _proper(self, X: np.ndarray, rows: tuple[str, ...], columns: tuple[str, ...]) -> Expressions:
        if self.matrices.improper:
            raise AnalysisError(self.matrices.improper)
        return self._told(X, rows, columns)

    def _told(self, X: np.ndarray, rows: tuple[str, ...], columns: tuple[str, ...]) -> Expressions:
        return Expressions(self, X, rows, columns)

    @property
    def title(self) -> str:
        """The mechanism's name."""
        return repr(self.name)

    @property
    def named(self) -> dict[str, Node]:
        """Symbols in the matrices, by name."""
        m = self.matrices
        return {x.data.name: x for x in symbols([n for X in (m.A, m.B, m.C, m.D) for n in X.ravel().tolist()])}

    def checked(self, values: Mapping[str, Any], wanted: Mapping[str, Node]) -> dict[str, float]:
        """Values by the names of symbols; refuses those that there are not. What `Expressions` ask."""
        return checked(self, values)

    def values(self, **parameters: float) -> dict[str, np.ndarray]:
        """A, B, C, D in numbers: with the parameters' own values, or others.

        Raises
        ------
        ModelError
            If there is no such parameter, equilibrium says what it is, or the point is no equilibrium with it.
        """
        return {k: getattr(self, k).at(parameters).astype(float) + 0.0 for k in "ABCD"}

    def eigenvalues(self, **parameters: float) -> np.ndarray:
        """Of A in numbers, (n,) complex [1/s]."""
        return np.linalg.eigvals(self.A.at(parameters).astype(float))

    def balance(self, **parameters: float) -> dict[str, float]:
        """Values of the parameters that balance, for values of the others."""
        told = checked(self, parameters)
        found = evaluate(list(self.balanced_by.values()), told)
        return {k: float(x) for k, x in zip(self.balanced_by, found, strict=True)}

    @cached_property
    def pencil(self) -> Pencil:
        """The same equations as a matrix of polynomials, constraints left in."""
        positive = [k for k, x in self.parameters.items() if x > 0.0]
        return pencil(self.mechanics, self.at, self.free, positive)

    def transfer_function(self, input: str | None = None, output: str | None = None) -> TransferFunction:
        """Transfer function with symbolic coefficients; of the only input and output if not named.

        Raises
        ------
        ModelError
            If there is no such input or output, or the mechanism is too large, with the size met.
        ImportError
            If the package ``sympy`` is not installed.
        """
        i, k = self.index("input", input), self.index("output", output)
        P = self.pencil
        ring = P.ring
        num, den, common = cancelled(ring, P.numerator(i, k), P.characteristic() * P.below[k])
        num, den = scaled(ring, num, den)
        both = [coefficients(ring, num), coefficients(ring, den)]
        graph = self.mechanics.graph
        nodes = ring.printer.back(both[0], graph), ring.printer.back(both[1], graph)
        units = self.matrices.input_units[i], self.matrices.output_units[k]
        names = {"input": self.inputs[i], "output": self.outputs[k], "input_unit": units[0], "output_unit": units[1]}
        return TransferFunction(
            name=self.name, **names, s=ring.s, num=tuple(both[0]), den=tuple(both[1]), cancelled=common,
            parameters=self.parameters, balanced_by=self.balanced_by, nodes=nodes,
            validity=self.validity,
        )  # fmt: skip

    def routh(self, positive: Sequence[str] | None = None) -> StabilityConditions:
        """When all eigenvalues have negative real parts, as inequalities in the parameters.

        Parameters
        ----------
        positive : sequence of str, optional
            What is greater than zero: parameters, and ``"sin(alpha)"`` or the like; all that is now, if not given.

        Raises
        ------
        ModelError
            If the mechanism is too large, with the size met.
        ImportError
            If the package ``sympy`` is not installed.
        """
        P = self.pencil
        out = stability(P.ring, P.characteristic(), self.name, (self.parameters, self.balanced_by), positive)
        out.validity = self.validity
        return out

    def lines(self) -> list[tuple[str, str]]:
        """Labels and texts for people: names, and what equilibrium asks of the parameters."""
        x, out = self.matrices, []
        for what, names, units in (
            ("state", x.states, x.state_units),
            ("input", x.inputs, x.input_units),
            ("output", x.outputs, x.output_units),
        ):
            out += [(what, with_unit(name, unit)) for name, unit in zip(names, units, strict=True)]
        out += [("equilibrium", f"{k} = {self._short(e)}") for k, e in self.balanced_by.items()]
        out += [("equilibrium", f"0 = {self._short(e)}") for e in self.conditions]
        return out + [("found", f"{name} is a number, so that loops close") for name in self.found]

    def _short(self, x: Node) -> Any:
        """For people: factored, where that is cheap."""
        made = self.printer(x)
        return self.printer.sympy.factor(made) if made.count_ops() < FACTORED else made

    def __repr__(self) -> str:
        return "\n".join(f"{a}: {b}" for a, b in self.lines())

    def __str__(self) -> str:
        """The names, and the matrices."""
        shown = "A" if self.matrices.improper else "ABCD"
        told = [(k, getattr(self, k)) for k in shown]
        out = [repr(self), *(f"{k} =\n{X}" for k, X in told if X.nodes.size)]
        return "\n".join(out + ([self.matrices.improper] if self.matrices.improper else []))

    def latex(self) -> str:
        """x' = A x + B u, y = C x + D u as LaTeX; x' = A x alone without inputs and outputs."""
        out = [rf"\dot x = {self.A.latex()} x"]
        if self.inputs:
            out[0] += f" + {self.B.latex()} u"
        if self.outputs:
            out.append(f"y = {self.C.latex()} x" + (f" + {self.D.latex()} u" if self.inputs else ""))
        return r" \\ ".join(out)

    def _repr_latex_(self) -> str:
        return rf"$\displaystyle \begin{{gathered}} {self.latex()} \end{{gathered}}$"

    def index(self, what: str, name: str | None) -> int:
        """Which input or output that is; the only one if not named."""
        names: tuple[str, ...] = getattr(self, f"{what}s")
        if name is None and len(names) == 1:
            return 0
        if name not in names:
            given = "say which" if name is None else f"there is no {what} {name!r}{suggest(name, list(names))}"
            there = listing(list(names)) if names else f"the equations were made without any: {what}s=[...]"
            raise ModelError(f"{given}; {there}")
        return names.index(name)
