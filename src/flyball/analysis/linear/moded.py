"""How eigenvalues change with parameters, where the mechanism is drawn or rests; controllers in the loop, sampled too.

The matrix is exact, its derivatives are differences of sixth order of it; see ``eigenvalues`` for what follows.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from ...errors import ModelError, SingularityError
from ...results.linear import follow
from ...results.sensitivity import Sensitivity
from ..equilibrium import ABOUT, equilibrium, resting
from ..linearize import LinearizeOptions, small_motions, without_inputs
from .derivatives import Equations, State
from .differences import Found, aside, derivative
from .instant import instant
from .kinks import refuse_kinks
from .question import Question
from .spectrum import EQUAL, WIDEST, equal, subspace


def of_modes(a: Question) -> Sensitivity:
    """Eigenvalues and their derivatives; of sampled controllers multipliers from one cycle to the next."""
    matrix, unit = _loop(a) if a.model.controllers else _free(a)
    base = matrix(a.parameters)
    dA = np.array([derivative(a.model, a.parameters, name, matrix) for name in a.to])
    w, dw = changes(base, dA.reshape(len(a.to), *base.shape), lambda k: aside(a.model, a.parameters, a.to[k], matrix))
    of = tuple(f"eigenvalue {k}" for k in range(len(w)))
    return Sensitivity("modes", of, a.to, (unit,) * len(of), {}, np.array([a.t]), w[None], dw[None])


def at_modes(a: Question) -> Found:
    """The eigenvalues for any parameters, in the order of those that they were."""
    matrix, _ = _loop(a) if a.model.controllers else _free(a)
    A = matrix(a.parameters)
    first, _ = changes(A, np.zeros((0, *A.shape)))

    def found(parameters: Mapping[str, float]) -> np.ndarray:
        return follow(np.array([first, np.linalg.eigvals(matrix(parameters)).astype(complex)]))[1]

    return found


def _free(a: Question) -> tuple[Found, str]:
    """The matrix of a mechanism without controllers, in the free coordinates that it has at first; its unit."""
    about = _places(a)

    def state(parameters: Mapping[str, float]) -> State:
        return instant(a.model, about(parameters), t=a.t, parameters=parameters, coordinates="absolute")[0]

    begin = state(a.parameters)
    f, _, _ = without_inputs(begin)
    refuse_kinks(Equations(begin), np.zeros((len(begin.v), 1)), np.zeros((len(begin.v), 1)), a.to)
    return lambda parameters: without_inputs(state(parameters), like=f)[2].A, "1/s"


def _loop(a: Question) -> tuple[Found, str]:
    """The matrix of the closed loop, and its unit: none if it leads from one sample to another."""
    about = _places(a)

    def linear(parameters: Mapping[str, float]) -> Any:
        place = about(parameters)
        given = {"about": place, "t": None if place else a.t, "parameters": parameters, "coordinates": "absolute"}
        return small_motions(a.model, LinearizeOptions(**(ABOUT | given)))[0]

    first = linear(a.parameters)

    def found(parameters: Mapping[str, float]) -> np.ndarray:
        now = linear(parameters)
        if now.states != first.states:
            raise ModelError(f"the states there are {', '.join(now.states)}, and were {', '.join(first.states)}")
        return now.A

    return found, "" if first.period else "1/s"


def _places(a: Question) -> Callable[[Mapping[str, float]], Any]:
    """The equilibrium for any parameters, near the first; None where eigenvalues are of the mechanism as drawn."""
    begin: list[Any] = []

    def about(parameters: Mapping[str, float]) -> Any:
        if a.about != "equilibrium":
            return None
        begin.append(equilibrium(a.model, resting(a.t, parameters, begin[0] if begin else None)))
        return begin.pop() if len(begin) > 1 else begin[0]

    return about


# How eigenvalues change with a matrix: dw = y^H dA x / y^H x (Lancaster 1964), groups of equal ones together.
#
# Where an eigenvalue is repeated with as many eigenvectors, its first changes are the eigenvalues of dA within them.
# Where it has too few, it has no derivative, unless all stay zero: a mechanism that can move away as a whole has two
# zeros and keeps them. Whether they stay is looked up a finite step aside.


ROUNDED = 100.0 * np.finfo(float).eps  # of the matrix' size: what is uncertain of it
PLAIN = 1e-6  # part of the matrix' size by which a group of equal eigenvalues differs from a multiple of the identity
STAYED = 1e-3  # of what dA would do to a group in a finite step: eigenvalues that moved less have stayed

Aside = Callable[[int], tuple[float, np.ndarray, str]]


def changes(A: np.ndarray, dA: np.ndarray, aside: Aside | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Eigenvalues and their derivatives.

    Parameters
    ----------
    A : ndarray (n, n)
    dA : ndarray (k, n, n)
        Derivatives of A by k parameters.
    aside : callable
        Gives for the k-th parameter a finite step, A that far aside, and the parameter's name.

    Returns
    -------
    w : ndarray (n,)
        Sorted by absolute and imaginary value.
    dw : ndarray (n, k)

    Raises
    ------
    SingularityError
        If an eigenvalue has no derivative.
    """
    from scipy.linalg import eig, matrix_balance

    if not len(A):
        return np.zeros(0, complex), np.zeros((0, len(dA)), complex)
    B, (scale, _) = matrix_balance(A, permute=False, separate=True)
    dB = dA / scale[:, None] * scale
    w, left, right = eig(B, left=True)
    order = np.lexsort((w.imag, np.abs(w)))
    w, left, right = w[order], left[:, order], right[:, order]
    size = float(np.linalg.norm(B, 2)) or 1.0
    out = np.zeros((len(w), len(dA)), complex)
    angle = np.abs((left.conj() * right).sum(axis=0))
    for group in equal(w, size * np.clip(ROUNDED / np.maximum(angle, 1e-300), EQUAL, WIDEST)):
        if len(group) == 1:
            y, x = left[:, group[0]], right[:, group[0]]
            out[group[0]] = np.array([y.conj() @ d @ x for d in dB]) / (y.conj() @ x)
        else:
            out[group] = _together(B, dB, w, group, size, scale, aside)
    return w.astype(complex), out


def _together(
    B: np.ndarray, dB: np.ndarray, w: np.ndarray, group: list[int], size: float, scale: np.ndarray, aside: Aside | None
) -> np.ndarray:
    """Derivatives of equal eigenvalues, (group, k)."""
    V, W = (subspace(X, v) for X, v in ((B, w[group]), (B.conj().T, w[group].conj())))
    inner = np.linalg.inv(W.conj().T @ V)
    own = inner @ (W.conj().T @ B @ V)
    plain = np.abs(own - np.trace(own) / len(group) * np.eye(len(group))).max() <= PLAIN * size
    out = np.zeros((len(group), len(dB)), complex)
    for k, d in enumerate(dB):
        inside = inner @ (W.conj().T @ d @ V)
        if plain:
            found = np.linalg.eigvals(inside)
            out[:, k] = found[np.lexsort((found.imag, found.real))]
        elif aside is not None:
            h, other, name = aside(k)
            value, spread = complex(np.mean(w[group])), float(np.abs(w[group]).max())
            then = np.abs(np.linalg.eigvals(other / scale[:, None] * scale))
            moved = np.sort(then)[: len(group)].max()  # as many as are zero now, if they are
            stayed = moved <= max(STAYED * h * np.abs(inside).max(), 10.0 * spread, np.sqrt(ROUNDED) * size)
            if abs(value) <= np.sqrt(ROUNDED) * size and stayed:
                continue
            raise SingularityError(
                f"the eigenvalue {value.real:.4g}{value.imag:+.4g}j 1/s is {len(group)}-fold and has fewer "
                f"eigenvectors: it has no derivative by {name!r}. Ask a little to the side of this value"
            )
    return out
