"""Who touches: the bodies and members of sets that contacts are counted by, and what a contact may be doing."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ..errors import ModelError
from ..model.quantities import MEMBER
from ..model.words import listing, suggest

STICK, SLIP, OPEN = 0, 1, 2
STATES = ("stick", "slip", "open")


class Sides:
    """Who touches: single bodies, ground and the members of sets, counted through.

    Parameters
    ----------
    names : names
        Of bodies, of ``"ground"``, and of sets of bodies.
    counts : int
        For each name the number of members of the set, -1 for a single body.
    """

    def __init__(self, names: Iterable[str], counts: Iterable[int]) -> None:
        self.names, self.counts = tuple(names), tuple(int(n) for n in counts)
        self.first = np.cumsum([0, *(1 if n < 0 else n for n in self.counts)])

    def __len__(self) -> int:
        return int(self.first[-1])

    def name(self, k: int) -> str:
        """Name of side ``k``: ``"ball"``, or ``"balls[17]"`` of a set."""
        owner = int(np.searchsorted(self.first, k, "right")) - 1
        return self.names[owner] if self.counts[owner] < 0 else f"{self.names[owner]}[{k - self.first[owner]}]"

    def span(self, name: str) -> tuple[int, int]:
        """First side of a name, and the one after its last: of a body, a set, or a member such as ``"balls[17]"``.

        Raises
        ------
        ModelError
            If there is none of that name.
        """
        owner, k = name, -1
        if name not in self.names and (found := MEMBER.fullmatch(name)):
            owner, k = found[1], int(found[2])
        if owner not in self.names:
            known = listing(list(self.names))
            raise ModelError(f"nothing that can touch is named {name!r}{suggest(name, self.names)}; {known}")
        at = self.names.index(owner)
        low, high = int(self.first[at]), int(self.first[at + 1])
        if k < 0:
            return low, high
        if self.counts[at] < 0 or k >= high - low:
            rule = "is a single body" if self.counts[at] < 0 else f"has the members 0 to {high - low - 1}"
            raise ModelError(f"there is no {name!r}: {owner!r} {rule}")
        return low + k, low + k + 1

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Sides) and (self.names, self.counts) == (other.names, other.counts)

    __hash__ = None  # type: ignore[assignment]
