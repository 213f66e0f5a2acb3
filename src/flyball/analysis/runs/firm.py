"""Parameters that change what bodies weigh, or gravity, of a mechanism that starts at rest as it is drawn.

Positions then are as they were, and nothing moves that masses could measure: the start is the same. That it is so is
looked at in the tables of each run, not told from the description.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ...tables.system import BODY_TURNS, MASS, OFFSET, PER_MASS, REGULARISE, TREE_P, System
from ...tables.values import Values, values
from ..assembly.start import Assembly
from ..compiled import Compiled
from ..motion.start import Start
from ..simulate import energy_size

SAME = ("frame_x", "term_x", "switch_x")
"""Tables that tell where things are."""


def rests_as_drawn(begun: Start) -> bool:
    """Whether a motion starts with every velocity zero, in the position that is drawn, whatever bodies weigh."""
    base, x = begun.base, begun.base.compiled.values
    model = x.structure.model
    still = not (base.v.any() or x.v.any() or begun.assembly.v.any())
    return still and not model.drivers and not model.initial and base.q.tobytes() == x.q.tobytes()


@dataclass(frozen=True)
class Weighing:
    """What fills tables of masses, gravity and forces in; as `soft.Filling`, where nothing else changes."""

    tables: ClassVar[tuple[str, ...]] = ("force_x", "const", "body_x", "glob")  # that it writes

    names: tuple[str, ...]
    parameters: Mapping[str, float]
    begun: Start
    span: float  # of the motion [s]

    def fill(self, point: np.ndarray, own: Mapping[str, np.ndarray]) -> bool:
        """Write them, if the start is the same.

        Raises
        ------
        ModelError
            If a number makes no sense.
        """
        given = {**self.parameters, **dict(zip(self.names, point.tolist(), strict=True))}
        base = self.begun.base
        first = base.compiled.values
        found = plain = values(first.structure, given)
        if not _stands(first, plain):
            return False
        if (mine := self.begun.assembly.compiled.values) is not first:
            found = values(mine.structure, given)
            if not _stands(mine, found):
                return False
        for name, table in own.items():
            if name in System._fields:
                table[...] = getattr(found.system, name)
        own["ledger"][0] = energy_size(
            Assembly(Compiled(plain, base.compiled.z, given), base.t, base.q, base.v), self.span
        )
        return True


def _stands(a: Values, b: Values) -> bool:
    """Whether two have all places and velocities in common, to the bit."""
    S, T, n = a.system, b.system, len(a.structure.model.parameters)
    pairs = [(getattr(S, name), getattr(T, name)) for name in SAME]
    pairs += [(a.q, b.q), (a.v, b.v), (S.const[n:], T.const[n:]), (S.glob[REGULARISE:], T.glob[REGULARISE:])]
    pairs += [(S.body_x[:, TREE_P:PER_MASS], T.body_x[:, TREE_P:PER_MASS])]
    pairs += [(S.body_x[:, OFFSET : BODY_TURNS + 1], T.body_x[:, OFFSET : BODY_TURNS + 1])]
    weighs = (S.body_x[:, MASS] > 0.0, T.body_x[:, MASS] > 0.0)
    return all(np.array_equal(x, y) for x, y in (*pairs, weighs))
