"""Code made for the mechanism of a study, and the runs that it is for: those with its numbers 0, 1 and -1."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ... import special
from ...special.recorder import PLAIN
from ..compiled import Compiled
from ..motion.engines import Engine
from .track import Batch


@dataclass(frozen=True)
class Code:
    """Made code, and what it assumes of the tables that change from run to run.

    Attributes
    ----------
    made : Made
    tables : mapping
        By name the entries of a table in the run that it was made for, and in which of them a run must agree; in the
        others it must have none of the numbers that are folded.
    """

    made: special.Made
    tables: Mapping[str, tuple[np.ndarray, np.ndarray]]

    @classmethod
    def of(cls, c: Compiled, tables: Sequence[str]) -> Code:
        """The code of a mechanism, of which these tables change.

        Raises
        ------
        ModelError
            If none can be made.
        """
        Engine(c, True)
        found = {}
        for name in tables:
            x = getattr(c.values.system, name).ravel()
            found[name] = x.copy(), np.isin(x, PLAIN)
        for name, k in c.made.known:
            if name in found:
                found[name][1][k] = True
        return cls(c.made, found)

    def serves(self, batch: Batch) -> np.ndarray:
        """Which of the runs it is for, (n,)."""
        out = np.ones(len(batch.runs), bool)
        for name, x in batch.base.items():
            if name not in self.tables:
                continue
            changed = [p for p in batch.parts if p.name == name]
            alike = np.delete(np.arange(x.size), np.concatenate([p.at for p in changed]) if changed else [])
            out &= self._agree(name, alike, x.ravel()[alike])
            for p in changed:
                out &= self._agree(name, p.at, p.x)
        return out

    def _agree(self, name: str, at: np.ndarray, x: np.ndarray) -> np.ndarray:
        mine, same = (a[at] for a in self.tables[name])
        return np.asarray(np.where(same, x == mine, ~np.isin(x, PLAIN)).all(axis=-1))
