"""Equations of motion as expressions: symbols, matrices and vectors, values."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ..analysis.assembly.start import Assembly
from ..analysis.options import Options
from ..graph.arrays import objects
from ..graph.node import Graph, Node, Symbol
from ..model.expressions import is_number_text
from ..model.model import Model
from ..tables.structure import Choices, structure
from ..tables.values import values
from .coordinates import Chosen, started
from .expressions import Expressions
from .formulated import Formulated, Place, formulated
from .home import Home
from .quaternions import quaternions
from .state import named_state, places_at


@dataclass(frozen=True, kw_only=True)
class SymbolicOptions(Options):
    """What `Mechanism.symbolic` is asked."""

    coordinates: str
    inputs: tuple[str, ...]
    parameters: Mapping[str, float] | None
    names: str


class Symbols(Home):
    """Equations of motion of a mechanism in one kind of coordinates, in its own names.

    qdot = T v,   M vdot = f + G^T lam,   g = 0,   G v = nu,   G vdot = gamma
    """

    def __init__(self, model: Model, chosen: Chosen, o: SymbolicOptions, told: Mapping[str, Symbol]) -> None:
        self.model, self._asked = model, o
        self.tree, self.coordinates = chosen  # names of the tree joints; which coordinates these are, and why
        self.described = model  # before its inputs and numbers were symbols
        self.graph = Graph()
        s = structure(model, Choices(tree=self.tree, coupled=bool(self.tree)))
        self._told = told  # symbols of parameters that go by other names: inputs, numbers of fields
        self._given = self._parameters(o)
        given: Any = self._given
        x = values(s, given or None)
        self.formulated: Formulated = formulated(x, self.graph)

    # -- symbols

    @property
    def title(self) -> str:
        """The mechanism's name."""
        return repr(self.model.name)

    def _parameters(self, o: SymbolicOptions) -> dict[str, Node]:
        """Symbols of the parameters that have values of their own; the others are expressions of these."""
        values = self.model.environment(o.parameters)
        out = {}
        for name, value in self.model.parameters.items():
            if name in self._told:
                out[name] = self.graph.symbol(self._told[name], values[name])
            elif o.names == "none":
                continue
            elif name in (o.parameters or {}) or not isinstance(value, str) or is_number_text(value):
                out[name] = self.graph.symbol(Symbol(name, "parameter"), values[name])
        return out

    @property
    def named(self) -> dict[str, Node]:
        """Every symbol by its name: time, state, accelerations, multipliers, loads, places, parameters, inputs."""
        given = {x.data.name: x for x in self._given.values()}
        return self.formulated.named | given

    @cached_property
    def units(self) -> list[list[Node]]:
        """Symbols of each quaternion: their squares add up to one."""
        return quaternions(self.formulated)

    @property
    def parameters(self) -> dict[str, float]:
        """Parameters that are symbols, with their own values [SI]."""
        return {x.data.name: x.value for x in self._given.values() if x.data.kind == "parameter"}

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of the inputs, in the order asked for; their symbols are 0 unless they are given."""
        return self._asked.inputs

    def expression(self, name: str) -> Expressions:
        """A symbol by its name, to calculate with."""
        x = self.symbol(name)
        return Expressions(self, x, unit=x.data.unit)

    # -- equations

    def _symbols(self, nodes: Sequence[Node]) -> Expressions:
        return Expressions(self, objects(nodes), [x.data.name for x in nodes])

    @property
    def t(self) -> Expressions:
        """Time."""
        return Expressions(self, self.formulated.traced.t, unit="s")

    @property
    def q(self) -> Expressions:
        """Coordinates, (nq,)."""
        return self._symbols(self.formulated.traced.q)

    @property
    def v(self) -> Expressions:
        """Velocities, (nv,)."""
        return self._symbols(self.formulated.traced.v)

    @property
    def vdot(self) -> Expressions:
        """Accelerations, (nv,)."""
        return self._symbols(self.formulated.vdot)

    @property
    def lam(self) -> Expressions:
        """Multipliers, (nr,)."""
        return self._symbols(self.formulated.traced.lam)

    @property
    def loads(self) -> Expressions:
        """What presses together the surfaces of each joint with friction [N]."""
        return self._symbols(self.formulated.traced.loads)

    @property
    def load_values(self) -> Expressions:
        """What the loads are, from the multipliers: loads = load_values closes the equations."""
        return Expressions(self, self.formulated.traced.returned, self.loads.rows, unit="N")

    @property
    def places(self) -> dict[str, Place]:
        """Places of followers on curves, by name: symbol, what is zero there, rate."""
        return {p.symbol.data.name: p for p in self.formulated.places}

    @property
    def T(self) -> Expressions:
        """Qdot = T v, (nq, nv)."""
        return Expressions(self, self.formulated.traced.T, self.q.rows, self.v.rows)

    @property
    def M(self) -> Expressions:
        """Mass matrix, (nv, nv)."""
        return Expressions(self, self.formulated.traced.M, self.v.rows, self.v.rows)

    @property
    def f(self) -> Expressions:
        """All forces but reactions, gyroscopic ones included, along the velocities, (nv,)."""
        return Expressions(self, self.formulated.traced.f, self.v.rows)

    @property
    def g(self) -> Expressions:
        """Constraints, (nr,): zero where they are closed, and of rows that restrain velocities only."""
        return Expressions(self, self.formulated.traced.g, self.lam.rows)

    @property
    def nu(self) -> Expressions:
        """Right-hand side of the constraints' velocities, G v = nu, (nr,)."""
        return Expressions(self, self.formulated.traced.nu, self.lam.rows)

    @property
    def G(self) -> Expressions:
        """Jacobian of the constraints along the velocities, (nr, nv)."""
        return Expressions(self, self.formulated.traced.G, self.lam.rows, self.v.rows)

    @property
    def gamma(self) -> Expressions:
        """Right-hand side of the constraints' accelerations, G vdot = gamma, (nr,)."""
        return Expressions(self, self.formulated.traced.gamma, self.lam.rows)

    @property
    def residual(self) -> Expressions:
        """M vdot - f - G^T lam, (nv,): zero along every motion."""
        return self.M @ self.vdot - self.f - self.G.T @ self.lam

    # -- numbers

    @cached_property
    def assembly(self) -> Assembly:
        """Where the mechanism starts, in these coordinates."""
        return started(self.model, self._asked.parameters, self.tree)

    @cached_property
    def start(self) -> dict[str, float]:
        """Time and state as described and assembled, by the names of the symbols: found by the engine when asked for.

        Raises
        ------
        AssemblyError
            If the mechanism cannot be assembled.
        """
        a = self.assembly
        return self.state(a.t, a.q, a.v)

    def state(self, t: float, q: np.ndarray, v: np.ndarray) -> dict[str, Any]:
        """The engine's arrays by the names of the symbols, as `Prepared` has them; times come last in arrays.

        Parameters
        ----------
        t : float
        q : ndarray (nq,)
        v : ndarray (nv,)
        """
        return named_state(self.formulated, t, q, v)

    def checked(self, values: Mapping[str, Any], wanted: Mapping[str, Node]) -> dict[str, Any]:
        """Values of symbols, refused by name where wrong or missing; places on curves are found."""
        known = dict(values)
        names = {p.symbol.data.name: p for p in self.formulated.places}
        if missing := [p for k, p in names.items() if k in wanted and k not in known]:
            known |= places_at(self.formulated, missing, known)
        return super().checked(known, wanted)

    def evaluate(self, values: Mapping[str, Any]) -> dict[str, np.ndarray]:
        """M, f, g, nu, G, gamma and T at values of the symbols; see `Expressions.at`."""
        return {k: getattr(self, k).at(values) for k in ("T", "M", "f", "g", "nu", "G", "gamma")}
