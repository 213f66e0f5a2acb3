"""Explicit differential equations of a mechanism, in independent coordinates that have names."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ...analysis.linear.free import compared, gaps
from ...errors import ModelError
from ...graph.derivative import tangents
from ...graph.node import Node, Symbol
from ...graph.values import evaluate
from ...model.body import Driver
from ...model.model import suggest
from ...numerics.rank import parts
from ...tracing.trace import Traced
from ..expressions import Expressions
from ..state import places_at
from .reduced import More, Reduced, reduced
from .told import told

if TYPE_CHECKING:
    from ..equations import Equations

FELT = 1e-8  # part by which something may change with multipliers that act on nothing


class ExplicitEquations:
    """Equations of motion without constraints and multipliers, M a = f, by coordinate partitioning.

    The independent coordinates u determine the others, w: by formulas where loops close in closed form, in the mode of
    assembly that is drawn; else by their equations, which Newton's method solves. Velocities and accelerations of the
    others follow from the constraints' derivatives (Wehage and Haug 1982), exactly.

        M a = f,   M = Z^T M Z,   f = Z^T (f - M b),   v = Z u' + b',   v' = Z a + b

    Attributes
    ----------
    equations : Equations
        Those with constraints.
    independent : tuple of str
        Independent coordinates.
    dependent : tuple of str
        Those that have a formula, in the order in which they are found: each may hold those before it.
    implicit : tuple of str
        Coordinates (and loads of joints with friction) that have none.
    notes : tuple of str
        Why they have none.
    branches : dict
        From each dependent coordinate to the form of its equation and the branch that is taken.
    """

    def __init__(self, equations: Equations, solution: Reduced, inputs: dict[str, Node]) -> None:
        self.equations, self.solution, self.inputs = equations, solution, inputs
        self.independent = solution.independent
        formulas = [d for d in solution.positions if d.closed]
        self.dependent = tuple(n for d in formulas for n in d.names)
        self.branches = {n: d.how for d in formulas for n in d.names}
        self.implicit = tuple(n for d in solution.formulas.implicit for n in d.names)
        self.notes = tuple(solution.notes)

    # -- parts

    def _told(self, nodes: Any, rows: Sequence[str] = (), columns: Sequence[str] = ()) -> Expressions:
        x = np.asarray(nodes, object)
        out = np.empty(x.shape, object)
        out.ravel()[:] = self.solution.inlined([self.equations.graph.node(y) for y in x.ravel()])
        return Expressions(self.equations, out, rows, columns)

    @property
    def M(self) -> Expressions:
        """Reduced mass matrix, along the independent velocities."""
        return self._told(self.solution.M, self.independent, self.independent)

    @property
    def f(self) -> Expressions:
        """Reduced forces, along the independent velocities."""
        return self._told(self.solution.f, self.independent)

    @property
    def Z(self) -> Expressions:
        """What the velocities change with the independent ones: v = Z u' + what drivers do."""
        return self._told(self.solution.Z, self.solution.names, self.independent)

    @property
    def accelerations(self) -> Expressions:
        """Of the independent coordinates, solved for in straight-line code (L D L^T)."""
        return self._told(self.solution.accelerations[self.solution.chosen], self.independent)

    def formula(self, coordinate: str) -> Expressions:
        """A dependent coordinate as it is found: it may hold others that are found before.

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
        """What vanishes where an implicit coordinate is right: the equations that it shares with others.

        Raises
        ------
        ModelError
            If it is not implicit.
        """
        for d in self.solution.formulas.implicit:
            if coordinate in d.names:
                return self._told(d.residuals, d.names)
        raise ModelError(f"{coordinate!r} is not implicit; these are: {', '.join(self.implicit) or 'none'}")

    @property
    def determinants(self) -> dict[str, Expressions]:
        """What must not vanish, by what it determines: where it does, the partition is singular."""
        return {k: self._told(x) for k, x in self.solution.determinants.items()}

    def __getitem__(self, name: str) -> Expressions:
        """Anything that a result has, in the independent coordinates, their rates, and what has no formula.

        Raises
        ------
        ModelError
            If there is nothing of that name, or redundant constraints leave it undetermined.
        """
        found = self.equations[name]
        self._refuse_undetermined(name, found)
        told = self._told(found.nodes, found.rows, found.columns)
        return Expressions(self.equations, told.nodes, found.rows, found.columns, found.unit)

    def _unit(self, name: str) -> str:
        return str(self.equations.symbol(name).data.unit) if name in self.equations.named else "rad"

    def _refuse_undetermined(self, name: str, x: Expressions) -> None:
        s = self.solution
        place = s.place
        if not s.undetermined:
            return
        y = parts(compared(place.G, place.scale)).dependencies
        values = place.values | {a.data.name: 0.0 for a in self.equations.formulated.vdot}
        lam = s.traced.lam
        slope = np.array([self._slope(x.list(), symbol, values) for symbol in lam])
        slope = gaps(slope.T, place.G[: len(lam)], place.scale).T  # by multipliers of rows of unit size
        among = np.abs(y[: len(lam)].T @ slope)
        if (among > FELT * np.abs(slope).max(initial=0.0)).any():
            raise ModelError(
                f"{name!r} is not determined: redundant constraints ({', '.join(s.undetermined)}) leave it open; ask "
                "for other quantities, or take the redundancy out: m.mobility() names it"
            )

    @staticmethod
    def _slope(nodes: list[Any], by: Node, values: dict[str, float]) -> list[float]:
        return [float(y) for y in evaluate(tangents(nodes, [(by, 1.0)]), values)]

    def __repr__(self) -> str:
        return (
            f"<explicit equations of {self.equations.model.name!r} in {', '.join(self.independent) or 'nothing free'}>"
        )

    def __str__(self) -> str:
        return told(self)


def explicit(equations: Equations, independent: Sequence[str] = (), closed: bool = False) -> ExplicitEquations:
    """Take constraints and multipliers out: see `Equations.explicit`."""
    eq, x = equations, equations.formulated
    traced, inputs = with_rates(eq)
    places = [(p.symbol, p.equation) for p in x.places]
    start = eq.start | (places_at(x, x.places, eq.start) if places else {})
    found = reduced(traced, start, independent, More(x.vdot, places))
    out = ExplicitEquations(eq, found, inputs)
    if closed and out.implicit:
        raise ModelError(
            f"{eq.model.name!r} has no closed form: {'; '.join(found.notes)}. Leave out closed: these coordinates are "
            "implicit functions then, with exact derivatives"
        )
    return out


def with_rates(eq: Equations) -> tuple[Traced, dict[str, Node]]:
    """Equations in which inputs that move drivers have rates, and all inputs by name.

    Raises
    ------
    ModelError
        If a parameter that is an input changes the constraints.
    """
    x, g = eq.formulated.traced, eq.graph
    given = {name: eq.symbol(name) for name in eq.inputs}
    nu, gamma = x.nu.copy(), x.gamma.copy()
    inputs: dict[str, Node] = {}
    for name, u in given.items():
        inputs[name] = u
        part = eq.model[name] if any(name == d.name for d in eq.model.drivers) else None
        if isinstance(part, Driver):
            k = x.structure.slices[name].start
            rates = [g.symbol(Symbol(f"{name}{p}", "input", "", f"{u.data.unit}/s{n}"), 0.0) for p, n in RATES]
            nu[k], gamma[k] = nu[k] + rates[0], gamma[k] + rates[1]
            inputs |= {r.data.name: r for r in rates}
            eq.formulated.named.update({r.data.name: r for r in rates})
        elif any(y != 0.0 for y in tangents([*x.g, *x.nu], [(u, 1.0)])):
            raise ModelError(
                f"input {name!r} changes constraints, so that its rates act too; let a driver do that, and name that"
            )
    return replace(x, nu=nu, gamma=gamma), inputs


RATES = (("'", ""), ("''", "^2"))
