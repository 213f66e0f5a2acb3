"""Notices of what takes long, as lines of their own."""

from __future__ import annotations

import warnings
from typing import Any

import typer

from ..errors import PerformanceNotice


def show_notices(talk: bool) -> None:
    """Print notices as they come, without the line of code that they are about; without ``talk`` none is printed."""
    if not talk:
        warnings.filterwarnings("ignore", "compiling ", PerformanceNotice)
        return
    warnings.filterwarnings("always", "compiling ", PerformanceNotice)
    usual = warnings.showwarning

    def show(message: Any, category: type[Warning], *more: Any, **where: Any) -> None:
        if issubclass(category, PerformanceNotice):
            typer.echo(str(message), err=True)
        else:
            usual(message, category, *more, **where)

    if getattr(usual, "__name__", "") != show.__name__:
        warnings.showwarning = show
