"""Progress of an analysis: a bar on a terminal or in a notebook, shown after two seconds."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from typing import Any, Protocol

AFTER = 2.0  # seconds before there is a bar
EVERY = 0.1  # seconds between two states of it


class ReportProgress(Protocol):
    """Takes the fraction done, and what else there is to say."""

    def __call__(self, fraction: float, note: str = "") -> None:
        """Tell."""


def progress_bar(wish: bool | Callable[[float], None], what: str) -> AbstractContextManager[ReportProgress]:
    """What an analysis tells how far it is: ``wish`` is a function, or whether there may be a bar.

    Nothing is written but to a terminal or a notebook. The bar has no thread of its own and is gone when the analysis
    ends, also by an error or an interrupt.
    """
    if callable(wish):
        return nullcontext(lambda fraction, note="": wish(fraction))
    return _DelayedBar(what) if wish else nullcontext(no_progress)


def no_progress(fraction: float, note: str = "") -> None:
    """Nobody looks."""


def _bar_type() -> Callable[[str], Any] | None:
    """What makes a bar where somebody sees it, or None."""
    ask = getattr(sys.modules.get("IPython"), "get_ipython", None)
    if ask is not None and getattr(ask(), "kernel", None) is not None:
        return _NotebookBar
    return _Terminal if sys.stderr is not None and sys.stderr.isatty() else None


class _DelayedBar:
    """A bar that comes late and is drawn seldom; only then it is asked whether somebody sees it."""

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
    """A line of a terminal, by rich; refreshed by hand, so that no thread runs beside compiled code."""

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
    """A bar below the cell of a notebook; it needs no widgets."""

    def __init__(self, what: str) -> None:
        from IPython import display

        self.what, self.html = what, display.HTML
        self.handle = display.display(self.html(""), display_id=True)

    def draw(self, fraction: float, note: str) -> None:
        bar = f'<progress max="1" value="{fraction:.3f}"></progress> {100 * fraction:.0f} %'
        self.handle.update(self.html(f"{self.what} {bar} {note}"))

    def end(self) -> None:
        self.handle.update(self.html(""))
