"""The nonlinear state space of a mechanism: x' = f(x, u, t), y = h(x, u, t)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...derivatives.linear_reduction import product
from ...errors import AnalysisError, ModelError
from ...expression_graph.evaluation import evaluate, jacobian, symbols_of
from ...expression_graph.graph import Node, OpaqueFunction
from ..expressions import TOO_LONG, Expressions, formula_lines
from .definitions import ImplicitSolver, implicit_rates
from .explicit_equations import ExplicitEquations
from .linear_systems import Determinants

StateNumbers = Sequence[float] | np.ndarray


class StateEquations:
    """State space of a mechanism, with names: x' = f(x, u, t), y = h(x, u, t).

    The states are the independent coordinates (all four Euler parameters of a body's orientation), their rates, and the
    states of controllers. An input that moves a driver counts as three: itself, its rate and its acceleration.

    Attributes
    ----------
    explicit : ExplicitEquations
    states, inputs, outputs : tuple of str
    x, u : list of Node
        Symbols of states and inputs.
    f, h : Expressions
        Functions of x, u, t and parameters; implicit coordinates are symbols (`implicit`).
    start : ndarray (nx,)
        The state as described and assembled.
    """

    def __init__(self, explicit: ExplicitEquations, outputs: Sequence[str] = ()) -> None:
        e, self.explicit, self.equations = explicit.solution, explicit, explicit.equations
        if isinstance(outputs, str):
            outputs = [outputs]
        self.t, self.graph = e.traced.t, e.traced.graph
        self.x = [*(e.traced.q[k] for k in e.known), *(e.traced.v[d] for d in e.chosen), *e.traced.states]
        self.u, self.inputs = list(explicit.inputs.values()), tuple(explicit.inputs)
        self.states, self.outputs = tuple(s.data.name for s in self.x), tuple(outputs)
        qdot = product(e.traced.T, np.array(e.traced.v, object))[e.known]
        f = e.inlined([self.graph.node(y) for y in (*qdot, *e.accelerations[e.chosen], *e.traced.state_rates)])
        self.f = Expressions(self.equations, _expression_vector(f), self.states)
        self.h = Expressions(
            self.equations, _expression_vector([_output_expression(explicit, name) for name in outputs]), self.outputs
        )
        self._implicit = e.formulas.implicit
        self.start = np.array([e.start[s.data.name] for s in self.x], float)
        self._solvers: list[ImplicitSolver] | None = None
        self._refuse_others()

    @property
    def implicit(self) -> tuple[str, ...]:
        """Coordinates and loads of joints with friction without a formula, which Newton's method computes."""
        return tuple(n for d in self._implicit for n in d.names)

    def _refuse_others(self) -> None:
        """Refuse symbols that are neither states nor inputs."""
        known = {s.index for s in (*self.x, *self.u, self.t, *(w for d in self._implicit for w in d.symbols))}
        for s in symbols_of([*self.f.list(), *self.h.list()]):
            if s.moving and s.index not in known:
                raise AnalysisError(
                    f"the state space depends on {s.data.name!r}, which is no function of the states in "
                    f"{self.equations.coordinates.partition(':')[0]} coordinates; try other coordinates"
                )

    # -- derivatives

    def jacobian(self, what: Expressions, by: Sequence[str] | None = None) -> Expressions:
        """Total derivatives by states, inputs, time or parameters, (expressions, by): A, B, C, D anywhere.

        Implicit coordinates w change with these by dw/dx = -(dr/dw)^-1 dr/dx.

        Parameters
        ----------
        what : Expressions
            A vector, as `f` and `h`.
        by : sequence of str, optional
            Names of symbols; the states if not given.

        Raises
        ------
        ModelError
            If a Python function has no known derivative.
        """
        names = self.states if by is None else tuple(by)
        seeds = [self.graph.symbol(s.data) for s in (self._symbol(n) for n in names)]
        nodes = [self.graph.node(y) for y in what.list()]
        try:
            out = jacobian(nodes, seeds)
            chain = implicit_rates(self._implicit, seeds, Determinants())
            if chain:
                held = jacobian(nodes, [w for w, _ in chain])
                out = out + product(held, np.array([row for _, row in chain], object).reshape(len(chain), len(seeds)))
        except OpaqueFunction as error:
            raise ModelError(f"{error}; give the law as a text, or its values as a table") from None
        return Expressions(self.equations, out, what.rows, names)

    def _symbol(self, name: str) -> Node:
        return self.explicit.inputs.get(name) or self.equations.symbol(name)

    # -- numbers

    def point(
        self,
        x: StateNumbers,
        u: StateNumbers | None = None,
        t: float = 0.0,
        parameters: Mapping[str, float] | None = None,
    ) -> dict[str, float]:
        """Values of all symbols at a state, for `Expressions.at`; implicit ones by Newton's method.

        Parameters
        ----------
        x : sequence of float (nx,)
        u : sequence of float (nu,), optional
            By default zero for inputs added to laws, and the parameters' own values.
        t : float [s]
        parameters : mapping, optional

        Raises
        ------
        ModelError
            If there are too many numbers, or too few, or a name is unknown.
        SingularityError
            If the mechanism cannot get there without passing a singular position.
        """
        u = [s.value for s in self.u] if u is None else u
        for what, names, numbers in (("state", self.states, x), ("input", self.inputs, u)):
            if len(numbers) != len(names):
                raise ModelError(
                    f"{len(names)} numbers are wanted for the {what}s ({', '.join(names)}), not {len(numbers)}"
                )
        values = {n: float(y) for n, y in zip((*self.states, *self.inputs), (*x, *u), strict=True)}
        values |= {self.equations.symbol(n).data.name: float(y) for n, y in (parameters or {}).items()}
        values[self.t.data.name] = float(t)
        if self._implicit and self._solvers is None:
            self._solvers = self._initial_values()
        for solver in self._solvers or []:
            values |= solver(values)
        return values

    def evaluate(
        self,
        x: StateNumbers,
        u: StateNumbers | None = None,
        t: float = 0.0,
        parameters: Mapping[str, float] | None = None,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Values of x' (nx,) and y (ny,) at a state; see `point`."""
        found = np.array(evaluate([*self.f.list(), *self.h.list()], self.point(x, u, t, parameters)), float)
        return found[: len(self.x)], found[len(self.x) :]

    def __call__(self, t: float, x: np.ndarray, *u: float) -> np.ndarray:
        """x' with the signature of ``scipy.integrate.solve_ivp``; further arguments are the inputs, all or none."""
        return self.evaluate(x, u or None, t)[0]

    def _initial_values(self) -> list[ImplicitSolver]:
        values = self.explicit.solution.start | {s.data.name: s.value for s in self.u}
        out = []
        for d in self._implicit:
            out.append(ImplicitSolver(d, values))
            values |= out[-1](values)
        return out

    def __repr__(self) -> str:
        size = f"{len(self.states)} states, {len(self.inputs)} inputs, {len(self.outputs)} outputs"
        return f"<state space of {self.equations.model.name!r}: {size}>"

    def __str__(self) -> str:
        lines = [f"state space of {self.equations.model.name!r}: x' = f(x, u, t), y = h(x, u, t)"]
        for what, names in (("states", self.states), ("inputs", self.inputs), ("outputs", self.outputs)):
            lines.append(f"{what}: {', '.join(names) or 'none'}")
        lines += [f"implicit: {', '.join(self.implicit)}"] if self.implicit else []
        for letter, made in (("f", self.f), ("h", self.h)):
            if made.rows:
                rows = [(f"{letter}[{n}]", x) for n, x in zip(made.rows, made.readable, strict=True)]
                too_long = [f"{letter}: {TOO_LONG.format(made.operations)}"]
                lines += ["", *(formula_lines(rows, self.equations.units) or too_long)]
        return "\n".join(lines)


def _expression_vector(nodes: Sequence[Any]) -> np.ndarray:
    out = np.empty(len(nodes), object)
    out[:] = nodes
    return out


def _output_expression(explicit: ExplicitEquations, name: str) -> Any:
    found = explicit[name]
    if found.shape:
        raise ModelError(
            f"output {name!r} is {found.shape[0]} numbers; name one of them: a result has {name}_x or the like"
        )
    return found.nodes[()]
