"""Derivatives of eigenvalues by parameters, in the described position or at the equilibrium, with controllers.

The system matrix is exact. Its derivatives are differences of sixth order; then dw = y^H dA x / y^H x (Lancaster
1964), with groups of equal eigenvalues treated together. Sampled controllers are supported.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from ..derivatives.eigenvalues import EQUAL_TOLERANCE, MAX_SPLITTING, equal_groups, invariant_subspace
from ..derivatives.equation_derivatives import EquationDerivatives, MechanismState
from ..derivatives.nonsmooth_points import refuse_nonsmooth
from ..errors import ModelError, SingularityError
from ..linear.linearize import LinearizeOptions, controlled_linear_model, equations_without_inputs
from ..linear.operating_point import operating_state
from ..results.linear_model import sort_branches
from ..results.sensitivity_and_optimum import Sensitivity
from ..statics.equilibrium import LINEARIZE_DEFAULTS, equilibrium, rest_options
from ..tables.coordinate_choice import rotors
from .parameter_derivatives import DerivativeRequest, ParameterFunction, difference_derivative, offset_sample


def eigenvalue_sensitivity(a: DerivativeRequest) -> Sensitivity:
    """Eigenvalues and their derivatives; with sampled controllers the multipliers of one cycle."""
    matrix, unit = _system_matrix(a)
    base = matrix(a.parameters)
    units = entry_units(base)
    dA = np.array([difference_derivative(a.model, a.parameters, name, matrix, units) for name in a.to])
    w, dw = eigenvalue_derivatives(
        base, dA.reshape(len(a.to), *base.shape), lambda k: offset_sample(a.model, a.parameters, a.to[k], matrix)
    )
    of = tuple(f"eigenvalue {k}" for k in range(len(w)))
    return Sensitivity("modes", of, a.to, (unit,) * len(of), {}, np.array([a.t]), w[None], dw[None])


def entry_units(A: np.ndarray) -> np.ndarray:
    """Magnitudes (n, n) in which the entries of a system matrix are comparable: T_i / T_j of the balanced T^-1 A T."""
    from scipy.linalg import matrix_balance

    if not A.size:
        return np.ones_like(A)
    scale = matrix_balance(A, permute=False, separate=True)[1][0]
    return np.outer(scale, 1.0 / scale)


def eigenvalue_function(a: DerivativeRequest) -> ParameterFunction:
    """Function that returns the eigenvalues for any parameters, in the order of the initial ones."""
    matrix, _ = _system_matrix(a)
    A = matrix(a.parameters)
    first, _ = eigenvalue_derivatives(A, np.zeros((0, *A.shape)))

    def found(parameters: Mapping[str, float]) -> np.ndarray:
        return sort_branches(np.array([first, np.linalg.eigvals(matrix(parameters)).astype(complex)]))[1]

    return found


def _system_matrix(a: DerivativeRequest) -> tuple[ParameterFunction, str]:
    """Function for the system matrix, in fixed free coordinates; and the unit of eigenvalues."""
    if any(e.sampled for e in a.model.controllers):
        return _cycle_matrix(a), ""
    about = _equilibrium_by_parameters(a)
    coordinates = "joint" if rotors(a.model) else "absolute"

    def state(parameters: Mapping[str, float]) -> MechanismState:
        return operating_state(a.model, about(parameters), t=a.t, parameters=parameters, coordinates=coordinates)[0]

    begin = state(a.parameters)
    f, _, _ = equations_without_inputs(begin)
    refuse_nonsmooth(EquationDerivatives(begin), *np.zeros((2, len(begin.v), 1)), to=a.to)
    return lambda parameters: equations_without_inputs(state(parameters), like=f)[2].A, "1/s"


def _cycle_matrix(a: DerivativeRequest) -> ParameterFunction:
    """Function for the matrix over one cycle of sampled controllers."""
    about = _equilibrium_by_parameters(a)
    coordinates = "joint" if rotors(a.model) else "absolute"

    def linear(parameters: Mapping[str, float]) -> Any:
        place = about(parameters)
        given = {"about": place, "t": None if place else a.t, "parameters": parameters, "coordinates": coordinates}
        return controlled_linear_model(a.model, LinearizeOptions(**(LINEARIZE_DEFAULTS | given)))[0]

    first = linear(a.parameters)

    def found(parameters: Mapping[str, float]) -> np.ndarray:
        now = linear(parameters)
        if now.states != first.states:
            raise ModelError(f"the states there are {', '.join(now.states)}, and were {', '.join(first.states)}")
        return now.A

    return found


def _equilibrium_by_parameters(a: DerivativeRequest) -> Callable[[Mapping[str, float]], Any]:
    """Function for the equilibrium at any parameters, near the first; None where the described position is used."""
    begin: list[Any] = []

    def about(parameters: Mapping[str, float]) -> Any:
        if a.about != "equilibrium":
            return None
        begin.append(equilibrium(a.model, rest_options(a.t, parameters, begin[0] if begin else None)))
        return begin.pop() if len(begin) > 1 else begin[0]

    return about


# Derivatives of the eigenvalues of a matrix: dw = y^H dA x / y^H x (Lancaster 1964), groups of equal ones together.
#
# If an eigenvalue is repeated with as many eigenvectors, its first-order changes are the eigenvalues of dA in their
# subspace. If it has fewer eigenvectors, it has no derivative, unless all stay zero: a mechanism that can move as a
# whole has two zero eigenvalues and keeps them. A finite step of the parameter checks whether they stay zero.


MATRIX_ROUNDING = 100.0 * np.finfo(float).eps  # uncertainty of the matrix, relative to its norm
IDENTITY_TOLERANCE = 1e-6  # difference of a group from a multiple of the identity, relative to the norm
# Eigenvalues that moved less than this part of the change by dA in a finite step have stayed.
STAYED_FRACTION = 1e-3

OffsetSample = Callable[[int], tuple[float, np.ndarray, str]]


def eigenvalue_derivatives(
    A: np.ndarray, dA: np.ndarray, aside: OffsetSample | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Eigenvalues and their derivatives.

    Parameters
    ----------
    A : ndarray (n, n)
    dA : ndarray (k, n, n)
        Derivatives of A by k parameters.
    aside : callable
        Returns for the k-th parameter a finite step, A at the stepped value, and the parameter's name.

    Returns
    -------
    w : ndarray (n,)
        Eigenvalues sorted by magnitude, then imaginary part, then real part.
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
    order = _in_order(w)
    w, left, right = w[order], left[:, order], right[:, order]
    size = float(np.linalg.norm(B, 2)) or 1.0
    out = np.zeros((len(w), len(dA)), complex)
    angle = np.abs((left.conj() * right).sum(axis=0))
    for group in equal_groups(
        w, size * np.clip(MATRIX_ROUNDING / np.maximum(angle, 1e-300), EQUAL_TOLERANCE, MAX_SPLITTING)
    ):
        if len(group) == 1:
            y, x = left[:, group[0]], right[:, group[0]]
            out[group[0]] = np.array([y.conj() @ d @ x for d in dB]) / (y.conj() @ x)
        else:
            out[group] = _group_derivatives(B, dB, w, group, size, scale, aside)
    return w.astype(complex), out


def _in_order(w: np.ndarray) -> np.ndarray:
    """Indices that sort eigenvalues by magnitude, equal but for rounding or not, imaginary part, and real part."""
    size = np.abs(w)
    order, distinct = np.argsort(size), np.zeros(len(w), int)
    distinct[order] = np.cumsum(np.diff(size[order], prepend=0.0) > EQUAL_TOLERANCE * size[order])
    return np.lexsort((w.real, w.imag, distinct))


def _group_derivatives(
    B: np.ndarray,
    dB: np.ndarray,
    w: np.ndarray,
    group: list[int],
    size: float,
    scale: np.ndarray,
    aside: OffsetSample | None,
) -> np.ndarray:
    """Derivatives of equal eigenvalues, (group, k)."""
    V, W = (invariant_subspace(X, v) for X, v in ((B, w[group]), (B.conj().T, w[group].conj())))
    inner = np.linalg.inv(W.conj().T @ V)
    own = inner @ (W.conj().T @ B @ V)
    plain = np.abs(own - np.trace(own) / len(group) * np.eye(len(group))).max() <= IDENTITY_TOLERANCE * size
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
            moved = np.sort(then)[: len(group)].max()  # as many as are zero now
            stayed = moved <= max(
                STAYED_FRACTION * h * np.abs(inside).max(), 10.0 * spread, np.sqrt(MATRIX_ROUNDING) * size
            )
            if abs(value) <= np.sqrt(MATRIX_ROUNDING) * size and stayed:
                continue
            raise SingularityError(
                f"the eigenvalue {value.real:.4g}{value.imag:+.4g}j 1/s is {len(group)}-fold and has fewer "
                f"eigenvectors: it has no derivative with respect to {name!r}. Choose a value slightly different from "
                "this one"
            )
    return out
