"""Choices of a simulation and its output times."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from ...equations import projection
from ...errors import ModelError
from ...numerics.integrators.tableaux import tableau
from ..options import Options, count, names_of, positive, seconds
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
MOST = 10_000_000  # steps
HELD = 2  # copies of a motion in memory while its parts are put together
LEAST = 4  # numbers kept of each time: of one hinge
LITTLE = 2**18  # [bytes] that every machine has
DOUBLE = np.dtype(float).itemsize
MEMORY = 2**36  # [bytes] of a machine that does not say how much it has
RATE = 10.0  # [1/s] of Baumgarte's method, where none is given
FINEST = 1e-13  # relative tolerance below which rounding decides
SMALL = 1e-2  # part of a coordinate's size below which its error is held to atol, where that is not given
COARSEST = 0.1  # tolerance above which what comes out is no motion of the mechanism
LEAST_ATOL = 1e-14  # part of the mechanism's length [m], or of a radian, that rounding leaves


@dataclass(frozen=True, kw_only=True)
class Integration(Options):
    """How a motion is integrated, as kept in the result; the meanings stand with `Mechanism.simulate`."""

    coordinates: str
    method: str
    rtol: float
    atol: float | None
    max_step: float
    max_steps: int
    stabilization: str
    alpha: float | None
    beta: float | None
    step: float | None
    rho_inf: float | None

    def __post_init__(self) -> None:
        super().__post_init__()
        own = vars(self)
        for name in ("max_step", "step"):
            if isinstance(own[name], str):
                own[name] = seconds(own[name], name)
        for name in ("rtol", "atol", "max_step", "step"):
            if own[name] is not None or name in ("rtol", "max_step"):
                positive(own[name], name)
        if self.step is not None and self.max_step != np.inf:
            raise ModelError("max_step does nothing with steps of fixed width (step=); leave one of the two out")
        count(self.max_steps, "max_steps")
        if self.rtol < FINEST:
            raise ModelError(
                f"rtol must not be smaller than {FINEST:g}, got {self.rtol!r}: rounding is larger than that"
            )
        if self.rtol > COARSEST:
            raise ModelError(
                f"rtol must not be larger than {COARSEST:g}, got {self.rtol!r}: every step might be off by that "
                f"part of the motion"
            )
        known_coordinates(self.coordinates)
        if self.stabilization not in STABILIZATION:
            known = ", ".join(STABILIZATION)
            raise ModelError(f"unknown stabilization {self.stabilization!r}; choose one of {known}")
        self._rates()
        self.check_method()

    def check_method(self) -> None:
        """Refuse integrators that there are not."""
        try:
            tableau(self.method)
        except ValueError as error:
            raise ModelError(
                f"{error}; simulate knows implicit ones too (radau for stiff mechanisms), and impulse, for contact"
            ) from None
        self.refuse_without_step()

    def refuse_without_step(self) -> None:
        """Refuse a method that has no estimate of its error, if no width of its steps is given."""
        if self.step is None and not tableau(self.method).E.any():
            raise ModelError(f"method={self.method!r} has no estimate of its error: give the width of its steps, step=")

    def _rates(self) -> None:
        """Baumgarte's rates have their usual values, or are refused where nothing asks for them."""
        for name in ("alpha", "beta"):
            value = getattr(self, name)
            if self.stabilization == "baumgarte":
                value = RATE if value is None else value
                positive(value, name)
                object.__setattr__(self, name, value)
            elif value is not None:
                raise ModelError(f"{name} is a rate of stabilization='baumgarte'; with {self.stabilization!r} it does "
                                 f"nothing")  # fmt: skip

    def sized(self, length: float) -> Self:
        """With its `tolerance` as ``atol``."""
        return self.known(atol=self.tolerance(length))

    def tolerance(self, length: float) -> float:
        """The ``atol`` given, or that of a mechanism of that length [m]."""
        return usual_atol(self.rtol, length) if self.atol is None else self.atol

    def choices(self) -> dict[str, Any]:
        """The choices of the integration by name, without what else was asked."""
        own = vars(self)
        return {name: own[name] for name in names_of(Integration)}


def usual_atol(rtol: float, length: float) -> float:
    """The tolerance where the state is small, of a mechanism of that length [m]."""
    return max(SMALL * rtol, LEAST_ATOL) * min(1.0, length)


def projected(coordinates: str, rtol: float, atol: float, max_steps: int = MOST) -> Integration:
    """An integration as other analyses want it: by the usual method, kept on the constraints."""
    return Integration(
        coordinates=coordinates,
        method="dop853",
        rtol=rtol,
        atol=atol,
        max_step=np.inf,
        max_steps=max_steps,
        stabilization="projection",
        alpha=None,
        beta=None,
        step=None,
        rho_inf=None,
    )


def refuse_unheld(outputs: int, width: int) -> None:
    """Refuse more output times, of ``width`` numbers each, than the memory of this machine holds.

    Raises
    ------
    ModelError
        With how many bytes they take, and how many times would fit.
    """
    each = HELD * width * DOUBLE
    if outputs * each > LITTLE and outputs * each > (there := _memory()):
        raise ModelError(
            f"outputs: {outputs:,} times take {outputs * each // 2**20:,} MiB of memory or more, and this machine has "
            f"{there // 2**20:,} MiB. Ask for fewer ({there // each:,} would fill it), or simulate in parts (start=)"
        )


def _memory() -> int:
    """What this machine has [bytes]."""
    try:
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):  # Windows does not tell
        return MEMORY


def _even(t_start: float, t_end: float, n: int) -> np.ndarray:
    """Evenly spaced times: those of ``np.linspace``, in a third of its time."""
    times = np.arange(n, dtype=float)
    times *= (t_end - t_start) / (n - 1)
    times += t_start
    times[-1] = t_end
    return times


def output_times(t_start: float, t_end: float, outputs: int | Sequence[float]) -> np.ndarray:
    """Ascending output times within the interval.

    Raises
    ------
    ModelError
        If the interval is empty or not finite, or the times are not ascending within it.
    """
    if not (math.isfinite(t_start) and math.isfinite(t_end)):
        raise ModelError(f"start and end time must be finite, got {t_start} and {t_end}")
    if not t_end > t_start:
        raise ModelError(f"the end time {t_end:g} s must be later than the start time {t_start:g} s")
    if isinstance(outputs, (int, np.integer)):
        if outputs < 2:
            raise ModelError(f"outputs must be at least 2 (start and end), got {outputs}")
        refuse_unheld(int(outputs), LEAST)
        return _even(t_start, t_end, int(outputs))
    try:
        times = np.asarray(outputs, float)
    except (TypeError, ValueError):
        raise ModelError(f"outputs must be a number of times, or the times [s] themselves, not {outputs!r}") from None
    if times.ndim != 1 or not len(times) or not np.isfinite(times).all() or not (np.diff(times) > 0).all():
        raise ModelError("outputs must be a number of times, or times in ascending order")
    if times[0] < t_start or times[-1] > t_end:
        raise ModelError(f"output times must lie between {t_start:g} s and {t_end:g} s")
    return times
