"""Samples at which an eigenvalue is just on its way through the imaginary axis.

Next to the axis an eigenvalue counts as on it: from how near on is a matter of rounding, not where it crosses. Such a
sample is no end of a stretch in which to look for the crossing; where eigenvalues stay on the axis it is.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby, pairwise

import numpy as np

from .sample import Sample, match

SLOWER = 1e-3  # part of its usual change that the real part of an eigenvalue makes at least, on its way through


def passing(samples: Sequence[Sample]) -> np.ndarray:
    """Whether at each of some samples, in order, an eigenvalue is on the axis and off it before and after, (m,) bool.

    Where several in a row are on the axis, the real part must go on changing from one to the next.
    """
    branch = [np.arange(len(samples[0].w))]
    for a, b in pairwise(samples):
        branch.append(match(a, b)[branch[-1]])
    sides = np.array([x.sides[k] for x, k in zip(samples, branch, strict=True)])
    real = np.array([x.raw.real[k] for x, k in zip(samples, branch, strict=True)])
    place = np.array([x.place for x in samples])
    out = np.zeros(len(samples), bool)
    for j in range(sides.shape[1]):
        for off, run in groupby(range(len(samples)), (sides[:, j] != 0).tolist().__getitem__):
            own = list(run)
            first, last = own[0], own[-1]
            if off or first == 0 or last == len(samples) - 1:
                continue
            if first != last:
                usual = np.abs(real[last + 1, j] - real[first - 1, j]) / (place[last + 1] - place[first - 1])
                steps = np.abs(np.diff(real[own, j])) / np.diff(place[own])
                if sides[first - 1, j] == sides[last + 1, j] or not (steps >= SLOWER * usual).all():
                    continue
            out[own] = True
    return out
