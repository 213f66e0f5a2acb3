"""Which frequencies a Bode plot shows, and its phase without jumps: both from poles and zeros."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from ..results.linear import LinearModel

POINTS, FEWER = 500, 150  # of a large model
SLOWEST = 10  # poles of a large model that are shown
DECADES = 8.0  # at most
NONE = 1e-7  # of the largest pole or zero: below, it is at the origin
SAME = 1e-6  # a pole and a zero nearer than this, of their distance from the origin, cancel
SHARPEST = 1e-4  # damping ratio of resonances: sharper ones are drawn as if they had this


def frequencies(model: LinearModel, pairs: Sequence[tuple[str, str]]) -> np.ndarray:
    """Angular frequencies [rad/s], a decade beyond poles and zeros of (input, output) pairs, closer at resonances."""
    if model.large:
        roots = model.descriptor.nearest(SLOWEST)
    else:
        roots = np.concatenate([np.concatenate(roots_of(model, *pair)) for pair in pairs])
    if model.period is not None:  # z = exp(s period)
        roots = np.log(roots[np.abs(roots) > NONE].astype(complex)) / model.period
    size = np.abs(roots)
    roots = roots[size > NONE * size.max(initial=0.0)]
    size = np.abs(roots) if len(roots) else np.ones(1)
    low, high = np.log10(size.min()) - 1.0, np.log10(size.max()) + 1.0
    even = np.logspace(max(low, high - DECADES), high, FEWER if model.large else POINTS)
    resonant = roots[(roots.imag > 0.0) & (np.abs(roots.real) < 0.5 * np.abs(roots))]
    u = np.sinh(
        np.linspace(-6.0, 6.0, 14 if model.large else 42)
    )  # even in number: the peak itself of an undamped one is infinite
    near = [abs(r) * (1.0 + max(abs(r.real) / abs(r), SHARPEST) * u) for r in resonant]
    tops = [np.array([r.imag]) for r in resonant if abs(r.real) > SHARPEST * abs(r)]
    every = np.concatenate([even, *near, *tops])
    most = np.inf if model.period is None else np.pi / model.period  # beyond it nothing new is seen
    return np.unique(np.minimum(every[(every >= even[0]) & (every <= even[-1])], most))


def roots_of(model: LinearModel, input: str, output: str) -> tuple[np.ndarray, np.ndarray]:
    """Zeros and poles [1/s] of a transfer function that do not cancel; none where the output does not follow."""
    found, all_poles, _ = model.transfer(input, output)
    zeros, poles = list(found[np.isfinite(found)]), list(all_poles)
    largest = max(map(abs, poles), default=0.0)
    for zero in list(zeros):
        gaps = [abs(zero - pole) for pole in poles]
        k = int(np.argmin(gaps)) if gaps else 0
        if gaps and gaps[k] <= SAME * max(abs(zero), 1e-2 * largest):
            zeros.remove(zero)
            del poles[k]
    return np.array(zeros, complex), np.array(poles, complex)


def phase(model: LinearModel, input: str, output: str, omega: np.ndarray, response: np.ndarray) -> np.ndarray:
    """Phase [rad] of a response, without jumps; it begins between -pi and pi.

    Every pole and zero contributes an angle that changes evenly with frequency, so that turns are known however sharp
    a resonance is. Roots on the imaginary axis count as damped. Of a large model they are not known, and the phase
    changes by less than half a turn from one frequency to the next.
    """
    if model.large:
        return _unwrapped(response)
    zeros, poles = roots_of(model, input, output)
    largest = max(np.abs(zeros).max(initial=0.0), np.abs(poles).max(initial=0.0))
    turned = np.zeros(len(omega))
    for sign, roots in ((1.0, zeros), (-1.0, poles)):
        for root in roots:
            on_axis = abs(root.real) <= NONE * largest
            angle = np.arctan2(omega - root.imag, 0.0 if on_axis else abs(root.real))
            turned += sign * (angle if on_axis or root.real < 0.0 else np.pi - angle)
    own = np.where(np.isfinite(response) & (np.abs(response) > 0.0), np.angle(response), np.nan)
    if not np.isfinite(own).any():
        return own
    offset = np.nanmedian(np.angle(np.exp(1j * (own - turned))))  # the gain's sign
    out = own + 2.0 * np.pi * np.round((turned + offset - own) / (2.0 * np.pi))
    return _begun(out)


def _begun(phase: np.ndarray) -> np.ndarray:
    """The same phase, but for whole turns, which begins between -pi and pi."""
    first = phase[np.isfinite(phase)][:1]
    return phase - 2.0 * np.pi * np.ceil((first - np.pi * (1.0 - 1e-6)) / (2.0 * np.pi)) if len(first) else phase


def _unwrapped(response: np.ndarray) -> np.ndarray:
    """Phase from one frequency to the next; by half a turn it falls at a pole, where the response is large, and rises
    at a zero.
    """
    known = np.flatnonzero(np.isfinite(response) & (np.abs(response) > 0.0))
    size, turn = np.log(np.abs(response[known])), np.angle(response[known])
    steps = np.angle(np.exp(1j * np.diff(turn)))
    beside = size[1:] + size[:-1] - np.r_[size[:1], size[:-2]] - np.r_[size[2:], size[-1:]]
    half = np.abs(np.abs(steps) - np.pi) < NONE
    steps[half] = np.where(beside[half] > 0.0, -np.pi, np.pi)
    out = np.full(len(response), np.nan)
    out[known] = np.cumsum(np.r_[turn[:1], steps])
    return _begun(out)
