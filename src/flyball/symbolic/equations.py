"""The equations of motion of a mechanism as expressions: what `Mechanism.symbolic` returns.

`Equations` combines the symbols and matrices, the display as text, LaTeX and HTML, and the linearisation. Quantities of
results, such as reactions and energies, come from the formulas of `results` evaluated on symbols.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from ..analysis_options import AnalysisOptions
from ..assembly.assembled_state import Assembly
from ..errors import AnalysisError, ModelError
from ..expression_graph.graph import Graph, Node, Symbol, UndeterminedDecision, expanded_symbol_count, object_vector
from ..model.expressions import is_number_text
from ..model.model import Model
from ..model.names import curve_parts
from ..model.output_files import LATEX, PAGE, write_file
from ..model.quantities import ENERGY
from ..results.result import Result
from ..tables.structure import Choices, structure
from ..tables.table_definitions import FREE
from ..tables.values import values
from .document_formats import Document, latex_document, text_document
from .equations_document import document
from .expressions import Expressions, SymbolTable
from .named_equations import (
    CoordinateChoice,
    CurveParameter,
    NamedEquations,
    curve_parameters_at,
    initial_assembly,
    quaternions,
    state_by_symbol,
    trace_named_equations,
)

if TYPE_CHECKING:
    from ..results.equilibrium import Equilibrium
    from .explicit.explicit_equations import ExplicitEquations, StateEquations
    from .export import Code
    from .joint_equations import JointEquations
    from .lagrange import Lagrange
    from .linear.linear_equations import LinearEquations


@dataclass(frozen=True, kw_only=True)
class SymbolicOptions(AnalysisOptions):
    """Arguments of `Mechanism.symbolic`."""

    coordinates: str
    inputs: tuple[str, ...]
    parameters: Mapping[str, float] | None
    names: str


class EquationSymbols(SymbolTable):
    """Equations of motion of a mechanism in one kind of coordinates, in its own names.

    qdot = T v,   M vdot = f + G^T lam,   g = 0,   G v = nu,   G vdot = gamma,   zdot of the controller states z
    """

    def __init__(
        self, model: Model, chosen: CoordinateChoice, o: SymbolicOptions, parameter_values: Mapping[str, Symbol]
    ) -> None:
        self.model, self._options = model, o
        self.tree, self.coordinates = chosen  # names of the tree joints; description of the coordinates
        self.described = model  # before inputs and numbers became symbols
        self.graph = Graph()
        s = structure(model, Choices(tree=self.tree, coupled=bool(self.tree)))
        self._told = parameter_values  # symbols of parameters with other names: inputs, numbers of fields
        self._given = self._parameters(o)
        given: Any = self._given
        x = values(s, given or None)
        self.named_equations: NamedEquations = trace_named_equations(x, self.graph)

    # -- symbols

    @property
    def title(self) -> str:
        """The mechanism's name."""
        return repr(self.model.name)

    def _parameters(self, o: SymbolicOptions) -> dict[str, Node]:
        """Symbols of the parameters that have their own value; the others are expressions of these."""
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
        return self.named_equations.named | given

    @cached_property
    def units(self) -> list[list[Node]]:
        """Symbols of each quaternion: their squares add up to one."""
        return quaternions(self.named_equations)

    @property
    def parameters(self) -> dict[str, float]:
        """Parameters that are symbols, with their own values [SI]."""
        return {x.data.name: x.value for x in self._given.values() if x.data.kind == "parameter"}

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of the inputs, in the requested order; their symbols are 0 unless they are given."""
        return self._options.inputs

    def expression(self, name: str) -> Expressions:
        """A symbol by its name, to calculate with."""
        x = self.symbol(name)
        return Expressions(self, x, unit=x.data.unit)

    # -- equations

    def _symbols(self, nodes: Sequence[Node]) -> Expressions:
        return Expressions(self, object_vector(nodes), [x.data.name for x in nodes])

    @property
    def t(self) -> Expressions:
        """Time."""
        return Expressions(self, self.named_equations.traced.t, unit="s")

    @property
    def q(self) -> Expressions:
        """Coordinates, (nq,)."""
        return self._symbols(self.named_equations.traced.q)

    @property
    def v(self) -> Expressions:
        """Velocities, (nv,)."""
        return self._symbols(self.named_equations.traced.v)

    @property
    def vdot(self) -> Expressions:
        """Accelerations, (nv,)."""
        return self._symbols(self.named_equations.vdot)

    @property
    def z(self) -> Expressions:
        """Controller states, (nz,)."""
        return self._symbols(self.named_equations.traced.states)

    @property
    def zdot(self) -> Expressions:
        """Rates of the controller states, (nz,)."""
        return Expressions(self, self.named_equations.traced.state_rates, self.z.rows)

    @property
    def lam(self) -> Expressions:
        """Multipliers, (nr,)."""
        return self._symbols(self.named_equations.traced.lam)

    @property
    def loads(self) -> Expressions:
        """Normal loads of joints with friction [N], as symbols."""
        return self._symbols(self.named_equations.traced.loads)

    @property
    def load_values(self) -> Expressions:
        """The loads as functions of the multipliers: loads = load_values closes the equations."""
        return Expressions(self, self.named_equations.traced.returned, self.loads.rows, unit="N")

    @property
    def places(self) -> dict[str, CurveParameter]:
        """Curve parameters of followers, by name: symbol, equation, rate."""
        return {p.symbol.data.name: p for p in self.named_equations.places}

    @property
    def T(self) -> Expressions:
        """Matrix T of qdot = T v, (nq, nv)."""
        return Expressions(self, self.named_equations.traced.T, self.q.rows, self.v.rows)

    @property
    def M(self) -> Expressions:
        """Mass matrix, (nv, nv)."""
        return Expressions(self, self.named_equations.traced.M, self.v.rows, self.v.rows)

    @property
    def f(self) -> Expressions:
        """All forces but reactions, gyroscopic ones included, along the velocities, (nv,)."""
        return Expressions(self, self.named_equations.traced.f, self.v.rows)

    @property
    def g(self) -> Expressions:
        """Constraint residuals, (nr,): zero where closed; zero for rows on velocities only."""
        return Expressions(self, self.named_equations.traced.g, self.lam.rows)

    @property
    def nu(self) -> Expressions:
        """Right-hand side of the constraints' velocities, G v = nu, (nr,)."""
        return Expressions(self, self.named_equations.traced.nu, self.lam.rows)

    @property
    def G(self) -> Expressions:
        """Jacobian of the constraints along the velocities, (nr, nv)."""
        return Expressions(self, self.named_equations.traced.G, self.lam.rows, self.v.rows)

    @property
    def gamma(self) -> Expressions:
        """Right-hand side of the constraints' accelerations, G vdot = gamma, (nr,)."""
        return Expressions(self, self.named_equations.traced.gamma, self.lam.rows)

    @property
    def residual(self) -> Expressions:
        """M vdot - f - G^T lam, (nv,): zero along every motion."""
        return self.M @ self.vdot - self.f - self.G.T @ self.lam

    # -- numbers

    @cached_property
    def assembly(self) -> Assembly:
        """Initial state in these coordinates."""
        return initial_assembly(self.model, self._options.parameters, self.tree)

    @cached_property
    def start(self) -> dict[str, float]:
        """Time and state as described and assembled, by symbol names; computed by the engine on first use.

        Raises
        ------
        AssemblyError
            If the mechanism cannot be assembled.
        """
        a = self.assembly
        return self.state(a.t, a.q, a.v, a.compiled.z.real)

    def state(self, t: float, q: np.ndarray, v: np.ndarray, z: Sequence[float] | np.ndarray = ()) -> dict[str, Any]:
        """Arrays of the engine as values by symbol names; arrays over time have the time last.

        Parameters
        ----------
        t : float
        q : ndarray (nq,)
        v : ndarray (nv,)
        z : ndarray
            Controller states, the first of the engine's states.
        """
        return state_by_symbol(self.named_equations, t, q, v, z)

    def checked(self, values: Mapping[str, Any], requested: Mapping[str, Node]) -> dict[str, Any]:
        """Check values of symbols by name, and find the curve parameters."""
        known = dict(values)
        names = {p.symbol.data.name: p for p in self.named_equations.places}
        if missing := [p for k, p in names.items() if k in requested and k not in known]:
            known |= curve_parameters_at(self.named_equations, missing, known)
        return super().checked(known, requested)

    def evaluate(self, values: Mapping[str, Any]) -> dict[str, np.ndarray]:
        """M, f, g, nu, G, gamma, T and zdot at values of the symbols; see `Expressions.at`."""
        return {k: getattr(self, k).at(values) for k in ("T", "M", "f", "g", "nu", "G", "gamma", "zdot")}


class Quantities:
    """A motion at one time, of symbols."""

    def __init__(self, equations: Equations) -> None:
        self.equations = equations
        x = equations.named_equations
        T = x.traced
        rows = [_row(a) for a in ([T.t], x.user_q, T.v, T.z, x.vdot, T.lam)]
        t, q, v, z, vdot, lam = rows
        self.result = Result(equations.model, x.values, t[0], q, v, z, vdot, lam, health=None)  # type: ignore[arg-type]

    def quantity(self, name: str) -> Expressions:
        """A quantity of a part, by its name in results."""
        owner, what = curve_parts(name, self.result.model)
        what = what or "value"
        self._refuse(owner, what)
        if what == "quaternion":
            return self._quaternion(owner)
        if what == "power" and (found := self._power(owner)) is not None:
            return found
        try:
            with np.errstate(invalid="ignore"):  # formulas return NaN where something has no value
                unit, values = self.result.channel(f"{owner}.{what}")
        except UndeterminedDecision as error:
            raise AnalysisError(f"{name!r} has no expression: {error}") from error
        return self._of(values, unit)

    def reaction(self, joint: str, axes: str, on: str | None) -> tuple[Expressions, Expressions]:
        """Force and torque of a joint."""
        with np.errstate(invalid="ignore"):  # formulas return NaN where something has no value
            force, torque = self.result[joint].reaction(axes=axes, on=on)
        return self._of(force, "N"), self._of(torque, "N*m")

    def _of(self, values: Any, unit: str) -> Expressions:
        cleaned = self.equations.named_equations.cleaned(np.asarray(values, object))
        one = cleaned[0] if cleaned.ndim else cleaned[()]
        return Expressions(self.equations, one, unit=unit)

    def _refuse(self, owner: str, what: str) -> None:
        if what == "work":
            raise ModelError(f"'{owner}.work' is an integral along the motion, no function of the state")
        if owner == ENERGY and what == "balance":
            raise ModelError("'energy.balance' compares with the start of a motion; it is no function of the state")

    def _quaternion(self, owner: str) -> Expressions:
        """Quaternion of a free body: its coordinates."""
        x = self.equations.named_equations
        b = x.values.structure.place.get(owner, -1)
        S = x.values.system
        if b < 0 or S.tree.joint[b] != FREE:
            instead = f"{owner}.angle" if x.values.structure.model.planar else f"{owner}.rotation"
            more = "" if x.values.structure.model.planar or b < 0 else ", or coordinates='absolute'"
            raise ModelError(f"the quaternion of {owner!r} is no coordinate here: take {instead!r}{more}")
        e = [x.named[f"{owner}.e{k}"] for k in range(4)]
        return Expressions(self.equations, object_vector(e), [n.data.name for n in e], unit="1")

    def _power(self, owner: str) -> Expressions | None:
        """Power of a driver: its effort times the prescribed rate."""
        x = self.equations.named_equations
        s, T = x.values.structure, x.traced
        if owner not in {d.name for d in s.model.drivers}:
            return None
        k = s.slices[owner].start
        return self._of(np.array([T.lam[k] * T.nu[k]], object), "W")


def _row(x: list[Any]) -> np.ndarray:
    """Array (1, n) of objects for one time."""
    out = np.empty((1, len(x)), object)
    out[0, :] = x
    return out


READABLE, WRITABLE = 1e7, 1e13  # written-out symbols of chains of 8 and of 22 links in joint coordinates


class EquationDisplay:
    """Display of equations of motion as text, LaTeX and HTML."""

    @cached_property
    def document(self) -> Document:
        """Document with all equations in short form: see `text`, `to_html` and `to_latex`.

        Raises
        ------
        ModelError
            If they are too large to be written for readers.
        """
        if self._written_out > WRITABLE:
            raise ModelError(f"the {self._too_large('a page')}")
        return document(cast("Equations", self))

    @cached_property
    def _written_out(self) -> int:
        """Number of symbols of the equations without names for common subexpressions."""
        eq = cast("Equations", self)
        return expanded_symbol_count(
            x for k in ("M", "f", "g", "G", "gamma", "zdot") for x in getattr(eq, k).nodes.ravel()
        )

    def _too_large(self, what: str) -> str:
        eq = cast("Equations", self)
        return (
            f"equations of {eq.model.name!r} are too large for {what}: {self._written_out:.2g} symbols if written out; "
            "print single ones (eq.M[0, 0], eq['energy.kinetic']), or take them as code: eq.export(folder)"
        )

    def text(self) -> str:
        """The document as plain text: symbols, constraints, mass matrix, forces, equations of motion, energies."""
        return text_document(self.document)

    def latex(self) -> str:
        """The document as a complete LaTeX file, for ``pdflatex``."""
        return latex_document(self.document)

    def to_latex(self, path: str | os.PathLike) -> None:
        """Write the LaTeX file.

        Raises
        ------
        ModelError
            If the file cannot be written.
        """
        write_file(path, self.latex(), LATEX)

    def html(self) -> str:
        """The document as one HTML page that needs no network: browsers draw its formulas (MathML) themselves."""
        from ..view.equations_page import equations_page

        return equations_page(self.document)

    def to_html(self, path: str | os.PathLike) -> None:
        """Write the page.

        Raises
        ------
        ModelError
            If the file cannot be written.
        """
        write_file(path, self.html(), PAGE)

    def lines(self) -> list[tuple[str, str]]:
        """Labels and texts: sizes, and the names of all symbols."""
        eq = cast("Equations", self)
        size = {k: getattr(eq, k).operations for k in ("M", "f", "g", "G", "gamma")}
        out = [
            ("coordinates", eq.coordinates),
            ("q", ", ".join(eq.q.rows)),
            ("v", ", ".join(eq.v.rows)),
            ("z", ", ".join(eq.z.rows)),
            ("lam", ", ".join(eq.lam.rows) or "none: no constraints"),
            ("loads", ", ".join(eq.loads.rows)),
            ("places", ", ".join(eq.places)),
            ("inputs", ", ".join(eq.inputs)),
            ("parameters", ", ".join(f"{k} = {x:g}" for k, x in eq.parameters.items()) or "none"),
            ("operations", ", ".join(f"{k} {n}" for k, n in size.items())),
        ]
        return [(a, b) for a, b in out if b]

    def as_dict(self) -> dict[str, Any]:
        """Plain data: names, parameters, and the matrices as texts."""
        eq = cast("Equations", self)
        names = {k: list(getattr(eq, k).rows) for k in ("q", "v", "z", "lam", "loads")}
        texts = {k: getattr(eq, k).texts() for k in ("M", "f", "g", "nu", "G", "gamma", "zdot")}
        told = {"name": eq.model.name, "coordinates": eq.coordinates, "inputs": list(eq.inputs)}
        return told | names | {"parameters": eq.parameters} | texts

    def __str__(self) -> str:
        if self._written_out > READABLE:
            told = "\n".join(f"{label:<12} {text}" for label, text in self.lines())
            return f"{told}\nThe {self._too_large('the screen')}"
        return self.text()

    def _repr_html_(self) -> str:
        from ..view.page import notebook_iframe

        return notebook_iframe(self.html())


def _refuse_inputs(balanced_by: Sequence[str], inputs: Sequence[str]) -> None:
    """Refuse inputs among the parameters that balance the operating point."""
    for name in balanced_by:
        if name in inputs:
            raise ModelError(
                f"balanced_by names {name!r}, an input, which is what is added at the point: let its element "
                f"have a parameter of its own ({name!r} with torque='tau' or force='F', 'tau' and 'F' among the "
                f"mechanism's parameters), and name that: balanced_by=['tau']"
            )


class Linearization:
    """The linear part of `Equations`."""

    described: Model  # without the inputs
    tree: tuple[str, ...]
    _options: Any

    def linear(
        self,
        outputs: Sequence[str] = (),
        *,
        at: Equilibrium | Result | Mapping[str, Any] | None = None,
        independent: Sequence[str] = (),
        balanced_by: Sequence[str] = (),
    ) -> LinearEquations:
        """Linear equations x' = A x + B u, y = C x + D u whose entries are expressions of the parameters.

        They follow from the constrained equations by derivatives at the point, including reactions that turn with the
        bodies; transfer functions and conditions of stability follow from them. The inputs u are those of
        `Mechanism.symbolic`. The point is an equilibrium, or a motion in which joint coordinates turn at constant rates
        while all others are constant.

        Parameters
        ----------
        outputs : sequence of str
            Quantities of results: coordinates, sensors, reactions such as ``"A.fx"``, energies.
        at : Equilibrium, Result or mapping, optional
            Operating point. By default the reference configuration, with the parameters as symbols. A mapping gives
            coordinates, and as ``"A.angle rate"`` or ``"A.angle'"`` their rates: numbers, texts with a unit,
            expressions of the mechanism's parameters. Coordinates that are not given keep their reference values, or
            are moved to close loops. At an equilibrium, or the end of a motion, the coordinates are numbers.
        independent : sequence of str
            Coordinates whose changes are the states; chosen by pivoting if not given.
        balanced_by : sequence of str
            Parameters and controller states that are solved for so that the point is an equilibrium, as many as there
            are conditions.

        Raises
        ------
        ModelError
            If a name does not exist, the point cannot be closed, is singular or no equilibrium, or something moves
            without inertia.
        AnalysisError
            If the linear equations change with time.
        """
        from .linear.linear_equations import LinearizationOptions, linearize_about

        _refuse_inputs(balanced_by, self._options.inputs)
        if isinstance(at, Mapping):
            at = {_rate(name): x for name, x in at.items()}

        return linearize_about(
            self.described,
            LinearizationOptions(
                inputs=self._options.inputs,
                outputs=outputs,
                at=at,
                coordinates="joint" if self.tree else "absolute",
                independent=independent,
                balanced_by=balanced_by,
                parameters=self._options.parameters,
                tree=self.tree,
            ),
        )


def _rate(name: Any) -> Any:
    """Convert ``"A.angle rate"``, the name of a state, to the symbol ``"A.angle'"``."""
    return f"{name[:-1]} rate" if isinstance(name, str) and name.endswith("'") else name


class Equations(EquationDisplay, Linearization, EquationSymbols):
    """Equations of motion of a mechanism in one kind of coordinates.

        qdot = T v,   M vdot = f + G^T lam,   g = 0,   G v = nu,   G vdot = gamma,   zdot of the controller states z

    Symbols have the names used in results: ``"A.angle"``, its rate ``"A.angle'"``, parameters by their names. All are
    `Expressions`: ``eq.M[0, 0]``, ``eq.f.sympy()``, ``eq.g.at({"A.angle": 0.3})``. Every quantity of a result is
    available by its name: ``eq["slider.x"]``, ``eq["A.force"]``, ``eq["energy.kinetic"]``, ``eq["spring.power"]``.

    Attributes
    ----------
    model : Mechanism
    coordinates : str
        Description of the coordinates, with the reason of the choice.
    q, v, vdot : Expressions
        The symbols of coordinates, velocities and accelerations. A body that is free in space has the Euler parameters
        ``e0`` to ``e3`` in q, and in v the angular velocity ``w_x``, ``w_y``, ``w_z`` along its own axes.
    z, zdot : Expressions
        The symbols of controller states, ``"pid.integral"``, and their rates.
    lam : Expressions
        The symbols of the multipliers, one for each row of g; of a driver or a coupling its effort.
    loads : Expressions
        Normal loads of joints with friction: symbols in f. ``load_values`` gives them as functions of the
        multipliers.
    T, M, f, g, nu, G, gamma : Expressions
        f contains all forces except reactions, with gyroscopic terms. Drivers have constraint rows like joints.
    """

    # -- quantities of results

    @cached_property
    def quantities(self) -> Quantities:
        """Quantities of a motion at one time, as expressions."""
        return Quantities(self)

    def __getitem__(self, name: str) -> Expressions:
        """A quantity of a result by its name, or a symbol.

        Quantities of joints and drivers contain the multipliers. Those of tree joints contain the accelerations, too.

        Raises
        ------
        ModelError
            If the name is unknown, or the quantity is no function of the state: works, energy balances.
        """
        return self.expression(name) if name in self.named else self.quantities.quantity(name)

    def reaction(self, joint: str, *, axes: str = "world", on: str | None = None) -> tuple[Expressions, Expressions]:
        """Force [N] and torque [N m] of a joint, as `JointView.reaction`, in terms of lam (and vdot for tree joints).

        Parameters
        ----------
        joint : str
        axes : str
            ``"world"``, ``"joint"``, or the name of one of the two bodies.
        on : str, optional
            The body on which it acts; by default the second one. The torque is about the joint's point on that body.
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
            Whether to refuse mechanisms whose loops have no closed form; else these coordinates are implicit functions.

        Raises
        ------
        ModelError
            If a name does not exist, or the coordinates named depend on one another, are too many or too few.
        SingularityError
            If the reference configuration is a singular position.
        """
        from .explicit.explicit_equations import explicit_equations

        return explicit_equations(self, independent, closed)

    def state_space(
        self, outputs: Sequence[str] = (), *, independent: Sequence[str] = (), closed: bool = False
    ) -> StateEquations:
        """The nonlinear state space x' = f(x, u, t), y = h(x, u, t); the inputs u are those of `Mechanism.symbolic`.

        Parameters
        ----------
        outputs : sequence of str
            Quantities of results: coordinates, sensors, reactions such as ``"A.fx"``, energies.
        independent, closed
            As for `explicit`.

        Raises
        ------
        ModelError
            As for `explicit`; if an output does not exist or is not determined.
        SingularityError
            If the reference configuration is a singular position.
        """
        from .explicit.explicit_equations import StateEquations

        return StateEquations(self.explicit(independent, closed=closed), outputs)

    def joint(self, name: str, *, orientation: str = "quaternion") -> JointEquations:
        """Equations of one joint between two free frames, with the building blocks that they come from.

        Parameters
        ----------
        name : str
        orientation : {"quaternion", "bryant"}
            Symbols for the orientation of the frames.
        """
        from .joint_equations import joint_equations

        return joint_equations(self.model, self._given.items(), name, orientation)

    def lagrange(self) -> Lagrange:
        """The same equations from the energies, by Lagrange's formalism; in quasi-velocities where bodies turn."""
        from .lagrange import Lagrange

        return Lagrange(self)

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
        from .export import export_equations

        return export_equations(self, folder, language=language, functions=functions, outputs=outputs, name=name)

    def __repr__(self) -> str:
        return f"<equations of {self.model.name!r} in {self.coordinates.partition(':')[0]} coordinates>"
