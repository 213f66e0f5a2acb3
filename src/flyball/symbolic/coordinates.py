"""The choice of coordinates for symbolic equations, and the initial state in them.

The rule is that of a simulation. The traced equations in the reference configuration show whether inertia acts along
every coordinate and whether the reactions that friction needs are determined. The compiled engine is used only if they
are not.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..assembly.assemble import assemble
from ..assembly.assembled_state import Assembly
from ..assembly.compiled_mechanism import CompiledMechanism, compile_mechanism
from ..errors import AnalysisError
from ..expression_graph.evaluation import evaluate_array
from ..expression_graph.tracing import object_tables, trace_equations
from ..model.model import Model
from ..simulation.initial_state import THIN_INERTIA, find_initial_state, refuse_unknown_coordinates
from ..tables.coordinate_choice import spanning_joints

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
    cut = [j.name for j in model.joints if j.name not in tree]
    more = f"; loops are cut at {', '.join(cut[:8])}" if cut else ""
    more += f" and {len(cut) - 8} more" if len(cut) > 8 else ""
    return f"joint: {'as requested' if wish == 'joint' else 'these make the fewest equations'}{more}"


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
