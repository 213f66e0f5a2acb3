"""Checkpoints: a motion that is saved to a file while it runs, segment by segment, and can be resumed from there.

A segment starts from the stored result of the segment before it and from nothing else: factorizations and starting
values of solvers are computed anew. A motion that was interrupted or killed and is then resumed from its file
therefore equals the uninterrupted motion to the last digit.
"""

from __future__ import annotations

import os
import signal
import threading
import time
import uuid
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import FlyballError, Interrupted, ModelError, SimulationError
from ..model.model import Model
from ..progress import ReportProgress, progress_bar
from ..results import diagnostics
from ..results.files import save
from ..results.motion_record import record_motion
from ..results.result import Result, concatenate_results
from ..results.result_loading import read_result
from ..results.study import study_fingerprint
from .initial_state import start_time
from .integration_intervals import Segment
from .integration_options import output_times
from .method_choice import AUTO_METHOD as ANY
from .method_choice import MethodChoice, SimulateOptions, choose_method, is_unresolved, reason_for_impulses
from .motion_result import motion_judgements
from .simulate import Span, simulate, simulate_with_reason


@dataclass(frozen=True, kw_only=True)
class CheckpointOptions(SimulateOptions):
    """Arguments of `Mechanism.simulate`."""

    checkpoint: str | os.PathLike | None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.checkpoint is not None and not isinstance(self.checkpoint, (str, os.PathLike)):
            raise ModelError(f"checkpoint is the path of a file, not {self.checkpoint!r}")


def simulate_with_checkpoints(model: Model, o: CheckpointOptions) -> Result:
    """Simulate; save the motion to a file while it runs if ``checkpoint`` is given."""
    return simulate(model, o) if o.checkpoint is None else _simulated_with_checkpoints(model, o)


def _simulated_with_checkpoints(model: Model, o: CheckpointOptions) -> Result:
    assert o.checkpoint is not None
    cls, model = type(model), model.snapshot()
    t_start = start_time(o.t_start, o.start)
    span = (t_start, o.t_end, output_times(t_start, o.t_end, o.outputs))
    way = choose_method(model, o)
    kept = CheckpointFile(Path(o.checkpoint), _motion_fingerprint(model, o, span), span[2])
    if not kept.path.absolute().parent.is_dir():
        raise ModelError(f"checkpoint={os.fspath(o.checkpoint)!r}: there is no such folder")
    if kept.read(cls):
        return kept.parts[-1]
    with progress_bar(o.progress, "simulating") as tell:
        return _SegmentedMotion(model, way, span, kept, tell, o.method == ANY).all()


def _motion_fingerprint(model: Model, o: CheckpointOptions, span: Span) -> str:
    known = {f.name: getattr(o, f.name) for f in fields(SimulateOptions)}
    try:
        return study_fingerprint(model, np.array(span[:2]), known, (), span[2])
    except ModelError as error:
        raise ModelError(f"checkpoint: the motion cannot be kept in a file: {error}") from None


class _SegmentedMotion:
    """A motion computed segment by segment."""

    def __init__(
        self, model: Model, way: MethodChoice, span: Span, file: CheckpointFile, report: ReportProgress, auto: bool
    ) -> None:
        self.model, self.way, self.span, self.kept, self.tell = model, way, span, file, report
        self.auto = auto

    def all(self) -> Result:
        """Compute the motion to its end."""
        kept, way = self.kept, self.way
        options, why = (way.instead, kept.by) if kept.by and way.instead is not None else (way.options, way.why)
        try:
            return self._through(options, why)
        except (ModelError, SimulationError) as error:
            if way.instead is None or options is way.instead or not is_unresolved(error):
                raise
            kept.restart(reason_for_impulses(error))
            try:
                return self._through(way.instead, kept.by)
            except FlyballError:
                raise error from None

    def _through(self, o: SimulateOptions, why: str) -> Result:
        """Compute the motion to its end by the given method."""
        kept = self.kept
        while True:
            try:
                found, part = self._part(o, why)
            except SimulationError as error:
                kept.write()
                if isinstance(error.result, Result):
                    error.result = kept.whole(error.result)
                raise
            except Interrupted as error:
                raise self._interrupted(kept.whole(error.result)) from None
            if not part.paused:
                break
            kept.add(found)
            if part.asked:
                result = kept.whole()
                from .impulse_stepping.impulse_simulation import INTERRUPTED_MESSAGE

                result.health.message = INTERRUPTED_MESSAGE.format(result.final[0])
                raise self._interrupted(result)
        result = kept.whole(found)
        kept.finish(result)
        return result

    def _interrupted(self, result: Result) -> Interrupted:
        """Return the exception for the user's interrupt; the motion can be resumed where the last segment ended."""
        kept = self.kept
        kept.write()
        result.health.message += (
            f"; {kept.path} contains it to t = {kept.parts[-1].final[0]:.6g} s; the same call continues from there"
            if kept.parts
            else f"; no segment of it had ended, so {kept.path} contains nothing: the same call starts again"
        )
        return Interrupted(result.health.message, result)

    def _part(self, o: SimulateOptions, why: str) -> tuple[Result, Segment]:
        """Compute the next segment. Returns its motion and the segment's state."""
        first, last, times = self.span
        before = self.kept.parts[-1] if self.kept.parts else None
        t = first if before is None else before.final[0]
        part = Segment(first, resumes=before is not None)

        def report_part(fraction: float) -> None:
            try:
                self.tell((t + fraction * (last - t) - first) / (last - first))
            except KeyboardInterrupt:
                if not part.interrupted():
                    raise

        changed: Mapping[str, Any] = {"progress": report_part}
        if before is not None:
            changed = {**changed, "start": before, "t_start": None}
            times = times[times >= t] if before.carried.get("open") else times[times > t]
        with deferred_interrupt(part):
            return simulate_with_reason(self.model, o.known(**changed), (t, last, times), why, self.auto, part), part


# Keyboard interrupts of a motion with checkpoints.


@contextmanager
def deferred_interrupt(part: Segment) -> Iterator[None]:
    """Let a keyboard interrupt end a long segment in order, at its present time.

    A second interrupt, or one of a segment that has run only briefly, raises at once. Where another handler is
    installed, or outside the main thread, nothing is changed.
    """
    in_main = threading.current_thread() is threading.main_thread()
    if not in_main or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield
        return

    def on_interrupt(number: int, frame: Any) -> None:
        if not part.interrupted():
            signal.default_int_handler(number, frame)

    signal.signal(signal.SIGINT, on_interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)


# Files of a motion with checkpoints: one result file, and segment files with what was computed since it was written.
#
# Every file that exists is complete: it is written under another name and then renamed. The first file is rewritten
# once the segment files hold as much as it does. In total about three times the size of the result is written. A write
# covers only what was computed since the last one, except when the first file is rewritten.


EVERY = 20.0  # least time between two writes [s]
MOST_FILES = 60  # largest number of segment files
CHECKPOINT_KEY = "checkpoint"  # in `Result.carried`
REMEDY = "give another file, or remove that one"


class CheckpointFile:
    """Segments of a motion and the files that store them.

    Parameters
    ----------
    path : Path
    mark : str
        Fingerprint of the motion.
    times : ndarray [s]
        Output times of the whole motion.

    Attributes
    ----------
    parts : list of Result
        Segments computed so far; several that are already written may be joined to one.
    by : str
        Why impulse time stepping replaced the integration; empty if it did not.
    """

    def __init__(self, path: Path, mark: str, times: np.ndarray) -> None:
        self.path, self.mark, self.times = path, mark, times
        self.parts: list[Result] = []
        self.by = ""
        self._run, self._count, self._written = uuid.uuid4().hex, 0, 0  # number of segments, and of those in files
        self._first = self._rows_beside = 0  # output times in the first file, and in the segment files
        self._files: list[Path] = []
        self._last = time.monotonic()

    def read(self, cls: type[Model]) -> bool:
        """Read the files. Returns whether they hold the whole motion.

        Raises
        ------
        ModelError
            If the file is something else, damaged, or of another motion.
        """
        if not self.path.exists():
            return False
        found = read_result(self.path, cls)
        told = found.carried.get(CHECKPOINT_KEY)
        if told is None:
            raise ModelError(f"{self.path} is a result, but not one that was kept with checkpoint=; {REMEDY}")
        if told["mark"] != self.mark:
            raise ModelError(
                f"{self.path} is of another motion than this: model, values, options or the version of flyball are "
                f"not the same. To continue from its end give start=fb.load_result(...); else {REMEDY}"
            )
        self._run, self._count, self.by = told["run"], told["parts"], told["by"]
        self.parts, self._first = [found], len(found.t)
        while (path := self._place(self._count + 1)).exists():
            more = read_result(path, cls)
            told = more.carried.get(CHECKPOINT_KEY, {})
            if told.get("run") != self._run:
                break
            self.parts.append(more)
            self._files.append(path)
            self._count, self._rows_beside = told["parts"], self._rows_beside + len(more.t)
        self._written = len(self.parts)
        return bool(self.parts[-1].carried[CHECKPOINT_KEY]["done"])

    def add(self, part: Result) -> None:
        """Add a segment; write it if a write is due."""
        self.parts.append(part)
        self._count += 1
        if time.monotonic() - self._last > EVERY:
            self.write()

    def restart(self, by: str) -> None:
        """Discard all segments; the motion starts again by another method, for the reason ``by``."""
        self.parts, self.by, self._run = [], by, uuid.uuid4().hex
        self._count = self._written = self._first = self._rows_beside = 0
        self._remove_segment_files()

    def write(self) -> None:
        """Write the segments that are not in files yet."""
        new = self.parts[self._written :]
        if not new:
            return
        rows = sum(len(p.t) for p in new)
        if self._rows_beside + rows >= self._first or len(self._files) >= MOST_FILES:
            self.parts = [self._joined(self.parts)]
            self._save(self.path, self.parts[0])
            self._remove_segment_files()
            self._first, self._rows_beside = len(self.parts[0].t), 0
        else:
            self.parts[self._written :] = [self._joined(new)]
            place = self._place(self._count - len(new) + 1)
            self._save(place, self.parts[-1])
            self._files.append(place)
            self._rows_beside += rows
        self._written, self._last = len(self.parts), time.monotonic()

    def whole(self, *last: Result) -> Result:
        """Return all segments joined with the one computed last."""
        return self._joined([*self.parts, *last])

    def finish(self, result: Result) -> None:
        """Write the whole motion to one file that other programs can read, and remove the segment files."""
        self._save(self.path, result, done=True)
        self._remove_segment_files()

    def _joined(self, parts: Sequence[Result]) -> Result:
        return with_joined_health(concatenate_results(parts, self.times), parts)

    def _save(self, path: Path, result: Result, done: bool = False) -> None:
        result.carried[CHECKPOINT_KEY] = {
            "mark": self.mark, "run": self._run, "parts": self._count, "by": self.by, "done": done
        }  # fmt: skip
        save(result, path, with_labelled=done)

    def _place(self, part: int) -> Path:
        return self.path.with_name(f"{self.path.name}.{part}")

    def _remove_segment_files(self) -> None:
        """Remove the segment files, including those of an earlier motion."""
        for path in self.path.parent.glob(f"{self.path.name}.*"):
            if path.name.removeprefix(f"{self.path.name}.").isdigit():
                path.unlink(missing_ok=True)
        self._files = []


def with_joined_health(result: Result, parts: Sequence[Result]) -> Result:
    """Return ``result`` (the joined segments) with a health report that covers all segments."""
    if len(parts) == 1:
        return result
    health = result.health
    impulses = isinstance(health.options.get("method"), Mapping)
    result.record = record_motion(result, accelerations=not impulses)
    judgements = diagnostics.impulse_judgements if impulses else motion_judgements
    health.late = judgements(result, parts[0].health.late["mobility"])
    return result
