"""Equations of motion as expressions: the engine's own loops run in Python on symbols.

    qdot = T v,  M vdot = f + G^T lam,  g = 0,  G v = nu,  G vdot = gamma

The numbers in the tables (filled in by the same code, run on symbols of the parameters), the state and the time can be
expressions. Loads of joints with friction are separate symbols; `TracedEquations.loads` are these symbols and
`TracedEquations.returned` their values in terms of the multipliers.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..engine.articulated_body import mass_entries
from ..engine.element_dispatch import row_biases, row_values
from ..engine.entry_point import allocate_work
from ..engine.kinematics import coordinate_rates, update_motions, update_poses
from ..engine.loads import apply_efforts, apply_forces, gather_forces, inertial_wrenches, reaction_loads
from ..engine.rows import count_measured, update_controllers
from ..laws.bytecode import BY_TIME, evaluate_jet
from ..model.expressions import is_number_text
from ..model.model import Model
from ..tables.coordinate_choice import require_rotor_coordinates
from ..tables.structure import Choices, structure
from ..tables.structure_definition import Structure
from ..tables.table_definitions import NUMBERS, PLANAR, System, Work, named_arrays, with_numbers
from ..tables.values import values
from .graph import Graph, Node, Symbol, object_vector

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
    inertial_wrenches(S, W)
    update_controllers(S, W, t, z, zdot)
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
        if t.formula.of_kind.place:
            found |= {
                int(S.term_parameters[k, 1].real): f"{t.element.name}.x",
                int(S.term_parameters[k, 2].real): f"{t.element.name}.y",
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
