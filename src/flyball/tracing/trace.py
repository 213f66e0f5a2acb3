"""The engine's own loops run in plain Python on expressions: the equations of motion, nothing derived twice.

    qdot = T v,  M vdot = f + G^T lam,  g = 0,  G v = nu,  G vdot = gamma

What may be an expression is what the tables hold (``tables`` says how), the state and the time. Loads of joints with
friction are symbols of their own; what they are when the reactions are known is in `Traced.loads`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..equations.dispatch import row_biases, row_values
from ..equations.friction import reaction_loads
from ..equations.kinematics import motions, poses
from ..equations.loads import efforts, forces, gather, inertial
from ..equations.mass import mass_entries
from ..equations.rows import measured
from ..equations.scratch import work
from ..equations.tree import rates
from ..graph.node import Graph, Node, Symbol
from ..tables.specs import Structure
from ..tables.system import (
    LOAD,
    NUMBERS,
    PLANAR,
    RETURNED,
    VALUE,
    System,
    Work,
    arrays,
    with_numbers,
)

TRACED = tuple(name for name in NUMBERS if name != "switch_numbers")
"""The tables of numbers in `System` that equations of motion without switches are made of."""


def traced_arrays(S: System) -> dict[str, np.ndarray]:
    """Their arrays by name, always in the same order."""
    return {name: x for table in TRACED for name, x in arrays(getattr(S, table), table)}


@dataclass
class Traced:
    """Equations of motion as expressions. Arrays of objects: nodes, or numbers where nothing moves."""

    graph: Graph
    structure: Structure
    system: System  # its tables of numbers hold objects
    work: Work  # kinematics of bodies and frames, rows, twist columns: as the engine leaves them
    t: Node
    q: list[Node]
    v: list[Node]
    z: list[Node]  # turns, places on curves, works
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
    powers: np.ndarray  # rates of the works, in the order of ``z``; 0 elsewhere
    returned: np.ndarray  # (nl,): loads that follow from the multipliers


def plain(S: System) -> System:
    """The tables of numbers as arrays of objects, of Python's own numbers."""

    def objects(_: str, x: np.ndarray) -> np.ndarray:
        out = np.empty(x.shape, object)
        out.ravel()[:] = x.ravel().tolist()
        return out

    return with_numbers(S, objects, TRACED)


def traced(
    s: Structure, S: System, graph: Graph | None = None, names: Names | None = None, drawn: Sequence[Any] = ()
) -> Traced:
    """Run the engine's loops on symbols.

    Parameters
    ----------
    s, S : Structure, System
        A mechanism in some coordinates. The tables of numbers are `plain`, with expressions where wanted.
    graph : Graph, optional
        Where expressions in the tables live.
    names : Names, optional
        What the symbols are called.
    drawn : sequence, optional
        What the coordinates are where the engine's are zero, (nq,): the equations are then in these.
    """
    graph = Graph() if graph is None else graph
    names = names or numbered(s, len(S.rows.law))
    graph.functions.names.update(tables_by_name(s, S))
    W = work(s, S, dtype=object)
    t = graph.symbol(Symbol("t", "time", "t", "s"))
    q, v, z, lam, loads = ([graph.symbol(x) for x in names_] for names_ in names)
    work_rates = np.zeros(len(z), object)
    nv = s.nv
    own = [x - at for x, at in zip(q, drawn, strict=True)] if len(drawn) else q
    _kinematics(S, W, t, own, v, z)
    nm = measured(S)
    for n, load in enumerate(loads):
        W.sensed[LOAD, 2 * nm + n] = load
    T = np.array([[0.0] * nv] * s.nq, object).reshape(s.nq, nv)
    _rates(S, q, v, T)
    f = W.velocities.applied
    inertial(S, W)
    forces(S, W, t, work_rates)
    gather(S, W, f)
    efforts(S, W, t, work_rates, f)
    M = mass_matrix(S, W, nv)
    gradients, G = _rows(S, W, nm, nv)
    W.rows.multiplier[:] = lam
    reaction_loads(S, W)
    return Traced(
        graph, s, S, W, t, q, v, z, lam, loads, T, M, f.copy(), W.rows.value.copy(), W.rows.nu.copy(), G,
        W.rows.gamma.copy(), W.sensed[VALUE : VALUE + 3, :nm].T.copy(), gradients, work_rates,
        W.sensed[RETURNED, 2 * nm :].copy(),
    )  # fmt: skip


def tables_by_name(s: Structure, S: System) -> dict[int, str]:
    """What tables are called, by where they begin in the table of constants; curves of joints are x and y of these."""
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


def numbered(s: Structure, rows: int) -> Names:
    """Symbols that are called by their numbers."""

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
    """Poses, rows, velocities and bias accelerations: as `projection.place` and `projection.move`."""
    poses(S, W, q)
    row_values(S, W, t, z)
    motions(S, W, v)
    row_biases(S, W, t, v, z)


def _rates(S: System, q: list[Node], v: list[Node], T: np.ndarray) -> None:
    """Qdot = T v, column by column."""
    for d in range(len(v)):
        one = [1.0 if k == d else 0.0 for k in range(len(v))]
        rates(S, q, one, T[:, d])


def _rows(S: System, W: Work, nm: int, nv: int) -> tuple[np.ndarray, np.ndarray]:
    """Gradients of what is measured and of the rows, dense."""
    nr = len(S.rows.law)
    dense = np.array([[0.0] * nv] * (nr + nm), object).reshape(nr + nm, nv)
    for k in range(nr + nm):
        for e in range(S.row_start[k], S.row_start[k + 1]):
            dense[k, S.column[e]] = dense[k, S.column[e]] + W.G[e]
    return dense[nr:], dense[:nr]


def mass_matrix(S: System, W: Work, nv: int) -> np.ndarray:
    """M, dense: of the bodies themselves where every one hangs on ground, else of composite bodies."""
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
