"""A mechanism's equations of motion in its own names: traced, then told as one writes them.

Coordinates are those that a user knows (an angle told to be drawn at 0.3 is 0.3 there). Drivers of coordinates are
constraints with a multiplier, the effort, whichever coordinates these are. Angles have no whole turns to be counted
(`angles`); a follower's place on its curve is a symbol that has an equation of its own.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..constraints.curve import point
from ..equations.records import load
from ..equations.rows import BY_TIME, parameters
from ..graph.arrays import objects
from ..graph.node import Graph, Node, Symbol
from ..laws.evaluation import evaluate_jet
from ..math.vec import mtv, sub
from ..tables.values import Values
from ..tracing.trace import Names, Traced, plain, traced
from .angles import Angles, Cleaned, counted
from .names import called


@dataclass
class Place:
    """Where a follower is on its curve: a symbol, the equation that it fulfils, and how fast it moves."""

    symbol: Node
    equation: Any  # zero there
    rate: Any
    term: int


@dataclass
class Formulated:
    """Equations of motion in a mechanism's own names. All arrays are of nodes or numbers."""

    values: Values  # its tables hold objects
    traced: Traced  # with the rows of prescribed coordinates, which the engine has not
    own_q: list[Any]  # the engine's coordinates: those of `traced` less what they are as drawn
    drawn: list[Any]  # that
    vdot: list[Node]
    places: list[Place]
    cleaned: Cleaned
    named: dict[str, Node]  # every symbol by its name


def formulated(x: Values, graph: Graph) -> Formulated:
    """Trace a mechanism and tell its equations in its own names.

    Parameters
    ----------
    x : Values
        Filled in with numbers or with expressions of ``graph``.
    graph : Graph
    """
    s = x.structure
    S = x.system if x.system.const.dtype == object else plain(x.system)
    x = replace(x, system=S)
    S, more = counted(x, S)
    names = called(x)
    drawn = _drawn(S, s.nq)
    hints = [Symbol(f"turns of term {k}", "state") for k in more]
    nr = len(s.rows)
    wanted: Names = (names.q, names.v, [*names.z, *hints], names.lam[:nr], names.loads)
    T = traced(s, S, graph, wanted, drawn)
    own_q = [q - at for q, at in zip(T.q, drawn, strict=True)]
    places, feet = _places(x, T)
    new = [(foot, place.symbol) for foot, place in zip(feet, places, strict=True)]
    cleaned = _cleaner(x, T, own_q, more, new)
    lam = [*T.lam, *(graph.symbol(e) for e in names.lam[nr:])]
    T = _told(_prescribed(T, S, lam), cleaned)
    places = [replace(p, equation=_one(cleaned, p.equation), rate=_one(cleaned, p.rate)) for p in places]
    vdot = [graph.symbol(a) for a in names.vdot]
    named = {n.data.name: n for n in (T.t, *T.q, *T.v, *vdot, *lam, *T.loads, *(p.symbol for p in places))}
    return Formulated(x, T, own_q, drawn, vdot, places, cleaned, named)


def _drawn(S: Any, nq: int) -> list[Any]:
    """Values of the coordinates as drawn, where the engine's are zero."""
    out: list[Any] = [0.0] * nq
    for b in range(len(S.tree.parent)):
        if S.bodies.offset[b] != 0.0:
            out[S.tree.q[b]] = S.bodies.offset[b]
    return out


def _places(x: Values, T: Traced) -> tuple[list[Place], list[Node]]:
    """Places on curves with their equations, and the iterations that find them in the engine."""
    S, W = T.system, T.work
    places, feet = [], []
    for k, t in enumerate(x.structure.terms):
        kind = t.formula.of_kind
        if kind.foot is None or kind.progress is None:
            continue
        F, M, par = load(W.FK, t.F), load(W.FK, t.M), parameters(S.term_parameters, k)
        symbol = T.z[S.terms.hint[k]]
        p = mtv(F[1], sub(M[0], F[0]))
        x0, x1, _, y0, y1, _ = point(par, symbol, S.const)
        feet.append(kind.foot(par, F, M, symbol, S.const))
        rate = kind.progress(par, F, M, symbol, S.const)[0]
        places.append(Place(symbol, (p[0] - x0) * x1 + (p[1] - y0) * y1, rate, k))
    return places, feet


def _cleaner(x: Values, T: Traced, own_q: list[Any], more: list[int], new: list[tuple[Node, Any]]) -> Cleaned:
    angles = Angles(x, own_q, T.work)
    s, unknown = x.structure, []
    owners = {f"{t.owner.name}.{t.what}": t for t in s.terms if t.owner is not None}
    for name, at in s.state_at.items():
        if name.endswith((".work", ".place")):
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
    return Cleaned(T.graph, new, unknown)


def _prescribed(T: Traced, S: Any, lam: list[Node]) -> Traced:
    """Coordinates that drivers prescribe as constraints: q = f(t), of which the multiplier is the effort."""
    s = T.structure
    order = sorted(s.prescribed, key=lambda k: s.slices[k].start)
    g, nu, G, gamma = [], [], np.zeros((len(order), s.nv), object), []
    for k, name in enumerate(order):
        b = s.prescribed[name]
        f = evaluate_jet(S.code, S.const, S.tree.law[b], T.work.stack, T.t, T.work.sensed, BY_TIME)
        g.append(T.q[S.tree.q[b]] - f[0])
        nu.append(f[1])
        gamma.append(f[2])
        G[k] = 0.0
        G[k, S.tree.v[b]] = 1.0
        if S.tree.work[b] >= 0:
            T.powers[S.tree.work[b]] = lam[len(s.rows) + k] * T.v[S.tree.v[b]]
    return replace(
        T,
        lam=lam,
        g=np.r_[T.g, objects(g)],
        nu=np.r_[T.nu, objects(nu)],
        G=np.vstack([T.G, G]),
        gamma=np.r_[T.gamma, objects(gamma)],
    )


ARRAYS = ("T", "M", "f", "g", "nu", "G", "gamma", "measured", "gradients", "powers", "returned")


def _told(T: Traced, cleaned: Cleaned) -> Traced:
    new: dict[str, Any] = {name: cleaned(getattr(T, name)) for name in ARRAYS}
    return replace(T, **new)


def _one(cleaned: Cleaned, x: Any) -> Any:
    return cleaned(objects([x]))[0]
