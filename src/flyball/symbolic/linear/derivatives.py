"""A mechanism's equations traced for linearisation, and their derivatives by state, multipliers and inputs.

    r = M vdot - f - G^T lam,  g,  n = G v - nu,  s = zdot,  y

are differentiated by positions (along the velocities, so that quaternions have three directions), velocities,
controller states, accelerations, multipliers and inputs. Multipliers are held constant: the change of the reactions'
directions, d(G^T lam)/dx, is in dr/dx.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ...engine.kinematics import quaternion_at
from ...errors import ModelError
from ...expression_graph.evaluation import directional_derivatives, evaluate, substitute
from ...expression_graph.graph import Graph, Node, Symbol, object_vector, zero_objects
from ...expression_graph.tracing import (
    TracedEquations,
    object_tables,
    parameter_symbols,
    trace_equations,
    with_prescribed_rows,
)
from ...model.contact import has_contact
from ...model.element_laws import Input, with_inputs
from ...model.model import Model
from ...model.quantities import single_quantity
from ...model.unsupported_elements import refuse_sampled_controllers
from ...results.health import Health
from ...results.result import Result
from ...tables.structure import Choices, structure
from ...tables.structure_definition import VelocityName, velocity_names
from ...tables.values import Values, values


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
    if s.functions:
        raise ModelError(
            f"law {s.functions[0].text!r} is a Python function, which has no derivatives; write it as an expression or "
            f"give a table"
        )
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
