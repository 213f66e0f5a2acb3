"""Runs in other processes: what is sent there, and what they keep of it."""

from __future__ import annotations

import hashlib
import pickle
import threading
import warnings
from collections import OrderedDict
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

import numpy as np

from ...errors import ModelError, StartWarning
from .compute import Answers, Question, compute, prepared

HELD = 4  # questions that a worker process keeps


def packed(question: Question, runs: int) -> tuple[str, bytes]:
    """For other processes, which compute so many runs together: bytes, and what they are known by.

    Raises
    ------
    ModelError
        If it holds something that cannot be sent.
    """
    try:
        data = pickle.dumps((question, runs))
    except Exception as pickling:
        data = _by_value((question, runs), pickling)
    return hashlib.sha256(data).hexdigest(), data


def _by_value(question: tuple[Question, int], pickling: Exception) -> bytes:
    """With functions that have no name in a module, if what Dask brings for that is there."""
    try:
        import cloudpickle
    except ImportError:
        raise ModelError(
            f"the study cannot be sent to another process ({pickling}): define its functions in a module that workers "
            f"can import, or leave executor out"
        ) from None
    return cloudpickle.dumps(question)


_HELD: OrderedDict[str, Question] = OrderedDict()
_LOCK = threading.Lock()


def elsewhere(key: str, data: bytes, points: np.ndarray) -> Answers:
    """Some runs in another process, which keeps what it made ready for the runs before."""
    with _LOCK:
        question = _HELD.get(key)
    if question is None:
        question, runs = pickle.loads(data)
        with _quiet():
            question = prepared(replace(question, model=question.model.snapshot()), points, runs)
        with _LOCK:
            _HELD[key] = question
            while len(_HELD) > HELD:
                _HELD.popitem(last=False)
    with _quiet():
        return compute(question, points)


@contextmanager
def _quiet() -> Iterator[None]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", StartWarning)  # remarks say it
        yield
