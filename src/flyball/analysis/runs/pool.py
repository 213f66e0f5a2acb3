"""Who computes the runs of a study: threads of this process, or an executor."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Generator, Iterator
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ThreadPoolExecutor, wait
from contextlib import contextmanager
from functools import partial

import numpy as np

from .compute import Answers, Question, compute, prepared
from .remote import elsewhere, packed

LONG, FIRST, PARTS = 512, 8, 64  # most runs in a task; in the first ones; into how many these divide a study
SECONDS = 0.5  # that a task should take
TAIL = 10  # part of that which the last ones take at least: to read and judge runs has a price for each task
TIMES = 100_000  # states that a task keeps at most
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
    size, at = max(1, min(FIRST, len(todo) // PARTS)), 0
    most = max(1, min(LONG, TIMES // len(question.times)))
    with _submitting(question, points[todo], executor, threads) as (submit, workers):
        waiting: dict[Future[Answers], np.ndarray] = {}
        try:
            while at < len(todo) or waiting:
                while at < len(todo) and len(waiting) < AHEAD * workers:
                    left = len(todo) - at
                    part = todo[at : at + max(1, size // TAIL, min(size, left // (2 * workers)))]
                    waiting[submit(points[part])] = part
                    at += len(part)
                for part, found in _done(waiting):
                    size = max(1, min(most, int(SECONDS * len(part) / max(found.seconds, 1e-6))))
                    yield part, found
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
    """(what computes some runs, how many workers there are)."""
    if executor is not None:
        key, data = packed(question, len(points))
        yield (
            lambda some: executor.submit(elsewhere, key, data, some),
            max(cores(), getattr(executor, "_max_workers", 0)),
        )
        return
    stop, run = threading.Event(), partial(compute, prepared(question, points, len(points)))
    pool = ThreadPoolExecutor(threads, thread_name_prefix="flyball study")
    try:
        yield lambda some: pool.submit(run, some, stop.is_set), threads
    finally:
        stop.set()  # runs that go on end, others do not begin
        pool.shutdown(cancel_futures=True)
