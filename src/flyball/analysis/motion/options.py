"""Choices of a simulation and its output times."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...equations import projection
from ...errors import ModelError
from ...numerics.integrators.tableaux import tableau
from .layer import known as known_coordinates

STABILIZATION = {
    "projection": projection.STAGES,
    "projection-steps": projection.STEPS,
    "baumgarte": projection.BAUMGARTE,
    "none": projection.NONE,
    "positions": projection.POSITIONS,
    "velocities": projection.VELOCITIES,
    "partitioning": projection.PARTITIONING,
}
FINEST = 1e-13  # relative tolerance below which rounding decides


@dataclass(frozen=True)
class Options:
    """Choices of a simulation, as kept in the result.

    ``coordinates``: ``absolute``, ``joint``, or ``auto`` for those in which a right-hand side costs less; the result's
    health says which and why. ``method``: an explicit Runge-Kutta pair. ``stabilization``: ``projection`` (states and
    stages are kept on the constraints), ``projection-steps`` (states only), ``positions`` or ``velocities`` (only these
    are kept), ``partitioning`` (dependent coordinates are solved for the independent ones), ``baumgarte`` with its two
    rates [1/s], or ``none``; `Mechanism.compare` shows what they do. ``max_step`` [s]: give it where a law acts for a
    short time only; what is shorter than a step can go unseen.
    """

    rtol: float = 1e-8
    atol: float = 1e-10
    method: str = "dop853"
    coordinates: str = "auto"
    stabilization: str = "projection"
    alpha: float = 10.0
    beta: float = 10.0
    max_step: float = np.inf
    max_steps: int = 10_000_000

    def __post_init__(self) -> None:
        for name in ("rtol", "atol", "max_step", "max_steps", "alpha", "beta"):
            value = getattr(self, name)
            if not isinstance(value, (int, float, np.number)) or not value > 0:
                raise ModelError(f"{name} must be greater than 0, got {value!r}")
        if self.rtol < FINEST:
            raise ModelError(
                f"rtol must not be smaller than {FINEST:g}, got {self.rtol!r}: rounding is larger than that"
            )
        known_coordinates(self.coordinates)
        if self.stabilization not in STABILIZATION:
            known = ", ".join(STABILIZATION)
            raise ModelError(f"unknown stabilization {self.stabilization!r}; choose one of {known}")
        try:
            tableau(self.method)
        except ValueError as error:
            raise ModelError(str(error)) from None


def options_from(options: Mapping[str, object]) -> Options:
    """Options from keyword arguments; unknown ones are refused."""
    known = [f.name for f in dataclasses.fields(Options)]
    for name in options:
        if name not in known:
            raise ModelError(f"simulate has no option {name!r}; it has {', '.join(known)}")
    return Options(**options)  # type: ignore[arg-type]


def output_times(t_start: float, t_end: float, outputs: int | Sequence[float]) -> np.ndarray:
    """Ascending output times within the interval.

    Raises
    ------
    ModelError
        If the interval is empty or not finite, or the times are not ascending within it.
    """
    if not (np.isfinite(t_start) and np.isfinite(t_end)):
        raise ModelError(f"start and end time must be finite, got {t_start} and {t_end}")
    if not t_end > t_start:
        raise ModelError(f"the end time {t_end:g} s must be later than the start time {t_start:g} s")
    if isinstance(outputs, (int, np.integer)):
        if outputs < 2:
            raise ModelError(f"outputs must be at least 2 (start and end), got {outputs}")
        return np.linspace(t_start, t_end, int(outputs))
    try:
        times = np.asarray(outputs, float)
    except (TypeError, ValueError):
        raise ModelError(f"outputs must be a number of times, or the times [s] themselves, not {outputs!r}") from None
    if times.ndim != 1 or not len(times) or not (np.diff(times) > 0).all():
        raise ModelError("outputs must be a number of times, or times in ascending order")
    if times[0] < t_start or times[-1] > t_end:
        raise ModelError(f"output times must lie between {t_start:g} s and {t_end:g} s")
    return times
