"""Inverse dynamics of a robot as laws: the efforts of its joints for given accelerations; derivatives of laws.

The recursive Newton-Euler formulas (`engine.recursive_dynamics`) run on expressions, with the measured coordinates and
rates of the joints as symbols.
"""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Any

import numpy as np

from ..engine.entry_point import zero_work
from ..engine.recursive_dynamics import newton_euler, place_bodies, tree_dynamics, velocity_paths
from ..errors import ModelError
from ..model.body import GROUND
from ..model.element import Element
from ..model.expression_parser import DEFINED, DEFINITIONS, SyntaxNode, called_table
from ..model.expressions import Expression, number
from ..tables.coordinate_choice import spanning_joints
from ..tables.forest import joint_bodies
from ..tables.structure import Choices, structure
from ..tables.structure_definition import Structure, velocity_names
from ..tables.values import values
from .evaluation import directional_derivatives, nodes_in_order
from .graph import ADD, CALL, DIVIDE, MULTIPLY, NUMBER, POWER, SYMBOL, Graph, Node, object_vector, spline_derivatives
from .tracing import object_tables, parameter_symbols

if TYPE_CHECKING:
    from ..controllers.joint_controller import JointController
    from ..model.model import Model
    from ..model.table import Table

POSITION, RATE, ACCELERATION = "q", "v", "a"
"""First letters of the symbols of a coordinate: its value, rate and acceleration, "q[0]" of the first coordinate."""
MAX_DEPTH = 30  # operations within each other, beyond which a part becomes a definition: Python recurses over trees
_OPERATORS = {ADD: "+", MULTIPLY: "*", DIVIDE: "/", POWER: "**"}
_NAMES = {"absolute": "abs", "minimum": "min", "maximum": "max"}


def joint_efforts(model: Model, e: JointController, moving: bool) -> list[SyntaxNode]:
    """Efforts along the coordinates of a controller, laws of the symbols above and of parameters.

    Parameters
    ----------
    model : Model
        A snapshot.
    e : JointController
    moving : bool
        Whether rates and accelerations count; else these are the efforts that hold the weight.

    Raises
    ------
    ModelError
        If its robot is no tree of joints whose coordinates are all controlled.
    """
    robot = controlled_robot(model, e)
    s = structure(robot, Choices(tree=spanning_joints(robot), coupled=True))
    velocity = _controlled_velocities(s, e)
    graph = Graph()
    symbols: dict[str, Any] = dict(parameter_symbols(robot, graph))
    told = {k: number(x, symbols, None, f"parameter {k!r} of {e.title}") for k, x in e.parameters}
    given = symbols | told
    S = values(s, given).system if given else object_tables(values(s).system)
    q, v, a = (np.zeros(s.nv, object) for _ in range(3))
    bodies = S.tree.parent.shape[0]
    of_velocity = np.repeat(np.arange(bodies), S.tree.nv)
    for k, d in enumerate(velocity):
        q[d] = graph.symbol(f"{POSITION}[{k}]") - S.bodies.offset[of_velocity[d]]
        if moving:
            v[d], a[d] = graph.symbol(f"{RATE}[{k}]"), graph.symbol(f"{ACCELERATION}[{k}]")
    W, V = zero_work(s, S, np.dtype(object)), velocity_paths(S.tree)
    D = tree_dynamics(bodies, s.nq, s.nv, object)
    tau = object_vector([0.0] * s.nv)
    place_bodies(S, W, D, q)
    newton_euler(S, W, V, D, v, a, tau)
    return [law_tree(tau[d]) for d in velocity]


def controlled_robot(model: Model, e: JointController) -> Model:
    """Bodies and joints of the controller's model: those that joints connect with its base, which is held fixed."""
    ignored = set(e.ignored)
    near: dict[str, list[tuple[str, str]]] = {name: [] for name in (GROUND, *(b.name for b in model.bodies))}
    for joint in model.joints:
        a, b = joint_bodies(model, joint)
        if ignored.isdisjoint((a, b)):
            near[a].append((joint.name, b))
            near[b].append((joint.name, a))
    base = e.base or GROUND
    reached, waiting, joints = {base}, [base], set[str]()
    while waiting:
        for name, other in near[waiting.pop()]:
            if e.base and other == GROUND:
                raise ModelError(f"{e.title}: its base {base!r} is connected with ground by {name!r}; leave base out")
            joints.add(name)
            if other not in reached:
                reached.add(other)
                waiting.append(other)
    _refuse_unreached(model, e, joints, base)
    kept = reached | joints | {f.name for f in model.frames if f.body in reached} | {x.name for x in model.materials}
    parts: dict[str, Any] = {name: None for name in model.by_name if name not in kept}
    robot = model.changed(parts)
    robot.initial = []
    robot.bulk = []
    if e.base:
        fixed: Any = Element.of_type("Fixed")
        origin = (0.0,) * (2 if model.planar else 3)
        robot.add(fixed(f"{e.name} holds {base}", GROUND, base, at=origin))
    return robot.snapshot()  # type: ignore[no-any-return]


def _refuse_unreached(model: Model, e: JointController, joints: set[str], base: str) -> None:
    """Refuse controlled joints beyond the robot, and couplings within."""
    for coordinate in e.coordinates:
        name = coordinate.partition(".")[0]
        if name not in joints:
            raise ModelError(
                f"{e.title}: no joints connect {name!r} with {base!r}; give base=, the body that carries the joints"
            )
    for c in model.couplings:
        if not joints.isdisjoint(x.partition(".")[0] for x in c.coupled()):
            raise ModelError(
                f"{e.title}: {c.title} couples joints of its model, and the model is a tree of independent joints; "
                f"leave the bodies that it drives out of the model, ignored=[...]"
            )


def _controlled_velocities(s: Structure, e: JointController) -> list[int]:
    """Velocities of the controller's coordinates in the tree; refuse another freedom, and a loop."""
    if s.rows:
        closing = ", ".join(dict.fromkeys(r.element.name for r in s.rows))
        raise ModelError(
            f"{e.title}: the joints of its model must form a tree, and {closing} adds constraint equations; leave "
            f"bodies of the loop out of the model, ignored=[...]"
        )
    names = [n.name for n in velocity_names(s)]
    free = [n for n in names if n not in e.coordinates]
    balls = [s.model[name].title for name, t in s.tree_joints.items() if any(p.kind == "S" for p in t.primitives)]
    if balls and free:
        raise ModelError(
            f"{e.title}: its model has ball joints, {', '.join(balls)}, and it controls coordinates of one velocity "
            f"each; put three Revolute joints with massless bodies between them in place of a ball joint, or leave "
            f"the bodies beyond it out of the model, ignored=[...]"
        )
    if free:
        raise ModelError(
            f"{e.title}: its model has coordinates that it does not control: {', '.join(free)}; add them to "
            f"coordinates, or leave the bodies that move along them out of the model, ignored=[...]"
        )
    if other := [c for c in e.coordinates if c not in names]:
        raise ModelError(
            f"{e.title}: {', '.join(other)} follows from other coordinates of its model; control {', '.join(names)}"
        )
    return [names.index(c) for c in e.coordinates]


def law_tree(x: Any) -> SyntaxNode:
    """Tree of a law that computes an expression (a node or a number); every common subexpression is computed once.

    Functions of which only the name is known are tables.
    """
    if not isinstance(x, Node):
        return SyntaxNode("number", (), float(x))
    order = nodes_in_order([x])
    uses = Counter(a.index for node in order for a in node.args)
    trees: dict[int, SyntaxNode] = {}
    depth: dict[int, int] = {}
    definitions: list[SyntaxNode] = []
    for node in order:
        tree = _operation(node, tuple(trees[a.index] for a in node.args))
        deep = 1 + max((depth[a.index] for a in node.args), default=0)
        if node is not x and tree.args and (uses[node.index] > 1 or deep > MAX_DEPTH):
            definitions.append(tree)
            tree, deep = SyntaxNode(DEFINED, (), len(definitions) - 1), 1
        trees[node.index], depth[node.index] = tree, deep
    return SyntaxNode(DEFINITIONS, (*definitions, trees[x.index])) if definitions else trees[x.index]


def _operation(x: Node, args: tuple[SyntaxNode, ...]) -> SyntaxNode:
    if x.op == NUMBER:
        return SyntaxNode("number", (), x.value)
    if x.op == SYMBOL:
        return SyntaxNode("name", (), x.data.name)
    if x.op == CALL:
        return SyntaxNode("table", args, x.data.printed_name)
    if x.op == "choose":  # the second argument where the first is positive, else the third
        return SyntaxNode("where", (SyntaxNode("<", (SyntaxNode("number", (), 0.0), args[0])), *args[1:]))
    if x.op == MULTIPLY and x.args[0].op == NUMBER and x.args[0].value == -1.0:
        return SyntaxNode("neg", args[1:])
    return SyntaxNode(_OPERATORS.get(x.op) or _NAMES.get(x.op, x.op), args)


def time_derivative(tree: SyntaxNode, model: Model, where: str, given: str) -> SyntaxNode:
    """Derivative by time of a law of time, parameters and tables.

    Parameters
    ----------
    tree : SyntaxNode
    model : Model
        The mechanism with the parameters and tables.
    where, given : str
        What the law is, and the field that may give its derivative, for messages.

    Raises
    ------
    ModelError
        If the law reads something else, or calls a Python function or a table with jumps of the slope.
    """
    parameters = model.environment()
    smooth = {x.name for x in model.tables if x.interpolation != "linear"}
    for n in tree.walk():
        unknown = n.kind == "name" and n.value not in {"t", *parameters}
        if unknown or n.kind in ("function", "called") or (n.kind == "table" and called_table(n)[0] not in smooth):
            what = "a Python function" if n.kind in ("function", "called") else f"{n.value!r}"
            raise ModelError(f"{where} depends on {what}, whose derivative by time is not known; give {given}")
    graph = Graph()
    t = graph.symbol("t")
    known: dict[str, Any] = {k: graph.symbol(k, x) for k, x in parameters.items()}
    law = Expression("", tree)
    curves: Any = {name: _Curve(model[name]) for name in law.tables}
    value = law.evaluate({**known, "t": t}, curves)
    return law_tree(directional_derivatives([value], [(t, 1.0)])[0])


class _Curve:
    """A table for expressions."""

    def __init__(self, table: Table) -> None:
        self._functions = spline_derivatives(table.data(), [], 0, table.name)

    def values(self, x: Node) -> list[Node]:
        """Return value and derivatives."""
        return [x.graph.call(f, x) for f in self._functions]

    def value(self, x: Node) -> Node:
        """Return the value."""
        return self.values(x)[0]
