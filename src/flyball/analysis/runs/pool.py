"""Who computes the runs of a study: threads of this process, or an executor."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Generator, Iterator
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ThreadPoolExecutor, wait
from contextlib import contextmanager

import numpy as np

from .compute import Answers, Question
from .remote import elsewhere, packed
from .runner import runner

LONG, PARTS = 256, 64  # most runs in a task, and tasks that a study has at least if it has that many runs
AHEAD = 4  # tasks that wait, for each worker that there may be
Task = Callable[[np.ndarray], "Future[Answers]"]


def cores() -> int:
    """How many this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not on every system
        return os.cpu_count() or 1


def computed(
    question: Question, points: np.ndarray, todo: np.ndarray, executor: Executor | None, threads: int
) -> Generator[tuple[np.ndarray, Answers], None, None]:
    """(numbers of runs, their answers), in the order in which they are done.

    When the consumer stops, or is interrupted, runs that have not begun are given up.
    """
    size = max(1, min(LONG, len(todo) // PARTS))
    parts = [todo[k : k + size] for k in range(0, len(todo), size)]
    with _submitting(question, points[todo], executor, threads) as (submit, most):
        waiting: dict[Future[Answers], np.ndarray] = {}
        try:
            for part in parts:
                waiting[submit(points[part])] = part
                while len(waiting) >= most:
                    yield from _done(waiting)
            while waiting:
                yield from _done(waiting)
        finally:
            for future in waiting:
                future.cancel()


def _done(waiting: dict[Future[Answers], np.ndarray]) -> Iterator[tuple[np.ndarray, Answers]]:
    ready, _ = wait(waiting, return_when=FIRST_COMPLETED)
    for future in ready:
        yield waiting.pop(future), future.result()


@contextmanager
def _submitting(
    question: Question, points: np.ndarray, executor: Executor | None, threads: int
) -> Iterator[tuple[Task, int]]:
    """(what computes some runs, how many such tasks may wait)."""
    if executor is not None:
        key, data = packed(question)
        yield (
            lambda some: executor.submit(elsewhere, key, data, some),
            AHEAD * max(cores(), getattr(executor, "_max_workers", 0)),
        )
        return
    stop, run = threading.Event(), runner(question, points)
    pool = ThreadPoolExecutor(threads, thread_name_prefix="flyball study")
    try:
        yield lambda some: pool.submit(run, some, stop.is_set), AHEAD * threads
    finally:
        stop.set()  # runs that go on end, others do not begin
        pool.shutdown(cancel_futures=True)
