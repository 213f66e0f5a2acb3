"""Equations of motion with symbols named after the mechanism: the traced equations in the chosen coordinates.

The coordinates are chosen by the rule of a simulation. The traced equations in the reference configuration show whether
inertia acts along every coordinate and whether the reactions that friction needs are determined. The compiled engine is
used only if they are not.

Positions have the names of coordinates: ``"hinge.angle"``. A rate has a prime behind it, ``"crank.x'"``, an
acceleration two. A body that is free in space has the Euler parameters ``e0`` to ``e3`` (scalar first) and the
angular velocity ``w_x``, ``w_y``, ``w_z`` along its own axes, a spherical joint those of its relative rotation.
Where a body's centre of mass is not its reference point, its coordinates are ``com_x``, ``com_y``, ``com_z``.
Multipliers are called ``"A.lam_nx"``.

The engine measures an angle by atan2 and adds whole turns. Here an angle is its closed form where it has one (a
coordinate, or in the plane a difference of the bodies' angles), else the arctangent, in (-pi, pi]. Coordinates
prescribed by drivers are constraints with a multiplier. The parameter of a follower's curve is a symbol with an
equation of its own.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from ..assembly.assemble import assemble
from ..assembly.assembled_state import Assembly
from ..assembly.compiled_mechanism import CompiledMechanism, compile_mechanism
from ..constraints.registry import Kind
from ..constraints.tangent import KIND as TANGENT
from ..constraints.tangent import tangent
from ..engine.kinematics import load_record, twist_column
from ..engine.loads import apply_efforts, apply_forces, gather_forces, inertial_wrenches
from ..engine.rows import row_parameters
from ..errors import AnalysisError, ModelError
from ..expression_graph.graph import (
    ADD,
    MULTIPLY,
    NUMBER,
    Graph,
    Node,
    Symbol,
    evaluate,
    evaluate_array,
    nodes_in_order,
    object_vector,
)
from ..expression_graph.tracing import Names, TracedEquations, object_tables, trace_equations, with_prescribed_rows
from ..math.scalar import atan2
from ..math.spline import BREAKS
from ..math.vec import dot, mtv, sub
from ..model.body import Body, Driver, Frame
from ..model.controller_signals import ConnectedState
from ..model.element import Element
from ..model.joint import Joint
from ..model.model import Model
from ..model.names import curve_parts
from ..simulation.initial_state import THIN_INERTIA, find_initial_state, refuse_unknown_coordinates
from ..tables.coordinate_choice import cut_joints_text, spanning_joints
from ..tables.forest import coordinate_row
from ..tables.structure_definition import Structure, velocity_names
from ..tables.table_definitions import FREE, OF_RATE, SPHERICAL, System, Work, map_arrays
from ..tables.values import Values

RANK_TOLERANCE = (
    1e-6  # rows of the Jacobian are independent if the smallest singular value exceeds this part of the largest
)


class CoordinateChoice(NamedTuple):
    """Coordinates of equations: names of the tree joints, and a description with the reason of the choice."""

    tree: tuple[str, ...]
    why: str


def choose_coordinates(model: Model, parameters: Mapping[str, float] | None, wish: str) -> CoordinateChoice:
    """Choose coordinates: as requested by ``wish``, or for ``auto`` joint coordinates unless friction prevents it.

    Raises
    ------
    ModelError
        If ``wish`` is unknown, or if a body can move without inertia.
    AnalysisError
        If, in joint coordinates, friction depends on undetermined reactions of redundant constraints.
    """
    refuse_unknown_coordinates(wish)
    tree = spanning_joints(model) if wish != "absolute" else ()
    if not _is_regular(compile_mechanism(model, parameters=parameters, tree=tree), wish):
        return _engine_choice(model, parameters, wish)
    if wish == "absolute":
        return CoordinateChoice((), "absolute: as requested")
    if not tree:
        return CoordinateChoice((), "absolute: no joint can be a tree joint")
    return CoordinateChoice(tree, _description(model, wish, tree))


def _description(model: Model, wish: str, tree: Sequence[str]) -> str:
    why = "as requested" if wish == "joint" else "these make the fewest equations"
    return f"joint: {why}{cut_joints_text(model, tree)}"


def _is_regular(c: CompiledMechanism, wish: str) -> bool:
    """Whether, in the reference configuration, all velocities have inertia and friction has determined reactions."""
    s, S = c.structure, c.values.system
    light, loaded = S.scales.semidefinite != 0.0, bool(s.loads) and wish != "absolute"
    if not light and not loaded:
        return True
    T = trace_equations(s, object_tables(S))
    state = (([T.t], [0.0]), (T.q, c.values.q), (T.v, c.values.v), (T.z, c.z))
    at = {x.data.name: float(np.real(y)) for xs, ys in state for x, y in zip(xs, ys, strict=True)}
    G, sizes = np.asarray(evaluate_array(T.G, at), float) * c.sizes, c.sizes
    if loaded and not _independent(G):
        return False
    if not light:
        return True
    M = np.asarray(evaluate_array(T.M, at), float) * sizes * sizes[:, None]
    # Joint coordinates need their own inertia; bodies only along the motions that the rows allow.
    if not s.tree:
        Z = _null_space_of_rows(G)
        M = Z.T @ M @ Z
    return not len(M) or bool(np.linalg.eigvalsh(M)[0] > THIN_INERTIA * S.bodies.mass.sum() * c.values.length**2)


def _independent(G: np.ndarray) -> bool:
    if not len(G):
        return True
    if len(G) > G.shape[1]:
        return False
    w = np.linalg.svd(G, compute_uv=False)
    return bool(w[-1] > RANK_TOLERANCE * w[0])


def _null_space_of_rows(G: np.ndarray) -> np.ndarray:
    """Basis of the motions that the rows allow, (nv, freedoms)."""
    if not len(G):
        return np.eye(G.shape[1])
    _, w, V = np.linalg.svd(G)
    return V[int((w > RANK_TOLERANCE * w[0]).sum()) :].T


def _engine_choice(model: Model, parameters: Mapping[str, float] | None, wish: str) -> CoordinateChoice:
    """The choice that a simulation makes."""
    try:
        start = find_initial_state(model, 0.0, parameters, None, "joint" if wish == "auto" else wish)
    except AnalysisError as error:  # friction that depends on loads missing in joint coordinates
        if wish != "auto":
            raise
        return CoordinateChoice((), f"absolute: {str(error).partition(': ')[2]}")
    tree = tuple(start.assembly.compiled.structure.tree)
    return CoordinateChoice(tree, start.coordinates if not tree or wish == "joint" else _description(model, wish, tree))


def initial_assembly(model: Model, parameters: Mapping[str, float] | None, tree: tuple[str, ...]) -> Assembly:
    """Initial state as described and assembled, in given coordinates.

    Raises
    ------
    AssemblyError
        If the mechanism cannot be assembled.
    """
    a = assemble(model, parameters=parameters)
    if not tree:
        return a
    c = compile_mechanism(model, parameters=parameters, tree=tree)
    q, v = c.take(a.compiled, a.t, a.q, a.v)
    return replace(a, compiled=c, q=q, v=v)


COORDINATE_LETTERS = {"displacement": "s", "angle": r"\varphi", "angle_1": r"\varphi_1", "angle_2": r"\varphi_2"}
RATE, SECOND = "'", "''"


class MechanismSymbols(NamedTuple):
    """Symbols of a mechanism, in the order of the engine's arrays."""

    q: list[Symbol]
    v: list[Symbol]
    vdot: list[Symbol]
    z: list[Symbol]
    lam: list[Symbol]  # multipliers of the rows, then efforts of drivers that prescribe a coordinate
    loads: list[Symbol]


def mechanism_symbols(x: Values) -> MechanismSymbols:
    """Symbols of a mechanism in some coordinates."""
    s = x.structure
    v = [_velocity(x, name.name, name.unit) for name in velocity_names(s)]
    q = _coordinates(s, v)
    rates = [_rate(p) if p.kind == "coordinate" else p for p in v]
    seconds = [_second(p) if p.kind == "coordinate" else _rate(p, "acceleration") for p in v]
    states = [_controller_state(c) for c in s.controls] + [_state(name) for name in s.states[len(s.controls) :]]
    loads = [Symbol(f"{e.name}.load", "load", rf"P_{{{latex_part_name(e.name)}}}", "N", e.name) for e in s.loads]
    return MechanismSymbols(q, rates, seconds, states, _multipliers(s), loads)


def _velocity(x: Values, name: str, unit: str) -> Symbol:
    """Symbol of the coordinate whose rate a velocity is; an angular velocity has its own symbol."""
    owner, what = curve_parts(name)
    kind, _, axis = what.rpartition(" ")
    index = latex_part_name(owner)
    if kind == "turn":
        return Symbol(f"{owner}.w_{axis}", "velocity", rf"\omega_{{{axis},{index}}}", "rad/s", owner)
    letter = COORDINATE_LETTERS.get(what, what if what in "xyz" else rf"\mathrm{{{what}}}")
    if what in "xyz" and _has_offset_centre(x, owner):
        what, index = f"com_{what}", f"S,{index}"
    return Symbol(f"{owner}.{what}", "coordinate", _indexed(letter, index), unit, owner)


def _has_offset_centre(x: Values, owner: str) -> bool:
    """Whether ``owner`` is a body whose centre of mass is not its reference point."""
    return owner in x.bodies and any(c.real != 0.0 for c in x.bodies[owner].com)


def _indexed(letter: str, index: str) -> str:
    base, _, own = letter.partition("_")
    return f"{base}_{{{own + ',' if own else ''}{index}}}"


def _coordinates(s: Structure, v: list[Symbol]) -> list[Symbol]:
    """Coordinates of every row of the body table."""
    out: list[Symbol] = []
    tree = s.tables["tree"]
    for b, (first, kind) in enumerate(zip(tree.v.tolist(), tree.joint.tolist(), strict=True)):
        if kind in (FREE, SPHERICAL):
            owner = v[first + (3 if kind == FREE else 0)].element
            out += v[first : first + 3] if kind == FREE else []
            out += [
                Symbol(f"{owner}.e{k}", "coordinate", rf"e_{{{k},{latex_part_name(owner)}}}", "1", owner)
                for k in range(4)
            ]
        else:
            out += v[first : first + int(tree.nv[b])]
        assert len(out) == int(tree.q[b] + tree.nq[b])
    return out


def _rate(p: Symbol, kind: str = "velocity") -> Symbol:
    unit = f"{p.unit}^2" if p.unit.endswith("/s") else f"{p.unit}/s"
    return Symbol(p.name + RATE, kind, _dotted(r"\dot", p.latex), unit, p.element)


def _second(p: Symbol) -> Symbol:
    return Symbol(p.name + SECOND, "acceleration", _dotted(r"\ddot", p.latex), f"{p.unit}/s^2", p.element)


def _dotted(dot: str, latex: str) -> str:
    """A dot over the letter, not over its indices."""
    letter, _, rest = latex.partition("_")
    return f"{dot}{{{letter}}}" + (f"_{rest}" if rest else "")


def _controller_state(x: ConnectedState) -> Symbol:
    index = latex_part_name(x.controller.name)
    return Symbol(x.name, "state", rf"\mathrm{{{latex_part_name(x.state)}}}_{{{index}}}", "", x.controller.name)


def _state(name: str) -> Symbol:
    owner, what = curve_parts(name)
    latex = {"place": "s", "work": "W"}.get(what, rf"\mathrm{{{what}}}")
    unit = {"place": "m", "work": "J"}.get(what, "rad")
    return Symbol(
        name if what in ("place", "work") else f"{name} (turns)",
        "state",
        f"{latex}_{{{latex_part_name(owner)}}}",
        unit,
        owner,
    )


def _multipliers(s: Structure) -> list[Symbol]:
    """Multipliers, one for each row; those of drivers and couplings are efforts."""
    names = [_row_name(row.element, row.label) for row in s.rows]
    names = list(numbered_names(names))
    out = [_multiplier(s, name, row.element) for name, row in zip(names, s.rows, strict=True)]
    return out + [_multiplier(s, f"{name}.effort", s.model[name]) for name in s.prescribed]


def _row_name(e: Element, label: str) -> str:
    if isinstance(e, Driver):
        return f"{e.name}.effort"
    return f"{e.name}.lam_{label}" if label and isinstance(e, Joint) else f"{e.name}.lam"


def _multiplier(s: Structure, name: str, e: Element) -> Symbol:
    what = name.removeprefix(f"{e.name}.")
    letter, index = (
        (r"\tau", "")
        if what == "effort"
        else (r"\lambda", what.removeprefix("lam").removeprefix("_").removeprefix("n"))
    )
    unit = ("N*m" if s.model.unit(e.coordinate, e).startswith("rad") else "N") if isinstance(e, Driver) else ""
    return Symbol(
        name, "multiplier", _indexed(letter, (index + "," if index else "") + latex_part_name(e.name)), unit, e.name
    )


def numbered_names(names: Iterable[str]) -> Iterable[str]:
    """The names; repeated names get a number."""
    seen: dict[str, int] = {}
    for name in names:
        seen[name] = seen.get(name, 0) + 1
        yield name if seen[name] == 1 else f"{name}_{seen[name]}"


def latex_part_name(name: str) -> str:
    """Name of a part of the mechanism in LaTeX."""
    for c in "\\{}$&#^_%~":
        name = name.replace(c, rf"\{c}" if c in "{}$&#_%" else "-")
    return rf"\text{{{name}}}"


FULL_TURN = 2.0 * math.pi


def with_whole_turns(x: Values, S: System) -> tuple[System, list[int]]:
    """Tables in which every angle counts whole turns, those of drivers too, and no row is compared modulo a turn.

    Returns
    -------
    System, list of int
        For each state appended to those of the structure: the term that uses it.
    """
    s = x.structure
    hint, parameters = S.terms.hint.copy(), S.term_parameters.copy()
    more: list[int] = []
    for k, t in enumerate(s.terms):
        if t.formula.of_kind.turns and hint[k] < 0:
            hint[k] = len(s.states) + len(more)
            parameters[k, 0] = 1.0
            more.append(k)
    rows = S.rows._replace(wrapped=np.where(S.rows.wrapped == OF_RATE, OF_RATE, 0))
    return S._replace(rows=rows, terms=S.terms._replace(hint=hint), term_parameters=parameters), more


class ClosedFormAngles:
    """Closed forms of measured angles, in the coordinates q (engine's own, as expressions)."""

    def __init__(self, x: Values, q: Sequence[Any], W: Any) -> None:
        self.x, self.q = x, q
        self._since = self._turned(W) if x.structure.model.planar else {}

    def of(self, owner: Any, what: str, F: int, M: int) -> Any:
        """Angle from frame F to frame M measured by a term of ``owner``; None if it has no closed form."""
        s, S = self.x.structure, self.x.system
        if isinstance(owner, Joint):
            row = coordinate_row(s, owner.name, what)
            if row is not None:
                return owner.coordinates[what].sign * self.q[S.tree.q[row]]
        if not s.model.planar:
            return None
        here, there = (self._heading(k) + self._since[int(S.frame_body[k])] for k in (F, M))
        if isinstance(owner, Body | Frame):
            return there
        drawn_here, drawn_there = (self._heading(k) + self._reference_angle(int(S.frame_body[k])) for k in (F, M))
        whole = math.floor((_real(drawn_there) - _real(drawn_here)) / FULL_TURN + 0.5)
        return there - here - FULL_TURN * whole

    def of_tangent(self, W: Any, F: int, M: int, par: Any) -> Any:
        """Direction of a rope between circles about the origins of two frames, in the first."""
        S = self.x.system
        here, there = load_record(W.frames, F), load_record(W.frames, M)
        d, b = sub(there[0], here[0]), S.const[int(par[1].real)]
        if not self.x.structure.model.planar:
            return tangent(mtv(here[1], d), b)[1]
        body = int(S.frame_body[F])
        return tangent(d, b)[1] - (self._since[body] - self._reference_angle(body))

    def _turned(self, W: Any) -> dict[int, Any]:
        """Angle of every body of a planar mechanism: reference angle plus its coordinates."""
        S, x = self.x.system, self.x
        since: list[Any] = []
        for b in range(len(S.tree.parent)):
            total = since[S.tree.parent[b]] if S.tree.parent[b] >= 0 else 0.0
            for i in range(S.tree.nv[b]):
                at = S.tree.q[b] + i
                total = total + twist_column(S, W, b, i)[0][2] * (self.q[at] - x.q[at])
            since.append(total)
        out: dict[int, Any] = {-1: 0.0}
        for name, b in x.structure.place.items():
            if b >= 0:
                out[b] = x.bodies[name].angle + since[b]
        return out

    def _reference_angle(self, b: int) -> Any:
        names = {at: name for name, at in self.x.structure.place.items()}
        return 0.0 if b < 0 else self.x.bodies[names[b]].angle

    def _heading(self, frame: int) -> Any:
        """Direction angle of a frame's x axis in its body."""
        R = self.x.system.frames.rotation[frame]
        return atan2(R[3], R[0])


def _real(x: Any) -> float:
    return float(x.real)


class TurnElimination:
    """Replaces nodes in expressions and removes the counting of turns.

    Parameters
    ----------
    graph : Graph
    new : pairs of nodes and their replacements
    unknown : nodes of counted angles without a closed form
    """

    def __init__(self, graph: Graph, new: Sequence[tuple[Node, Any]], unknown: Sequence[Node]) -> None:
        self.graph = graph
        self._known: dict[int, Node] = {x.index: graph.node(y) for x, y in new}
        self._unknown = {x.index for x in unknown}

    def __call__(self, array: np.ndarray) -> np.ndarray:
        """The array with the replacements made."""
        out = np.empty(array.shape, object)
        flat = array.ravel().tolist()
        for x in nodes_in_order(flat):
            if x.index not in self._known:
                self._known[x.index] = self._constructed(x)
        out.ravel()[:] = [self._known[x.index] if isinstance(x, Node) else x for x in flat]
        return out

    def _constructed(self, x: Node) -> Node:
        args = tuple(self._known[a.index] for a in x.args)
        if x.op == "rounded" and not x.moving:  # whole turns in the reference configuration
            return self.graph.number(x.value)
        if x.op == ADD:
            found = _unwrapped(*args) or _unwrapped(args[1], args[0])
            if found is not None and found[1].moving:  # an angle nearest to a constant one counts no turns
                theta, near = found
                lost = any(s.index in self._unknown for s in nodes_in_order([near]))
                return theta if lost else near
        return x if all(a is b for a, b in zip(args, x.args, strict=True)) else self.graph.rebuilt(x, args)


def _unwrapped(theta: Node, turns: Node) -> tuple[Node, Node] | None:
    """(theta, near) of theta + 2 pi rounded((near - theta) / 2 pi); None for other expressions."""
    factor, inner = _factored(turns)
    if inner.op != "rounded" or abs(factor - FULL_TURN) > 1e-12:
        return None
    share, way = _factored(inner.args[0])
    if abs(share * FULL_TURN - 1.0) < 1e-12:
        if way.op != ADD:
            return None
        for near, other in (way.args, way.args[::-1]):
            if other is -theta:
                return theta, near
    if abs(share * FULL_TURN + 1.0) < 1e-12 and way is theta:
        return theta, theta.graph.number(0.0)
    return None


def _factored(x: Node) -> tuple[float, Node]:
    if x.op == MULTIPLY and x.args[0].op == NUMBER:
        return x.args[0].value, x.args[1]
    return 1.0, x


@dataclass
class CurveParameter:
    """Curve parameter of a follower: its symbol, its equation, and its rate."""

    symbol: Node
    equation: Any  # residual that is zero
    rate: Any
    term: int


@dataclass
class NamedEquations:
    """Equations of motion with symbols named after the mechanism. All arrays contain nodes or numbers."""

    values: Values  # its tables contain objects
    traced: TracedEquations  # with rows for prescribed coordinates, which the engine does not have
    # The engine's coordinates: those of `trace_equations` minus their reference values.
    user_q: list[Any]
    reference_values: list[Any]  # these reference values
    vdot: list[Node]
    places: list[CurveParameter]
    cleaned: TurnElimination
    named: dict[str, Node]  # every symbol by its name


def trace_named_equations(x: Values, graph: Graph) -> NamedEquations:
    """Trace a mechanism and name its equations after its parts.

    Parameters
    ----------
    x : Values
        Tables filled with numbers or with expressions of ``graph``.
    graph : Graph
    """
    s = x.structure
    S = x.system if x.system.const.dtype == object else object_tables(x.system)
    x = replace(x, system=S)
    S, more = with_whole_turns(x, S)
    names = mechanism_symbols(x)
    drawn = _reference_values(S, s.nq)
    hints = [Symbol(f"turns of term {k}", "state") for k in more]
    nr = len(s.rows)
    wanted: Names = (names.q, names.v, [*names.z, *hints], names.lam[:nr], names.loads)
    T = trace_equations(s, S, graph, wanted, drawn)
    own_q = [q - at for q, at in zip(T.q, drawn, strict=True)]
    places, feet = _curve_parameters(x, T)
    new = list(feet)
    cleaned = _cleaner(x, T, own_q, more, new)
    lam = [*T.lam, *(graph.symbol(e) for e in names.lam[nr:])]
    T = _cleaned_arrays(with_prescribed_rows(T, lam, drawn), cleaned)
    places = [
        replace(p, equation=_cleaned_entry(cleaned, p.equation), rate=_cleaned_entry(cleaned, p.rate)) for p in places
    ]
    vdot = [graph.symbol(a) for a in names.vdot]
    named = {n.data.name: n for n in (T.t, *T.q, *T.v, *T.states, *vdot, *lam, *T.loads, *(p.symbol for p in places))}
    return NamedEquations(x, T, own_q, drawn, vdot, places, cleaned, named)


def _reference_values(S: Any, nq: int) -> list[Any]:
    """Values of the coordinates in the reference configuration, where the engine's are zero."""
    out: list[Any] = [0.0] * nq
    for b in range(len(S.tree.parent)):
        if S.bodies.offset[b] != 0.0:
            out[S.tree.q[b]] = S.bodies.offset[b]
    return out


def _curve_parameters(x: Values, T: TracedEquations) -> tuple[list[CurveParameter], list[tuple[Node, Any]]]:
    """Curve parameters with their equations, and the nodes of the engine's iterations with their symbols."""
    S, W = T.system, T.work
    places: list[CurveParameter] = []
    feet: list[tuple[Node, Any]] = []
    for k, t in enumerate(x.structure.terms):
        kind = t.formula.of_kind
        if kind.foot is None or kind.progress is None or kind.offset is None:
            continue
        F, M, par = load_record(W.frames, t.F), load_record(W.frames, t.M), row_parameters(S.term_parameters, k)
        symbol = T.z[S.terms.hint[k]]
        feet.append((kind.foot(par, F, M, symbol, S.const), symbol))
        if symbol not in [place.symbol for place in places]:  # of a row, others of the curve have the same
            rate = kind.progress(par, F, M, symbol, S.const)[0]
            places.append(CurveParameter(symbol, dot(*kind.offset(par, F, M, symbol, S.const)), rate, k))
    return places, feet


def _cleaner(
    x: Values, T: TracedEquations, user_q: list[Any], more: list[int], new: list[tuple[Node, Any]]
) -> TurnElimination:
    angles = ClosedFormAngles(x, user_q, T.work)
    s, S, unknown = x.structure, T.system, []
    owners = {f"{t.owner.name}.{t.what}": t for t in s.terms if t.owner is not None}
    directions = {int(S.terms.hint[k]): k for k, t in enumerate(s.terms) if t.formula.kind == TANGENT}
    for at, k in directions.items():
        F, M = s.terms[k].F, s.terms[k].M
        new.append((T.z[at], angles.of_tangent(T.work, F, M, row_parameters(S.term_parameters, k))))
    for name, at in s.state_at.items():
        if at < len(s.controls) or name.endswith((".work", ".place")):
            continue
        t = owners.get(name)
        found = None if t is None else angles.of(t.owner, t.what, t.F, t.M)
        if found is None:
            unknown.append(T.z[at])
        else:
            new.append((T.z[at], found))
    for n, k in enumerate(more):
        t, z = s.terms[k], T.z[len(s.states) + n]
        found = angles.of(t.owner, t.what, t.F, t.M)
        if found is None:
            unknown.append(z)
        else:
            new.append((z, found))
    return TurnElimination(T.graph, new, unknown)


ARRAYS = ("T", "M", "f", "g", "nu", "G", "gamma", "measured", "gradients", "zdot", "returned")


def _cleaned_arrays(T: TracedEquations, cleaned: TurnElimination) -> TracedEquations:
    new: dict[str, Any] = {name: cleaned(getattr(T, name)) for name in ARRAYS}
    return replace(T, **new)


def _cleaned_entry(cleaned: TurnElimination, x: Any) -> Any:
    return cleaned(object_vector([x]))[0]


def quaternions(x: NamedEquations) -> list[list[Node]]:
    """Symbols of every quaternion, four each."""
    out = []
    tree = x.traced.system.tree
    for kind, q in zip(tree.joint.tolist(), tree.q.tolist(), strict=True):
        if kind in (FREE, SPHERICAL):
            first = q + (3 if kind == FREE else 0)
            out.append(list(x.traced.q[first : first + 4]))
    return out


CURVE_SAMPLES = 20  # initial samples of a curve between two breaks


def state_by_symbol(
    x: NamedEquations, t: float, q: np.ndarray, v: np.ndarray, z: Sequence[float] | np.ndarray
) -> dict[str, Any]:
    """Arrays of the engine as values by symbol names."""
    T = x.traced
    out: dict[str, Any] = {T.t.data.name: t}
    for symbol, drawn, value in zip(T.q, x.reference_values, q, strict=True):
        out[symbol.data.name] = _python_number(value + drawn.real)
    others = (*zip(T.v, v, strict=True), *zip(T.states, z, strict=False))
    return out | {symbol.data.name: _python_number(value) for symbol, value in others}


def _python_number(x: Any) -> Any:
    """Convert to a Python number."""
    return x.item() if isinstance(x, np.generic) else x


def curve_parameters_at(
    x: NamedEquations, places: Sequence[CurveParameter], values: Mapping[str, Any]
) -> dict[str, Any]:
    """Curve parameters of followers: the nearest points of the curves, at one time.

    Raises
    ------
    ModelError
        If the values are arrays: every time would have its own curve parameters.
    """
    S, W, out = x.traced.system, x.traced.work, {}
    if any(np.ndim(v) for v in values.values()):
        names = [p.symbol.data.name for p in places]
        raise ModelError(
            f"give {', '.join(names)} too: places on curves are found for one instant only, not for arrays"
        )
    for place in places:
        t = x.values.structure.terms[place.term]
        records = [c for k in (t.F, t.M) for part in load_record(W.frames, k)[:2] for c in part]
        given = [*x.cleaned(object_vector([*records, *row_parameters(S.term_parameters, place.term)])), *S.const]
        numbers = [float(np.real(n)) for n in evaluate(given, values)]
        F, M = ((tuple(n[:3]), tuple(n[3:])) for n in (numbers[:12], numbers[12:24]))
        out[place.symbol.data.name] = nearest_curve_parameter(
            t.formula.of_kind, tuple(numbers[24:32]), F, M, np.array(numbers[32:])
        )
    return out


def nearest_curve_parameter(kind: Kind, par: tuple[float, ...], F: tuple, M: tuple, data: np.ndarray) -> float:
    """Parameter of the point of a curve nearest to M: the nearest sample, refined by Newton's method."""
    at = int(par[1])
    breaks = data[at + BREAKS : at + BREAKS + int(data[at + 1])]
    s = np.linspace(breaks[0], breaks[-1], CURVE_SAMPLES * len(breaks))
    assert kind.foot is not None
    assert kind.offset is not None
    d = kind.offset(par, F, M, s, data)[0]
    guess = s[np.argmin(dot(d, d))]
    return float(kind.foot(par, F, M, float(guess), data))


def generalised_forces(x: NamedEquations) -> list[tuple[str, np.ndarray]]:
    """(what, forces along the velocities) of inertia, of gravity and of every force."""
    T = x.traced
    S, W = T.system, T.work
    W = W._replace(body_wrenches=W.body_wrenches.copy())
    weightless = S._replace(gravity=np.array([0.0] * 3, object), gravity_laws=np.full(4, -1))
    turning = _gathered_forces(weightless, W, T.t, False)
    out = [("Centrifugal, Coriolis and gyroscopic forces", turning)]
    if any(c != 0.0 for c in S.gravity) or (S.gravity_laws >= 0).any():
        out.append(("Weight", _gathered_forces(S, W, T.t, False) - turning))
    for k, e in enumerate(T.structure.forces):
        own = map_arrays(lambda _, x: x[k : k + 1], S.forces)  # noqa: B023
        one = S._replace(forces=own, force_parameters=S.force_parameters[k : k + 1], force_code=S.force_code[k : k + 1])
        out.append((f"{e.name} ({type(e).__name__})", _gathered_forces(one, W, T.t, True)))
    return [(title, x.cleaned(f)) for title, f in out]


def _gathered_forces(S: System, W: Work, t: Any, elements: bool) -> np.ndarray:
    """Forces along the velocities: of inertia and weight, or of the ``elements`` in the tables."""
    f = np.empty(W.velocities.solved.shape[0], object)
    f[:] = 0.0
    W.body_wrenches[:] = 0.0
    rates = np.zeros(len(S.forces.F) + W.trial.size, object)
    if not elements:
        inertial_wrenches(S, W, t, rates)
        gather_forces(S, W, f)
        return f
    apply_forces(S, W, t, rates)
    gather_forces(S, W, f)
    apply_efforts(S, W, t, rates, f)
    return f
