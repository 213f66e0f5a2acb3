"""Which laws of a motion have to be sampled within its steps: what they do follows the state, or is not known."""

from __future__ import annotations

from ...equations.within import law_starts
from ...laws.breaks import Breaks, acts_briefly
from ..compiled import Compiled


def sampled_laws(c: Compiled, breaks: Breaks) -> frozenset[int]:
    """Starts of the laws that samples have to guard within steps: what they do follows the state, or is not known."""
    by_state = c.structure.kept.get("laws that follow the state", None, 1, lambda: _by_state(c))
    if not breaks.given_up:
        return by_state
    return by_state | {int(at) for at in law_starts(c.system) if at in breaks.given_up}


def _by_state(c: Compiled) -> frozenset[int]:
    code = c.system.code.tolist()
    return frozenset(at for at in set(law_starts(c.system).tolist()) if at >= 0 and acts_briefly(code, at))


def told_of(c: Compiled, sampled: frozenset[int]) -> str:
    """What health says of laws that are sampled; nothing where there are none."""
    if not sampled:
        return ""
    names = dict.fromkeys(c.structure.laws[at] for at in sorted(sampled))
    first = ", ".join(list(names)[:3]) + (f" and {len(names) - 3} more" if len(names) > 3 else "")
    return f"{first}: sampled within steps; what a state passes between two samples is not seen"
