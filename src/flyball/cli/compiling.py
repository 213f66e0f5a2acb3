"""Word of the first compilation, as a line of its own."""

from __future__ import annotations

import warnings
from typing import Any

import typer

from ..errors import PerformanceNotice

DERIVATIVES = "compiling the derivatives of the equations for this machine, once: about a quarter of a minute"


def announce_compiling(talk: bool, *kernels: str) -> None:
    """Say that the first use takes long, if it is the first use of kernels: the motion's by default.

    Notices of the analyses, which know better what they need, are printed as they come; without ``talk`` none is.
    """
    if not talk:
        warnings.filterwarnings("ignore", "compiling ", PerformanceNotice)
        return
    warnings.filterwarnings("always", "compiling ", PerformanceNotice)
    warnings.filterwarnings("ignore", "compiling the derivatives ", PerformanceNotice)
    _print_notices()
    from ..analysis.motion.compiling import ENGINE
    from ..compiler.notice import announce

    if not kernels or "motion_kernel" in kernels:
        announce((ENGINE,))
    if "residual_kernel" in kernels and _derivatives_will():
        typer.echo(DERIVATIVES, err=True)


def _print_notices() -> None:
    """Have notices printed as they are, without the line of code that they are about."""
    usual = warnings.showwarning

    def show(message: Any, category: type[Warning], *more: Any, **where: Any) -> None:
        if issubclass(category, PerformanceNotice):
            typer.echo(str(message), err=True)
        else:
            usual(message, category, *more, **where)

    if getattr(usual, "__name__", "") != show.__name__:
        warnings.showwarning = show


def _derivatives_will() -> bool:
    from ..equations.residual import stepped

    return stepped.cold
