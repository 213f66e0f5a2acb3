"""Word of the first compilation, on a terminal."""

from __future__ import annotations

import sys
import warnings

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
    from ..equations.residual import stepped

    return {"motion_kernel": engine, "residual_kernel": stepped}[name].cold  # type: ignore[attr-defined]
