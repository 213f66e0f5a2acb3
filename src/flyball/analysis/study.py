"""Many runs of one model: points, who computes them, what goes to a file and is gone on with from it."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import closing
from dataclasses import dataclass, fields, replace
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import AnalysisError, FlyballError, ModelError, StartWarning
from ..model.model import Model
from ..model.words import listing, suggest
from ..results.study import WAITING, Study
from ..results.study_file import save_study
from ..results.study_reading import fingerprint, stored
from .motion.choice import IMPULSE, SimulateOptions
from .motion.engines import AUTO, worth_making
from .motion.implicit.suited import IMPLICIT
from .motion.impulse.settings import Stepping
from .motion.options import output_times
from .motion.start import start_time
from .options import count
from .progress import shown
from .runs.compute import Question
from .runs.designs import DESIGNS, SAMPLED, points
from .runs.pool import computed, cores
from .runs.reading import ends_only, readings
from .simulate import simulate

EVERY = 20.0  # seconds between two states of the file
USUAL = 501  # output times, where motions are looked at between their ends
TRIED = 5  # runs that may fail before it is given up to choose an engine by one


@dataclass(frozen=True, kw_only=True)
class StudyOptions(SimulateOptions):
    """What `Mechanism.study` is asked."""

    vary: Mapping[str, Any]
    of: Sequence[str] | Mapping[str, Callable]
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
        if not self.of:
            raise ModelError("of names no quantity; for instance of=['max(slider.x)']")
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
        if self.executor is not None and not isinstance(self.executor, Executor):
            raise ModelError(
                f"executor is one of concurrent.futures (of Dask: client.get_executor()), not {self.executor!r}"
            )
        if both := self.vary.keys() & (self.parameters or {}).keys():
            raise ModelError(f"{', '.join(sorted(both))}: given in parameters, and varied; leave one of them out")


def study(model: Model, o: StudyOptions) -> Study:
    """Run a model at many values of its parameters: see `Mechanism.study`."""
    started = time.perf_counter()
    model = model.snapshot()
    x, axes = points(model, o.vary, o.design, o.samples, o.seed)
    asked = readings(model, o.of)
    outputs = o.outputs if o.outputs is not None else [o.t_end] if ends_only(asked) else USUAL
    times = output_times(start_time(o.t_start, o.start), o.t_end, outputs)
    known = {f.name: getattr(o, f.name) for f in fields(SimulateOptions)} | {"outputs": times, "progress": False}
    question = Question(model, SimulateOptions(**known), tuple(o.vary), asked, times)
    model.environment(o.parameters)
    mark = "" if o.file is None else fingerprint(model, x, known, [(r.title, r.function) for r in asked], times)
    there = o.file is not None and Path(o.file).exists()
    found = stored(Path(o.file), mark) if o.file is not None and there else _begun(question, o, x, axes, mark)
    found.start, found.options["method"] = o.start, o.method
    with shown(o.progress, "studying") as tell, warnings.catch_warnings():
        warnings.simplefilter("ignore", StartWarning)  # remarks of the runs say it
        _run(_decided(question, found), found, o, tell)
    found.seconds += time.perf_counter() - started
    if o.file is not None:
        save_study(found, o.file)
    return found


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
    )


def _options(o: SimulateOptions) -> dict[str, Any]:
    """Options of `simulate`, but those that the study has by itself."""
    told = {f.name: getattr(o, f.name) for f in fields(o) if f.name not in ("outputs", "progress", "start")}
    return told | {"parameters": dict(o.parameters or {})}


def _decided(question: Question, found: Study) -> Question:
    """With the engine that all runs have: one choice, so that none depends on what was computed before it.

    Contact and implicit methods are for the tables in any case; to ask for these may be to ask for an integrator.
    """
    model, o = question.model, question.options
    others = o.method in (IMPULSE, *IMPLICIT) or isinstance(o.method, Stepping)
    if o.specialize != AUTO or others or model.contacts or model.bulk:
        return question
    if found.options["specialize"] == AUTO:
        found.options["specialize"] = o.stabilization != "partitioning" and _made_code_pays(question, found)
    return replace(question, options=replace(o, specialize=found.options["specialize"]))


def _made_code_pays(question: Question, found: Study) -> bool:
    """Whether code for this mechanism pays, by what the first run that does not fail computes."""
    todo = np.flatnonzero(found.status == WAITING)
    for k in todo[:TRIED]:
        try:
            run = simulate(question.model, replace(question.at(found.points[k]), specialize=False))
        except Exception:  # its reason is told when its turn comes
            continue
        return worth_making(run.values, run.health.evaluations, len(todo))
    return False


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
    answers.reasons, answers.remarks = found.reasons, found.remarks
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
    if isinstance(found.options["method"], dict):
        found.options["method"] = Stepping(**found.options["method"])
    return found
