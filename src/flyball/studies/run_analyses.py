"""One run of a study: an analysis of the model, and the quantities that are read from its result by name.

Motions and kinematics give curves over the output times, or one number of a curve; an instant, an equilibrium,
modes and linear models give numbers; a user's function gives what it returns.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..analysis_options import AnalysisOptions, AssembleOptions
from ..assembly.assemble import assemble
from ..derivatives.equation_derivatives import MechanismState
from ..derivatives.output_derivatives import snapshot
from ..errors import ModelError, SimulationError
from ..kinematics.driven_motion import KinematicsOptions, kinematics
from ..linear.linearize import LinearizeOptions, linearize
from ..linear.modes import ModesOptions, modes
from ..model.element_laws import with_inputs
from ..model.expressions import number
from ..model.messages import listing, suggest
from ..model.model import Model
from ..model.quantities import single_quantity
from ..model.unsupported_elements import refuse_sampled_controllers, refuse_unsupported, unsupported_elements
from ..results.linear_model import LinearModel
from ..results.wording import NOT_JUDGED, STABLE
from ..simulation.initial_state import choose_coordinates
from ..simulation.method_choice import SimulateOptions
from ..simulation.prescribed_motion import is_checked_afterwards
from ..simulation.simulate import simulate
from ..statics.equilibrium import equilibrium, rest_options

CURVE, END, FUNCTION, VALUE = "curve", "end", "function", "value"


@dataclass(frozen=True)
class StudyQuantity:
    """One quantity of a study: ``how`` it is read from ``name`` in the result, or computed by a function."""

    title: str
    how: str
    name: str
    unit: str
    function: Callable[[Any], Any] | None = None
    of: tuple[Any, ...] = ()  # further parts of its name


def study_quantities(
    of: Sequence[str] | Mapping[str, Callable[[Any], Any]], named: Callable[[Any], StudyQuantity]
) -> tuple[StudyQuantity, ...]:
    """The requested quantities.

    Raises
    ------
    ModelError
        If there is no such quantity, or it is no number.
    """
    if isinstance(of, Mapping):
        for title, function in of.items():
            if not isinstance(title, str) or not callable(function):
                raise ModelError(f"of maps names to functions of a run's result, not {title!r} to {function!r}")
        return tuple(StudyQuantity(title, FUNCTION, title, "", function) for title, function in of.items())
    if isinstance(of, (str, bytes)) or not isinstance(of, Sequence) or not all(isinstance(x, str) for x in of):
        raise ModelError(f"of is a list of names, for instance of=['max(slider.x)'], not {of!r}")
    if len(set(of)) < len(of):
        raise ModelError(f"of names something twice: {', '.join(map(str, of))}")
    return tuple(named(text) for text in of)


def ends_only(quantities: Sequence[StudyQuantity]) -> bool:
    """Whether only the ends of motions are needed."""
    return all(r.how == END for r in quantities)


def reduce_curve(reduction: str, t: np.ndarray, y: np.ndarray, times: np.ndarray) -> np.ndarray:
    """A curve at the times of the study (NaN after the end of the motion), or one number of it."""
    if reduction == CURVE and t is times:
        return y
    if reduction == CURVE:
        out = np.full(len(times), np.nan)
        at = np.searchsorted(times, t)
        there = at < len(times)
        there[there] = times[at[there]] == t[there]
        out[at[there]] = y[there]
        return out
    if not len(t):
        return np.array(np.nan)
    if reduction == END:
        return np.array(y[-1])
    if reduction in ("max", "min"):
        return np.array(getattr(np, reduction)(y))
    y = y if reduction == "mean" else y**2
    span = t[-1] - t[0]
    mean = float(np.sum(0.5 * (y[1:] + y[:-1]) * np.diff(t)) / span) if span > 0.0 else float(y[-1])
    return np.array(mean if reduction == "mean" else np.sqrt(mean))


REDUCTIONS = ("end", "max", "min", "mean", "rms")
REDUCTION_NAME = re.compile(rf"\s*({'|'.join(REDUCTIONS)})\s*\((.+)\)\s*")
CALL_NAME = re.compile(r"\s*(\w+)\s*\(.*\)\s*")


class RunAnalysis:
    """An analysis that a study performs at one point.

    Attributes
    ----------
    title : str
        Its name in ``analysis=``.
    takes : tuple of str
        Options that it accepts, besides those of every study.
    timed : bool
        Whether it has output times.
    """

    title: str
    takes: tuple[str, ...] = ()
    timed = False

    def refuse(self, model: Model) -> None:
        """Refuse a model that the analysis does not support, before any run."""

    def options(
        self, known: Mapping[str, Any], times: np.ndarray, quantities: Sequence[StudyQuantity]
    ) -> AnalysisOptions:
        """Options of each run, except the varied parameters."""
        raise NotImplementedError

    def run(self, model: Model, o: Any) -> Any:
        """The result at one point."""
        raise NotImplementedError

    def remarks(self, found: Any) -> Sequence[object]:
        """Remarks of a single run."""
        return ()

    def doubtful(self, found: Any) -> Sequence[str]:
        """Reasons why the result may not meet its tolerance."""
        return ()

    def named(self, model: Model, text: Any) -> StudyQuantity:
        """A quantity by name.

        Raises
        ------
        ModelError
            If there is no such quantity, or it is no number.
        """
        raise NotImplementedError

    def value(self, found: Any, r: StudyQuantity, times: np.ndarray) -> np.ndarray:
        """Value of a quantity in a result."""
        raise NotImplementedError

    def read(self, found: Any, quantities: Sequence[StudyQuantity], times: np.ndarray) -> list[np.ndarray]:
        """Requested quantities of one run: (times,) for a curve, else ()."""
        return [_function_value(r, found) if r.how == FUNCTION else self.value(found, r, times) for r in quantities]


class TimedAnalysis(RunAnalysis):
    """An analysis with output times. ``value`` and ``remarks`` read a `Result`; replace them if it returns another."""

    timed = True

    def named(self, model: Model, text: Any) -> StudyQuantity:
        """A curve, or one number of it."""
        found = REDUCTION_NAME.fullmatch(text) if isinstance(text, str) else None
        how, name = (found[1], found[2].strip()) if found else (CURVE, text)
        if isinstance(name, str) and (called := CALL_NAME.fullmatch(name)):
            raise ModelError(
                f"of={text!r}: {called[1]!r} is no number of a curve{suggest(called[1], REDUCTIONS)}; "
                f"{listing(list(REDUCTIONS))}, of one curve each; for others give functions, of={{'name': function}}"
            )
        return StudyQuantity(text, how, name, single_quantity(model, name).unit)

    def value(self, found: Any, r: StudyQuantity, times: np.ndarray) -> np.ndarray:
        """Value of the quantity, from its curve."""
        return reduce_curve(r.how, found.t, found.curve(r.name)[1], times)

    def remarks(self, found: Any) -> Sequence[object]:
        """Remarks in the health of the result."""
        return found.health.remarks


class MotionAnalysis(TimedAnalysis):
    """`Mechanism.simulate`."""

    title = "motion"
    takes = (*(f for f in SimulateOptions.__dataclass_fields__ if f not in ("parameters", "progress")),)

    def options(
        self, known: Mapping[str, Any], times: np.ndarray, quantities: Sequence[StudyQuantity]
    ) -> AnalysisOptions:
        """Options of the study, with its output times."""
        return SimulateOptions.from_arguments({**known, "outputs": times, "progress": False})

    def run(self, model: Model, o: SimulateOptions) -> Any:
        """The motion to its end."""
        result = simulate(model, o)
        if not result.health.success:
            raise SimulationError(result.health.message, result)
        return result

    def doubtful(self, found: Any) -> Sequence[str]:
        """Doubts in the health of the result."""
        return found.health.doubtful


class KinematicsAnalysis(TimedAnalysis):
    """`Mechanism.kinematics`."""

    title = "kinematics"
    takes = ("t_start", "t_end", "outputs", "coordinates", "specialize")

    def refuse(self, model: Model) -> None:
        """Refuse elements whose state depends on a motion."""
        refuse_unsupported(model, self.title, is_checked_afterwards)

    def options(
        self, known: Mapping[str, Any], times: np.ndarray, quantities: Sequence[StudyQuantity]
    ) -> AnalysisOptions:
        """Options of the study, with its output times."""
        return KinematicsOptions.from_arguments({**known, "times": times, "t_end": None, "progress": False})

    def run(self, model: Model, o: KinematicsOptions) -> Any:
        """The motion prescribed by the drivers."""
        return kinematics(model, o)


@dataclass(frozen=True, kw_only=True)
class FunctionOptions(AnalysisOptions):
    """Arguments of a user's function: the values of the parameters."""

    parameters: Mapping[str, float] | None


@dataclass(frozen=True)
class FunctionAnalysis(RunAnalysis):
    """A user's function of the mechanism and parameter values; it may return anything that has curves at one time."""

    function: Callable[[Any, dict[str, float]], Any]
    title = "function"

    def options(
        self, known: Mapping[str, Any], times: np.ndarray, quantities: Sequence[StudyQuantity]
    ) -> AnalysisOptions:
        """The values of parameters."""
        return FunctionOptions.from_arguments(known)

    def run(self, model: Model, o: FunctionOptions) -> Any:
        """The return value of the function."""
        return self.function(model, dict(o.parameters or {}))

    def named(self, model: Model, text: Any) -> StudyQuantity:
        """Refuse names: quantities of a user's function must be functions."""
        raise ModelError(
            f"of={text!r}: the results of a function of your own have no names; give of={{'name': function of it}}"
        )


def _function_value(r: StudyQuantity, found: Any) -> np.ndarray:
    """Number that a user's function computes from a result."""
    y = np.asarray(r.function(found))  # type: ignore[misc]
    if y.ndim or y.dtype.kind not in "fiub":
        what = f"an array of {' x '.join(map(str, y.shape))}" if y.ndim else repr(y.item())
        raise ModelError(f"the function {r.title!r} returned {what}; one number is wanted")
    return y.astype(float)


MODE_NAME = re.compile(r"(frequency|omega|damping_ratio)\[(\d+)\]")
MODE_UNITS = {"frequency": "Hz", "omega": "rad/s", "damping_ratio": ""}
RESPONSE_NAME = re.compile(r"(gain|phase)\((.+)\)")
ABSCISSA, IS_STABLE, LEAST_STIFFNESS = "abscissa", "stable", "least"
MODE_QUANTITIES = "frequency[0], omega[0] and damping_ratio[0], slowest first, and stable"
LINEAR_QUANTITIES = "gain(output, input), gain(output, input, omega), phase(output, input, omega) and abscissa"


def _curve_at_instant(model: Model, text: Any) -> StudyQuantity:
    """Value of a curve in a result with one time."""
    if isinstance(text, str) and (found := REDUCTION_NAME.fullmatch(text)):
        raise ModelError(f"of={text!r}: there is one instant only, at which {found[2].strip()} is one number")
    return StudyQuantity(text, VALUE, text, single_quantity(model, text).unit)


class InstantAnalysis(RunAnalysis):
    """A mechanism assembled at a time: positions, velocities, accelerations and reactions there."""

    title = "instant"
    takes = ("t",)

    def refuse(self, model: Model) -> None:
        """Refuse switching elements, whose state depends on a motion."""
        if parts := list(unsupported_elements(model)):
            raise ModelError(
                f"{model.name!r} has {', '.join(e.title for e in parts)}, and analysis='instant' does not support "
                "parts with modes; analysis='motion' does"
            )

    def options(
        self, known: Mapping[str, Any], times: np.ndarray, quantities: Sequence[StudyQuantity]
    ) -> AnalysisOptions:
        """Time and parameters."""
        return AssembleOptions.from_arguments({**known, "t": known["t"] or 0.0})

    def run(self, model: Model, o: AssembleOptions) -> Any:
        """The state as a result with one time."""
        a = assemble(model, t=o.t, parameters=o.parameters)
        if a.compiled.structure.rotors_without_velocity:
            a, _ = choose_coordinates(a, "joint", o.parameters)
        return snapshot(MechanismState.moving(a.compiled, a.t, a.q, a.v))

    def named(self, model: Model, text: Any) -> StudyQuantity:
        """A curve of a result."""
        return _curve_at_instant(model, text)

    def value(self, found: Any, r: StudyQuantity, times: np.ndarray) -> np.ndarray:
        """Value of the curve."""
        return np.array(found.curve(r.name)[1][0])


class EquilibriumAnalysis(InstantAnalysis):
    """`Mechanism.equilibrium`."""

    title = "equilibrium"

    def refuse(self, model: Model) -> None:
        """Refuse nothing here: each run refuses what it does not support."""

    def options(
        self, known: Mapping[str, Any], times: np.ndarray, quantities: Sequence[StudyQuantity]
    ) -> AnalysisOptions:
        """Options of the equilibrium; every run starts from the described position."""
        return rest_options(known["t"] or 0.0, known["parameters"])

    def run(self, model: Model, o: Any) -> Any:
        """The equilibrium."""
        return equilibrium(model, o)

    def named(self, model: Model, text: Any) -> StudyQuantity:
        """A curve of a result, or a number of the equilibrium."""
        return (
            StudyQuantity(text, VALUE, text, "")
            if text in (IS_STABLE, LEAST_STIFFNESS)
            else _curve_at_instant(model, text)
        )

    def value(self, found: Any, r: StudyQuantity, times: np.ndarray) -> np.ndarray:
        """Value of a curve, or a number of the equilibrium."""
        if r.name == IS_STABLE:
            return np.array(np.nan if found.stability == NOT_JUDGED else float(found.stability == STABLE))
        return np.array(found.least if r.name == LEAST_STIFFNESS else found[r.name])

    def remarks(self, found: Any) -> Sequence[object]:
        """Notes of the equilibrium, and missing stability."""
        own = [] if found.stability == STABLE else [f"the equilibrium is {found.stability}"]
        return [*own, *found.kinks, *found.notes]


@dataclass(frozen=True, kw_only=True)
class SmallMotionOptions(AnalysisOptions):
    """Operating point of small motions: as described at ``t``, or the equilibrium."""

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
        """Operating point as options of the single analysis."""
        told: dict[str, Any] = {"parameters": self.parameters, "coordinates": "auto", "frozen": False}
        if self.about is None:
            return told | {"about": None, "t": self.t}
        return told | {"about": equilibrium(model, rest_options(self.t, self.parameters)), "t": None}


class SmallMotionAnalysis(RunAnalysis):
    """Small motions about an operating point."""

    takes = ("t", "about")

    def options(
        self, known: Mapping[str, Any], times: np.ndarray, quantities: Sequence[StudyQuantity]
    ) -> AnalysisOptions:
        """Operating point, inputs and outputs."""
        out, into = (
            tuple(dict.fromkeys(r.of[k] for r in quantities if r.how == VALUE and len(r.of) == 3)) for k in (0, 1)
        )
        t, parameters, about = known["t"] or 0.0, known["parameters"], known["about"]
        return SmallMotionOptions(t=t, parameters=parameters, about=about, inputs=into, outputs=out)

    def remarks(self, found: Any) -> Sequence[object]:
        """Notes of the result."""
        return found.notes


class ModesAnalysis(SmallMotionAnalysis):
    """`Mechanism.modes`."""

    title = "modes"

    def refuse(self, model: Model) -> None:
        """Refuse sampled controllers, which only `linearize` supports."""
        refuse_sampled_controllers(model, "modes")

    def run(self, model: Model, o: SmallMotionOptions) -> Any:
        """The modes."""
        return modes(model, ModesOptions(count=None, **o.there(model)))

    def named(self, model: Model, text: Any) -> StudyQuantity:
        """A number of a mode, or of all."""
        if text == IS_STABLE:
            return StudyQuantity(text, VALUE, text, "")
        if not (isinstance(text, str) and (found := MODE_NAME.fullmatch(text.replace(" ", "")))):
            raise ModelError(f"of={text!r}: modes have {MODE_QUANTITIES}")
        return StudyQuantity(text, VALUE, found[1], MODE_UNITS[found[1]], None, (int(found[2]),))

    def value(self, found: Any, r: StudyQuantity, times: np.ndarray) -> np.ndarray:
        """Number of a mode; NaN if the mode does not exist."""
        if r.name == IS_STABLE:
            return np.array(float(found.stable))
        numbers, k = getattr(found, r.name), r.of[0]
        return np.array(numbers[k] if k < len(numbers) else np.nan)


class LinearAnalysis(SmallMotionAnalysis):
    """`Mechanism.linearize`: eigenvalues, and responses of outputs to inputs."""

    title = "linearize"

    def run(self, model: Model, o: SmallMotionOptions) -> LinearModel:
        """The linear model with the requested inputs and outputs."""
        return linearize(model, LinearizeOptions(inputs=o.inputs, outputs=o.outputs, independent=(), **o.there(model)))

    def named(self, model: Model, text: Any) -> StudyQuantity:
        """Gain or phase from an input to an output, or a number of the eigenvalues."""
        if text == ABSCISSA:
            return StudyQuantity(text, VALUE, text, "1/s")
        if not (isinstance(text, str) and (found := RESPONSE_NAME.fullmatch(text.strip()))):
            raise ModelError(
                f"of={text!r}: linear models have {LINEAR_QUANTITIES}; for curves there is analysis='instant'"
            )
        how, parts = found[1], [x.strip() for x in found[2].split(",")]
        if len(parts) not in ((2, 3) if how == "gain" else (3,)):
            raise ModelError(f"of={text!r}: linear models have {LINEAR_QUANTITIES}")
        out, into = single_quantity(model, parts[0]).unit, with_inputs(model, [parts[1]])[1][0].unit
        at = number(parts[2], {}, "rad/s", text) if len(parts) == 3 else 0.0
        below = f"({into})" if set("*/") & set(into) else into or "1"
        unit = "rad" if how == "phase" else "" if "SI" in (out, into) else f"{out or 1}/{below}"
        return StudyQuantity(text, VALUE, how, unit, None, (parts[0], parts[1], at))

    def value(self, found: Any, r: StudyQuantity, times: np.ndarray) -> np.ndarray:
        """Number of the frequency response (with sign at frequency 0), or of the eigenvalues."""
        if r.name == ABSCISSA:
            return _spectral_abscissa(found)
        out, into, at = r.of
        g = found.response([at], into, out)[0]
        return np.array(np.angle(g) if r.name == "phase" else g.real if at == 0.0 else abs(g))


def _spectral_abscissa(found: LinearModel) -> np.ndarray:
    """Largest growth rate [1/s]; with sampled controllers that of s in z = exp(s period)."""
    w = found.eigenvalues
    if not len(w):
        return np.array(np.nan)
    if found.period is None:
        return np.array(w.real.max())
    with np.errstate(divide="ignore"):  # a multiplier of 0 decays within one period
        return np.array(np.log(np.abs(w)).max() / found.period)
