"""Progress of an analysis: a bar on a terminal or in a notebook, shown after two seconds."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from typing import Any, Protocol

AFTER = 2.0  # delay before a bar is shown [s]
EVERY = 0.1  # interval between two updates of the bar [s]


class ReportProgress(Protocol):
    """Callback that takes the completed fraction and an optional note."""

    def __call__(self, fraction: float, note: str = "") -> None:
        """Report progress."""


def progress_bar(wish: bool | Callable[[float], None], what: str) -> AbstractContextManager[ReportProgress]:
    """Context manager that yields a progress callback; ``wish`` is such a function, or whether a bar may be shown.

    Output is only written to a terminal or a notebook. The bar has no thread of its own and is removed when the
    analysis ends, also by an error or an interrupt.
    """
    if callable(wish):
        return nullcontext(lambda fraction, note="": wish(fraction))
    return _DelayedBar(what) if wish else nullcontext(no_progress)


def no_progress(fraction: float, note: str = "") -> None:
    """Discard progress reports."""


def _bar_type() -> Callable[[str], Any] | None:
    """Return the type of bar for the current output, or None if there is no terminal or notebook."""
    ask = getattr(sys.modules.get("IPython"), "get_ipython", None)
    if ask is not None and getattr(ask(), "kernel", None) is not None:
        return _NotebookBar
    return _Terminal if sys.stderr is not None and sys.stderr.isatty() else None


class _DelayedBar:
    """A bar that appears after a delay and is updated rarely; only then the type of output is determined."""

    def __init__(self, what: str) -> None:
        self.what, self.drawn, self.unseen = what, None, False
        self.begin = self.last = time.monotonic()

    def __enter__(self) -> ReportProgress:
        return self

    def __call__(self, fraction: float, note: str = "") -> None:
        now = time.monotonic()
        if now - self.begin < AFTER or now - self.last < EVERY or (self.drawn is None and fraction >= 1.0):
            return
        self.last = now
        if self.drawn is None and not self.unseen:
            make = _bar_type()
            self.drawn, self.unseen = make and make(self.what), make is None
        if self.drawn is not None:
            self.drawn.draw(min(max(fraction, 0.0), 1.0), note)

    def __exit__(self, *_: object) -> None:
        if self.drawn is not None:
            self.drawn.end()


class _Terminal:
    """A line on a terminal, drawn by rich; refreshed explicitly, so that no thread runs beside compiled code."""

    def __init__(self, what: str) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

        percent = TextColumn("{task.percentage:>3.0f} %")
        columns = (TextColumn("{task.description}"), BarColumn(), percent, TimeRemainingColumn(),
                   TextColumn("{task.fields[note]}"))  # fmt: skip
        self.bar = Progress(*columns, console=Console(file=sys.stderr), transient=True, auto_refresh=False)
        self.task = self.bar.add_task(what, total=1.0, note="")
        self.bar.start()

    def draw(self, fraction: float, note: str) -> None:
        self.bar.update(self.task, completed=fraction, note=note)
        self.bar.refresh()

    def end(self) -> None:
        self.bar.stop()


class _NotebookBar:
    """A bar below the notebook cell; it needs no widgets."""

    def __init__(self, what: str) -> None:
        from IPython import display

        self.what, self.html = what, display.HTML
        self.handle = display.display(self.html(""), display_id=True)

    def draw(self, fraction: float, note: str) -> None:
        bar = f'<progress max="1" value="{fraction:.3f}"></progress> {100 * fraction:.0f} %'
        self.handle.update(self.html(f"{self.what} {bar} {note}"))

    def end(self) -> None:
        self.handle.update(self.html(""))
