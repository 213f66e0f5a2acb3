"""Modes: eigenvalues and shapes of the linear equations, dense for all of them, sparse for the slowest of many."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ..model.model import Model
from ..model.touching import holds_at_times
from ..numerics.rank import span
from ..results.growth import growing
from ..results.modes import Modes
from ..tables.names import velocity_names
from .linear.curves import snapshot
from .linear.derivatives import State
from .linear.in_bodies import in_bodies
from .linear.large import DENSE, FREE, Large, are_many, is_large
from .linear.reduced import Frame
from .linear.sliders import of_slides, of_states_only, refuse_sampled
from .linear.spectrum import EQUAL, Spectrum, spectrum
from .linearize import InstantOptions, without_inputs
from .options import count as at_least
from .resting.instant import closed_instant

FEW = 10
EACH = 4  # freedoms for each mode that is asked for, from which on these are found by themselves
STILL = 1e-6  # of the fastest: sparse eigenvalues below are zero; a double zero shows rounding by its square root
UNSURE = 1e-6  # of a sparse eigenvalue, whose own uncertainty is not known: growth below is none
ROUNDED = 1e-11  # parts of a shape, or of an eigenvalue, below this part of its largest are rounding
TINY = 1e-7  # directions of rigid motions below this part of the largest are none


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
    if model.controllers:
        return _controlled(model, o)
    if holds_at_times(model):
        joined, there, notes = closed_instant(model, o, "modes")
        return replace(_modes(joined, there), notes=notes)
    return _modes(model, o)


def _modes(model: Model, o: ModesOptions) -> Modes:
    """Of a mechanism in which nothing holds at times any more, but friction that slides."""
    count, frozen = o.count, o.frozen
    free = DENSE if count is None else max(FREE, EACH * count)
    x = o.state(model, partial(are_many, free))
    if is_large(x, free):
        return _sparse(x, count or FEW, frozen)
    f, frame, r = without_inputs(x, frozen)
    own = spectrum(r.A, r.doubt)
    one, rest = _listed(own, count)
    found = _made(x, own, one, r.position[:, : len(r.A)] @ own.vectors[:, one])
    return _judged(found, own, one, rest, frame)


def _listed(own: Spectrum, count: int | None) -> tuple[np.ndarray, np.ndarray]:
    """Indices of the eigenvalues that are told, one of each pair, slowest first; and of those left out."""
    w = own.values
    listed = np.array([k for group in own.groups for k in group[: own.geometric[group[0]]]], int)
    one = listed[w[listed].imag >= 0.0]
    one = one[np.lexsort((-w[one].real, np.abs(w[one])))]
    return one[:count], one[count:] if count is not None else one[:0]


def _judged(found: Modes, own: Spectrum, one: np.ndarray, rest: np.ndarray, frame: Frame) -> Modes:
    """The same modes, with what the eigenvalues say besides."""
    found.turning, found.seen_from = frame.turning, frame.told
    found.multiplicity, found.geometric_multiplicity = own.multiplicity[one], own.geometric[one]
    found.residual = own.residual
    found.growing = bool(growing(own.values[rest]).any())
    return found


def _controlled(model: Model, o: ModesOptions) -> Modes:
    """Of a mechanism with continuous controllers: of one that has bodies in their place, less these."""
    refuse_sampled(model, "modes")
    d = in_bodies(model, o.state(model), o.coordinates, (), frozen=o.frozen)
    slides, x = d.other.slides, d.state
    with d.in_own_words():
        f, frame, r = without_inputs(x, o.frozen, off=d.off)
    r = of_states_only(r, f, slides)
    own = spectrum(r.A, r.doubt)
    one, rest = _listed(own, o.count)
    mine = np.array([not of_slides(n.name, slides) for n in velocity_names(x.c.structure)])
    found = _made(x, own, one, r.position @ own.vectors[:, one], mine)
    found.point = snapshot(d.here)
    return _judged(found, own, one, rest, frame)


def _made(x: State, own: Spectrum, which: np.ndarray, shapes: np.ndarray, mine: np.ndarray | None = None) -> Modes:
    """Modes whose largest part is 1, seen from the ground; of the velocities ``mine`` only, if given."""
    w, fastest = own.values[which], float(np.abs(own.values).max(initial=0.0))
    mine = np.ones(len(shapes), bool) if mine is None else mine
    return _scaled(x, w, shapes[mine], fastest, mine)


def _scaled(x: State, w: np.ndarray, shapes: np.ndarray, fastest: float, mine: np.ndarray) -> Modes:
    """The same of given eigenvalues, and parts of the shapes."""
    names = [n for n, own in zip(velocity_names(x.c.structure), mine, strict=True) if own]
    length = (x.c.values.length / x.c.sizes)[mine, None]
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
        w, shapes, tuple(n.name for n in names), units, np.zeros(3), snapshot(x), fastest, False, one, one.copy()
    )


def _sparse(x: State, count: int, frozen: bool) -> Modes:
    """The slowest modes of a large mechanism at rest."""
    whole = Large.at(x, frozen)
    p = whole.pencil
    w, X, residual = p.nearest(count + FEW)  # more: of pairs and rigid motions one is listed
    w = np.where(np.abs(w) <= STILL * p.fastest, 0.0, w)
    w = np.where(np.abs(w.imag) <= ROUNDED * np.abs(w), w.real, w)
    w = np.where(growing(w) & (w.real <= UNSURE * np.abs(w)), 1j * w.imag, w)
    left, values, often = np.flatnonzero(w.imag >= 0.0), list[complex](), list[tuple[int, int]]()
    shapes = [np.zeros((len(X), 0), complex)]
    while len(left) and len(values) < count:
        one = np.abs(w[left] - w[left[0]]) <= EQUAL * abs(w[left[0]])
        own, left = left[one], left[~one]
        real = w[own[0]].imag == 0.0
        own_shapes = span(np.hstack([X[:, own].real, X[:, own].imag]) if real else X[:, own], TINY)
        if len(own) == 1:
            own_shapes = own_shapes[:, :1] if real else X[:, own]
        values += [w[own].mean()] * own_shapes.shape[1]
        often += [(len(own), own_shapes.shape[1])] * own_shapes.shape[1]
        shapes.append(own_shapes)
    every = np.ones(len(whole.scale), bool)
    shape = whole.scale[:, None] * np.hstack(shapes)[:, :count]
    found = _scaled(x, np.array(values[:count], complex), shape, p.fastest, every)
    found.residual = residual
    found.multiplicity, found.geometric_multiplicity = np.array(often[:count], int).reshape(-1, 2).T
    return found
