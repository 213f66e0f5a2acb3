"""A mechanism's equations traced for being made linear: with inputs as parameters, constraints and outputs by name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ...analysis.linear.inputs import Input, with_inputs
from ...errors import ModelError
from ...graph.arrays import objects, zeros
from ...graph.derivative import replaced
from ...graph.node import Graph, Node, Symbol
from ...laws.evaluation import evaluate_jet
from ...laws.opcodes import BY_TIME
from ...model.model import Model
from ...model.quantities import one
from ...model.touching import has_contact
from ...results.health import Health
from ...results.result import Result
from ...tables.names import Named, velocity_names
from ...tables.structure import Choices, structure
from ...tables.values import Values, values
from ...tracing.model import parameters
from ...tracing.trace import Traced, plain, traced


@dataclass
class Mechanics:
    """A mechanism as expressions: its equations of motion, its drawn state, its inputs.

    Attributes
    ----------
    values : Values
        Tables and drawn state, of expressions.
    x : Traced
    given : dict
        Parameter -> its symbol.
    env : dict
        Parameter -> what it is, an expression of those that have a value of their own.
    inputs : list of Input
    names : list of Named
        Of all velocities.
    vdot : list of Node
        Symbols of the accelerations.
    g, n : ndarray (rows,)
        Constraints on positions and velocities, G v - nu; prescribed coordinates behind the rows.
    multipliers : list of Node
        Symbols, those of prescribed coordinates (their efforts) behind those of the rows.
    r : ndarray (nv,)
        M vdot - f - G^T lam - efforts.
    holonomic : ndarray of bool (rows,)
    laws : list of (which coordinate, which velocity, Node, Node)
        Coordinates that drivers prescribe, and their rates.
    """

    values: Values
    x: Traced
    given: dict[str, Node]
    env: Mapping[str, Any]
    inputs: list[Input]
    names: list[Named]
    vdot: list[Node]
    g: np.ndarray
    n: np.ndarray
    multipliers: list[Node]
    r: np.ndarray
    holonomic: np.ndarray
    laws: list[tuple[int, int, Node, Node]]

    @property
    def graph(self) -> Graph:
        """Where all expressions live."""
        return self.x.graph

    @property
    def model(self) -> Model:
        """The mechanism, with the inputs in its laws."""
        return self.values.structure.model

    @property
    def pushed(self) -> list[Node]:
        """Symbols of the inputs."""
        return [self.given[i.parameter] for i in self.inputs]

    @property
    def added(self) -> list[Node]:
        """Symbols of those inputs that are no parameters of the mechanism: zero at the point."""
        return [self.given[i.parameter] for i in self.inputs if i.name != i.parameter]

    @cached_property
    def scale(self) -> np.ndarray:
        """What a large step is along every velocity, in parts of the mechanism's length."""
        return np.array([1.0 if k.unit == "m" else 1.0 / self.values.length for k in self.names])

    @cached_property
    def result(self) -> Result:
        """The state as a result of expressions at one time: outputs are its curves."""
        x = self.x
        q, v, a, lam, z = (objects(part)[None] for part in (x.q, x.v, self.vdot, self.multipliers, x.z))
        health = Health(True, "one state", 0.0, 0.0, 0, 0, 0, 0, 0.0)
        return Result(self.model, self.values, np.array([x.t], object), q, v, z, a, lam, health)

    def output(self, name: str) -> tuple[str, Node]:
        """(unit, expression) of a curve of results, or of a sensor."""
        unit, found = self.result.curve(name)
        return unit, self.graph.node(np.ravel(found)[0])


def mechanics(model: Model, tree: Sequence[str], inputs: Sequence[str], told: Mapping[str, float] | None) -> Mechanics:
    """Trace a mechanism.

    Parameters
    ----------
    model : Model
    tree : sequence of str
        Tree joints; none for absolute coordinates.
    inputs : sequence of str
        See `Mechanism.linearize`.
    told : mapping, optional
        Values of parameters in place of the model's own.

    Raises
    ------
    ModelError
        If there is no such input, or the mechanism has contact or laws that are Python functions.
    """
    if has_contact(model):
        raise ModelError(
            f"{model.name!r} has contact, which is no set of equations; linearize takes it where it rests, in numbers"
        )
    model, named = with_inputs(model, inputs)
    model = _with_values(model, told or {}).snapshot()
    s = structure(model, Choices(tree=tuple(tree), coupled=bool(tree)))
    if s.functions:
        raise ModelError(
            f"law {s.functions[0].text!r} is a Python function, which has no derivatives; write it as an expression or "
            f"give a table"
        )
    graph = Graph()
    given = parameters(model, graph)
    V = values(s, given)  # type: ignore[arg-type]
    x = traced(s, V.system if given else plain(V.system), graph)
    vdot = [graph.symbol(Symbol(f"a[{d}]", "acceleration", f"a_{{{d}}}")) for d in range(s.nv)]
    laws = _prescribed(x)
    efforts = [graph.symbol(Symbol(f"effort[{k}]", "multiplier")) for k in range(len(laws))]
    r = x.M @ np.array(vdot, object) - x.f
    if x.lam:
        r = r - x.G.T @ np.array(x.lam, object)
    for (_, d, _, _), effort in zip(laws, efforts, strict=True):
        r[d] = r[d] - effort
    r[:] = replaced(list(r), list(zip(x.loads, x.returned, strict=True)))
    n = (x.G @ np.array(x.v, object) - x.nu).tolist() if x.lam else []
    return Mechanics(
        values=V, x=x, given=given, env=V.env, inputs=named, names=velocity_names(s), vdot=vdot,
        g=objects([*x.g.tolist(), *(x.q[k] - law for k, _, law, _ in laws)]),
        n=objects([*n, *(x.v[d] - rate for _, d, _, rate in laws)]),
        multipliers=[*x.lam, *efforts], r=r,
        holonomic=np.array([*(row.holonomic for row in s.rows), *(True for _ in laws)], bool), laws=laws,
    )  # fmt: skip


def refuse_unknown(model: Model, outputs: Sequence[str]) -> None:
    """Refuse outputs that there are not."""
    for name in outputs:
        one(model, name)


def _with_values(model: Model, told: Mapping[str, float]) -> Model:
    """A copy whose parameters have these values."""
    out = model.copy()
    out.environment(told)  # refuses those that do not exist
    for name, x in told.items():
        out.parameters[name] = x
    return out


def _prescribed(x: Traced) -> list[tuple[int, int, Node, Node]]:
    """Coordinates that drivers prescribe: where they and their rates stand, and what these are."""
    S, s = x.system, x.structure
    stack = zeros(s.depth + 1, 3)
    out = []
    for b in s.prescribed.values():
        f, f1, _ = evaluate_jet(S.code, S.const, int(S.tree.law[b]), stack, x.t, zeros(3, 0), BY_TIME)
        law = x.graph.node(f - S.bodies.offset[b])
        out.append((int(S.tree.q[b]), int(S.tree.v[b]), law, x.graph.node(f1)))
    return out
