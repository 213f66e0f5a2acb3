"""What one run of a study is: an analysis of the model, and what is read of its answer by name."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...errors import ModelError, SimulationError
from ...model.model import Model
from ...model.quantities import one
from ...model.words import listing, suggest
from ..kinematics import KinematicsOptions, kinematics
from ..motion.choice import SimulateOptions
from ..options import Options
from ..simulate import simulate
from ..untouched import refuse_contact
from ..watched import KNOWN
from .reading import CURVE, FUNCTION, Reading, reduced

NUMBERS = ("end", "max", "min", "mean", "rms")
REDUCED = re.compile(rf"\s*({'|'.join(NUMBERS)})\s*\((.+)\)\s*")
CALLED = re.compile(r"\s*(\w+)\s*\(.*\)\s*")


class Single:
    """An analysis that a study asks, of one point.

    Attributes
    ----------
    title : str
        As it is called in ``analysis=``.
    takes : tuple of str
        Options that it has, besides those of every study.
    timed : bool
        Whether it has output times.
    """

    title: str
    takes: tuple[str, ...] = ()
    timed = False

    def refuse(self, model: Model) -> None:
        """Refuse a model that it knows nothing of, before there are runs."""

    def options(self, known: Mapping[str, Any], times: np.ndarray, asked: Sequence[Reading]) -> Options:
        """What each run is asked, but for the parameters that are varied."""
        raise NotImplementedError

    def run(self, model: Model, o: Any) -> Any:
        """The answer at one point."""
        raise NotImplementedError

    def remarks(self, found: Any) -> Sequence[object]:
        """What a single run would say besides."""
        return ()

    def doubtful(self, found: Any) -> Sequence[str]:
        """Reasons to think that the answer is not what its tolerance asks for."""
        return ()

    def named(self, model: Model, text: Any) -> Reading:
        """A quantity by name.

        Raises
        ------
        ModelError
            If there is no such quantity, or it is no number.
        """
        raise NotImplementedError

    def value(self, found: Any, r: Reading, times: np.ndarray) -> np.ndarray:
        """A quantity of an answer."""
        raise NotImplementedError

    def read(self, found: Any, asked: Sequence[Reading], times: np.ndarray) -> list[np.ndarray]:
        """What is asked for of one run: (times,) for a curve, else ()."""
        return [_of_function(r, found) if r.how == FUNCTION else self.value(found, r, times) for r in asked]


class Timed(Single):
    """An analysis whose answer is a result over output times."""

    timed = True

    def named(self, model: Model, text: Any) -> Reading:
        """A curve, or one number of it."""
        found = REDUCED.fullmatch(text) if isinstance(text, str) else None
        how, name = (found[1], found[2].strip()) if found else (CURVE, text)
        if isinstance(name, str) and (called := CALLED.fullmatch(name)):
            raise ModelError(
                f"of={text!r}: {called[1]!r} is no number of a curve{suggest(called[1], NUMBERS)}; "
                f"{listing(list(NUMBERS))}, of one curve each; for others give functions, of={{'name': function}}"
            )
        return Reading(text, how, name, one(model, name).unit)

    def value(self, found: Any, r: Reading, times: np.ndarray) -> np.ndarray:
        """Read off the curve."""
        return reduced(r.how, found.t, found.curve(r.name)[1], times)

    def remarks(self, found: Any) -> Sequence[object]:
        """Those of its health."""
        return found.health.remarks


class Motion(Timed):
    """`Mechanism.simulate`."""

    title = "motion"
    takes = (*(f for f in SimulateOptions.__dataclass_fields__ if f not in ("parameters", "progress")),)

    def options(self, known: Mapping[str, Any], times: np.ndarray, asked: Sequence[Reading]) -> Options:
        """Those of the study, at its output times."""
        return SimulateOptions.asked({**known, "outputs": times, "progress": False})

    def run(self, model: Model, o: SimulateOptions) -> Any:
        """The motion to its end."""
        result = simulate(model, o)
        if not result.health.success:
            raise SimulationError(result.health.message, result)
        return result

    def doubtful(self, found: Any) -> Sequence[str]:
        """Those of its health."""
        return found.health.doubtful


class Kinematics(Timed):
    """`Mechanism.kinematics`."""

    title = "kinematics"
    takes = ("t_start", "t_end", "outputs", "coordinates", "specialize")

    def refuse(self, model: Model) -> None:
        """Refuse what only a motion knows."""
        refuse_contact(model, self.title, KNOWN)

    def options(self, known: Mapping[str, Any], times: np.ndarray, asked: Sequence[Reading]) -> Options:
        """Those of the study, at its output times."""
        return KinematicsOptions.asked({**known, "times": times, "t_end": None, "progress": False})

    def run(self, model: Model, o: KinematicsOptions) -> Any:
        """As drivers prescribe."""
        return kinematics(model, o)


@dataclass(frozen=True, kw_only=True)
class PointOptions(Options):
    """What a function is asked: the values of the parameters."""

    parameters: Mapping[str, float] | None


@dataclass(frozen=True)
class Own(Single):
    """A function of the mechanism and the values of its parameters; curves are read of what has them at one time."""

    function: Callable[[Any, dict[str, float]], Any]
    title = "function"

    def options(self, known: Mapping[str, Any], times: np.ndarray, asked: Sequence[Reading]) -> Options:
        """The values of parameters."""
        return PointOptions.asked(known)

    def run(self, model: Model, o: PointOptions) -> Any:
        """What it returns."""
        return self.function(model, dict(o.parameters or {}))

    def named(self, model: Model, text: Any) -> Reading:
        """Only functions know what it returns."""
        raise ModelError(
            f"of={text!r}: names say nothing of what a function of your own returns; give of={{'name': function of it}}"
        )


def _of_function(r: Reading, found: Any) -> np.ndarray:
    """What a user's function makes of an answer: one number."""
    y = np.asarray(r.function(found))  # type: ignore[misc]
    if y.ndim or y.dtype.kind not in "fiub":
        what = f"an array of {' x '.join(map(str, y.shape))}" if y.ndim else repr(y.item())
        raise ModelError(f"the function {r.title!r} returned {what}; one number is wanted")
    return y.astype(float)
