"""Rigid bodies that have no answer: the error by which it is known, and what is said of friction that jams."""

from __future__ import annotations

from typing import Any

from ...errors import ModelError, SimulationError
from ...model.body import GROUND
from ...model.touch import Touch


class Unresolved(SimulationError):
    """An instant at which rigid bodies have no answer, or no end of answers."""


class Overlap(ModelError):
    """A motion that begins with bodies in each other."""


def jam(e: Any, t: float, alone: bool) -> str:
    """What is said where no force of friction in a joint, or where bodies touch, was found that goes with its own load.

    With one such load (``alone``) the search finds it if it exists; with several it may end short of them.
    """
    if not alone:
        where = f"of {bodies(e)}" if isinstance(e, Touch) else f"in joint {e.joint!r}"
        return (
            f"{e.title} {where}: at t = {t:.6g} s no loads were found that go with the friction that they cause, here "
            f"and elsewhere. Either friction grows with the load that it makes itself faster than that can hold it (a "
            f"jam, or Painleve's paradox), or there are such loads and the search ended short of them. Less friction "
            f"is easier (coefficients, radius, bending_length, twist_length); steps by impulses (method='impulse') "
            f"need no such search"
        )
    if isinstance(e, Touch):
        return (
            f"{e.title} of {bodies(e)} jams at t = {t:.6g} s: friction there grows with the load that it makes itself "
            f"faster than that can hold it (Painleve's paradox), so no finite force answers, or several do. With less "
            f"friction, or contact that gives way (law=), there is a solution; steps by impulses go over it"
        )
    return (
        f"{e.title} jams joint {e.joint!r} at t = {t:.6g} s: friction loads the joint by as much as the "
        f"load that it comes from, so no finite force answers, or several do. Check its coefficients, and the lengths "
        f"over which the joint carries moments (bending_length, twist_length)"
    )


def bodies(e: Touch) -> str:
    """Both bodies of a place of contact."""
    return " and ".join(repr(b) if b != GROUND else GROUND for b in (e.body_i, e.body_j))
