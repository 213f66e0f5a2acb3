"""Sobol' indices: which parameter accounts for how much of a variance."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import AnalysisError
from .numbers import plain

WITHIN = 0.95  # confidence
RESAMPLED = 499  # bootstrap samples


@dataclass(frozen=True, repr=False)
class Indices:
    """Parts of the variance of each quantity that parameters account for.

    Attributes
    ----------
    of, parameters : tuple of str
    samples : int
        How many they are found from: a power of two.
    left_out : int
        How many more there are of which one run failed.
    first : ndarray (of, parameters) [1]
        By itself: how much smaller the variance would be on average if the parameter were known.
    total : ndarray (of, parameters) [1]
        With all its interactions: what would be left of the variance if all others were known.
    first_range, total_range : ndarray (of, parameters, 2)
        Between which bounds they are with 95 % confidence, by resampling (BCa bootstrap); nan where nothing varies.
    """

    of: tuple[str, ...]
    parameters: tuple[str, ...]
    samples: int
    first: np.ndarray
    total: np.ndarray
    first_range: np.ndarray
    total_range: np.ndarray
    left_out: int = 0

    @classmethod
    def of_runs(cls, of: tuple[str, ...], parameters: tuple[str, ...], y: np.ndarray) -> Indices:
        """From y (of, 2 + parameters, samples): the samples A, B, and A with one column of B each; nan where a run
        failed. SciPy's estimators take a power of two of samples: of those that are whole as many as that.
        """
        whole = np.isfinite(y).all(axis=(0, 1))
        left = int(whole.sum())
        if left < 2:
            raise AnalysisError(f"{left} of {len(whole)} samples have all their runs: no variances are known")
        y = y[:, :, whole][:, :, : 1 << (left.bit_length() - 1)]
        found = [_estimated(x) for x in y]
        first, total, first_range, total_range = (np.array(x) for x in zip(*found, strict=True))
        return cls(of, parameters, y.shape[2], first, total, first_range, total_range, len(whole) - left)

    def __getitem__(self, of: str) -> dict[str, tuple[float, float]]:
        """Parameter -> (first, total) of a quantity."""
        k = self.of.index(of)
        pairs = zip(self.first[k].tolist(), self.total[k].tolist(), strict=True)
        return dict(zip(self.parameters, pairs, strict=True))

    def lines(self) -> list[tuple[str, str]]:
        """A table for people."""
        out = [("samples", f"{self.samples}; in brackets what 95 % of resamplings stay within")]
        if self.left_out:
            text = f"{self.left_out} samples of which a run failed: where that is so is missing from the indices"
            out.append(("left out", text))
        for i, name in enumerate(self.of):
            for k in np.argsort(-self.total[i], kind="stable"):
                parts = [
                    f"{what} {x[i, k]:.3f} [{r[i, k, 0]:.3f}, {r[i, k, 1]:.3f}]"
                    for what, x, r in (("first", self.first, self.first_range), ("total", self.total, self.total_range))
                ]
                out.append((name, f"{self.parameters[k]:<16} {', '.join(parts)}"))
        return out

    def as_dict(self) -> dict[str, Any]:
        """Everything as plain numbers and names."""
        return {
            "samples": self.samples,
            "left_out": self.left_out,
            "of": {
                name: {
                    p: {
                        "first": float(self.first[i, k]),
                        "total": float(self.total[i, k]),
                        "first_range": plain(self.first_range[i, k]),
                        "total_range": plain(self.total_range[i, k]),
                    }
                    for k, p in enumerate(self.parameters)
                }
                for i, name in enumerate(self.of)
            },
        }

    def plot(self, path: str | os.PathLike | None = None) -> Any:
        """Bars with their ranges; returns the Matplotlib figure, or writes it to ``path``."""
        from ..view.study import indices

        return indices(self, path)

    def __repr__(self) -> str:
        return "\n".join(f"{a:<16} {b}" for a, b in self.lines())


def _estimated(y: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Indices of one quantity, and their ranges, by SciPy's estimators; of a power of two of samples."""
    import warnings

    from scipy.stats import sobol_indices

    d, n = len(y) - 2, y.shape[1]
    if not np.ptp(y) > 0.0:
        return np.zeros(d), np.zeros(d), np.full((d, 2), np.nan), np.full((d, 2), np.nan)
    found = sobol_indices(func={"f_A": y[:1], "f_B": y[1:2], "f_AB": y[2:, None, :]}, n=n)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of a parameter that changes nothing the bounds are not defined
        spread = found.bootstrap(confidence_level=WITHIN, n_resamples=RESAMPLED)
    ranges = [
        np.stack([np.ravel(x.confidence_interval.low), np.ravel(x.confidence_interval.high)], axis=1)
        for x in (spread.first_order, spread.total_order)
    ]
    return np.ravel(found.first_order), np.ravel(found.total_order), ranges[0], ranges[1]
