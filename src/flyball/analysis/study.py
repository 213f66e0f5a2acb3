"""Many runs of one model: points, who computes them, what goes to a file and is gone on with from it."""

from __future__ import annotations

import inspect
import os
import time
import warnings
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import closing
from dataclasses import dataclass, fields
from functools import partial
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import AnalysisError, FlyballError, Interrupted, ModelError, StartWarning
from ..model.model import Model
from ..model.words import listing, suggest
from ..results.study import WAITING, Study
from ..results.study_file import save_study
from ..results.study_reading import fingerprint, stored
from ..tables.numbers import unused
from .motion.choice import SimulateOptions
from .motion.impulse.settings import Stepping
from .motion.options import output_times
from .motion.start import start_time
from .options import count
from .progress import shown
from .runs.compute import Question
from .runs.designs import DESIGNS, SAMPLED, points
from .runs.instants import Answers, Instant, Rest, Swings
from .runs.pool import computed, cores
from .runs.reading import ends_only, readings
from .runs.single import Kinematics, Motion, Own, Single

EVERY = 20.0  # seconds between two states of the file
USUAL = 501  # output times, where motions are looked at between their ends
JUDGED = 17  # the same, where they are not: their energy balance is
ANALYSES = {x.title: x for x in (Motion(), Kinematics(), Instant(), Rest(), Swings(), Answers())}
EVERY_STUDY = ("vary", "of", "analysis", "parameters", "design", "samples", "seed", "file", "executor", "threads",
               "progress")  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class StudyOptions(SimulateOptions):
    """What `Mechanism.study` is asked."""

    vary: Mapping[str, Any]
    of: Sequence[str] | Mapping[str, Callable]
    analysis: str | Callable[[Any, dict[str, float]], Any]
    t_end: float | None  # type: ignore[assignment]
    t: float | None
    about: str | None
    design: str
    samples: int | None
    seed: int | None
    outputs: int | Sequence[float] | None  # type: ignore[assignment]
    file: str | PathLike | None
    executor: Executor | None
    threads: int | None

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.vary:
            raise ModelError("vary names no parameter; for instance vary={'stiffness': [1e3, 1e4]}")
        if not isinstance(self.of, (Sequence, Mapping)) or not self.of:
            raise ModelError("of names no quantity; for instance of=['max(slider.x)']")
        if not callable(self.analysis) and (not isinstance(self.analysis, str) or self.analysis not in ANALYSES):
            named = [*ANALYSES, "a function of the mechanism and its parameters"]
            raise ModelError(
                f"unknown analysis {self.analysis!r}{suggest(str(self.analysis), ANALYSES)}; {listing(named)}"
            )
        if self.single.timed and self.t_end is None:
            raise ModelError(f"analysis={self.single.title!r} needs t_end, the time [s] when it ends")
        if self.design not in DESIGNS:
            raise ModelError(f"unknown design {self.design!r}{suggest(self.design, DESIGNS)}; {listing(list(DESIGNS))}")
        if self.design in SAMPLED:
            count(self.samples, f"samples, which design={self.design!r} needs,")
        for name in ("samples", "seed") if self.design not in SAMPLED else ():
            if getattr(self, name) is not None:
                raise ModelError(f"{name}={getattr(self, name)!r} does nothing with design={self.design!r}")
        if self.seed is not None:
            count(self.seed, "seed", 0)
        if self.threads is not None:
            count(self.threads, "threads")
            if self.executor is not None:
                raise ModelError("threads does nothing where an executor computes the runs; leave one of them out")
        if self.about is not None and not isinstance(self.about, str):
            raise ModelError(f"about is 'equilibrium' or None, not {self.about!r}")
        if self.file is not None and not isinstance(self.file, (str, PathLike)):
            raise ModelError(f"file is the path of a file, not {self.file!r}")
        if self.file is not None and not Path(self.file).absolute().parent.is_dir():
            raise ModelError(f"file={os.fspath(self.file)!r}: there is no such folder")
        if self.executor is not None and not isinstance(self.executor, Executor):
            raise ModelError(
                f"executor is one of concurrent.futures (of Dask: client.get_executor()), not {self.executor!r}"
            )
        if both := self.vary.keys() & (self.parameters or {}).keys():
            raise ModelError(f"{', '.join(sorted(both))}: given in parameters, and varied; leave one of them out")

    @property
    def single(self) -> Single:
        """What each run is."""
        return Own(self.analysis) if callable(self.analysis) else ANALYSES[self.analysis]

    def refuse_idle(self, model: Model) -> None:
        """Refuse options that the analysis does not have: those that are not what the method has them for."""
        usual = inspect.signature(type(model).study).parameters  # type: ignore[attr-defined]
        for f in fields(self):
            if f.name in (*EVERY_STUDY, *self.single.takes):
                continue
            if getattr(self, f.name) != usual[f.name].default:
                raise ModelError(f"{f.name} does nothing with analysis={self.single.title!r}; leave it out")

    def question(self, model: Model) -> Question:
        """What each run is asked."""
        single = self.single
        single.refuse(model)
        if not callable(self.analysis) and not isinstance(self.of, Mapping) and (idle := unused(model, [*self.vary])):
            raise ModelError(
                f"vary {idle[0]!r}: nothing of {model.name!r} depends on it, and all runs would be the same"
            )
        asked = readings(self.of, partial(single.named, model))
        times = np.array([self.t or 0.0])
        if single.timed:
            end = float(self.t_end or 0.0)
            outputs = self.outputs if self.outputs is not None else JUDGED if ends_only(asked) else USUAL
            times = output_times(start_time(self.t_start, self.start), end, outputs)
        known = {f.name: getattr(self, f.name) for f in fields(self)}
        return Question(model, single, single.options(known, times, asked), tuple(self.vary), asked, times)


def study(model: Model, o: StudyOptions) -> Study:
    """Analyse a model at many values of its parameters: see `Mechanism.study`."""
    started = time.perf_counter()
    model = model.snapshot()
    x, axes = points(model, o.vary, o.design, o.samples, o.seed)
    o.refuse_idle(model)
    question = o.question(model)
    model.environment(o.parameters)
    mark = "" if o.file is None else _mark(question, x)
    there = o.file is not None and Path(o.file).exists()
    found = stored(Path(o.file), mark) if o.file is not None and there else _begun(question, o, x, axes, mark)
    if found.analysis == "motion":
        found.start, found.options["method"] = o.start, o.method
    with shown(o.progress, "studying") as tell, warnings.catch_warnings():
        warnings.simplefilter("ignore", StartWarning)  # remarks of the runs say it
        _run(question, found, o, tell)
    found.seconds += time.perf_counter() - started
    if o.file is not None:
        save_study(found, o.file)
    if not found.complete:
        missing = int((found.status == WAITING).sum())
        raise Interrupted(f"the study was {found.message}; {missing} of {len(found)} runs are missing", found)
    return found


def _mark(question: Question, points: np.ndarray) -> str:
    """What tells the study from others."""
    o, asked = question.options, [(r.title, r.function) for r in question.asked]
    known = {f.name: getattr(o, f.name) for f in fields(o)} | {"analysis": question.single.title}
    own = getattr(question.single, "function", None)
    return fingerprint(question.model, points, known, asked + [("analysis", own)] * (own is not None), question.times)


def _begun(question: Question, o: StudyOptions, x: np.ndarray, axes: tuple[np.ndarray, ...], mark: str) -> Study:
    """A study of which nothing is computed."""
    env = question.model.environment(o.parameters)
    blank = question.empty(len(x))
    return Study(
        name=question.model.name,
        design=o.design,
        parameters=question.names,
        points=x,
        axes=axes,
        of=tuple(r.title for r in question.asked),
        units=tuple(r.unit for r in question.asked),
        t=question.times,
        values=dict(zip((r.title for r in question.asked), blank.values, strict=True)),
        status=blank.status,
        options=_options(question.options),
        base={name: env[name] for name in question.names},
        mark=mark,
        analysis=question.single.title,
    )


def _options(o: Any) -> dict[str, Any]:
    """Options of the analysis, but those that the study has by itself."""
    told = {f.name: getattr(o, f.name) for f in fields(o) if f.name not in ("outputs", "times", "progress", "start")}
    return told | {"parameters": dict(o.parameters or {})}


def _run(question: Question, found: Study, o: StudyOptions, tell: Any) -> None:
    """Compute what is still to be done; an interrupt leaves what was done by then.

    Raises
    ------
    AnalysisError
        If the executor fails; the file holds what was done by then.
    """
    todo = np.flatnonzero(found.status == WAITING)
    if not len(todo):
        return
    answers = question.empty(0)
    answers.values, answers.status = list(found.values.values()), found.status
    answers.reasons, answers.remarks, answers.doubtful = found.reasons, found.remarks, found.doubtful
    total, saved = len(found.points), time.monotonic()
    try:
        with closing(computed(question, found.points, todo, o.executor, o.threads or cores())) as parts:
            for at, part in parts:
                answers.take(at, part)
                tell(
                    float((found.status != WAITING).sum()) / total,
                    f"{int((found.status != WAITING).sum())} of {total} runs",
                )
                if o.file is not None and time.monotonic() - saved > EVERY:
                    save_study(found, o.file)
                    saved = time.monotonic()
    except KeyboardInterrupt:
        found.message = "interrupted by the user; what was computed is kept"
    except FlyballError:
        raise
    except Exception as error:
        if o.file is not None:
            save_study(found, o.file)
        kept = f"; what was done is in {o.file}, and the same call goes on from it" if o.file is not None else ""
        raise AnalysisError(f"the study cannot go on ({type(error).__name__}: {error}){kept}") from error
    else:
        found.message = ""


def load_study(path: str | PathLike) -> Study:
    """Read a study from a NetCDF file, as ``m.study(..., file=path)`` or `Study.save` writes it.

    Raises
    ------
    ModelError
        If there is no such file, it is damaged, or it is no study of flyball.
    """
    if not isinstance(path, (str, PathLike)):
        raise ModelError(f"the path of a study is a text or a path, not {path!r}")
    found = stored(path)
    if isinstance(found.options.get("method"), dict):
        found.options["method"] = Stepping(**found.options["method"])
    return found
