"""In which coordinates equations are written, and where the mechanism starts: without compiled code where that can be.

Which joints become coordinates is the choice of `analysis.motion.layer`. What that asks of the compiled engine, whether
inertia moves along every coordinate and whether friction knows its reactions, is asked of the traced equations at the
position that is drawn, and of the engine only where the answer there is no.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..analysis.assemble import assemble
from ..analysis.assembly.start import Assembly
from ..analysis.compiled import Compiled, compiled
from ..analysis.motion.layer import THIN, known
from ..analysis.motion.start import begin
from ..errors import AnalysisError
from ..graph.values import evaluated
from ..model.model import Model
from ..tables.spanning import spanning
from ..tracing.trace import plain, traced

RANK = 1e-6  # of the largest singular value of the constraints' Jacobian, above which rows surely are independent


class Chosen(NamedTuple):
    """Coordinates of equations: names of the tree joints, and which they are and why."""

    tree: tuple[str, ...]
    why: str


def chosen(model: Model, parameters: Mapping[str, float] | None, wish: str) -> Chosen:
    """Coordinates as wished; ``auto``: those of joints, wherever friction allows it.

    Raises
    ------
    ModelError
        For an unknown wish, or if a body can move without inertia.
    AnalysisError
        If friction follows reactions that redundancy leaves undetermined, for joint coordinates.
    """
    known(wish)
    tree = spanning(model) if wish != "absolute" else ()
    if not _clear(compiled(model, parameters=parameters, tree=tree), wish):
        return _engine_s(model, parameters, wish)
    if wish == "absolute":
        return Chosen((), "absolute: as asked for")
    if not tree:
        return Chosen((), "absolute: no joint can be a tree joint")
    return Chosen(tree, _told(model, wish, tree))


def _told(model: Model, wish: str, tree: Sequence[str]) -> str:
    cut = [j.name for j in model.joints if j.name not in tree]
    more = f"; rows remain for {', '.join(cut[:8])}" if cut else ""
    more += f" and {len(cut) - 8} more" if len(cut) > 8 else ""
    return f"joint: {'as asked for' if wish == 'joint' else 'these make the fewest equations'}{more}"


def _clear(c: Compiled, wish: str) -> bool:
    """Whether, as drawn, inertia moves along all velocities and rows leave no reaction open that a friction follows."""
    s, S = c.structure, c.values.system
    light, loaded = S.scales.semidefinite != 0.0, bool(s.loads) and wish != "absolute"
    if not light and not loaded:
        return True
    T = traced(s, plain(S))
    state = (([T.t], [0.0]), (T.q, c.values.q), (T.v, c.values.v), (T.z, c.z))
    at = {x.data.name: float(np.real(y)) for xs, ys in state for x, y in zip(xs, ys, strict=True)}
    G, sizes = np.asarray(evaluated(T.G, at), float) * c.sizes, c.sizes
    if loaded and not _independent(G):
        return False
    if not light:
        return True
    M = np.asarray(evaluated(T.M, at), float) * sizes * sizes[:, None]
    if not s.tree:  # joints' coordinates must have inertia of their own, bodies only where the rows let them go
        Z = _free(G)
        M = Z.T @ M @ Z
    return not len(M) or bool(np.linalg.eigvalsh(M)[0] > THIN * S.bodies.mass.sum() * c.values.length**2)


def _independent(G: np.ndarray) -> bool:
    if not len(G):
        return True
    if len(G) > G.shape[1]:
        return False
    w = np.linalg.svd(G, compute_uv=False)
    return bool(w[-1] > RANK * w[0])


def _free(G: np.ndarray) -> np.ndarray:
    """What the rows leave free, (nv, freedoms)."""
    if not len(G):
        return np.eye(G.shape[1])
    _, w, V = np.linalg.svd(G)
    return V[int((w > RANK * w[0]).sum()) :].T


def _engine_s(model: Model, parameters: Mapping[str, float] | None, wish: str) -> Chosen:
    """The choice that a motion makes."""
    try:
        start = begin(model, 0.0, parameters, None, "joint" if wish == "auto" else wish)
    except AnalysisError as error:  # friction that follows loads which joint coordinates do not know
        if wish != "auto":
            raise
        return Chosen((), f"absolute: {str(error).partition(': ')[2]}")
    tree = tuple(start.assembly.compiled.structure.tree)
    return Chosen(tree, start.coordinates if not tree or wish == "joint" else _told(model, wish, tree))


def started(model: Model, parameters: Mapping[str, float] | None, tree: tuple[str, ...]) -> Assembly:
    """Where the mechanism starts, as described and assembled, in coordinates that are chosen.

    Raises
    ------
    AssemblyError
        If the mechanism cannot be assembled.
    """
    a = assemble(model, parameters=parameters)
    if not tree:
        return a
    c = compiled(model, parameters=parameters, tree=tree)
    q, v = c.take(a.compiled, a.t, a.q, a.v)
    return replace(a, compiled=c, q=q, v=v)
