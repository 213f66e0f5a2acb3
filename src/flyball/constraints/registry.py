"""Every kind of constraint term, found in the files of this folder: kind -> formula."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable


def _found() -> dict[int, Callable]:
    rows: dict[int, Callable] = {}
    package = __name__.rpartition(".")[0]
    path = importlib.import_module(package).__path__
    for info in pkgutil.iter_modules(path):
        if info.name == "registry":
            continue
        module = importlib.import_module(f"{package}.{info.name}")
        own = getattr(module, "ROWS", {module.KIND: module.row} if hasattr(module, "KIND") else {})
        for kind, formula in own.items():
            if kind in rows:
                raise RuntimeError(f"constraints/{info.name}.py: KIND {kind} is taken by {rows[kind].__module__}")
            rows[kind] = formula
    if sorted(rows) != list(range(len(rows))):
        raise RuntimeError(f"the KINDs of constraints/ must be 0, 1, 2, ...; there are {sorted(rows)}")
    return rows


FORMULAS = _found()
"""``row(par, F, M, hint, data)`` -> value, force on M, torque on M, torque on F, acceleration bias."""
