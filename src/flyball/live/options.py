"""Arguments of `Mechanism.live`, and sliders for parameters, whose ranges are given or chosen about the value."""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from ..analysis_options import AnalysisOptions, require_count, require_positive, seconds
from ..errors import ModelError, UnitError
from ..model.expressions import parameter_formulas
from ..model.messages import listing, suggest
from ..model.model import Model
from ..model.units import same_kind, split_quantity, to_si
from .messages import finite_number

CHOSEN_FACTORS = 0.5, 2.0
"""A chosen range of a parameter, relative to its value."""
CHOSEN_AROUND_ZERO = -1.0, 1.0
"""The chosen range of a parameter whose value is 0, in its unit."""
RANGE_ROUNDING = 1e-9
"""Part of a range by which a value may exceed it: units are converted with rounding."""


@dataclass(frozen=True)
class Slider:
    """A parameter that can be moved; its numbers are in ``unit``, SI if that is empty.

    Attributes
    ----------
    chosen : bool
        Whether the range was chosen here, because none was given.
    """

    name: str
    unit: str
    value: float
    low: float
    high: float
    chosen: bool

    @property
    def quantity(self) -> float | str:
        """The value as analyses accept it."""
        return f"{self.value!r} {self.unit}" if self.unit else self.value

    def moved(self, value: Any) -> Slider:
        """Return the slider at another value.

        Raises
        ------
        InvalidMessage
            If the value is not a finite number. One outside the range is accepted: it can be typed.
        """
        return replace(self, value=finite_number(value, f"the new value of parameter {self.name!r}"))


def make_sliders(model: Model, ranges: Mapping[str, Sequence[Any]] | None = None) -> dict[str, Slider]:
    """Return a slider for each parameter that does not follow from others, by name.

    Parameters
    ----------
    model : Model
    ranges : mapping, optional
        Parameter to its least and largest value: numbers in SI units, or quantities. For others a range about the value
        is chosen: half to twice the value, or -1 to 1 if the value is 0.

    Raises
    ------
    ModelError
        If a range is given for something else, is no range, or does not contain the value.
    """
    given = dict(ranges or {})
    env, formulas = model.environment(), parameter_formulas(model.parameters)
    derived = {name for name, formula in formulas.items() if not formula.names.isdisjoint(model.parameters)}
    out = {}
    for name, written in model.parameters.items():
        if name in derived:
            continue
        number, unit = split_quantity(written) or ("", "") if isinstance(written, str) else ("", "")
        value = float(number) if unit else float(env[name])
        chosen = name not in given
        low, high = _chosen_range(value) if chosen else _given_range(name, given.pop(name), written, unit, value)
        out[name] = Slider(name, unit, value, low, high, chosen)
    for name in given:
        if name in derived:
            raise ModelError(
                f"ranges: parameter {name!r} of {model.name!r} follows from others ({model.parameters[name]}); give "
                "the ranges of these"
            )
        known = list(out)
        raise ModelError(f"ranges: {model.name!r} has no parameter {name!r}{suggest(name, known)}; {listing(known)}")
    return out


def _chosen_range(value: float) -> tuple[float, float]:
    if value == 0.0:
        return CHOSEN_AROUND_ZERO
    largest = sys.float_info.max
    low, high = sorted(min(max(factor * value, -largest), largest) for factor in CHOSEN_FACTORS)
    return low, high


def _given_range(name: str, given: Any, written: Any, unit: str, value: float) -> tuple[float, float]:
    where = f"range of parameter {name!r}"
    if isinstance(given, str) or not isinstance(given, Sequence) or len(given) != 2:
        raise ModelError(f"{where} is {given!r}; give the least and the largest value, for instance (0.1, 0.5)")
    low, high = (_in_unit(x, written, unit, where) for x in given)
    if not (math.isfinite(low) and math.isfinite(high) and low < high):
        raise ModelError(
            f"{where} is {given[0]!r} to {given[1]!r}; the first must be less than the second, both finite"
        )
    rounding = RANGE_ROUNDING * (high - low)
    if not low - rounding <= value <= high + rounding:
        raise ModelError(
            f"{where} is {given[0]!r} to {given[1]!r}; it must contain the parameter's value, {written!r}: give "
            "another range, or change the value in the model"
        )
    return low, high


def _in_unit(value: Any, written: Any, unit: str, where: str) -> float:
    """Return a number in SI, or a quantity, in the unit of the parameter."""
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise ModelError(f"{where}: {value!r} is neither a number nor a quantity such as '30 mm'")
    if isinstance(value, str):
        if isinstance(written, str) and unit:
            same_kind(written, value, where)
        try:
            value = to_si(value, None)
        except UnitError as error:
            raise ModelError(f"{where}: {error}") from None
    try:
        return float(value) / (to_si(f"1 {unit}", None) if unit else 1.0)
    except OverflowError:  # a whole number beyond the range of floats
        return math.inf


MAX_PORT = 65_535


@dataclass(frozen=True, kw_only=True)
class LiveOptions(AnalysisOptions):
    """Arguments of `Mechanism.live`."""

    t_end: float
    outputs: int
    ranges: Mapping[str, Sequence[Any]] | None
    port: int
    no_open: bool

    def __post_init__(self) -> None:
        super().__post_init__()
        vars(self)["t_end"] = seconds(self.t_end, "t_end")
        require_positive(self.t_end, "t_end")
        require_count(self.outputs, "outputs")
        if self.outputs < 2:
            raise ModelError(f"outputs is {self.outputs}; it must be at least 2, the start and the end of the motion")
        if not isinstance(self.ranges, Mapping | None):
            raise ModelError(
                f"ranges maps parameters to (least, largest), for instance {{'mass': (1, 3)}}, not {self.ranges!r}"
            )
        if isinstance(self.port, bool) or not isinstance(self.port, int) or not 0 <= self.port <= MAX_PORT:
            raise ModelError(f"port is {self.port!r}; it must be 0 (any free port) to {MAX_PORT}")
