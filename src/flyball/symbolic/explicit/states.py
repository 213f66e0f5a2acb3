"""The nonlinear state space of a mechanism: x' = f(x, u, t), y = h(x, u, t)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...errors import ModelError
from ...graph.derivative import jacobian, replaced
from ...graph.node import Node, Symbol
from ...graph.values import evaluate
from ...tracing.trace import Traced
from .definition import rates, with_formulas
from .explicit import ExplicitEquations, Start, explicit
from .newton import Implicit
from .partition import positions
from .solve import Determinants, times

Numbers = Sequence[float] | np.ndarray


class StateEquations:
    """x' = f(x, u, t), y = h(x, u, t) with names.

    The states are the independent coordinates (of a quaternion all four numbers), then their rates.

    Attributes
    ----------
    equations : ExplicitEquations
    states, inputs, outputs : tuple of str
    x, u : list of Node
        Symbols of states and inputs.
    t : Node
    f, h : ndarray of Node (nx,), (ny,)
        In x, u, t and parameters; coordinates that have no formula are symbols (`unknown`).
    start : ndarray (nx,)
        The assembled start.
    """

    def __init__(
        self, equations: ExplicitEquations, inputs: Mapping[str, Node] = {}, outputs: Mapping[str, Any] = {}
    ) -> None:
        e, traced = equations, equations.traced
        self.equations, self.t, self.graph = e, traced.t, traced.graph
        self.states, self.x = _states(e)
        self.inputs, self.outputs = tuple(inputs), tuple(outputs)
        self.u, new = _inputs(self.graph, inputs)
        v = np.array([*traced.v], object)
        qdot = times(traced.T, v)[e.known]
        nodes = [*qdot, *e.accelerations[e.chosen], *outputs.values()]
        nodes = [self.graph.node(y) for y in nodes]
        found = replaced(e.inlined(nodes), new)
        n = len(self.x)
        self.f, self.h = np.array(found[:n], object), np.array(found[n:], object)
        implicit = with_formulas(e.definitions)
        self._implicit = [type(d)(d.symbols, (), tuple(replaced(d.residuals, new)), d.how) for d in implicit]
        q, y = list(e.start.q), list(e.start.v)
        self.start = np.array([*(q[k] for k in e.known), *(y[d] for d in e.chosen)], float)
        self._solvers: list[Implicit] | None = None

    @property
    def unknown(self) -> tuple[str, ...]:
        """Coordinates, and loads of joints, that have no formula: Newton's method finds them."""
        return tuple(n for d in self._implicit for n in d.names)

    # -- derivatives

    def jacobian(self, nodes: Sequence[Any], by: Sequence[Node]) -> np.ndarray:
        """Total derivatives of expressions by states, inputs, time or parameters, (expressions, by).

        Coordinates without a formula change with these as their equations say: dw/dx = -(dr/dw)^-1 dr/dx.
        """
        nodes = [self.graph.node(y) for y in nodes]
        out = jacobian(nodes, list(by))
        chain = rates(self._implicit, list(by), Determinants())
        held = [(w, row) for w, row in chain]
        if held:
            out = out + times(jacobian(nodes, [w for w, _ in held]), np.array([row for _, row in held], object))
        return out

    # -- numbers

    def point(
        self, x: Numbers, u: Numbers = (), t: float = 0.0, parameters: Mapping[str, float] | None = None
    ) -> dict[str, float]:
        """Numbers of all symbols at a state, what has no formula found by Newton's method.

        Raises
        ------
        ModelError
            If there are too many numbers, or too few.
        SingularityError
            If the mechanism cannot get there without passing a singular position.
        """
        values = self._given(x, u, t, parameters)
        if self._implicit and self._solvers is None:
            self._solvers = self._begun()
        for solver in self._solvers or []:
            values |= solver(values)
        return values

    def evaluate(
        self, x: Numbers, u: Numbers = (), t: float = 0.0, parameters: Mapping[str, float] | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Numbers x' (nx,) and y (ny,) at a state; see `point`."""
        found = np.array(evaluate([*self.f, *self.h], self.point(x, u, t, parameters)), float)
        return found[: len(self.x)], found[len(self.x) :]

    def rhs(self, t: float, x: np.ndarray, *u: float) -> np.ndarray:
        """x' as ``scipy.integrate.solve_ivp`` asks for it; further arguments are the inputs."""
        return self.evaluate(x, u or (0.0,) * len(self.u), t)[0]

    def _given(self, x: Numbers, u: Numbers, t: float, parameters: Mapping[str, float] | None) -> dict[str, float]:
        for what, symbols_, numbers in (("state", self.x, x), ("input", self.u, u)):
            if len(numbers) != len(symbols_):
                names = ", ".join(self.states if what == "state" else self.inputs)
                raise ModelError(f"{len(symbols_)} numbers are wanted for the {what}s ({names}), not {len(numbers)}")
        values = dict(parameters or {})
        values |= {s.data.name: float(y) for s, y in zip(self.x, x, strict=True)}
        values |= {s.data.name: float(y) for s, y in zip(self.u, u, strict=True)}
        return values | {self.t.data.name: float(t)}

    def _begun(self) -> list[Implicit]:
        values = self._given(self.start, (0.0,) * len(self.u), self.equations.start.t, None)
        x = self.equations.traced
        values |= {s.data.name: float(y) for s, y in zip(x.q, self.equations.start.q, strict=True)}
        out = []
        for d in self._implicit:
            out.append(Implicit(d, values))
            values |= out[-1](values)
        return out


def state_equations(
    x: Traced,
    start: Start,
    inputs: Mapping[str, Node] = {},
    outputs: Mapping[str, Any] = {},
    independent: Sequence[str] = (),
) -> StateEquations:
    """The state space of a mechanism; see `explicit` and `StateEquations`.

    Parameters
    ----------
    x : Traced
    start : Start
    inputs : mapping
        Name -> symbol: a parameter that is one.
    outputs : mapping
        Name -> expression of q, v, lam, t.
    independent : sequence of str
        Coordinates that the states are.
    """
    return StateEquations(explicit(x, start, independent), inputs, outputs)


def _states(e: ExplicitEquations) -> tuple[tuple[str, ...], list[Node]]:
    """Names and symbols of the states."""
    x = e.traced
    names = []
    for q, v in positions(x.structure):
        if q[0] in e.known:
            body = e.names[v[0]].rpartition(".")[0]
            names += [e.names[v[0]]] if len(q) == 1 else [f"{body}.q{k}" for k in range(4)]
    rate = [f"{e.names[d]} rate" for d in e.chosen]
    return (*names, *rate), [*(x.q[k] for k in e.known), *(x.v[d] for d in e.chosen)]


def _inputs(graph: Any, inputs: Mapping[str, Node]) -> tuple[list[Node], list[tuple[Node, Node]]]:
    """Symbols of inputs, and what stands for what."""
    out, new = [], []
    for name, given in inputs.items():
        symbol = given if given.data.name == name else graph.symbol(Symbol(name, "input", "", given.data.unit))
        out.append(symbol)
        if symbol is not given:
            new.append((given, symbol))
    return out, new
