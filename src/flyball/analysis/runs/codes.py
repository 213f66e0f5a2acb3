"""Code made for the mechanisms of a study: which goes by the numbers that are 0, 1 or -1, and by some others."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ... import special
from ...special.recorder import PLAIN
from ...tables.system import System
from ...tables.values import Values
from ..compiled import Compiled
from ..motion.engines import Engine

MOST = 8  # codes of one study; runs that want another are computed by themselves


@dataclass(frozen=True)
class Code:
    """Made code, and what it takes for granted of the tables that change from run to run."""

    made: special.Made
    plain: tuple[np.ndarray, ...]  # where these are 0, 1 or -1
    fixed: tuple[tuple[str, int, float], ...]  # entries that it knows, and their values

    def knows(self, S: System) -> bool:
        """Whether tables have the entries that it knows."""
        return all(getattr(S, name).ravel()[k] == x for name, k, x in self.fixed)


class Codes:
    """Codes of the runs of a study, found as they are wanted; threads share them."""

    def __init__(self, c: Compiled, tables: Sequence[str]) -> None:
        self.tables = tables
        self.known: list[Code] = []
        self._by_pattern: dict[bytes, Code] = {}
        self._turn = threading.Lock()
        self._add(c.again())

    def of(self, x: Values, pattern: bytes) -> Code | None:
        """The code for a run with these tables; of the same ``pattern``, if that is told, all are plain alike."""
        S = x.system
        code = self._by_pattern.get(pattern) if pattern else None
        if code is not None and code.knows(S):
            return code
        with self._turn:
            plain = _plain(S, self.tables)
            code = next((k for k in self.known if _alike(k.plain, plain) and k.knows(S)), None)
            if code is None and len(self.known) < MOST:
                code = self._add(Compiled(x, np.zeros(len(x.structure.states))))
            if code is not None and pattern:
                self._by_pattern[pattern] = code
        return code

    def _add(self, c: Compiled) -> Code | None:
        """The code that a run by itself would have."""
        Engine(c, True)
        S, made = c.values.system, c.made
        if made is None or (entries := special.entries(made)) is None:
            return None
        fixed = tuple((name, k, float(getattr(S, name).ravel()[k])) for name, k in entries if name in self.tables)
        self.known.append(Code(made, _plain(S, self.tables), fixed))
        return self.known[-1]


def _plain(S: System, names: Sequence[str]) -> tuple[np.ndarray, ...]:
    return tuple(getattr(S, name) == x for name in names for x in PLAIN)


def _alike(a: Sequence[np.ndarray], b: Sequence[np.ndarray]) -> bool:
    return all(np.array_equal(x, y) for x, y in zip(a, b, strict=True))
