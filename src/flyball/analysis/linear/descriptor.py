"""The linear equations with the constraints left in, with named inputs and outputs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ...numerics.sparse_rank import weak_pivots
from ...results.descriptor import Descriptor
from ...tables.names import velocity_names
from .curves import gradients, slopes
from .derivatives import Equations
from .effects import effects, stepped
from .free import Free, prescribed, void
from .inputs import Input
from .large import Large, unit_rows
from .reduced import Frame
from .undetermined import refuse_open


def descriptor_of_large(whole: Large, inputs: Sequence[Input], outputs: Sequence[str]) -> Descriptor:
    """Of a large mechanism at rest; errors as `refuse_undetermined`."""
    import scipy.sparse as sp

    nv = len(whole.scale)
    none = sp.csr_matrix((nv, nv))
    C = gradients(whole.e.state, outputs)
    refuse_open(whole.e.state, outputs, C)
    return _descriptor(whole.e, whole.rows, (none, none), inputs, outputs, C)


def descriptor(e: Equations, f: Free, frame: Frame, inputs: Sequence[Input], outputs: Sequence[str]) -> Descriptor:
    """Of any mechanism, in the coordinates of its equations."""
    import scipy.sparse as sp

    G = unit_rows(_all_rows(e) @ sp.diags(f.scale))[0]
    return _descriptor(
        e,
        np.setdiff1d(np.arange(G.shape[0]), weak_pivots(G @ G.T)[0]) if G.shape[0] else np.zeros(0, int),
        (sp.csr_matrix(frame.N - frame.H), sp.csr_matrix(frame.H)),
        inputs,
        outputs,
        gradients(e.state, outputs),
    )


def _all_rows(e: Equations) -> Any:
    """Constraints, then prescribed coordinates, then turns that mean nothing; sparse."""
    import scipy.sparse as sp

    nv, still = e.state.c.structure.nv, void(e)
    one = sp.csr_matrix((np.ones(len(still)), (np.arange(len(still)), still)), shape=(len(still), nv))
    return sp.vstack([e.by_velocity[e.at["n"]], sp.csr_matrix(prescribed(e.state.c)), one]).tocsr()


def _descriptor(
    e: Equations,
    rows: np.ndarray,
    turning: tuple[Any, Any],
    inputs: Sequence[Input],
    outputs: Sequence[str],
    C: Any,
) -> Descriptor:
    """With those of all rows that are independent."""
    import scipy.sparse as sp

    c, s, at = e.state.c, e.state.c.structure, e.at
    names = velocity_names(s)
    G = _all_rows(e)
    others = G.shape[0] - len(s.rows)
    holonomic = np.r_[[r.holonomic for r in s.rows], np.ones(others, bool)].astype(bool)
    r, g, n = effects(e, inputs)
    gaps = np.where(holonomic[: len(g), None], g, n)
    gaps = np.vstack([gaps, np.zeros((G.shape[0] - len(g), len(inputs)))])
    V = sp.vstack([e.by_position[at["n"]], sp.csr_matrix((others, s.nv))]).tocsr()
    C = C.tocsc()
    nv, held = s.nv, len(s.rows) + len(s.prescribed)
    kept = rows[rows < held]  # what holds a turn that means nothing has no multiplier that anything depends on
    by_rows = sp.hstack([C[:, 3 * nv + kept], sp.csr_matrix((len(outputs), len(rows) - len(kept)))])
    D = np.array([_direct(e, outputs, i) for i in inputs]).reshape(len(inputs), len(outputs)).T
    of = [x.element.name for x in s.rows] + list(s.prescribed) + [names[d].name for d in void(e)]
    M, W, K = (X[at["r"]] for X in (e.by_acceleration, e.by_velocity, e.by_position))
    kinematic, turned = turning
    return Descriptor(
        mass=M,
        damping=W,
        stiffness=K,
        constraints=G[rows].tocsr(),
        on_positions=holonomic[rows],
        by_position=V[rows].tocsr(),
        kinematic=kinematic.tocsr(),
        turning=turned.tocsr(),
        forces=r,
        gaps=gaps[rows],
        C=sp.hstack([*(C[:, k * nv : (k + 1) * nv] for k in range(3)), by_rows]).tocsr(),
        D=D,
        coordinates=tuple(x.name for x in names),
        units=tuple(x.unit for x in names),
        rows=tuple(of[k] for k in rows),
        scale=c.sizes / c.values.length,
    )


def _direct(e: Equations, outputs: Sequence[str], i: Input) -> np.ndarray:
    """What an input does to the outputs by itself."""
    x = e.state
    n = len(x.v)
    still = [np.zeros((1, k)) for k in (n, n, n, len(x.lam) + len(x.c.structure.prescribed))]
    return slopes(x, outputs, still, stepped(e, i))[0]
