"""What a contact does at rest."""

from __future__ import annotations

from dataclasses import dataclass

STICKS, SMOOTH, LIMIT, PARTING = "sticks", "smooth", "at its friction limit", "about to part"


@dataclass(frozen=True)
class Touch:
    """A closed contact, or a stop that is reached, of a mechanism at rest.

    Attributes
    ----------
    name : str
        ``"block-floor"``, with a number where there are several; of a stop its own name.
    state : str
        ``"sticks"``; ``"smooth"`` without friction; ``"at its friction limit"``, where any more would make it slide; or
        ``"about to part"``, which carries nothing.
    normal : float
        Force that presses [N]; of a stop its effort [N or N m]; of friction in a joint, a brake or clutch the most that
        it bears.
    tangential : float [N]
        Friction force.
    used : float
        Friction force in parts of what friction bears; 0 without friction.
    gap : float [m]
        Distance of the surfaces; below 0 they overlap.
    """

    name: str
    state: str
    normal: float
    tangential: float = 0.0
    used: float = 0.0
    gap: float = 0.0

    def __str__(self) -> str:
        part = f"{100.0 * self.used:.3g} % of what it bears"
        friction = f", friction {self.tangential:.4g} N, {part}" if self.used else ""
        return f"{self.name} {self.state}, presses with {self.normal:.4g}{friction}"
