"""The equations of motion of a mechanism as expressions, in its own names."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..analysis.linear.inputs import Input, with_inputs
from ..analysis.motion.start import Start, begin
from ..analysis.options import Options
from ..analysis.untouched import refuse_contact
from ..errors import AnalysisError, ModelError
from ..graph.node import SYMBOL, Graph, Node, Symbol
from ..graph.printers import spelling
from ..model.expressions import is_number_text
from ..model.model import Model, listing, suggest
from ..tables.structure import Choices, structure
from ..tables.values import values
from .expressions import Expressions
from .formulated import Formulated, Place, formulated, objects
from .linear.face import Linear
from .quantities import Quantities
from .shown import Shown
from .state import named_state, places_at

if TYPE_CHECKING:
    from .explicit.explicit import ExplicitEquations
    from .explicit.states import StateEquations
    from .export.code import Code


@dataclass(frozen=True, kw_only=True)
class SymbolicOptions(Options):
    """What `Mechanism.symbolic` is asked."""

    coordinates: str
    inputs: tuple[str, ...]
    parameters: Mapping[str, float] | None
    names: str


class Equations(Shown, Linear):
    """Equations of motion of a mechanism in one kind of coordinates.

        qdot = T v,   M vdot = f + G^T lam,   g = 0,   G v = nu,   G vdot = gamma

    Symbols are called as in results: ``"A.angle"``, its rate ``"A.angle'"``, parameters by their names. Everything is
    an `Expressions`: ``eq.M[0, 0]``, ``eq.f.sympy()``, ``eq.g.at({"A.angle": 0.3})``. Whatever a result has can be
    asked for by its name: ``eq["slider.x"]``, ``eq["A.force"]``, ``eq["energy.kinetic"]``, ``eq["spring.power"]``.

    Attributes
    ----------
    model : Mechanism
    coordinates : str
        Which they are, and why.
    q, v, vdot : Expressions
        The symbols of coordinates, velocities and accelerations. A body that is free in space has the Euler parameters
        ``e0`` to ``e3`` in q, and in v the angular velocity ``w_x``, ``w_y``, ``w_z`` along its own axes.
    lam : Expressions
        The symbols of the multipliers, one for each row of g; of a driver or a coupling its effort.
    loads : Expressions
        What presses the surfaces of joints with friction together: symbols in f. What they are when multipliers are
        known is ``load_values``.
    T, M, f, g, nu, G, gamma : Expressions
        f has all forces but reactions, gyroscopic terms included. Rows of drivers are rows as all others.
    """

    def __init__(self, model: Model, start: Start, o: SymbolicOptions, inputs: Sequence[Input]) -> None:
        self.model, self.coordinates, self._start, self._asked = model, start.coordinates, start, o
        self.described = model
        self.graph = Graph()
        tree = start.assembly.compiled.structure.tree
        s = structure(model, Choices(tree=tree, coupled=bool(tree)))
        self._inputs = {i.parameter: Symbol(i.name, "input", unit=i.unit) for i in inputs if i.parameter != i.name}
        self._given = self._parameters(o)
        given: Any = self._given
        x = values(s, given or None)
        self.formulated: Formulated = formulated(x, self.graph)

    # -- symbols

    def _parameters(self, o: SymbolicOptions) -> dict[str, Node]:
        """Symbols of the parameters that have values of their own; the others are expressions of these."""
        told = self._start.assembly.compiled.values.told
        out = {}
        for name, value in self.model.parameters.items():
            if name in self._inputs:
                out[name] = self.graph.symbol(self._inputs[name], 0.0)
            elif name in (o.parameters or {}) or not isinstance(value, str) or is_number_text(value):
                out[name] = self.graph.symbol(Symbol(name, "parameter", spelling.name(name)), told[name])
        return out

    @cached_property
    def printer(self) -> Any:
        """The one that makes SymPy expressions; it knows which node a SymPy symbol stands for."""
        from ..graph.printers.sympy import SympyPrinter

        return SympyPrinter()

    @property
    def named(self) -> dict[str, Node]:
        """Every symbol by its name: time, state, accelerations, multipliers, loads, places, parameters, inputs."""
        given = {x.data.name: x for x in self._given.values()}
        return self.formulated.named | given

    @property
    def parameters(self) -> dict[str, float]:
        """Parameters that are symbols, with their own values [SI]."""
        return {k: x.value for k, x in self._given.items() if k not in self._inputs}

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of the inputs, in the order asked for; their symbols are 0 unless they are given."""
        return self._asked.inputs

    def symbol(self, x: Any) -> Node:
        """The node of a symbol, by its name, or as an expression that is one.

        Raises
        ------
        ModelError
            If there is none of that name.
        """
        if isinstance(x, Expressions):
            x = x.nodes[()] if not x.shape else x
        if isinstance(x, Node):
            if x.op != SYMBOL:
                raise ModelError(f"{x!r} is no symbol")
            return x
        named = self.named
        if x not in named:
            raise ModelError(f"{self.model.name!r} has no symbol {x!r}{suggest(str(x), named)}; {listing(list(named))}")
        return named[x]

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

    # -- what results have

    @cached_property
    def quantities(self) -> Quantities:
        """A motion at one instant, of expressions."""
        return Quantities(self)

    def __getitem__(self, name: str) -> Expressions:
        """Anything that a result has, by its name, or a symbol.

        Quantities of joints and drivers are in the multipliers, of joints whose coordinates the equations are in, in
        the accelerations too.

        Raises
        ------
        ModelError
            If there is nothing of that name, or it is no function of the state: works, energy balances.
        """
        return self.expression(name) if name in self.named else self.quantities.quantity(name)

    def reaction(self, joint: str, *, axes: str = "world", on: str | None = None) -> tuple[Expressions, Expressions]:
        """Force [N] and torque [N m] of a joint, as `JointView.reaction`: in lam, and in vdot for tree joints.

        Parameters
        ----------
        joint : str
        axes : str
            ``"world"``, ``"joint"``, or the name of one of the two bodies.
        on : str, optional
            The body on which it acts; the second one if not given. The torque is about the joint's point on that.
        """
        return self.quantities.reaction(joint, axes, on)

    # -- without constraints

    def explicit(self, independent: Sequence[str] = (), *, closed: bool = False) -> ExplicitEquations:
        """Equations of motion without constraints and multipliers, in independent coordinates.

        Parameters
        ----------
        independent : sequence of str
            Coordinates such as ``"A.angle"``, as many as there are freedoms; chosen by pivoting at the start if not
            given.
        closed : bool
            Whether to refuse mechanisms whose loops have no closed form; else what has none is an implicit function.

        Raises
        ------
        ModelError
            If a name does not exist, or the coordinates named depend on one another, are too many or too few.
        SingularityError
            If the mechanism is drawn in a singular position.
        """
        from .explicit.explicit import explicit

        return explicit(self, independent, closed)

    def state_space(
        self, outputs: Sequence[str] = (), *, independent: Sequence[str] = (), closed: bool = False
    ) -> StateEquations:
        """The nonlinear state space x' = f(x, u, t), y = h(x, u, t); the inputs u are those of `Mechanism.symbolic`.

        Parameters
        ----------
        outputs : sequence of str
            Anything that a result has: coordinates, sensors, reactions such as ``"A.fx"``, energies.
        independent, closed
            As for `explicit`.

        Raises
        ------
        ModelError
            As for `explicit`; if an output does not exist or is not determined.
        SingularityError
            If the mechanism is drawn in a singular position.
        """
        from .explicit.states import StateEquations

        return StateEquations(self.explicit(independent, closed=closed), outputs)

    # -- numbers

    @cached_property
    def start(self) -> dict[str, float]:
        """Time and state as described and assembled, by the names of the symbols."""
        a = self._start.assembly
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
        named = self.named
        for name in values:
            if name not in named:
                raise ModelError(f"{self.model.name!r} has no symbol {name!r}{suggest(str(name), named)}")
        known = dict(values)
        if missing := [
            p for p in self.formulated.places if p.symbol.data.name in wanted and p.symbol.data.name not in known
        ]:
            known |= places_at(self.formulated, missing, known)
        lacking = [k for k, x in wanted.items() if x.moving and k not in known]
        if lacking:
            raise ModelError(f"no value is given for {', '.join(lacking)}; eq.start has those at the start")
        return known

    def evaluate(self, values: Mapping[str, Any]) -> dict[str, np.ndarray]:
        """M, f, g, nu, G, gamma and T at values of the symbols; see `Expressions.at`."""
        return {k: getattr(self, k).at(values) for k in ("T", "M", "f", "g", "nu", "G", "gamma")}

    def export(
        self,
        folder: str | Path | None = None,
        *,
        language: str = "c",
        functions: Sequence[str] = (),
        outputs: Sequence[str] = (),
        name: str = "",
    ) -> Code:
        """Functions of these equations as code: see `Mechanism.export`."""
        from .export.code import exported

        return exported(self, folder, language=language, functions=functions, outputs=outputs, name=name)

    def __repr__(self) -> str:
        return f"<equations of {self.model.name!r} in {self.coordinates.partition(':')[0]} coordinates>"


COORDINATES = ("auto", "absolute", "joint")


def symbolic(model: Model, o: SymbolicOptions) -> Equations:
    """Equations of motion as expressions: see `Mechanism.symbolic`."""
    refuse_contact(model, "symbolic")
    plain = model.snapshot()
    told, inputs = with_inputs(plain, o.inputs) if o.inputs else (plain, [])
    told, auto = told.snapshot(), o.coordinates == "auto"
    try:
        start = begin(told, 0.0, o.parameters, None, "joint" if auto else o.coordinates)
    except AnalysisError:  # friction that follows loads which joint coordinates do not know
        if not auto:
            raise
        start = begin(told, 0.0, o.parameters, None, "absolute")
    out = Equations(told, start, o, inputs)
    out.described = plain
    return out
