"""Runs of a study that are of one instant: how a mechanism stands, where it rests, how it swings and answers there."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...errors import ModelError
from ...model.expressions import number
from ...model.model import Model
from ...model.quantities import one
from ...results.equilibrium import STABLE, UNJUDGED
from ...results.linear import LinearModel
from ..assemble import assemble
from ..equilibrium import equilibrium, resting
from ..linear.curves import snapshot
from ..linear.derivatives import State
from ..linear.inputs import with_inputs
from ..linear.sliders import refuse_sampled
from ..linearize import LinearizeOptions, linearize
from ..modes import ModesOptions, modes
from ..options import AssembleOptions, Options
from ..untouched import holding_parts
from .reading import VALUE, Reading
from .single import REDUCED, Single

MODE = re.compile(r"(frequency|omega|damping_ratio)\[(\d+)\]")
UNITS = {"frequency": "Hz", "omega": "rad/s", "damping_ratio": ""}
GAIN = re.compile(r"(gain|phase)\((.+)\)")
ABSCISSA, STANDS, LEAST = "abscissa", "stable", "least"
OF_MODES = "frequency[0], omega[0] and damping_ratio[0], slowest first, and stable"
OF_LINEAR = "gain(output, input), gain(output, input, omega), phase(output, input, omega) and abscissa"


def _curve(model: Model, text: Any) -> Reading:
    """A curve's value at the one instant that there is."""
    if isinstance(text, str) and (found := REDUCED.fullmatch(text)):
        raise ModelError(f"of={text!r}: there is one instant only, at which {found[2].strip()} is one number")
    return Reading(text, VALUE, text, one(model, text).unit)


class Instant(Single):
    """A mechanism assembled at a time: positions, velocities, accelerations and reactions there."""

    title = "instant"
    takes = ("t",)

    def refuse(self, model: Model) -> None:
        """Refuse what holds at times: whether it does, a motion knows."""
        if parts := list(holding_parts(model)):
            raise ModelError(
                f"{model.name!r} has {', '.join(e.title for e in parts)}, and analysis='instant' does not know what "
                f"holds at times; analysis='motion' does"
            )

    def options(self, known: Mapping[str, Any], times: np.ndarray, asked: Sequence[Reading]) -> Options:
        """Time and parameters."""
        return AssembleOptions.asked({**known, "t": known["t"] or 0.0})

    def run(self, model: Model, o: AssembleOptions) -> Any:
        """The state there, as a result with one time."""
        a = assemble(model, t=o.t, parameters=o.parameters)
        return snapshot(State.moving(a.compiled, a.t, a.q, a.v))

    def named(self, model: Model, text: Any) -> Reading:
        """A curve of a result."""
        return _curve(model, text)

    def value(self, found: Any, r: Reading, times: np.ndarray) -> np.ndarray:
        """Of the curve."""
        return np.array(found.curve(r.name)[1][0])


class Rest(Instant):
    """`Mechanism.equilibrium`."""

    title = "equilibrium"

    def refuse(self, model: Model) -> None:
        """What it does not know each run says."""

    def options(self, known: Mapping[str, Any], times: np.ndarray, asked: Sequence[Reading]) -> Options:
        """Where it rests, as drawn the guess of every run."""
        return resting(known["t"] or 0.0, known["parameters"])

    def run(self, model: Model, o: Any) -> Any:
        """The equilibrium."""
        return equilibrium(model, o)

    def named(self, model: Model, text: Any) -> Reading:
        """A curve of a result, or a number of the equilibrium."""
        return Reading(text, VALUE, text, "") if text in (STANDS, LEAST) else _curve(model, text)

    def value(self, found: Any, r: Reading, times: np.ndarray) -> np.ndarray:
        """Of a curve, or of the equilibrium."""
        if r.name == STANDS:
            return np.array(np.nan if found.stability == UNJUDGED else float(found.stability == STABLE))
        return np.array(found.least if r.name == LEAST else found[r.name])

    def remarks(self, found: Any) -> Sequence[object]:
        """What makes the answer less than it seems."""
        own = [] if found.stability == STABLE else [f"the equilibrium is {found.stability}"]
        return [*own, *found.kinks, *found.notes]


@dataclass(frozen=True, kw_only=True)
class AboutOptions(Options):
    """Where small motions are asked of: as drawn at ``t``, or about the equilibrium."""

    t: float
    parameters: Mapping[str, float] | None
    about: str | None
    inputs: tuple[str, ...] = ()
    outputs: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.about not in (None, "equilibrium"):
            raise ModelError(f"about must be 'equilibrium' or nothing, got {self.about!r}")

    def there(self, model: Model) -> dict[str, Any]:
        """Where, for the analysis of it."""
        told: dict[str, Any] = {"parameters": self.parameters, "coordinates": "auto", "frozen": False}
        if self.about is None:
            return told | {"about": None, "t": self.t}
        return told | {"about": equilibrium(model, resting(self.t, self.parameters)), "t": None}


class Small(Single):
    """Small motions about a place."""

    takes = ("t", "about")

    def options(self, known: Mapping[str, Any], times: np.ndarray, asked: Sequence[Reading]) -> Options:
        """Where, and from what to what."""
        out, into = (tuple(dict.fromkeys(r.of[k] for r in asked if r.how == VALUE and len(r.of) == 3)) for k in (0, 1))
        t, parameters, about = known["t"] or 0.0, known["parameters"], known["about"]
        return AboutOptions(t=t, parameters=parameters, about=about, inputs=into, outputs=out)

    def remarks(self, found: Any) -> Sequence[object]:
        """Its notes."""
        return found.notes


class Swings(Small):
    """`Mechanism.modes`."""

    title = "modes"

    def refuse(self, model: Model) -> None:
        """Refuse sampled controllers, which `linearize` knows."""
        refuse_sampled(model, "modes")

    def run(self, model: Model, o: AboutOptions) -> Any:
        """The modes."""
        return modes(model, ModesOptions(count=None, **o.there(model)))

    def named(self, model: Model, text: Any) -> Reading:
        """A number of a mode, or of all."""
        if text == STANDS:
            return Reading(text, VALUE, text, "")
        if not (isinstance(text, str) and (found := MODE.fullmatch(text.replace(" ", "")))):
            raise ModelError(f"of={text!r}: modes have {OF_MODES}")
        return Reading(text, VALUE, found[1], UNITS[found[1]], None, (int(found[2]),))

    def value(self, found: Any, r: Reading, times: np.ndarray) -> np.ndarray:
        """Of a mode; nan of one that there is not."""
        if r.name == STANDS:
            return np.array(float(found.stable))
        numbers, k = getattr(found, r.name), r.of[0]
        return np.array(numbers[k] if k < len(numbers) else np.nan)


def _abscissa(found: LinearModel) -> float:
    """Largest growth [1/s]; of multipliers from one sample to the next that of what they grow by in a period."""
    x = found.eigenvalues
    if not len(x):
        return np.nan
    if found.period is None:
        return float(x.real.max())
    most = float(np.abs(x).max())
    return float(np.log(most) / found.period) if most > 0.0 else -np.inf


class Answers(Small):
    """`Mechanism.linearize`: eigenvalues, and what outputs answer to inputs."""

    title = "linearize"

    def run(self, model: Model, o: AboutOptions) -> LinearModel:
        """The linear model, with the inputs and outputs that are asked for."""
        return linearize(model, LinearizeOptions(inputs=o.inputs, outputs=o.outputs, **o.there(model)))

    def named(self, model: Model, text: Any) -> Reading:
        """Gain or phase from an input to an output, or a number of the eigenvalues."""
        if text == ABSCISSA:
            return Reading(text, VALUE, text, "1/s")
        if not (isinstance(text, str) and (found := GAIN.fullmatch(text.strip()))):
            raise ModelError(f"of={text!r}: linear models have {OF_LINEAR}; for curves there is analysis='instant'")
        how, parts = found[1], [x.strip() for x in found[2].split(",")]
        if len(parts) not in ((2, 3) if how == "gain" else (3,)):
            raise ModelError(f"of={text!r}: linear models have {OF_LINEAR}")
        out, into = one(model, parts[0]).unit, with_inputs(model, [parts[1]])[1][0].unit
        at = number(parts[2], {}, "rad/s", text) if len(parts) == 3 else 0.0
        below = f"({into})" if set("*/") & set(into) else into or "1"
        unit = "rad" if how == "phase" else "" if "SI" in (out, into) else f"{out or 1}/{below}"
        return Reading(text, VALUE, how, unit, None, (parts[0], parts[1], at))

    def value(self, found: Any, r: Reading, times: np.ndarray) -> np.ndarray:
        """Of the frequency response, at frequency 0 with its sign; or of the eigenvalues."""
        if r.name == ABSCISSA:
            return np.array(_abscissa(found))
        out, into, at = r.of
        g = found.response([at], into, out)[0]
        return np.array(np.angle(g) if r.name == "phase" else g.real if at == 0.0 else abs(g))
