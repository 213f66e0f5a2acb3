"""Many runs of one model: computed by threads or an executor, stored in a file, and continued from it.

Each run is the single analysis with its own values of parameters, and may fail by itself. Processes of an
executor receive the pickled specification once and cache it.
"""

from __future__ import annotations

import hashlib
import inspect
import os
import pickle
import threading
import time
import warnings
from collections import OrderedDict
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ThreadPoolExecutor, wait
from contextlib import closing, contextmanager
from dataclasses import dataclass, field, fields, replace
from functools import partial
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from ..analysis_options import require_count
from ..errors import AnalysisError, FlyballError, Interrupted, ModelError, StartWarning
from ..model.messages import listing, suggest
from ..model.model import Model
from ..numerics.integrators.butcher_tableaux import TABLEAUX
from ..numerics.thread_team import available_cores
from ..progress import progress_bar
from ..results.study import DONE, FAILED, NOT_RUN, Study, load_study_file, save_study, study_fingerprint
from ..simulation.initial_state import start_time
from ..simulation.integration_options import Stepping, output_times
from ..simulation.method_choice import AUTO_METHOD as SUITABLE
from ..simulation.method_choice import SimulateOptions
from ..simulation.solver_switching import IN_MEMORY_ONLY, prepare_generated_code
from ..tables.element_numbers import unused_parameters
from .run_analyses import (
    CURVE,
    EquilibriumAnalysis,
    FunctionAnalysis,
    InstantAnalysis,
    KinematicsAnalysis,
    LinearAnalysis,
    ModesAnalysis,
    MotionAnalysis,
    RunAnalysis,
    StudyQuantity,
    ends_only,
    study_quantities,
)
from .sampling import DESIGNS, SAMPLED_DESIGNS, sample_points

# With fewer runs it is not checked whether generated code is worthwhile.
MIN_RUNS_FOR_CODE = 3


@dataclass(frozen=True)
class RunSpecification:
    """Specification of the runs of a study: the analysis with its options, and the quantities.

    ``model`` is a snapshot, ``names`` are the varied parameters, ``times`` the output times [s].
    """

    model: Model
    single: RunAnalysis
    options: Any
    names: tuple[str, ...]
    quantities: tuple[StudyQuantity, ...]
    times: np.ndarray

    def at(self, point: np.ndarray) -> Any:
        """The options of the run at a point."""
        values = dict(zip(self.names, point.tolist(), strict=True))
        return replace(self.options, parameters={**(self.options.parameters or {}), **values})

    def empty(self, n: int) -> RunResults:
        """Empty results of n runs."""
        shapes = [(n, len(self.times)) if r.how == CURVE else (n,) for r in self.quantities]
        return RunResults([np.full(s, np.nan) for s in shapes], np.zeros(n, np.int8))


@dataclass
class RunResults:
    """Results of runs: values (runs, ...) of each quantity, and the status of each run.

    By run number also the reasons of failures and doubts, and remarks.
    """

    values: list[np.ndarray]
    status: np.ndarray
    reasons: dict[int, str] = field(default_factory=dict)
    remarks: dict[int, str] = field(default_factory=dict)
    doubtful: dict[int, str] = field(default_factory=dict)
    seconds: float = 0.0  # computation time

    def take(self, at: np.ndarray, other: RunResults) -> None:
        """Store the results of some runs at the run numbers ``at``."""
        for mine, its in zip(self.values, other.values, strict=True):
            mine[at] = its
        self.status[at] = other.status
        for name in ("reasons", "remarks", "doubtful"):
            getattr(self, name).update({int(at[k]): text for k, text in getattr(other, name).items()})


def with_generated_code(question: RunSpecification, points: np.ndarray, runs: int) -> RunSpecification:
    """The specification with generated code for its mechanism, if that pays for the number of runs.

    Runs for which the code is valid use it, the others use the tables; the results are bit for bit the same.
    """
    o, model = question.options, question.model
    if runs <= MIN_RUNS_FOR_CODE or not isinstance(question.single, MotionAnalysis) or o.specialize is False:
        return question
    if model.contacts or model.bulk or o.method not in (SUITABLE, *TABLEAUX):
        return question
    # A point may fail here; its run then reports the reason.
    for k in dict.fromkeys((0, len(points) // 2, len(points) - 1)):
        try:
            first = question.single.run(model, replace(question.at(points[k]), specialize=o.specialize is True))
        except FlyballError:
            continue
        made = o.specialize is True or prepare_generated_code(first.values, first.health.evaluations, runs)
        return replace(question, options=replace(o, specialize=IN_MEMORY_ONLY if made else False))
    return question


def compute_runs(
    question: RunSpecification, points: np.ndarray, stopped: Callable[[], bool] = lambda: False
) -> RunResults:
    """Compute the runs at some points; when ``stopped`` returns true the rest stays open."""
    started = time.perf_counter()
    out = question.empty(len(points))
    for k, point in enumerate(points):
        if stopped():
            break
        _compute_run(question, point, out, k)
    out.seconds = time.perf_counter() - started
    return out


def _compute_run(question: RunSpecification, point: np.ndarray, out: RunResults, k: int) -> None:
    """Compute one run as number k; an error fails this run only, except an interrupt."""
    single = question.single
    try:
        found = single.run(question.model, question.at(point))
        for values, x in zip(out.values, single.read(found, question.quantities, question.times), strict=True):
            values[k] = x
        if doubts := single.doubtful(found):
            out.doubtful[k] = "; ".join(doubts)
        if remarks := (*single.remarks(found), *doubts):
            out.remarks[k] = "; ".join(map(str, remarks))
    except Exception as error:  # a run calls the user's functions, which may raise anything
        out.status[k], out.reasons[k] = FAILED, _failure_text(error)
        return
    out.status[k] = DONE


def _failure_text(error: Exception) -> str:
    text = str(error) or type(error).__name__
    text = text.replace("about=m.equilibrium()", "about='equilibrium'")  # the form that studies accept
    return text if isinstance(error, FlyballError) else f"{type(error).__name__}: {text}"


MAX_CACHED_SPECIFICATIONS = 4  # specifications cached in a worker process


def pickled_specification(question: RunSpecification, runs: int) -> tuple[str, bytes]:
    """Pickle the specification for other processes that compute so many runs: (key, bytes).

    Raises
    ------
    ModelError
        If it contains something that cannot be pickled.
    """
    try:
        data = pickle.dumps((question, runs))
    except Exception as pickling:  # the user's objects may raise anything
        data = _pickled_by_value((question, runs), pickling)
    return hashlib.sha256(data).hexdigest(), data


def _pickled_by_value(question: tuple[RunSpecification, int], pickling: Exception) -> bytes:
    """Pickle functions without a module name, too, if cloudpickle (part of Dask) is installed."""
    try:
        import cloudpickle
    except ImportError:
        raise ModelError(
            f"the study cannot be sent to another process ({pickling}): define its functions in a module that workers "
            f"can import, or leave executor out"
        ) from None
    return cloudpickle.dumps(question)


_CACHE: OrderedDict[str, RunSpecification] = OrderedDict()
_CACHE_LOCK = threading.Lock()


def compute_remotely(key: str, data: bytes, points: np.ndarray) -> RunResults:
    """Compute some runs in another process, which caches the specification."""
    with _CACHE_LOCK:
        question = _CACHE.get(key)
    if question is None:
        question, runs = pickle.loads(data)
        with _without_start_warnings():
            question = with_generated_code(replace(question, model=question.model.snapshot()), points, runs)
        with _CACHE_LOCK:
            _CACHE[key] = question
            while len(_CACHE) > MAX_CACHED_SPECIFICATIONS:
                _CACHE.popitem(last=False)
    with _without_start_warnings():
        return compute_runs(question, points)


@contextmanager
def _without_start_warnings() -> Iterator[None]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", StartWarning)  # the remarks contain it
        yield


MAX_TASK_RUNS, FIRST_TASK_RUNS, TASKS_PER_STUDY = (
    512,
    8,
    64,
    # Largest number of runs per task, number in the first tasks, and number of tasks that a study is split into.
)
TASK_SECONDS = 0.5  # target duration of a task
LAST_TASK_DIVISOR = (
    10  # part of that which the last ones take at least: to read and judge runs has a price for each task
)
MAX_TASK_STATES = 100_000  # largest number of states in memory per task
QUEUED_TASKS_PER_WORKER = 4  # queued tasks per worker
Task = Callable[[np.ndarray], "Future[RunResults]"]


def results_as_completed(
    question: RunSpecification, points: np.ndarray, todo: np.ndarray, executor: Executor | None, threads: int
) -> Generator[tuple[np.ndarray, RunResults], None, None]:
    """Yield (run numbers, results) in the order of completion.

    When the consumer stops or is interrupted, runs that have not started are cancelled.
    """
    size, at = max(1, min(FIRST_TASK_RUNS, len(todo) // TASKS_PER_STUDY)), 0
    most = max(1, min(MAX_TASK_RUNS, MAX_TASK_STATES // len(question.times)))
    with _task_submitter(question, points[todo], executor, threads) as (submit, workers):
        waiting: dict[Future[RunResults], np.ndarray] = {}
        try:
            while at < len(todo) or waiting:
                while at < len(todo) and len(waiting) < QUEUED_TASKS_PER_WORKER * workers:
                    left = len(todo) - at
                    part = todo[at : at + max(1, size // LAST_TASK_DIVISOR, min(size, left // (2 * workers)))]
                    waiting[submit(points[part])] = part
                    at += len(part)
                for part, found in _completed_tasks(waiting):
                    size = max(1, min(most, int(TASK_SECONDS * len(part) / max(found.seconds, 1e-6))))
                    yield part, found
        finally:
            for future in waiting:
                future.cancel()


def _completed_tasks(waiting: dict[Future[RunResults], np.ndarray]) -> Iterator[tuple[np.ndarray, RunResults]]:
    ready, _ = wait(waiting, return_when=FIRST_COMPLETED)
    for future in ready:
        yield waiting.pop(future), future.result()


@contextmanager
def _task_submitter(
    question: RunSpecification, points: np.ndarray, executor: Executor | None, threads: int
) -> Iterator[tuple[Task, int]]:
    """Context manager for (function that submits some runs, number of workers)."""
    if executor is not None:
        key, data = pickled_specification(question, len(points))
        yield (
            lambda some: executor.submit(compute_remotely, key, data, some),
            max(available_cores(), getattr(executor, "_max_workers", 0)),
        )
        return
    stop, run = threading.Event(), partial(compute_runs, with_generated_code(question, points, len(points)))
    pool = ThreadPoolExecutor(threads, thread_name_prefix="flyball study")
    try:
        yield lambda some: pool.submit(run, some, stop.is_set), threads
    finally:
        stop.set()  # running runs finish, others do not start
        pool.shutdown(cancel_futures=True)


SAVE_INTERVAL = 20.0  # seconds between two writes of the file
# Default number of output times if quantities need the motion between its ends.
DEFAULT_OUTPUTS = 501
# Default number otherwise: enough for the energy balance.
ENERGY_OUTPUTS = 17
ANALYSES = {
    x.title: x
    for x in (
        MotionAnalysis(),
        KinematicsAnalysis(),
        InstantAnalysis(),
        EquilibriumAnalysis(),
        ModesAnalysis(),
        LinearAnalysis(),
    )
}
COMMON_OPTIONS = ("vary", "of", "analysis", "parameters", "design", "samples", "seed", "file", "executor", "threads",
               "progress")  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class StudyOptions(SimulateOptions):
    """Arguments of `Mechanism.study`."""

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
        if self.design in SAMPLED_DESIGNS:
            require_count(self.samples, f"samples, which design={self.design!r} needs,")
        for name in ("samples", "seed") if self.design not in SAMPLED_DESIGNS else ():
            if getattr(self, name) is not None:
                raise ModelError(f"{name}={getattr(self, name)!r} does nothing with design={self.design!r}")
        if self.seed is not None:
            require_count(self.seed, "seed", 0)
        if self.threads is not None:
            require_count(self.threads, "threads")
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
    def single(self) -> RunAnalysis:
        """The analysis of each run."""
        return FunctionAnalysis(self.analysis) if callable(self.analysis) else ANALYSES[self.analysis]

    def refuse_idle(self, model: Model) -> None:
        """Refuse options that the analysis does not have, if they differ from their defaults."""
        usual = inspect.signature(type(model).study).parameters  # type: ignore[attr-defined]
        for f in fields(self):
            if f.name in (*COMMON_OPTIONS, *self.single.takes):
                continue
            if getattr(self, f.name) != usual[f.name].default:
                raise ModelError(f"{f.name} does nothing with analysis={self.single.title!r}; leave it out")
        if isinstance(self.method, Stepping) and self.method.history is not None:
            raise ModelError(f"a study keeps no contacts, so history={self.method.history!r} of Stepping does nothing")

    def question(self, model: Model) -> RunSpecification:
        """The specification of the runs."""
        single = self.single
        single.refuse(model)
        if (
            not callable(self.analysis)
            and not isinstance(self.of, Mapping)
            and (idle := unused_parameters(model, [*self.vary]))
        ):
            raise ModelError(
                f"vary {idle[0]!r}: nothing of {model.name!r} depends on it, and all runs would be the same"
            )
        asked = study_quantities(self.of, partial(single.named, model))
        times = np.array([self.t or 0.0])
        if single.timed:
            end = float(self.t_end or 0.0)
            outputs = (
                self.outputs if self.outputs is not None else ENERGY_OUTPUTS if ends_only(asked) else DEFAULT_OUTPUTS
            )
            times = output_times(start_time(self.t_start, self.start), end, outputs)
        known = {f.name: getattr(self, f.name) for f in fields(self)}
        return RunSpecification(model, single, single.options(known, times, asked), tuple(self.vary), asked, times)


def study(model: Model, o: StudyOptions) -> Study:
    """Analyse a model at many values of its parameters: see `Mechanism.study`."""
    started = time.perf_counter()
    model = model.snapshot()
    x, axes = sample_points(model, o.vary, o.design, o.samples, o.seed)
    o.refuse_idle(model)
    question = o.question(model)
    model.environment(o.parameters)
    mark = "" if o.file is None else _study_fingerprint(question, x)
    there = o.file is not None and Path(o.file).exists()
    found = (
        load_study_file(Path(o.file), mark)
        if o.file is not None and there
        else _blank_study(question, o, x, axes, mark)
    )
    if found.analysis == "motion":
        found.start, found.options["method"] = o.start, o.method
    with progress_bar(o.progress, "studying") as tell, warnings.catch_warnings():
        warnings.simplefilter("ignore", StartWarning)  # the remarks of the runs contain it
        _compute_missing(question, found, o, tell)
    found.seconds += time.perf_counter() - started
    if o.file is not None:
        save_study(found, o.file)
    if not found.complete:
        missing = int((found.status == NOT_RUN).sum())
        raise Interrupted(f"the study was {found.message}; {missing} of {len(found)} runs are missing", found)
    return found


def _study_fingerprint(question: RunSpecification, points: np.ndarray) -> str:
    """Fingerprint that identifies the study."""
    o, asked = question.options, [(r.title, r.function) for r in question.quantities]
    known = {f.name: getattr(o, f.name) for f in fields(o)} | {"analysis": question.single.title}
    own = getattr(question.single, "function", None)
    return study_fingerprint(
        question.model, points, known, asked + [("analysis", own)] * (own is not None), question.times
    )


def _blank_study(
    question: RunSpecification, o: StudyOptions, x: np.ndarray, axes: tuple[np.ndarray, ...], mark: str
) -> Study:
    """A study without results."""
    env = question.model.environment(o.parameters)
    blank = question.empty(len(x))
    return Study(
        name=question.model.name,
        design=o.design,
        parameters=question.names,
        points=x,
        axes=axes,
        of=tuple(r.title for r in question.quantities),
        units=tuple(r.unit for r in question.quantities),
        t=question.times,
        values=dict(zip((r.title for r in question.quantities), blank.values, strict=True)),
        status=blank.status,
        options=_option_values(question.options),
        base={name: env[name] for name in question.names},
        mark=mark,
        analysis=question.single.title,
    )


def _option_values(o: Any) -> dict[str, Any]:
    """Options of the analysis, except those of the study itself."""
    told = {f.name: getattr(o, f.name) for f in fields(o) if f.name not in ("outputs", "times", "progress", "start")}
    return told | {"parameters": dict(o.parameters or {})}


def _compute_missing(question: RunSpecification, found: Study, o: StudyOptions, report_progress: Any) -> None:
    """Compute the missing runs; an interrupt keeps the results so far.

    Raises
    ------
    AnalysisError
        If the executor fails; the file contains the results so far.
    """
    todo = np.flatnonzero(found.status == NOT_RUN)
    if not len(todo):
        return
    answers = question.empty(0)
    answers.values, answers.status = list(found.values.values()), found.status
    answers.reasons, answers.remarks, answers.doubtful = found.reasons, found.remarks, found.doubtful
    total, saved = len(found.points), time.monotonic()
    try:
        with closing(
            results_as_completed(question, found.points, todo, o.executor, o.threads or available_cores())
        ) as parts:
            for at, part in parts:
                answers.take(at, part)
                report_progress(
                    float((found.status != NOT_RUN).sum()) / total,
                    f"{int((found.status != NOT_RUN).sum())} of {total} runs",
                )
                if o.file is not None and time.monotonic() - saved > SAVE_INTERVAL:
                    save_study(found, o.file)
                    saved = time.monotonic()
    except KeyboardInterrupt:
        found.message = "interrupted by the user; the completed runs are kept"
    except FlyballError:
        raise
    except Exception as error:  # of the user's executor
        if o.file is not None:
            save_study(found, o.file)
        kept = (
            f"; the completed runs are in {o.file}, and the same call continues from it" if o.file is not None else ""
        )
        raise AnalysisError(f"the study cannot continue ({type(error).__name__}: {error}){kept}") from error
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
    found = load_study_file(path)
    if isinstance(found.options.get("method"), dict):
        found.options["method"] = Stepping(**found.options["method"])
    return found
