"""Equations of motion and inverse dynamics as expressions: the engine's own loops run in Python on symbols.

    qdot = T v,  M vdot = f + G^T lam,  g = 0,  G v = nu,  G vdot = gamma

The numbers in the tables (filled in by the same code, run on symbols of the parameters), the state and the time can be
expressions. Loads of joints with friction are separate symbols; `TracedEquations.loads` are these symbols and
`TracedEquations.returned` their values in terms of the multipliers.

Inverse dynamics of a robot are laws: the efforts of its joints for given accelerations. The recursive Newton-Euler
formulas (`engine.recursive_dynamics`) run on expressions, with the measured coordinates and rates of the joints as
symbols.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..engine.articulated_body import mass_entries
from ..engine.element_dispatch import row_biases, row_values
from ..engine.entry_point import allocate_work, zero_work
from ..engine.kinematics import coordinate_rates, update_motions, update_poses
from ..engine.loads import apply_efforts, apply_forces, gather_forces, inertial_wrenches, reaction_loads
from ..engine.recursive_dynamics import newton_euler, place_bodies, tree_dynamics, velocity_paths
from ..engine.rows import count_measured, update_controllers
from ..errors import ModelError
from ..laws.bytecode import BY_TIME, evaluate_jet
from ..model.body import GROUND
from ..model.element import Element
from ..model.expression_parser import DEFINED, DEFINITIONS, SyntaxNode, called_table
from ..model.expressions import Expression, is_number_text, number
from ..model.model import Model
from ..model.names import curve_parts
from ..tables.coordinate_choice import require_rotor_coordinates, rotors, spanning_joints
from ..tables.forest import joint_bodies
from ..tables.structure import Choices, structure
from ..tables.structure_definition import Structure, velocity_names
from ..tables.table_definitions import NUMBERS, PLANAR, System, Work, named_arrays, with_numbers
from ..tables.values import values
from .graph import (
    ADD,
    CALL,
    DIVIDE,
    MULTIPLY,
    NUMBER,
    POWER,
    SYMBOL,
    Graph,
    Node,
    Symbol,
    directional_derivatives,
    nodes_in_order,
    object_vector,
    spline_derivatives,
)

if TYPE_CHECKING:
    from ..controllers.joint_controller import JointController
    from ..model.model import Model
    from ..model.table import Table


TRACED_TABLES = tuple(name for name in NUMBERS if name != "switch_numbers")
"""Number tables of `System` that equations of motion without switches use."""


def traced_arrays(S: System) -> dict[str, np.ndarray]:
    """Arrays of `TRACED_TABLES` by name, in a fixed order."""
    return {name: x for table in TRACED_TABLES for name, x in named_arrays(getattr(S, table), table)}


@dataclass
class TracedEquations:
    """Equations of motion as expressions: object arrays of nodes, or of numbers where constant."""

    graph: Graph
    structure: Structure
    system: System  # its number tables contain objects
    work: Work  # kinematics of bodies and frames, rows, twist columns: as the engine leaves them
    t: Node
    q: list[Node]
    v: list[Node]
    z: list[Node]  # controller states, turn counters, curve parameters, works
    lam: list[Node]
    loads: list[Node]  # of joints with friction
    T: np.ndarray  # (nq, nv)
    M: np.ndarray  # (nv, nv)
    f: np.ndarray  # (nv,): applied and gyroscopic
    g: np.ndarray  # (nr,)
    nu: np.ndarray  # (nr,)
    G: np.ndarray  # (nr, nv)
    gamma: np.ndarray  # (nr,)
    measured: np.ndarray  # (nm, 3): value, rate and bias of every measured quantity
    gradients: np.ndarray  # (nm, nv): gradients of these
    zdot: np.ndarray  # rates of the controller states and works, in the order of ``z``; 0 elsewhere
    returned: np.ndarray  # (nl,): loads that follow from the multipliers

    @property
    def states(self) -> list[Node]:
        """Symbols of the controller states, the first of z."""
        return self.z[: len(self.structure.controls)]

    @property
    def state_rates(self) -> np.ndarray:
        """Rates of the controller states."""
        return self.zdot[: len(self.structure.controls)]


def object_tables(S: System) -> System:
    """The number tables as object arrays of Python numbers."""

    def objects(_: str, x: np.ndarray) -> np.ndarray:
        out = np.empty(x.shape, object)
        out.ravel()[:] = x.ravel().tolist()
        return out

    return with_numbers(S, objects, TRACED_TABLES)


def trace_equations(
    s: Structure, S: System, graph: Graph | None = None, names: Names | None = None, reference: Sequence[Any] = ()
) -> TracedEquations:
    """Run the engine's loops on symbols.

    Parameters
    ----------
    s, S : Structure, System
        A mechanism in some coordinates. The tables of numbers are `object_tables`, with expressions where wanted.
    graph : Graph, optional
        Graph of the expressions in the tables.
    names : Names, optional
        Names of the symbols.
    reference : sequence, optional
        Values of the coordinates where the engine's are zero, (nq,): the equations are then in these coordinates.

    Raises
    ------
    ModelError
        If the inertia of a rotor is not along a velocity.
    """
    require_rotor_coordinates(s)
    graph = Graph() if graph is None else graph
    names = names or numbered_symbols(s, len(S.rows.law))
    graph.functions.names.update(tables_by_name(s, S))
    W = allocate_work(s, S, dtype=object)
    t = graph.symbol(Symbol("t", "time", "t", "s"))
    q, v, z, lam, loads = ([graph.symbol(x) for x in names_] for names_ in names)
    zdot = np.zeros(len(z), object)
    nv = s.nv
    own = [x - at for x, at in zip(q, reference, strict=True)] if len(reference) else q
    _kinematics(S, W, t, own, v, z)
    nm = count_measured(S)
    for n, load in enumerate(loads):
        W.sensed.load[2 * nm + n] = load
    T = np.array([[0.0] * nv] * s.nq, object).reshape(s.nq, nv)
    _rates(S, q, v, T)
    f = W.velocities.applied
    update_controllers(S, W, t, z, zdot)
    inertial_wrenches(S, W, t, zdot)
    apply_forces(S, W, t, zdot)
    gather_forces(S, W, f)
    apply_efforts(S, W, t, zdot, f)
    M = mass_matrix(S, W, nv)
    gradients, G = _rows(S, W, nm, nv)
    W.rows.multiplier[:] = lam
    reaction_loads(S, W)
    return TracedEquations(
        graph, s, S, W, t, q, v, z, lam, loads, T, M, f.copy(), W.rows.value.copy(), W.rows.nu.copy(), G,
        W.rows.gamma.copy(), W.sensed[:3, :nm].T.copy(), gradients, zdot,
        W.sensed.returned[2 * nm : 2 * nm + len(loads)].copy(),
    )  # fmt: skip


def with_prescribed_rows(x: TracedEquations, lam: list[Node], reference: Sequence[Any] = ()) -> TracedEquations:
    """The equations with coordinates that drivers prescribe as further rows, q = f(t), in the order of results.

    Parameters
    ----------
    x : TracedEquations
    lam : list of Node
        Symbols of all multipliers; those of the further rows are efforts.
    reference : sequence, optional
        As for `trace_equations`.
    """
    s, S = x.structure, x.system
    g, nu, gamma, G, zdot = [], [], [], np.zeros((len(s.prescribed), s.nv), object), x.zdot.copy()
    for k, b in enumerate(s.prescribed.values()):
        f = evaluate_jet(S.code, S.const, S.tree.law[b], x.work.stack, x.t, x.work.sensed, BY_TIME)
        q, v = S.tree.q[b], S.tree.v[b]
        g.append(x.q[q] - (f[0] - (S.bodies.offset[b] - (reference[q] if len(reference) else 0.0))))
        nu.append(f[1])
        gamma.append(f[2])
        G[k] = 0.0
        G[k, v] = 1.0
        if S.tree.work[b] >= 0:
            zdot[S.tree.work[b]] = lam[len(s.rows) + k] * x.v[v]
    rows = {"g": np.r_[x.g, object_vector(g)], "nu": np.r_[x.nu, object_vector(nu)], "G": np.vstack([x.G, G])}
    return replace(x, lam=lam, gamma=np.r_[x.gamma, object_vector(gamma)], zdot=zdot, **rows)


def tables_by_name(s: Structure, S: System) -> dict[int, str]:
    """Names of tables by start index in the table of constants; curves of joints are tables of x and y."""
    found = {at: name for name, at in s.table_at.items()}
    for k, t in enumerate(s.terms):
        if t.formula.of_kind.splines:
            found |= {
                int(S.term_parameters[k, 1].real): f"{(t.owner or t.element).name}.x",
                int(S.term_parameters[k, 2].real): f"{(t.owner or t.element).name}.y",
            }
    return found


Names = tuple[list[Symbol], list[Symbol], list[Symbol], list[Symbol], list[Symbol]]
"""Symbols of q, v, z, lam and of the loads of joints."""


def numbered_symbols(s: Structure, rows: int) -> Names:
    """Symbols named by their numbers."""

    def of(letter: str, kind: str, count: int) -> list[Symbol]:
        return [Symbol(f"{letter}[{k}]", kind, f"{letter}_{{{k}}}") for k in range(count)]

    return (
        of("q", "coordinate", s.nq),
        of("v", "velocity", s.nv),
        of("z", "state", len(s.states)),
        of("lam", "multiplier", rows),
        of("load", "load", len(s.loads)),
    )


def _kinematics(S: System, W: Work, t: Node, q: list[Node], v: list[Node], z: list[Node]) -> None:
    """Update poses, rows, velocities and biases as the `update_positions` and `update_velocities` of the engine do."""
    update_poses(S, W, q)
    row_values(S, W, t, z)
    update_motions(S, W, v)
    row_biases(S, W, t, v, z)


def _rates(S: System, q: list[Node], v: list[Node], T: np.ndarray) -> None:
    """Fill T of qdot = T v, column by column."""
    for d in range(len(v)):
        one = [1.0 if k == d else 0.0 for k in range(len(v))]
        coordinate_rates(S, q, one, T[:, d])


def _rows(S: System, W: Work, nm: int, nv: int) -> tuple[np.ndarray, np.ndarray]:
    """Gradients of the measured quantities and of the rows, dense."""
    nr = len(S.rows.law)
    dense = np.array([[0.0] * nv] * (nr + nm), object).reshape(nr + nm, nv)
    for k in range(nr + nm):
        for e in range(S.row_start[k], S.row_start[k + 1]):
            dense[k, S.column[e]] = dense[k, S.column[e]] + W.G[e]
    return dense[nr:], dense[:nr]


def mass_matrix(S: System, W: Work, nv: int) -> np.ndarray:
    """Dense mass matrix: from single bodies if every body is attached to ground, else from composite bodies."""
    M = np.array([[0.0] * nv] * nv, object).reshape(nv, nv)
    if len(S.mass_entries.row):
        mass_entries(S, W)
        i, j = S.mass_entries.row, S.mass_entries.column
        M[i, j] = M[j, i] = W.M
        return M
    for b in range(len(S.tree.parent)):
        v0, n = S.tree.v[b], S.tree.nv[b]
        for k in range(n):
            M[v0 + k, v0 + k] = S.bodies.mass[b]
        if n == 6:
            M[v0 + 3 : v0 + 6, v0 + 3 : v0 + 6] = S.bodies.inertia[b].reshape(3, 3)
        elif S.tree.joint[b] == PLANAR:
            M[v0 + 2, v0 + 2] = S.bodies.inertia[b, 8]
    return M


def parameter_symbols(model: Model, graph: Graph) -> dict[str, Node]:
    """Symbols of the parameters that have their own value; the others are expressions of these."""
    told = model.environment()
    own = [k for k, x in model.parameters.items() if not isinstance(x, str) or is_number_text(x)]
    return {k: graph.symbol(Symbol(k, "parameter"), told[k]) for k in own}


def trace_model(
    model: Model, tree: tuple[str, ...] = (), symbols: bool = True, names: Names | None = None
) -> TracedEquations:
    """Trace a model in absolute or joint coordinates.

    Parameters
    ----------
    model : Model
    tree : tuple of str
        Names of the tree joints; none for absolute coordinates.
    symbols : bool
        Whether parameters are symbols; else they are numbers.
    names : Names, optional
        Symbols of the state.
    """
    model = model.snapshot()
    graph = Graph()
    given: dict[str, Any] = dict(parameter_symbols(model, graph)) if symbols else {}
    s = structure(model, Choices(tree=tuple(tree), coupled=bool(tree)))
    S = values(s, given).system
    return trace_equations(s, S if given else object_tables(S), graph, names)


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
    now = given | {"t": graph.symbol("t")}
    laws = zip(S.gravity, robot.gravity_laws(), strict=True)
    S = S._replace(gravity=np.array([g if law is None else law.evaluate(now) for g, law in laws], object))
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
    """Bodies, joints and rotors of the controller's model: what joints connect with its base, which is held fixed."""
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
    kept = reached | joints | {f.name for f in rotors(model) if curve_parts(f.coordinate_text())[0] in joints}
    kept |= {f.name for f in model.frames if f.body in reached} | {x.name for x in model.materials}
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
        name = curve_parts(coordinate)[0]
        if name not in joints:
            raise ModelError(
                f"{e.title}: no joints connect {name!r} with {base!r}; give base=, the body that carries the joints"
            )
    for c in model.couplings:
        if not joints.isdisjoint(curve_parts(x)[0] for x in c.coupled()):
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
    tables = model.law_tables()
    smooth = {x.name for x in tables.values() if x.interpolation != "linear"}
    for n in tree.walk():
        unknown = n.kind == "name" and n.value not in {"t", *parameters}
        if unknown or n.kind in ("function", "called") or (n.kind == "table" and called_table(n)[0] not in smooth):
            what = "a Python function" if n.kind in ("function", "called") else f"{n.value!r}"
            raise ModelError(f"{where} depends on {what}, whose derivative by time is not known; give {given}")
    graph = Graph()
    t = graph.symbol("t")
    known: dict[str, Any] = {k: graph.symbol(k, x) for k, x in parameters.items()}
    law = Expression("", tree)
    curves: Any = {name: _Curve(tables[name]) for name in law.tables}
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
