"""Matrices A, B, C, D of linear equations of expressions: derivatives of the traced equations, constraints eliminated.

    r = M vdot - f - G^T lam,  g,  n = G v - nu,  s = zdot,  y

are differentiated by positions (along the velocities, so that quaternions have three directions), velocities,
controller states, accelerations, multipliers and inputs. Multipliers are held constant: the change of the reactions'
directions, d(G^T lam)/dx, is in dr/dx.

`derivatives/linearized_equations` has the equations of the elimination. Independent rows and coordinates are chosen by
the values of the parameters, with the pivoting of `Mechanism.linearize`; the basis consists of expressions.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ...derivatives.linearized_equations import (
    InputTerms,
    ReducedEquations,
    acting_terms,
    constrained_changes,
    massless_motion_error,
    pivot_rows,
    product,
    state_names,
)
from ...engine.kinematics import quaternion_at
from ...errors import ModelError
from ...expression_graph.graph import (
    Graph,
    Node,
    Symbol,
    directional_derivatives,
    evaluate,
    object_vector,
    substitute,
    zero_objects,
)
from ...expression_graph.tracing import (
    TracedEquations,
    object_tables,
    parameter_symbols,
    trace_equations,
    with_prescribed_rows,
)
from ...laws.python_functions import refuse_function_laws
from ...model.contact import has_contact
from ...model.element_laws import Input, with_inputs
from ...model.model import Model
from ...model.quantities import single_quantity
from ...model.unsupported_elements import refuse_sampled_controllers
from ...numerics.rank import RANK_TOLERANCE, null_space, rank
from ...results.health import Health
from ...results.result import Result
from ...tables.structure import Choices, structure
from ...tables.structure_definition import VelocityName, velocity_names
from ...tables.values import Values, values
from ..explicit.linear_systems import DependentEquations, is_zero, nominal_values, solve_equations


@dataclass
class TracedMechanism:
    """A mechanism as expressions: its equations of motion, its reference state, its inputs.

    Attributes
    ----------
    values : Values
        Tables and reference state, as expressions.
    x : TracedEquations
    given : dict
        Parameter -> its symbol.
    env : dict
        Parameter -> expression of the parameters that have their own value.
    inputs : list of Input
    names : list of VelocityName
        Names of all velocities.
    vdot : list of Node
        Symbols of the accelerations.
    n : ndarray (rows,)
        Constraints on velocities, G v - nu; prescribed coordinates follow the rows.
    r : ndarray (nv,)
        M vdot - f - G^T lam.
    holonomic : ndarray of bool (rows,)
    """

    values: Values
    x: TracedEquations
    given: dict[str, Node]
    env: Mapping[str, Any]
    inputs: list[Input]
    names: list[VelocityName]
    vdot: list[Node]
    n: np.ndarray
    r: np.ndarray
    holonomic: np.ndarray

    @property
    def graph(self) -> Graph:
        """The graph of all expressions."""
        return self.x.graph

    @property
    def g(self) -> np.ndarray:
        """Constraints on positions, (rows,); prescribed coordinates follow the rows."""
        return self.x.g

    @property
    def s(self) -> np.ndarray:
        """Rates of the controller states, (nz,)."""
        return self.x.state_rates

    @property
    def multipliers(self) -> list[Node]:
        """Symbols of the multipliers of the rows, then of prescribed coordinates (their efforts)."""
        return self.x.lam

    @property
    def model(self) -> Model:
        """The model, with the inputs in its laws."""
        return self.values.structure.model

    @property
    def pushed(self) -> list[Node]:
        """Symbols of the inputs."""
        return [self.given[i.parameter] for i in self.inputs]

    @property
    def added(self) -> list[Node]:
        """Symbols of the inputs that are no parameters of the mechanism: zero at the point."""
        return [self.given[i.parameter] for i in self.inputs if i.name != i.parameter]

    @property
    def controls(self) -> list[str]:
        """Names of the controller states."""
        return [x.name for x in self.values.structure.controls]

    @cached_property
    def scale(self) -> np.ndarray:
        """Natural step along every velocity, relative to the mechanism's length."""
        return np.array([1.0 if k.unit == "m" else 1.0 / self.values.length for k in self.names])

    @cached_property
    def result(self) -> Result:
        """The state as a result with one time, of expressions; outputs are its curves."""
        x = self.x
        q, v, a, lam, z = (object_vector(part)[None] for part in (x.q, x.v, self.vdot, self.multipliers, x.z))
        health = Health(True, "one state", 0.0, 0.0, 0, 0, 0, 0, 0.0)
        return Result(self.model, self.values, np.array([x.t], object), q, v, z, a, lam, health)

    def output(self, name: str) -> tuple[str, Node]:
        """(unit, expression) of a curve of results, or of a sensor."""
        unit, found = self.result.curve(name)
        return unit, self.graph.node(np.ravel(found)[0])


def trace_mechanism(
    model: Model, tree: Sequence[str], inputs: Sequence[str], changed_parameters: Mapping[str, float] | None
) -> TracedMechanism:
    """Trace a mechanism.

    Parameters
    ----------
    model : Model
    tree : sequence of str
        Tree joints; none for absolute coordinates.
    inputs : sequence of str
        See `Mechanism.linearize`.
    changed_parameters : mapping, optional
        Values of parameters that replace the model's own.

    Raises
    ------
    ModelError
        If there is no such input, or the mechanism has contact, sampled controllers or laws that are Python functions.
    """
    refuse_sampled_controllers(model, "symbolic")
    if has_contact(model):
        raise ModelError(
            f"{model.name!r} has contact, which is no set of equations; linearize takes it where it rests, in numbers"
        )
    model, named = with_inputs(model, inputs)
    model = _with_values(model, changed_parameters or {}).snapshot()
    s = structure(model, Choices(tree=tuple(tree), coupled=bool(tree)))
    refuse_function_laws(s.functions)
    graph = Graph()
    given = parameter_symbols(model, graph)
    V = values(s, given)  # type: ignore[arg-type]
    x = trace_equations(s, V.system if given else object_tables(V.system), graph)
    vdot = [graph.symbol(Symbol(f"a[{d}]", "acceleration", f"a_{{{d}}}")) for d in range(s.nv)]
    efforts = [graph.symbol(Symbol(f"effort[{k}]", "multiplier")) for k in range(len(s.prescribed))]
    x = with_prescribed_rows(x, [*x.lam, *efforts])
    v, lam = object_vector(x.v), object_vector(x.lam)
    r = x.M @ object_vector(vdot) - x.f - x.G.T @ lam
    r[:] = substitute(list(r), list(zip(x.loads, x.returned, strict=True)))
    holonomic = np.array([*(row.holonomic for row in s.rows), *(True for _ in efforts)], bool)
    return TracedMechanism(V, x, given, V.env, named, velocity_names(s), vdot, x.G @ v - x.nu, r, holonomic)


def refuse_unknown(model: Model, outputs: Sequence[str]) -> None:
    """Refuse unknown outputs."""
    for name in outputs:
        single_quantity(model, name)


def _with_values(model: Model, changed_parameters: Mapping[str, float]) -> Model:
    """Copy of the model with these parameter values."""
    out = model.copy()
    out.environment(changed_parameters)  # refuses unknown parameters
    for name, x in changed_parameters.items():
        out.parameters[name] = x
    return out


BY = ("x", "v", "z", "a", "l", "w")


@dataclass
class Perturbed:
    """Values and derivatives of the equations at a point, as expressions of parameters, or numbers.

    Attributes
    ----------
    value : dict
        ``"r"``, ``"g"``, ``"n"``, ``"s"``, ``"y"`` -> values.
    by : dict
        ``"rx"`` -> derivatives of r by positions, and so on: rows ``r``, ``g``, ``n``, ``s``, ``y``, columns `BY`.
    N : ndarray (nv, nv)
        (rate of a change of position) = (change of velocity) + N (change of position).
    T : ndarray (nq, nv)
        Matrix of qdot = T v.
    """

    value: dict[str, np.ndarray]
    by: dict[str, np.ndarray]
    N: np.ndarray
    T: np.ndarray

    def replaced(self, pairs: Sequence[tuple[Node, Node]]) -> Perturbed:
        """Replace parameters by other expressions."""

        def new(X: np.ndarray) -> np.ndarray:
            out = X.copy()
            out.ravel()[:] = substitute(list(X.ravel()), pairs)
            return out

        value, by = ({k: new(X) for k, X in of.items()} for of in (self.value, self.by))
        return Perturbed(value, by, new(self.N), new(self.T))


class Derivatives:
    """All equations and their derivatives, as expressions of the state.

    Parameters
    ----------
    m : TracedMechanism
    outputs : sequence of Node
    """

    def __init__(self, m: TracedMechanism, outputs: Sequence[Node]) -> None:
        self.m = m
        self.blocks: dict[str, np.ndarray] = {"r": m.r, "g": m.g, "n": m.n, "s": m.s, "y": object_vector(outputs)}
        self.ends = np.cumsum([0, *(len(b) for b in self.blocks.values())])
        nodes = [x for b in self.blocks.values() for x in b]
        self.nodes = nodes
        x = m.x
        along = [list(zip(x.q, x.T[:, d], strict=True)) for d in range(len(x.v))]
        seeds = {"x": [[(q, t) for q, t in a if t != 0.0] for a in along]}
        seeds |= {k: [[(s, 1.0)] for s in of] for k, of in zip(
            BY[1:], (x.v, x.states, m.vdot, m.multipliers, m.pushed), strict=True
        )}  # fmt: skip
        self.columns = {k: [directional_derivatives(nodes, s) for s in of] for k, of in seeds.items()}
        self.N = _turning(m)

    @property
    def all(self) -> list[Any]:
        """All expressions, in a fixed order."""
        columns = [x for of in self.columns.values() for column in of for x in column]
        return [*self.nodes, *columns, *self.N.ravel(), *self.m.x.T.ravel()]

    def at(self, point: Sequence[tuple[Node, Any]]) -> Perturbed:
        """Replace the symbols of the state by other expressions."""
        return self._sorted(substitute(self.all, point))

    def near(self, point: Mapping[str, float]) -> Perturbed:
        """Evaluate with numbers; symbol's name -> value."""
        return self._sorted(evaluate(self.all, point))

    def _sorted(self, found: list[Any]) -> Perturbed:
        rows = len(self.nodes)
        value = self._parted(object_vector(found[:rows]))
        at, by = rows, dict[str, np.ndarray]()
        for k in BY:
            count = len(self.columns[k])
            J = zero_objects(rows, count)
            for c in range(count):
                J[:, c] = found[at : at + rows]
                at += rows
            by |= {f"{name}{k}": part for name, part in self._parted(J).items()}
        nv, nq = len(self.m.x.v), len(self.m.x.q)
        N = object_vector(found[at : at + nv * nv]).reshape(nv, nv)
        T = object_vector(found[at + nv * nv :]).reshape(nq, nv)
        return Perturbed(value, by, N, T)

    def _parted(self, J: np.ndarray) -> dict[str, np.ndarray]:
        return {k: J[i:j] for k, i, j in zip(self.blocks, self.ends[:-1], self.ends[1:], strict=True)}


def _turning(m: TracedMechanism) -> np.ndarray:
    """Matrix N: the changes of rotations have components along turning axes."""
    nv = len(m.x.v)
    N = zero_objects(nv, nv)
    for b in range(len(m.x.system.tree.parent)):
        _, w0 = quaternion_at(m.x.system, b)
        if w0 >= 0:
            x, y, z = m.x.v[w0 : w0 + 3]
            N[w0 : w0 + 3, w0 : w0 + 3] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]  # -(w x)
    return N


ROUNDING_TOLERANCE = 1e-13  # rows below this part of the largest are rounding


@dataclass
class Freedoms:
    """Free coordinates at a point, and independent constraints.

    Attributes
    ----------
    G : ndarray (rows, nv)
        All constraints, along the velocities.
    chosen, chosen_v : ndarray of int
        Free coordinates, and free velocities.
    rows, rows_v : ndarray of int
        Independent constraints on positions, and among all constraints; the others follow from these.
    held : ndarray of int
        Rotations of point masses, which are fixed.
    on_positions : ndarray of bool (rows,)
        Which constraints are on positions.
    """

    G: np.ndarray
    chosen: np.ndarray
    chosen_v: np.ndarray
    rows: np.ndarray
    rows_v: np.ndarray
    held: np.ndarray
    on_positions: np.ndarray

    @cached_property
    def Z(self) -> np.ndarray:
        """Basis of the changes of positions, (nv, f), with the identity in the rows ``chosen``."""
        return self._basis(self.rows, self.chosen)

    @cached_property
    def Zv(self) -> np.ndarray:
        """Basis of the changes of velocities, (nv, fv), with the identity in the rows ``chosen_v``."""
        return self.Z if self.chosen_v is self.chosen else self._basis(self.rows_v, self.chosen_v)

    def dependent_positions(self, right: np.ndarray) -> np.ndarray:
        """See `FreeMotions`."""
        every = zero_objects(len(self.G), right.shape[1])
        every[self.on_positions] = right
        return self._dependent(self.rows, self.chosen, every)

    def dependent_velocities(self, right: np.ndarray) -> np.ndarray:
        """See `FreeMotions`."""
        return self._dependent(self.rows_v, self.chosen_v, right)

    def coordinates(self, x: np.ndarray) -> np.ndarray:
        """See `FreeMotions`."""
        return x[self.chosen]

    @property
    def dependent_v(self) -> np.ndarray:
        """Velocities that depend on the chosen ones."""
        return self._others(self.chosen_v)

    def _others(self, chosen: np.ndarray) -> np.ndarray:
        return np.setdiff1d(np.arange(self.G.shape[1]), np.r_[chosen, self.held])

    def _dependent(self, rows: np.ndarray, chosen: np.ndarray, right: np.ndarray) -> np.ndarray:
        out, others = zero_objects(self.G.shape[1], right.shape[1]), self._others(chosen)
        if len(others) and right.shape[1]:
            out[others] = -solve_equations(self.G[np.ix_(rows, others)], right[rows])
        return out

    def _basis(self, rows: np.ndarray, chosen: np.ndarray) -> np.ndarray:
        identity = np.eye(self.G.shape[1]).astype(object)
        return identity[:, chosen] + self._dependent(rows, chosen, self.G[:, chosen])


def find_freedoms(m: TracedMechanism, p: Perturbed, requested: Sequence[str] = ()) -> Freedoms:
    """Freedoms at a point; ``requested`` names the independent coordinates.

    Raises
    ------
    ModelError
        If the requested coordinates do not determine the others.
    """
    G = p.by["nv"]
    held = _massless_velocities(p)
    which = np.flatnonzero(m.holonomic)
    chosen, rows = _chosen(m, G, which, held, _indices(m, requested))
    chosen_v, rows_v = chosen, rows
    if len(which) < len(G):
        chosen_v, rows_v = _chosen(m, G, np.arange(len(G)), held, None)
    return Freedoms(G, chosen, chosen_v, rows, rows_v, held, m.holonomic)


def _indices(m: TracedMechanism, requested: Sequence[str]) -> np.ndarray | None:
    known = [n.name for n in m.names]
    for name in requested:
        if name not in known:
            raise ModelError(f"there is no coordinate {name!r} among those that can be independent: {', '.join(known)}")
    return np.sort([known.index(name) for name in requested]) if requested else None


def scaled_rows(G: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """Values of rows scaled to unit norm, rotations scaled to lengths."""
    A = nominal_values(G) * scale
    size = np.sqrt((A * A).sum(axis=1))
    least = ROUNDING_TOLERANCE * size.max(initial=0.0)
    return np.where(size > least, 1.0 / np.where(size > least, size, 1.0), 0.0)[:, None] * A


def _chosen(
    m: TracedMechanism, G: np.ndarray, which: np.ndarray, held: np.ndarray, requested: np.ndarray | None
) -> tuple[np.ndarray, np.ndarray]:
    """Independent coordinates and independent rows."""
    from scipy.linalg import qr

    still = np.eye(len(m.names))[held]
    A = np.vstack([scaled_rows(G[which], m.scale), still])
    N = null_space(A)
    chosen = pivot_rows(N)
    if requested is not None:
        if len(requested) != len(chosen) or rank(N[requested]) < len(chosen):
            raise ModelError(
                f"{', '.join(m.names[d].name for d in requested)} do not determine the other coordinates there: "
                f"{len(chosen)} that do are {', '.join(m.names[d].name for d in chosen)}"
            )
        chosen = requested
    if not len(which):
        return chosen, which
    _, R, order = qr(A[: len(which)].T, mode="economic", pivoting=True)
    d = np.abs(np.diag(R))
    return chosen, np.sort(which[order[: int((d > RANK_TOLERANCE * d[0]).sum())]])


def _massless_velocities(p: Perturbed) -> np.ndarray:
    """Velocities without inertia, force and constraint."""
    empty = lambda X: np.array([all(is_zero(x) for x in row) for row in X], bool)  # noqa: E731
    out = empty(p.by["ra"]) & empty(p.by["rx"]) & empty(p.by["rv"]) & empty(p.by["nv"].T)
    return np.flatnonzero(out)


def reduce_linear(m: TracedMechanism, p: Perturbed, f: Freedoms) -> ReducedEquations:
    """Eliminate the constraints.

    Raises
    ------
    ModelError
        If a free motion has no inertia.
    """
    by, nb = p.by, f.Zv.shape[1]
    c = constrained_changes(f, InputTerms(by["rw"], by["gw"][m.holonomic], by["nw"], by["sw"]), by["nx"], p.N)
    others, laws = (acting_terms(c, *(by[f"{row}{of}"] for of in "vxzw")) for row in "rs")
    Y = _left_null_space(f, by["rl"])
    mass = product(Y.T, product(by["ra"], f.Zv))
    forces = product(Y.T, product(by["ra"], c.known) + others)
    try:
        b_dot = -solve_equations(mass, forces) if nb else forces
    except DependentEquations as e:
        raise massless_motion_error(m.names[f.chosen_v[e.row]].name) from None
    acceleration = product(f.Zv, b_dot) + c.known
    left = product(by["ra"], acceleration) + others
    lam = zero_objects(len(m.multipliers), left.shape[1])
    if len(f.rows_v):
        rest = f.dependent_v
        lam[f.rows_v] = -solve_equations(by["rl"][np.ix_(rest, f.rows_v)], left[rest])
    rate = np.vstack([c.a_dot, b_dot, laws])
    out = ReducedEquations(rate, c.x, c.u, acceleration, lam, c.z, laws, np.ones(len(laws)))
    out.add_second_order(f, Y, mass, [by[f"r{of}"] for of in "avx"], p.N)
    return out


def _left_null_space(f: Freedoms, R: np.ndarray) -> np.ndarray:
    """Matrix Y with Y^T R = 0 and the identity in the chosen rows."""
    Y = zero_objects(*f.Zv.shape)
    Y[f.chosen_v, np.arange(len(f.chosen_v))] = 1.0
    rest = f.dependent_v
    if len(rest) and len(f.chosen_v):
        Y[rest] = -solve_equations(R[np.ix_(rest, f.rows_v)].T, R[np.ix_(f.chosen_v, f.rows_v)].T)
    return Y


@dataclass
class StateSpaceMatrices:
    """State space matrices as arrays of nodes or numbers.

    Attributes
    ----------
    improper : str
        Reason why there are no B, C and D: an output depends on the rate of an input; else empty.
    """

    states: tuple[str, ...]
    state_units: tuple[str, ...]
    inputs: tuple[str, ...]
    input_units: tuple[str, ...]
    outputs: tuple[str, ...]
    output_units: tuple[str, ...]
    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray
    mass: np.ndarray | None
    damping: np.ndarray | None
    stiffness: np.ndarray | None
    improper: str = ""


def state_space_matrices(
    m: TracedMechanism, p: Perturbed, f: Freedoms, r: ReducedEquations, outputs: Sequence[tuple[str, str]]
) -> StateSpaceMatrices:
    """Matrices for the state in which rates of inputs are eliminated; ``outputs``: names and units."""
    (A, B, C, D), improper = r.state_space(_outputs(p, r))
    why = ""
    if improper:
        output, i, rate = improper
        why = (
            f"output {outputs[output][0]!r} follows the {rate} of input {m.inputs[i].name!r}, which no state-space "
            "model describes; leave out one of the two, or use the transfer function"
        )
    states, units = state_names(m.names, f, m.controls)
    still = [(s, 0.0) for s in m.added]
    new = lambda X: None if X is None else replaced(X, still)  # noqa: E731
    return StateSpaceMatrices(
        states=states,
        state_units=units,
        inputs=tuple(i.name for i in m.inputs),
        input_units=tuple(i.unit for i in m.inputs),
        outputs=tuple(name for name, _ in outputs),
        output_units=tuple(unit for _, unit in outputs),
        A=replaced(A, still),
        B=replaced(B, still),
        C=replaced(C, still),
        D=replaced(D, still),
        mass=new(r.M),
        damping=new(r.D),
        stiffness=new(r.K),
        improper=why,
    )


def replaced(X: np.ndarray, pairs: Sequence[tuple[Node, float]]) -> np.ndarray:
    """A matrix with symbols replaced."""
    out = X.copy()
    out.ravel()[:] = substitute(list(X.ravel()), pairs)
    return out


def _outputs(p: Perturbed, r: ReducedEquations) -> np.ndarray:
    """Derivatives of the outputs by the states, the inputs and their rates, (outputs, n + 3 k)."""
    n, k = len(r.rate), p.by["yw"].shape[1]
    y = product(p.by["yx"], r.position) + product(p.by["yv"], r.velocity)
    y = y + product(p.by["ya"], r.acceleration) + product(p.by["yl"], r.multipliers)
    y = y + product(p.by["yz"], r.states)
    y[:, n : n + k] = y[:, n : n + k] + p.by["yw"]
    return y
