"""Modes: eigenvalues and mode shapes of the linear equations, all of them (dense) or the slowest ones (sparse)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ..analysis_options import require_count as at_least
from ..derivatives.eigenvalues import EQUAL_TOLERANCE, Spectrum, spectrum
from ..derivatives.equation_derivatives import MechanismState
from ..derivatives.linearized_equations import TurningFrame
from ..derivatives.output_derivatives import snapshot
from ..model.contact import has_switching_elements
from ..model.model import Model
from ..model.unsupported_elements import refuse_sampled_controllers
from ..numerics.rank import column_space
from ..results.modes import Modes, is_growing
from ..tables.structure_definition import velocity_names
from .descriptor import DENSE_FREEDOMS, DENSE_VELOCITIES, SparseEquations, exceeds_dense_size, uses_sparse_equations
from .linearize import OperatingPointOptions, equations_without_inputs
from .operating_point import contact_operating_point

DEFAULT_COUNT = 10
# With more freedoms than this per requested mode, the modes are computed by the sparse solver.
FREEDOMS_PER_MODE = 4
ZERO_EIGENVALUE = (
    1e-6  # sparse eigenvalues below this part of the fastest are 0: rounding splits a double zero by its square root
)
# Uncertainty of a sparse eigenvalue, relative to its size: a smaller real part is no growth.
GROWTH_UNCERTAINTY = 1e-6
SHAPE_ROUNDING = 1e-11  # parts of a shape or an eigenvalue below this part of its largest are rounding
RIGID_TOLERANCE = 1e-7  # directions of rigid motions below this part of the largest count as zero


@dataclass(frozen=True, kw_only=True)
class ModesOptions(OperatingPointOptions):
    """Arguments of `Mechanism.modes`."""

    count: int | None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.count is not None:
            at_least(self.count, "count")


def modes(model: Model, o: ModesOptions) -> Modes:
    """Compute the modes about an equilibrium or a steady motion: see `Mechanism.modes`."""
    refuse_sampled_controllers(model, "modes")
    if has_switching_elements(model):
        joined, there, notes = contact_operating_point(model, o, "modes")
        return replace(_smooth_modes(joined, there), notes=notes)
    return _smooth_modes(model, o)


def _smooth_modes(model: Model, o: ModesOptions) -> Modes:
    """Modes of a mechanism without switching elements, except friction that slides."""
    count, frozen = o.count, o.frozen
    free = DENSE_VELOCITIES if count is None else max(DENSE_FREEDOMS, FREEDOMS_PER_MODE * count)
    x = o.state(model, None if model.with_states() else partial(exceeds_dense_size, free))
    if uses_sparse_equations(x, free):
        return _sparse_modes(x, count or DEFAULT_COUNT, frozen)
    f, frame, r = equations_without_inputs(x, frozen)
    own = spectrum(r.A, r.uncertainty)
    one, rest = _selected_eigenvalues(own, count)
    found = _normalised_modes(x, own, one, r.position[:, : len(r.A)] @ own.vectors[:, one])
    return _with_eigenvalue_data(found, own, one, rest, frame)


def _selected_eigenvalues(eigenvalues: Spectrum, count: int | None) -> tuple[np.ndarray, np.ndarray]:
    """Indices of the eigenvalues to report, one of each pair, slowest first, and of those left out."""
    w = eigenvalues.values
    listed = np.array([k for group in eigenvalues.groups for k in group[: eigenvalues.geometric[group[0]]]], int)
    one = listed[w[listed].imag >= 0.0]
    one = one[np.argsort(np.abs(w[one]), kind="stable")]
    size = np.abs(w[one])
    rank = np.cumsum(np.diff(size, prepend=size[:1]) > EQUAL_TOLERANCE * size)  # a pair w, -w has the same
    one = one[np.lexsort((-w[one].real, rank))]
    return one[:count], one[count:] if count is not None else one[:0]


def _with_eigenvalue_data(
    found: Modes, eigenvalues: Spectrum, one: np.ndarray, rest: np.ndarray, frame: TurningFrame
) -> Modes:
    """Add multiplicities, residual, frame and growth to the modes."""
    found.turning, found.seen_from = frame.turning, frame.description
    found.multiplicity, found.geometric_multiplicity = eigenvalues.multiplicity[one], eigenvalues.geometric[one]
    found.residual = eigenvalues.residual
    found.growing = bool(is_growing(eigenvalues.values[rest]).any())
    return found


def _normalised_modes(x: MechanismState, eigenvalues: Spectrum, which: np.ndarray, shapes: np.ndarray) -> Modes:
    """Modes scaled to a largest component of 1, seen from the ground."""
    fastest = float(np.abs(eigenvalues.values).max(initial=0.0))
    return _scaled_modes(x, eigenvalues.values[which], shapes, fastest)


def _scaled_modes(x: MechanismState, w: np.ndarray, shapes: np.ndarray, fastest: float) -> Modes:
    """Scale modes with given eigenvalues ``w`` and shapes."""
    names = velocity_names(x.c.structure)
    length = (x.c.values.length / x.c.sizes)[:, None]
    size = length * np.abs(shapes)
    for k in range(shapes.shape[1]):
        if size[:, k].max(initial=0.0) > 0.0:
            shapes[:, k] /= shapes[np.argmax(size[:, k]), k]
    least = SHAPE_ROUNDING * (length * np.abs(shapes)).max(axis=0, initial=0.0) / length
    shapes = np.where(np.abs(shapes.real) > least, shapes.real, 0.0) + 1j * np.where(
        np.abs(shapes.imag) > least, shapes.imag, 0.0
    )
    units = tuple(n.unit for n in names)
    one = np.ones(len(w), int)
    return Modes(
        w, shapes, tuple(n.name for n in names), units, np.zeros(3), snapshot(x), fastest, False, one, one.copy()
    )


def _sparse_modes(x: MechanismState, count: int, frozen: bool) -> Modes:
    """Compute the slowest modes of a large mechanism at rest."""
    whole = SparseEquations.at(x, frozen)
    p = whole.pencil
    # Compute more than requested: of pairs and rigid motions only one is listed.
    w, X, residual = p.nearest(count + DEFAULT_COUNT)
    w = np.where(np.abs(w) <= ZERO_EIGENVALUE * p.fastest, 0.0, w)
    w = np.where(np.abs(w.imag) <= SHAPE_ROUNDING * np.abs(w), w.real, w)
    w = np.where(is_growing(w) & (w.real <= GROWTH_UNCERTAINTY * np.abs(w)), 1j * w.imag, w)
    left, values, often = np.flatnonzero(w.imag >= 0.0), list[complex](), list[tuple[int, int]]()
    shapes = [np.zeros((len(X), 0), complex)]
    while len(left) and len(values) < count:
        one = np.abs(w[left] - w[left[0]]) <= EQUAL_TOLERANCE * abs(w[left[0]])
        own, left = left[one], left[~one]
        real = w[own[0]].imag == 0.0
        own_shapes = column_space(np.hstack([X[:, own].real, X[:, own].imag]) if real else X[:, own], RIGID_TOLERANCE)
        if len(own) == 1:
            own_shapes = own_shapes[:, :1] if real else X[:, own]
        values += [w[own].mean()] * own_shapes.shape[1]
        often += [(len(own), own_shapes.shape[1])] * own_shapes.shape[1]
        shapes.append(own_shapes)
    shape = whole.scale[:, None] * np.hstack(shapes)[:, :count]
    found = _scaled_modes(x, np.array(values[:count], complex), shape, p.fastest)
    found.residual = residual
    found.multiplicity, found.geometric_multiplicity = np.array(often[:count], int).reshape(-1, 2).T
    return found
