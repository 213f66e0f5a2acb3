"""Which laws of a motion have to be sampled within its steps: what they do follows the state, or is not known."""

from __future__ import annotations

from ...equations.within import law_starts
from ...laws.breaks import Breaks, acts_briefly
from ..compiled import Compiled


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
