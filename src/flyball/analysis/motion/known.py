"""What is known of a motion's laws before it begins: times at which steps end, and which laws have to be sampled."""

from __future__ import annotations

import numpy as np

from ...equations.within import law_starts
from ...laws.breaks import Breaks, acts_briefly, found_beforehand
from ...model.kept import bits
from ...tables.system import SWITCH_LAW
from ..compiled import Compiled

MOST = 8  # spans of the same numbers of which it is kept


def breaks_of(c: Compiled, t0: float, t1: float) -> Breaks:
    """Times [s] between t0 and t1 at which laws have corners, or begin and end brief actions, by time alone."""
    x, S = c.values, c.system
    starts = [*law_starts(S), *(S.switch_i[S.switch_i[:, SWITCH_LAW] >= 0, SWITCH_LAW] if len(S.switch_i) else ())]
    known = set(c.structure.laws)
    starts = [int(at) for at in starts if int(at) in known]
    key = bits({"t0": t0, "t1": t1})
    return x.kept.get("breaks", key, MOST, lambda: found_beforehand(S.code.tolist(), np.real(S.const), starts, t0, t1))


def sampled_laws(c: Compiled, breaks: Breaks) -> frozenset[int]:
    """Starts of the laws that samples have to guard within steps: what they do follows the state, or is not known."""
    S, code = c.system, c.system.code.tolist()
    every = {int(at) for at in law_starts(S) if at >= 0}
    return frozenset(at for at in every if at in breaks.given_up or acts_briefly(code, at))


def told_of(c: Compiled, sampled: frozenset[int]) -> str:
    """What health says of laws that are sampled; nothing where there are none."""
    names = dict.fromkeys(c.structure.laws[at] for at in sorted(sampled))
    if not names:
        return ""
    first = ", ".join(list(names)[:3]) + (f" and {len(names) - 3} more" if len(names) > 3 else "")
    return f"{first}: sampled within steps; what a state passes between two samples is not seen"
