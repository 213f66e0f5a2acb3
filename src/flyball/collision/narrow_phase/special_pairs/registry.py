"""All pairs of kinds with contact formulas of their own, found in the files of this folder.

A file declares ``KINDS = (a, b)``, the smaller number first, or several of these in ``PAIRS``; None as the
second stands for any kind that no other file declares with the first. It also defines ``collide``, a formula:

``collide(G, i, j, A, B, reach, scratch)`` -> number of contacts, written into the first rows of ``scratch``
(`primitives`). ``G`` is the `Geometry`, i of kind a and j of kind b are the shapes, ``A`` and ``B`` their poses
``(p, R)``: origin, and the rotation from the shape's to world axes, row by row. Positions are in world axes,
relative to the origin of shape i. Points with a gap above ``reach`` are omitted.
"""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable
from types import ModuleType


def _modules() -> list[ModuleType]:
    package = __name__.rpartition(".")[0]
    path = importlib.import_module(package).__path__
    names = [info.name for info in pkgutil.iter_modules(path) if info.name != "registry"]
    return [importlib.import_module(f"{package}.{name}") for name in names]


def declared_pairs(modules: list[ModuleType]) -> dict[tuple[int, int | None], Callable]:
    """Collect the pairs declared by these modules.

    Raises
    ------
    RuntimeError
        If a pair is declared twice, or with the larger number first.
    """
    ways: dict[tuple[int, int | None], Callable] = {}
    for m in modules:
        for pair in getattr(m, "PAIRS", (m.KINDS,) if hasattr(m, "KINDS") else ()):
            if pair in ways:
                raise RuntimeError(f"the pair {pair} of kinds is declared twice, the second time by {m.__name__}")
            if pair[1] is not None and pair[1] < pair[0]:
                raise RuntimeError(f"{m.__name__}: in the pair {pair} of kinds the smaller number comes first")
            ways[pair] = m.collide
    return ways


PAIR_FORMULAS = declared_pairs(_modules())
