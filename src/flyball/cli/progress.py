"""Progress on a terminal: a bar, and word of the first compilation."""

from __future__ import annotations

import sys
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import typer

from ..errors import PerformanceNotice

KERNELS = {  # what to say before they are compiled
    "motion_kernel": "compiling for this machine, once: about half a minute",
    "residual_kernel": "compiling the derivatives of the equations for this machine, once: about a quarter of a minute",
}


def announce_compiling(talk: bool, *kernels: str) -> None:
    """On a terminal, say that the first use takes long, if it is the first use of kernels: the motion's by default.

    The analyses' own notices, which are for those who call them from Python, are then not needed.
    """
    warnings.filterwarnings("ignore", "compiling ", PerformanceNotice)
    for name in kernels or ("motion_kernel",):
        if talk and sys.stderr.isatty() and _will_compile(name):
            typer.echo(KERNELS[name], err=True)


def _will_compile(name: str) -> bool:
    from ..equations.engine import engine
    from ..equations.residual import residual_kernel

    return {"motion_kernel": engine, "residual_kernel": residual_kernel}[name].cold  # type: ignore[attr-defined]


@contextmanager
def progress_bar(talk: bool) -> Iterator[Callable[[float], None] | None]:
    """A progress bar on a terminal, once the run has taken a second; else nothing."""
    if not (talk and sys.stderr.isatty()):
        yield None
        return
    announce_compiling(talk)
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn("simulating"), BarColumn(), TextColumn("{task.percentage:>3.0f} %"), TimeRemainingColumn())
    bar = Progress(*columns, console=Console(stderr=True), transient=True)
    task = bar.add_task("", total=1.0)
    begin: list[float] = []

    def progress(fraction: float) -> None:
        if not begin:
            begin.append(time.monotonic())
        if not bar.live.is_started and time.monotonic() - begin[0] > 1.0:
            bar.start()
        bar.update(task, completed=fraction)

    try:
        yield progress
    finally:
        if bar.live.is_started:
            bar.stop()
