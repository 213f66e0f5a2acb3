"""Modes: eigenvalues and shapes of the linear equations, dense for all of them, sparse for the lowest of many.

For large mechanisms at rest without damping, K x - G^T l = w^2 M x, G x = 0 is solved as it stands, by Lanczos
iterations with shift and invert (Ericsson and Ruhe 1980): nothing is reduced, so sparse matrices stay sparse.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import AnalysisError
from ..model.model import Model
from ..numerics.rank import span
from ..results.modes import GROWS, Modes
from ..tables.names import velocity_names
from .linear.curves import snapshot
from .linear.derivatives import Equations, State
from .linear.kinks import refuse_kinks
from .linear.spectrum import EQUAL, spectrum
from .linear.steady import balanced
from .linearize import InstantOptions, without_inputs
from .options import count as at_least

DENSE = 600  # velocities up to which all modes are found
RIGID = 1e-6  # shift, of the largest stiffness over the largest mass
FEW = 10
ROUNDED = 1e-11  # parts of a shape below this part of its largest are rounding
UNDAMPED = 1e-12
TINY = 1e-7  # directions of random motions below this part of the largest are none
REFINED = 2  # times that a solution is improved: rows may be redundant


@dataclass(frozen=True, kw_only=True)
class ModesOptions(InstantOptions):
    """What `Mechanism.modes` is asked."""

    count: int | None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.count is not None:
            at_least(self.count, "count")


def modes(model: Model, o: ModesOptions) -> Modes:
    """Natural motions about an equilibrium or a steady motion: see `Mechanism.modes`."""
    count, frozen = o.count, o.frozen
    x = o.state(model)
    if len(x.v) > DENSE and x.c.structure.tree:
        x = o.state(model, "absolute")
    if len(x.v) > DENSE and not np.abs(x.v).max() > 0.0:
        return _sparse(x, count or FEW, frozen)
    f, frame, r = without_inputs(x, frozen)
    own = spectrum(r.A, r.doubt)
    w = own.values
    listed = np.array([k for group in own.groups for k in group[: own.geometric[group[0]]]], int)
    one = listed[w[listed].imag >= 0.0]
    one = one[np.lexsort((-w[one].real, np.abs(w[one])))]
    rest = one[count:] if count is not None else one[:0]
    one = one[:count]
    shapes = r.position[:, : len(r.A)] @ own.vectors[:, one]
    found = _made(x, w[one], shapes, float(np.abs(w).max(initial=0.0)))
    found.turning, found.seen_from = frame.turning, frame.told
    found.multiplicity, found.geometric_multiplicity = own.multiplicity[one], own.geometric[one]
    found.residual = own.residual
    found.growing = bool((w[rest].real > GROWS * np.abs(w[rest])).any())
    return found


def _made(x: State, w: np.ndarray, shapes: np.ndarray, fastest: float) -> Modes:
    """Modes whose largest part is 1, seen from the ground."""
    names = velocity_names(x.c.structure)
    length = (x.c.values.length / x.c.sizes)[:, None]
    sign = np.array([n.sign for n in names])[:, None]
    size = length * np.abs(shapes)
    for k in range(shapes.shape[1]):
        if size[:, k].max(initial=0.0) > 0.0:
            shapes[:, k] /= shapes[np.argmax(size[:, k]), k]
    least = ROUNDED * (length * np.abs(shapes)).max(axis=0, initial=0.0) / length
    shapes = np.where(np.abs(shapes.real) > least, shapes.real, 0.0) + 1j * np.where(
        np.abs(shapes.imag) > least, shapes.imag, 0.0
    )
    units = tuple(n.unit for n in names)
    one = np.ones(len(w), int)
    return Modes(
        w, sign * shapes, tuple(n.name for n in names), units, np.zeros(3), snapshot(x), fastest, False, one, one.copy()
    )


def _sparse(x: State, count: int, frozen: bool) -> Modes:
    """The slowest modes of a large mechanism at rest."""
    import scipy.sparse as sp
    from scipy.sparse.linalg import LinearOperator, eigsh, splu

    e = Equations(x)
    if not frozen:
        balanced(x, e)
    refuse_kinks(e)
    if not all(row.holonomic for row in x.c.structure.rows):
        raise AnalysisError(
            f"{x.c.structure.model.name!r} has {len(x.v)} velocities and constraints on velocities only; modes of so "
            f"large a mechanism are found without such constraints only"
        )
    r = e.at["r"]
    M, D, K = (X[r].tocsc() for X in (e.by_acceleration, e.by_velocity, e.by_position))
    if abs(D).max() > UNDAMPED * abs(K).max():
        raise AnalysisError(
            f"{x.c.structure.model.name!r} has {len(x.v)} velocities and damping; modes of so large a mechanism are "
            f"found without damping only. Take the dampers out, or ask for coordinates='joint' if these are few"
        )
    G = e.by_position[e.at["g"]]
    size = np.sqrt(np.asarray(G.multiply(G).sum(axis=1)).ravel())
    G = sp.diags(1.0 / np.where(size > 0.0, size, 1.0)) @ G
    typical = abs(K).max()
    shift = -RIGID * typical / abs(M).max()
    symmetric = 0.5 * (K + K.T)
    if abs(K - K.T).max() > 1e-8 * typical:
        raise AnalysisError(
            f"{x.c.structure.model.name!r} has {len(x.v)} velocities and forces without a potential, which turn with "
            f"bodies; modes of so large a mechanism are found without them only"
        )
    n, m = len(x.v), G.shape[0]
    A = sp.bmat([[symmetric - shift * M, G.T * typical], [G * typical, -1e-11 * typical * sp.identity(m)]]).tocsc()
    exact = sp.bmat([[symmetric - shift * M, G.T * typical], [G * typical, None]]).tocsr()
    solve = splu(A)

    def invert(b: np.ndarray) -> np.ndarray:
        b = np.r_[b.ravel(), np.zeros(m)]
        y = solve.solve(b)
        for _ in range(REFINED):
            y += solve.solve(b - exact @ y)
        return y[:n]

    squares, V = _few(invert, symmetric, M, 2 * count + 20)
    if squares is None:
        inverse = LinearOperator((n, n), matvec=invert, dtype=float)
        start = invert(M @ np.random.default_rng(0).standard_normal(n))
        squares, V = eigsh(symmetric, k=count, M=M, sigma=shift, OPinv=inverse, which="LM", v0=start)
    order = np.argsort(squares)[:count]
    w = np.sqrt(squares[order].astype(complex))
    w = np.where(squares[order] < 0.0, w.imag + 0j, 1j * w.real)
    V = V[:, order]
    found = _made(x, w, V.astype(complex), float(np.sqrt(typical / abs(M).max())))
    again = np.array([invert(M @ v) for v in V.T]).T * (squares[order] - shift)
    found.residual = float((np.linalg.norm(again - V, axis=0) / np.linalg.norm(V, axis=0)).max(initial=0.0))
    _repeated(found)
    return found


def _repeated(found: Modes) -> None:
    """Multiplicities among the modes of a mechanism at rest: equal frequencies, and zeros, which are double."""
    w = found.eigenvalues
    still = np.array([kind == "rigid" for kind in found.kinds], bool)
    near = np.abs(w[:, None] - w) <= EQUAL * np.abs(w)
    found.geometric_multiplicity = np.where(still, still.sum(), near.sum(axis=1))
    found.multiplicity = np.where(still, 2, 1) * found.geometric_multiplicity


def _few(invert: Any, K: Any, M: Any, most: int) -> tuple[np.ndarray | None, np.ndarray]:
    """All squares of frequencies and shapes, where there are fewer freedoms than ``most``; else None.

    The inverse maps everything to motions that the constraints allow: as many random vectors as there are freedoms span
    them.
    """
    from scipy.linalg import eigh

    random = np.random.default_rng(1).standard_normal((K.shape[0], most))
    found = np.array([invert(M @ x) for x in random.T]).T
    found /= np.linalg.norm(found, axis=0)
    U = span(found, TINY)
    rank = U.shape[1]
    if rank == most:
        return None, found
    Z = np.array([invert(M @ x) for x in U[:, :rank].T]).T
    Z, _ = np.linalg.qr(Z / np.linalg.norm(Z, axis=0))
    squares, V = eigh(Z.T @ K @ Z, Z.T @ (M @ Z))
    return squares, Z @ V
