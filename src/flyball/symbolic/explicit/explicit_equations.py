"""Explicit differential equations of a mechanism in independent coordinates, and its state space.

The state space is nonlinear: x' = f(x, u, t), y = h(x, u, t).
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ...derivatives.linearized_equations import gap_lengths, normalised_rows, product
from ...errors import AnalysisError, ModelError
from ...expression_graph.graph import (
    Node,
    OpaqueFunction,
    Symbol,
    directional_derivatives,
    evaluate,
    jacobian,
    symbols_of,
)
from ...expression_graph.simplification.factors import symbol_count
from ...expression_graph.simplification.simplify import (
    ArctangentSubstitution,
    fast_simplification,
    without_whole_turns,
)
from ...expression_graph.tracing import TracedEquations
from ...model.body import Driver
from ...model.model import suggest
from ...numerics.rank import fundamental_subspaces
from ..expressions import TOO_LONG, Expressions, formula_lines, node_count
from ..named_equations import curve_parameters_at
from .coordinate_partitioning import ExtraSymbols, IndependentEquations, reduce_equations
from .definitions import Definition, ImplicitSolver, implicit_rates
from .linear_systems import Determinants

if TYPE_CHECKING:
    from ..equations import Equations


# Up to so many operations everything is expressed in the independent coordinates.
MAX_READ = 300
# A coordinate is, up to so many symbols, even if its formula by others is shorter.
SHORT_COUNT = 40.0
Row = tuple[str, Any]


def report(x: ExplicitEquations) -> str:
    """The equations as text of readable length."""
    s, units = x.solution, x.equations.units
    free = ", ".join(x.independent)
    lines = [
        f"explicit equations of {x.equations.model.name!r}: M a = f"
        + (f", a the accelerations of {free}" if free else ""),
        f"independent: {free or 'none, drivers leave no freedom'}",
        *(f"{name}: {form_description(how)}" for name, how in x.branches.items()),
        *x.notes,
        *(["angles are determined up to whole turns"] if any(d.closed for d in s.positions) else []),
    ]
    algebra = ArctangentSubstitution(
        [(w, y, d.radius) for d in s.definitions if d.closed for w, y in definition_pairs(d)]
    )
    places = coordinate_formulas(s.positions, algebra)
    motion = [(f"M[{a}, {b}]", s.M[i, j]) for (i, a), (j, b) in upper_triangle(x.independent)]
    motion += [(f"f[{a}]", y) for a, y in zip(x.independent, s.f, strict=True)]
    g = x.equations.graph
    motion = [(name, g.node(y)) for name, y in motion]
    body = shorter_listing(
        [places + substituted_rows(motion, algebra), places + with_rate_formulas(motion, s.definitions, s.positions)],
        units,
    )
    if not body:
        body = [
            line
            for row in places
            for line in formula_lines([row], units) or [f"{row[0]}: {TOO_LONG.format(node_count([row[1]]))}"]
        ]
        body += [f"{k}: {TOO_LONG.format(getattr(x, k).operations)}" for k in ("M", "f")]
    size = {k: getattr(x, k).operations for k in ("M", "f")}
    return "\n".join([*lines, "", *body, "", f"operations: {', '.join(f'{k} {n}' for k, n in size.items())}"])


def form_description(how: str) -> str:
    """Form of an equation as text, without letters that are not defined here."""
    how = re.sub(r"A cos w \+ B sin w \+ C = 0, branch (.)", r"of the two solutions the drawn one (branch \1)", how)
    how = how.replace("A cos w + B sin w = 0", "of two opposite directions that of the reference configuration")
    return re.sub(r"quadratic, branch (.)", r"of the two solutions the drawn one (branch \1)", how)


def definition_pairs(d: Definition) -> list[tuple[Node, Any]]:
    """Symbols with their formulas."""
    return list(zip(d.symbols, d.values, strict=True))


def upper_triangle(names: Sequence[str]) -> list[tuple[tuple[int, str], tuple[int, str]]]:
    """Index pairs of the upper triangle of a symmetric matrix, with names."""
    told = list(enumerate(names))
    return [(a, b) for a in told for b in told if a[0] <= b[0]]


def coordinate_formulas(definitions: Sequence[Definition], algebra: ArctangentSubstitution) -> list[Row]:
    """Formulas of dependent coordinates: by the independent ones if short, else by others before them."""
    out = []
    for w, y in (pair for d in definitions if d.closed for pair in definition_pairs(d)):
        y = without_whole_turns(w.graph.node(y))
        by_free = algebra([w])
        put = fast_simplification(by_free)[0]
        out.append((w.data.name, put if symbol_count([put]) <= max(SHORT_COUNT, symbol_count([y])) else y))
    return out


def substituted_rows(rows: Sequence[Row], algebra: ArctangentSubstitution) -> list[Row]:
    """The rows expressed in the independent coordinates."""
    return list(zip([name for name, _ in rows], algebra([y for _, y in rows]), strict=True))


def with_rate_formulas(
    rows: Sequence[Row], definitions: Sequence[Definition], places: Sequence[Definition]
) -> list[Row]:
    """The rows in dependent coordinates and their rates, preceded by formulas of the rates that occur."""
    by = {w.index: (w, y) for d in definitions[len(places) :] if d.closed for w, y in definition_pairs(d)}
    wanted: dict[int, Row] = {}
    to_see = [y for _, y in rows]
    while to_see:
        for s in symbols_of([to_see.pop()]):
            if s.index in by and s.index not in wanted:
                w, y = by[s.index]
                wanted[s.index] = (w.data.name, w.graph.node(y))
                to_see.append(w.graph.node(y))
    return [*(wanted[k] for k in by if k in wanted), *rows]


def shorter_listing(alternatives: Sequence[Sequence[Row]], units: Sequence[Sequence[Node]]) -> list[str]:
    """Lines of the first alternative if it is small, else of the shorter one; none if all are too long."""
    first, second = ([y for _, y in rows] for rows in alternatives)
    lines = [formula_lines(alternatives[0], units)] if node_count(first) <= MAX_READ else []
    if not (lines and lines[0]) or sum(map(len, lines[0])) > 2500 or node_count(second) < node_count(first) / 2:
        lines.append(formula_lines(alternatives[1], units))
    return min((x for x in lines if x), key=lambda x: sum(map(len, x)), default=[])


INPUT_THRESHOLD = 1e-8  # relative change by undetermined multipliers that counts as none


class ExplicitEquations:
    """Equations of motion without constraints and multipliers, M a = f, by coordinate partitioning.

    The independent coordinates u determine the others, w: by formulas where loops close in closed form, in the
    assembly mode of the reference configuration; else by equations, which Newton's method solves. Velocities and
    accelerations of the others follow exactly from the constraints' derivatives (Wehage and Haug 1982).

        M a = f,   M = Z^T M Z,   f = Z^T (f - M b),   v = Z u' + b',   v' = Z a + b

    Attributes
    ----------
    equations : Equations
        The equations with constraints.
    independent : tuple of str
        Independent coordinates.
    dependent : tuple of str
        Coordinates with a formula, in the order in which they are found: each may contain earlier ones.
    implicit : tuple of str
        Coordinates (and loads of joints with friction) without a formula.
    notes : tuple of str
        Reasons why they have none.
    branches : dict
        Dependent coordinate -> form of its equation, and the branch.
    """

    def __init__(self, equations: Equations, solution: IndependentEquations, inputs: dict[str, Node]) -> None:
        self.equations, self.solution, self.inputs = equations, solution, inputs
        self.independent = solution.independent
        formulas = [d for d in solution.positions if d.closed]
        self.dependent = tuple(n for d in formulas for n in d.names)
        self.branches = {n: d.how for d in formulas for n in d.names}
        self.implicit = tuple(n for d in solution.formulas.implicit for n in d.names)
        self.notes = tuple(solution.notes)

    # -- parts

    def _as_expressions(self, nodes: Any, rows: Sequence[str] = (), columns: Sequence[str] = ()) -> Expressions:
        x = np.asarray(nodes, object)
        out = np.empty(x.shape, object)
        out.ravel()[:] = self.solution.inlined([self.equations.graph.node(y) for y in x.ravel()])
        return Expressions(self.equations, out, rows, columns)

    @property
    def M(self) -> Expressions:
        """Reduced mass matrix, along the independent velocities."""
        return self._as_expressions(self.solution.M, self.independent, self.independent)

    @property
    def f(self) -> Expressions:
        """Reduced forces, along the independent velocities."""
        return self._as_expressions(self.solution.f, self.independent)

    @property
    def Z(self) -> Expressions:
        """Derivatives of the velocities by the independent ones: v = Z u' + terms of drivers."""
        return self._as_expressions(self.solution.Z, self.solution.names, self.independent)

    @property
    def accelerations(self) -> Expressions:
        """Accelerations of the independent coordinates, in straight-line code (L D L^T)."""
        return self._as_expressions(self.solution.accelerations[self.solution.chosen], self.independent)

    def formula(self, coordinate: str) -> Expressions:
        """Formula of a dependent coordinate; it may contain coordinates found before.

        Raises
        ------
        ModelError
            If it has no formula, or is independent.
        """
        for d in self.solution.positions:
            if coordinate in d.names and d.closed:
                return Expressions(self.equations, d.values[d.names.index(coordinate)], unit=self._unit(coordinate))
        if coordinate in self.independent:
            raise ModelError(f"{coordinate!r} is independent: it has no formula")
        known = {*self.dependent, *self.implicit}
        if coordinate in self.implicit:
            raise ModelError(f"{coordinate!r} has no formula: {'; '.join(self.notes)}")
        raise ModelError(f"there is no dependent coordinate {coordinate!r}{suggest(coordinate, known)}")

    def conditions(self, coordinate: str) -> Expressions:
        """Equations of an implicit coordinate, which it shares with others.

        Raises
        ------
        ModelError
            If it is not implicit.
        """
        for d in self.solution.formulas.implicit:
            if coordinate in d.names:
                return self._as_expressions(d.residuals, d.names)
        raise ModelError(f"{coordinate!r} is not implicit; these are: {', '.join(self.implicit) or 'none'}")

    @property
    def determinants(self) -> dict[str, Expressions]:
        """Determinants by the coordinates they determine; where one vanishes, the partition is singular."""
        return {k: self._as_expressions(x) for k, x in self.solution.determinants.items()}

    def __getitem__(self, name: str) -> Expressions:
        """A quantity of a result, in the independent coordinates, their rates, and implicit coordinates.

        Raises
        ------
        ModelError
            If the name is unknown, or redundant constraints leave the quantity undetermined.
        """
        found = self.equations[name]
        self._refuse_undetermined(name, found)
        told = self._as_expressions(found.nodes, found.rows, found.columns)
        return Expressions(self.equations, told.nodes, found.rows, found.columns, found.unit)

    def _unit(self, name: str) -> str:
        return str(self.equations.symbol(name).data.unit) if name in self.equations.named else "rad"

    def _refuse_undetermined(self, name: str, x: Expressions) -> None:
        s = self.solution
        place = s.place
        if not s.undetermined:
            return
        y = fundamental_subspaces(normalised_rows(place.G, place.scale)).dependencies
        values = place.values | {a.data.name: 0.0 for a in self.equations.named_equations.vdot}
        lam = s.traced.lam
        slope = np.array([self._slope(x.list(), symbol, values) for symbol in lam])
        slope = gap_lengths(slope.T, place.G[: len(lam)], place.scale).T  # by multipliers of unit rows
        among = np.abs(y[: len(lam)].T @ slope)
        if (among > INPUT_THRESHOLD * np.abs(slope).max(initial=0.0)).any():
            raise ModelError(
                f"{name!r} is not determined: redundant constraints ({', '.join(s.undetermined)}) leave it "
                "undetermined; choose other quantities, or remove the redundancy: m.mobility() names it"
            )

    @staticmethod
    def _slope(nodes: list[Any], by: Node, values: dict[str, float]) -> list[float]:
        return [float(y) for y in evaluate(directional_derivatives(nodes, [(by, 1.0)]), values)]

    def __repr__(self) -> str:
        return (
            f"<explicit equations of {self.equations.model.name!r} in {', '.join(self.independent) or 'nothing free'}>"
        )

    def __str__(self) -> str:
        return report(self)


def explicit_equations(
    equations: Equations, independent: Sequence[str] = (), closed: bool = False
) -> ExplicitEquations:
    """Eliminate constraints and multipliers: see `Equations.explicit`."""
    eq, x = equations, equations.named_equations
    traced, inputs = with_input_rates(eq)
    places = [(p.symbol, p.equation) for p in x.places]
    start = eq.start | (curve_parameters_at(x, x.places, eq.start) if places else {})
    found = reduce_equations(traced, start, independent, ExtraSymbols(x.vdot, places))
    out = ExplicitEquations(eq, found, inputs)
    if closed and out.implicit:
        raise ModelError(
            f"{eq.model.name!r} has no closed form: {'; '.join(found.notes)}. Leave out closed: these coordinates are "
            "implicit functions then, with exact derivatives"
        )
    return out


def with_input_rates(eq: Equations) -> tuple[TracedEquations, dict[str, Node]]:
    """Equations in which inputs that move drivers have symbols for their rates, and all inputs by name.

    Raises
    ------
    ModelError
        If a parameter that is an input changes the constraints.
    """
    x, g = eq.named_equations.traced, eq.graph
    given = {name: eq.symbol(name) for name in eq.inputs}
    nu, gamma = x.nu.copy(), x.gamma.copy()
    inputs: dict[str, Node] = {}
    for name, u in given.items():
        inputs[name] = u
        part = eq.model[name] if any(name == d.name for d in eq.model.drivers) else None
        if isinstance(part, Driver):
            k = x.structure.slices[name].start
            rates = [g.symbol(Symbol(f"{name}{p}", "input", "", f"{u.data.unit}/s{n}"), 0.0) for p, n in RATE_SUFFIXES]
            nu[k], gamma[k] = nu[k] + rates[0], gamma[k] + rates[1]
            inputs |= {r.data.name: r for r in rates}
            eq.named_equations.named.update({r.data.name: r for r in rates})
        elif any(y != 0.0 for y in directional_derivatives([*x.g, *x.nu], [(u, 1.0)])):
            raise ModelError(
                f"input {name!r} changes constraints, so that its rates act too; let a driver do that, and name that"
            )
    return replace(x, nu=nu, gamma=gamma), inputs


RATE_SUFFIXES = (("'", ""), ("''", "^2"))


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
