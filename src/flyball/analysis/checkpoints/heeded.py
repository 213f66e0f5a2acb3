"""The user's interrupt of a motion that is kept on the way."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from ..motion.part import Part


@contextmanager
def heeded(part: Part) -> Iterator[None]:
    """Have an interrupt end a part that was long computed where it is, in order; a second one, or before, at once.

    Where something else handles interrupts, or in another thread than the first, nothing is changed.
    """
    in_main = threading.current_thread() is threading.main_thread()
    if not in_main or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield
        return

    def asked(number: int, frame: Any) -> None:
        if not part.interrupted():
            signal.default_int_handler(number, frame)

    signal.signal(signal.SIGINT, asked)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)
