"""Spectra of curves: one-sided amplitude spectra, and power spectral densities by Welch's method."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from ..analysis_options import require_count, seconds
from ..errors import AnalysisError, ModelError
from ..model.messages import listing, suggest
from ..model.quantities import single_quantity
from .wording import NEGLIGIBLE

if TYPE_CHECKING:
    from .result import Result

UNEVEN_PART = 1e-6  # deviation of an output time from an even grid, relative to the step, from which it is refused
SEGMENTS = 4  # length of the record over that of a segment of Welch's method, if none is given
LEAST_SAMPLES = 8  # of a record, and of a segment
LISTED_PEAKS = 5  # number of printed peaks of a curve
LEAST_PEAK = 0.01  # height of a printed peak relative to the highest


@dataclass
class Spectrum:
    """Amplitude spectra and power spectral densities of curves.

    The record is the motion from the first to the last time; its last sample begins the next period and is not part of
    it, so that frequencies are whole multiples of one over the record's length. The mean of each curve is subtracted.

    Attributes
    ----------
    names : tuple of str
        Names of the curves.
    units, density_units : tuple of str
        Units of amplitudes, and of power spectral densities, which are per Hz.
    mean : ndarray (k,)
        Subtracted means.
    start, step : float [s]
        First time and time step of the record.
    samples : int
        Number of samples of the record.
    window : str
        Window, which multiplies the samples of the record, or of each segment.
    frequency : ndarray (n,) [Hz]
    amplitude : ndarray (n, k)
        One-sided amplitudes: a sine whose periods fit the record has its own amplitude at its own frequency. They are
        corrected for the mean of the window.
    density_frequency : ndarray (m,) [Hz]
    density : ndarray (m, k)
        One-sided power spectral densities, averaged over segments that overlap by half: their integral over frequency
        is the variance. They are corrected for the mean square of the window.
    resampled : bool
        Whether the curves were interpolated at evenly spaced times.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    mean: np.ndarray
    start: float
    step: float
    samples: int
    window: str
    frequency: np.ndarray
    amplitude: np.ndarray = field(repr=False)
    density_frequency: np.ndarray = field(repr=False)
    density: np.ndarray = field(repr=False)
    resampled: bool = False

    @property
    def density_units(self) -> tuple[str, ...]:
        """Units of the power spectral densities."""
        return tuple(
            "1/Hz" if u in ("", "1") else f"({u})^2/Hz" if set(u) & set("*/^") else f"{u}^2/Hz" for u in self.units
        )

    def peaks(self, name: str, count: int = LISTED_PEAKS) -> list[tuple[float, float]]:
        """Return frequency [Hz] and amplitude of the highest peaks of a curve's amplitude spectrum, highest first.

        Peaks lower than 1 % of the highest, and rounding errors beside the mean, are left out.

        Raises
        ------
        ModelError
            If the spectrum has no such curve, or the count is not a whole number of at least 1.
        """
        from scipy.signal import find_peaks

        require_count(count, "count")
        if name not in self.names:
            raise ModelError(f"the spectrum has no {name!r}{suggest(name, self.names)}; {listing(list(self.names))}")
        k = self.names.index(name)
        a = self.amplitude[:, k]
        least = max(LEAST_PEAK * a.max(), NEGLIGIBLE * abs(self.mean[k]))
        found, _ = find_peaks(np.r_[a, 0.0])
        highest = sorted((i for i in found if a[i] > least), key=lambda i: -a[i])[:count]
        return [(float(self.frequency[i]), float(a[i])) for i in highest]

    def lines(self) -> list[tuple[str, str]]:
        """Return the record, and mean and peaks of each curve."""
        end = self.start + self.samples * self.step
        way = ", resampled by cubic splines" if self.resampled else ""
        out = [
            ("record", f"{self.start:g} to {end:g} s, {self.samples} samples{way}"),
            ("frequencies", f"up to {self.frequency[-1]:g} Hz in steps of {self.frequency[1]:g} Hz"),
            ("window", self.window),
            ("densities", f"in steps of {self.density_frequency[1]:g} Hz, by Welch's method"),
        ]
        for k, name in enumerate(self.names):
            unit = "" if self.units[k] == "1" else f" {self.units[k].replace('*', ' ')}"
            peaks = ", ".join(f"{a:.4g}{unit} at {f:.6g} Hz" for f, a in self.peaks(name))
            out.append((name, f"mean {self.mean[k]:.4g}{unit}; peaks {peaks or 'none'}"))
        return out

    def as_dict(self) -> dict[str, Any]:
        """Everything as plain numbers and names."""
        own = ("start", "step", "samples", "window", "resampled")
        out: dict[str, Any] = {k: getattr(self, k) for k in own}
        out |= {"frequency": self.frequency.tolist(), "density_frequency": self.density_frequency.tolist()}
        rows = zip(self.names, self.units, self.density_units, strict=True)
        return out | {
            "curves": {
                name: {"unit": unit, "mean": float(self.mean[k]), "amplitude": self.amplitude[:, k].tolist()}
                | {"density_unit": density_unit, "density": self.density[:, k].tolist()}
                for k, (name, unit, density_unit) in enumerate(rows)
            }
        }

    def plot(self, path: str | os.PathLike | None = None) -> Any:
        """Amplitudes and power spectral densities; returns the Matplotlib figure, or writes it to ``path``."""
        from ..view.result_plots import spectrum_plot

        return spectrum_plot(self, path)

    def __repr__(self) -> str:
        width = max(len(label) for label, _ in self.lines())
        return "\n".join(f"{label:<{width}}  {text}" for label, text in self.lines())


def curve_spectrum(
    result: Result, names: tuple[str, ...], window: str, start: Any, segment: Any, outputs: int | None
) -> Spectrum:
    """Return the spectrum of curves of a motion; see `Result.spectrum`."""
    if not names:
        raise ModelError("spectrum: name at least one curve, for instance run.spectrum('A.rate')")
    if twice := next((x for k, x in enumerate(names) if x in names[:k]), None):
        raise ModelError(f"spectrum: {twice!r} is named twice")
    units = tuple(single_quantity(result.model, name).unit for name in names)
    values = np.stack([result.curve(name)[1] for name in names], axis=1).astype(float)
    t = result.t
    if start is not None:
        start = seconds(start, "start")
        if not len(t) or not t[0] <= start < t[-1]:
            span = f"{t[0]:g} to {t[-1]:g} s" if len(t) else "no time"
            raise ModelError(f"spectrum: start={start:g} s is not in the motion, which has {span}")
        values, t = values[t >= start], t[t >= start]
    for k in np.flatnonzero(~np.isfinite(values).all(axis=0)):
        raise AnalysisError(f"spectrum: {names[k]!r} is not a finite number at every output time from {t[0]:g} s")
    if outputs is not None:
        t, values = _resampled(t, values, outputs)
    return array_spectrum(names, units, t, values, window, segment, resampled=outputs is not None)


def _resampled(t: np.ndarray, values: np.ndarray, outputs: int) -> tuple[np.ndarray, np.ndarray]:
    """Interpolate at evenly spaced times by cubic splines."""
    from scipy.interpolate import CubicSpline

    require_count(outputs, "outputs", LEAST_SAMPLES + 1)
    if len(t) < 4:
        raise AnalysisError(f"spectrum: {len(t)} output times are too few to interpolate; simulate with more outputs")
    even = np.linspace(t[0], t[-1], outputs)
    return even, CubicSpline(t, values)(even)


def array_spectrum(
    names: tuple[str, ...],
    units: tuple[str, ...],
    t: np.ndarray,
    values: np.ndarray,
    window: str,
    segment: Any,
    resampled: bool = False,
) -> Spectrum:
    """Return the spectrum of values (n, k) at evenly spaced times ``t`` (n,) [s].

    Raises
    ------
    ModelError
        If the window is unknown, or the segment does not fit the record.
    AnalysisError
        If there are too few times, or they are not evenly spaced.
    """
    from scipy.signal import get_window, welch

    n = len(t) - 1
    if n < LEAST_SAMPLES:
        raise AnalysisError(
            f"spectrum: {len(t)} output times are too few; simulate with outputs= of at least {LEAST_SAMPLES + 1}"
        )
    step = _even_step(t)
    wanted = n * step / SEGMENTS if segment is None else seconds(segment, "segment")
    length = max(round(wanted / step), LEAST_SAMPLES if segment is None else 0)
    if not LEAST_SAMPLES <= length <= n:
        low, high = LEAST_SAMPLES * step, n * step
        raise ModelError(
            f"spectrum: segment={segment!r} must be between {low:g} s ({LEAST_SAMPLES} steps) and {high:g} s"
        )
    try:
        weights = get_window(window, n)
    except (ValueError, TypeError):
        known = "'hann', 'boxcar' (none), 'hamming', 'blackmanharris' or 'flattop'"
        raise ModelError(
            f"spectrum: {window!r} is no window of scipy.signal without parameters; give {known}"
        ) from None
    x = values[:n]
    mean = x.mean(axis=0)
    amplitude = 2.0 * np.abs(np.fft.rfft((x - mean) * weights[:, None], axis=0)) / weights.sum()
    amplitude[0] /= 2.0
    if n % 2 == 0:
        amplitude[-1] /= 2.0  # at half the sampling frequency positive and negative frequencies are one
    density_frequency, density = welch(x - mean, 1.0 / step, window, length, detrend=False, axis=0)
    return Spectrum(
        names, units, mean, float(t[0]), step, n, window, np.fft.rfftfreq(n, step), amplitude, density_frequency,
        density, resampled,
    )  # fmt: skip


def _even_step(t: np.ndarray) -> float:
    """Return the step of evenly spaced times.

    Raises
    ------
    AnalysisError
        If they are not evenly spaced.
    """
    step = float(t[-1] - t[0]) / (len(t) - 1)
    if np.abs(t - np.linspace(t[0], t[-1], len(t))).max() > UNEVEN_PART * step:
        steps = np.diff(t)
        raise AnalysisError(
            f"spectrum: the output times are not evenly spaced (steps from {steps.min():.3g} to {steps.max():.3g} s); "
            f"simulate with a number of outputs, outputs={len(t)}, or interpolate evenly here: "
            f"run.spectrum(..., outputs={len(t)})"
        )
    return step
