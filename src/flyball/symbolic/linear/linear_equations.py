"""Linear equations of a mechanism about an operating point, with entries that are expressions of its parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from ...errors import AnalysisError, ModelError
from ...expression_graph.graph import Node, Symbol, evaluate, substitute, symbols_of
from ...linear.operating_point import operating_state
from ...model.messages import listing, suggest
from ...model.model import Model
from ...results.equilibrium import Equilibrium
from ...results.result import Result
from ...results.wording import with_unit
from ...tables.coordinate_choice import rotors, spanning_joints
from ..explicit.linear_systems import nominal_value
from ..expressions import Expressions, SymbolTable
from .operating_point import (
    OperatingPoint,
    Validity,
    balancing_multipliers,
    balancing_parameters,
    equilibrium_conditions,
    given_point,
    not_identically_zero,
    reference_point,
    refuse_singular,
    refuse_unbalanced,
    refuse_unsteady,
)
from .polynomials import cancel_common_factors, readable_coefficients, scale_fraction
from .stability_conditions import StabilityConditions, stability_conditions
from .state_matrices import (
    Derivatives,
    Freedoms,
    Perturbed,
    StateSpaceMatrices,
    TracedMechanism,
    find_freedoms,
    reduce_linear,
    refuse_unknown,
    state_space_matrices,
    trace_mechanism,
)
from .transfer_functions import PolynomialPencil, TransferFunction, checked_values, polynomial_pencil

FACTORED = 300  # operations up to which entries are factored for display


@dataclass
class LinearEquations(SymbolTable):
    """Linear equations x' = A x + B u, y = C x + D u whose entries are expressions of the mechanism's parameters.

    The states are changes of as many coordinates as there are freedoms, of their rates, and of controller states, as in
    `LinearModel`.

    Attributes
    ----------
    name : str
    parameters : dict
        Name -> value of the parameters that have their own value.
    matrices : StateSpaceMatrices
        The matrices as arrays of nodes.
    conditions : list of Node
        Expressions that must vanish for the point to be an equilibrium. The equations are valid for parameters with
        which they vanish; other values are refused.
    balanced_by : dict
        Parameter -> expression of the others, solved from the conditions of equilibrium.
    found : tuple of str
        Coordinates that are numbers at the point, independent of the parameters: loops were closed numerically.
    """

    name: str
    parameters: dict[str, float]
    matrices: StateSpaceMatrices
    conditions: list[Node]
    balanced_by: dict[str, Node]
    found: tuple[str, ...]
    at: Perturbed = field(repr=False)
    free: Freedoms = field(repr=False)
    mechanics: TracedMechanism = field(repr=False)
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
        """Matrix A of x' = A x + B u, (n, n)."""
        return self._told(self.matrices.A, self.states, self.states)

    @property
    def B(self) -> Expressions:
        """Matrix B of x' = A x + B u, (n, inputs); errors as for `C`."""
        return self._proper(self.matrices.B, self.states, self.inputs)

    @property
    def C(self) -> Expressions:
        """Matrix C of y = C x + D u, (outputs, n).

        Raises
        ------
        AnalysisError
            If an output depends on the rate of an input.
        """
        return self._proper(self.matrices.C, self.outputs, self.states)

    @property
    def D(self) -> Expressions:
        """Matrix D of y = C x + D u, (outputs, inputs); errors as for `C`."""
        return self._proper(self.matrices.D, self.outputs, self.inputs)

    @property
    def mass(self) -> Expressions | None:
        """Matrix M of M a'' + D a' + K a = 0 in the first f states, (f, f); None with velocity constraints."""
        return self._second(self.matrices.mass)

    @property
    def damping(self) -> Expressions | None:
        """Matrix D of M a'' + D a' + K a = 0; None as for `mass`."""
        return self._second(self.matrices.damping)

    @property
    def stiffness(self) -> Expressions | None:
        """Matrix K of M a'' + D a' + K a = 0; None as for `mass`."""
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
        return {x.data.name: x for x in symbols_of([n for X in (m.A, m.B, m.C, m.D) for n in X.ravel().tolist()])}

    def checked(self, values: Mapping[str, Any], requested: Mapping[str, Node]) -> dict[str, float]:
        """Check values by symbol name for `Expressions`; unknown names are refused."""
        return checked_values(self, values)

    def values(self, **parameters: float) -> dict[str, np.ndarray]:
        """Numerical A, B, C, D with the parameters' own values, or others.

        Raises
        ------
        ModelError
            If a parameter is unknown or determined by equilibrium, or the point is no equilibrium with it.
        """
        return {k: getattr(self, k).at(parameters).astype(float) + 0.0 for k in "ABCD"}

    def eigenvalues(self, **parameters: float) -> np.ndarray:
        """Eigenvalues of the numerical A, (n,) complex [1/s]."""
        return np.linalg.eigvals(self.A.at(parameters).astype(float))

    def balance(self, **parameters: float) -> dict[str, float]:
        """Values of the parameters in ``balanced_by``, for values of the others."""
        told = checked_values(self, parameters)
        found = evaluate(list(self.balanced_by.values()), told)
        return {k: float(x) for k, x in zip(self.balanced_by, found, strict=True)}

    @cached_property
    def pencil(self) -> PolynomialPencil:
        """The equations as a matrix of polynomials, with constraints."""
        positive = [k for k, x in self.parameters.items() if x > 0.0]
        return polynomial_pencil(self.mechanics, self.at, self.free, positive)

    def transfer_function(self, input: str | None = None, output: str | None = None) -> TransferFunction:
        """Transfer function with symbolic coefficients; of the only input and output by default.

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
        num, den, common = cancel_common_factors(ring, P.numerator(i, k), P.characteristic() * P.below[k])
        num, den = scale_fraction(ring, num, den)
        both = [readable_coefficients(ring, num), readable_coefficients(ring, den)]
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
        """Conditions for negative real parts of all eigenvalues, as inequalities in the parameters.

        Parameters
        ----------
        positive : sequence of str, optional
            Positive quantities: parameters, and ``"sin(alpha)"`` or similar; by default all that are positive now.

        Raises
        ------
        ModelError
            If the mechanism is too large, with the size met.
        ImportError
            If the package ``sympy`` is not installed.
        """
        P = self.pencil
        out = stability_conditions(P.ring, P.characteristic(), self.name, (self.parameters, self.balanced_by), positive)
        out.validity = self.validity
        return out

    def lines(self) -> list[tuple[str, str]]:
        """Labels and texts of the report: names, and the conditions of equilibrium."""
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
        """Expression for display: factored, where that is cheap."""
        made = self.printer(x)
        return self.printer.sympy.factor(made) if made.count_ops() < FACTORED else made

    def __repr__(self) -> str:
        return "\n".join(f"{a}: {b}" for a, b in self.lines())

    def __str__(self) -> str:
        """Names and matrices as text."""
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
        """Index of an input or output; of the only one if not named."""
        names: tuple[str, ...] = getattr(self, f"{what}s")
        if name is None and len(names) == 1:
            return 0
        if name not in names:
            given = "say which" if name is None else f"there is no {what} {name!r}{suggest(name, list(names))}"
            there = listing(list(names)) if names else f"the equations were made without any: {what}s=[...]"
            raise ModelError(f"{given}; {there}")
        return names.index(name)


REST_TOLERANCE = 1e-12  # relative to the characteristic rate: smaller rates are rounding


@dataclass(frozen=True, kw_only=True)
class LinearizationOptions:
    """Arguments of `linear_equations`."""

    inputs: Sequence[str] = ()
    outputs: Sequence[str] = ()
    at: Equilibrium | Result | Mapping[str, Any] | None = None
    coordinates: str = "joint"
    independent: Sequence[str] = ()
    balanced_by: Sequence[str] = ()
    parameters: Mapping[str, float] | None = None
    tree: Sequence[str] | None = None  # the tree joints, if known


def linear_equations(
    model: Model,
    inputs: Sequence[str] = (),
    outputs: Sequence[str] = (),
    *,
    at: Equilibrium | Result | Mapping[str, Any] | None = None,
    coordinates: str = "joint",
    independent: Sequence[str] = (),
    balanced_by: Sequence[str] = (),
    parameters: Mapping[str, float] | None = None,
) -> LinearEquations:
    """Linear equations x' = A x + B u, y = C x + D u with the parameters as symbols.

    About an equilibrium, or a motion in which joint coordinates turn at constant rates while all others are constant.

    Parameters
    ----------
    inputs, outputs : sequence of str
        As for `Mechanism.linearize`.
    at : Equilibrium, Result or mapping, optional
        Operating point. By default the reference configuration, with coordinates as the expressions that define it. A
        mapping gives coordinates, and as ``"A.angle rate"`` their rates: numbers, texts with a unit, expressions of
        parameters. Coordinates that are not given keep their reference values, or are moved to close loops. At an
        equilibrium, or the end of a motion, the coordinates are numbers.
    coordinates : {"joint", "absolute"}
        Coordinates of the equations.
    independent : sequence of str
        Coordinates whose changes are the states; chosen by pivoting if not given.
    balanced_by : sequence of str
        Parameters and controller states that are solved for so that the point is an equilibrium, as many as there are
        conditions.
    parameters : mapping, optional
        Values that replace the model's own, in SI units or with a unit.

    Raises
    ------
    ModelError
        If a name does not exist, the point cannot be closed, is singular or no equilibrium, or something moves without
        inertia.
    AnalysisError
        If the linear equations change with time, or an output depends on the rate of an input.
    """
    if coordinates not in ("joint", "absolute"):
        raise ModelError(f"unknown coordinates {coordinates!r}; choose one of joint, absolute")
    asked = LinearizationOptions(
        inputs=inputs, outputs=outputs, at=at, coordinates=coordinates, independent=independent,
        balanced_by=balanced_by, parameters=parameters,
    )  # fmt: skip
    return linearize_about(model, asked)


def linearize_about(model: Model, o: LinearizationOptions) -> LinearEquations:
    """As `linear_equations`."""
    refuse_unknown(model, o.outputs)
    m, point = _traced_at_point(model, o)
    for name in {*o.balanced_by} & {*m.controls}:  # unknown for now
        k = m.controls.index(name)
        point.z[k] = m.given[name] = m.graph.symbol(Symbol(name, "parameter"), nominal_value(point.z[k]))
    curves = [m.output(name) for name in o.outputs]
    d = Derivatives(m, [y for _, y in curves])
    where = point.replacing(m)
    first = d.at([*where, *((s, 0.0) for s in m.multipliers)])
    refuse_singular(m, [m.graph.node(x) for x in _by_velocity(d)], point)
    f = find_freedoms(m, first, o.independent)
    lam = balancing_multipliers(m, point, f)
    at_rest = equilibrium_conditions(m, point, lam, f)
    pairs = balancing_parameters(m, at_rest, o.balanced_by) if o.balanced_by else []
    q, v, z = (substitute(part, pairs) for part in (point.q, point.v, point.z))
    point = OperatingPoint(q, v, z, point.t, point.found)
    lam[:] = substitute(list(lam), pairs)
    known = {s.data.name: nominal_value(x) for s, x in [*pairs, *zip(m.multipliers, lam, strict=True)]}
    refuse_unbalanced(m, f, first, point.numbers(m) | _loads_at_rest(m) | known)
    where = [*point.replacing(m), *zip(m.multipliers, lam, strict=True)]
    p = d.at(where).replaced(pairs) if pairs else d.at(where)
    f = find_freedoms(m, p, o.independent)
    refuse_unsteady(m, d, f, point, known)
    out = state_space_matrices(
        m, p, f, reduce_linear(m, p, f), list(zip(o.outputs, (unit for unit, _ in curves), strict=True))
    )
    return LinearEquations(
        name=m.model.name,
        parameters={k: x.value for k, x in m.given.items() if x not in m.added and k not in dict(_names(pairs))},
        conditions=[] if pairs else at_rest,
        balanced_by=dict(_names(pairs)),
        found=point.found,
        at=p,
        free=f,
        mechanics=m,
        matrices=out,
        validity=Validity([] if pairs else at_rest, not_identically_zero(substitute(list(m.g), where))),
    )


def _names(pairs: Sequence[tuple[Any, Any]]) -> list[tuple[str, Any]]:
    return [(s.data.name, x) for s, x in pairs]


def _by_velocity(d: Derivatives) -> list[Any]:
    """Entries of G, row by row."""
    rows = slice(*d.ends[2:4])
    columns = np.array([c[rows] for c in d.columns["v"]], object).reshape(len(d.m.x.v), -1)
    return list(columns.T.ravel())


def _loads_at_rest(m: TracedMechanism) -> dict[str, float]:
    """Values of the loads of joints with friction, which are no unknowns at rest."""
    return {s.data.name: 0.0 for s in m.x.loads}


def _traced_at_point(model: Model, o: LinearizationOptions) -> tuple[TracedMechanism, OperatingPoint]:
    """The traced mechanism and the operating point."""
    if isinstance(o.at, Equilibrium | Result):
        if isinstance(o.at, Equilibrium) and o.at.preload:
            raise ModelError(
                "at is an equilibrium under a preload, which is no part of the mechanism: add it to its forces"
            )
        x, _ = operating_state(model, o.at, coordinates=o.coordinates, parameters=o.parameters)
        values = dict(x.c.parameters)
        m = trace_mechanism(model, x.c.structure.tree, o.inputs, values)
        moves = np.abs(x.v / x.c.sizes).max(initial=0.0) > REST_TOLERANCE * x.c.work.options.rate
        v = x.v if moves else 0.0 * x.v
        return m, OperatingPoint(x.q.tolist(), v.tolist(), x.z.tolist(), x.t)
    tree = o.tree
    if tree is None:
        tree = spanning_joints(model) if o.coordinates == "joint" or rotors(model) else ()
    m = trace_mechanism(model, tree, o.inputs, o.parameters)
    return m, reference_or_given(m, o.at)


def reference_or_given(m: TracedMechanism, at: Mapping[str, Any] | None) -> OperatingPoint:
    """The given point, or the reference configuration if its loops are closed; else moved to close them."""
    if not (at is None or isinstance(at, Mapping)):
        raise ModelError(
            f"at={at!r}: must be a mapping of coordinates, an equilibrium, a result, or None for the reference "
            "configuration"
        )
    return given_point(m, at or {}) if at or len(m.g) else reference_point(m)
