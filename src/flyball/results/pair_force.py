"""Contact forces between two bodies, or sets of them, over time."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..errors import ModelError
from .sides import OPEN, SLIP, STATES, STICK

if TYPE_CHECKING:
    from .contacts import Contacts


class PairForce:
    """What contacts do to one body (or set) over time, summed.

    Attributes
    ----------
    on, by : str
        On whom, and by whom; ``by`` is empty where it is all others.
    t : ndarray (n,) [s]
    force : ndarray (n, 3) [N]
        Sum on ``on``, world axes; (n, 2) in the plane.
    normal_force : ndarray (n,) [N]
        Sum of the sizes along the normals: with opposite normals they do not cancel.
    tangential_force : ndarray (n,) [N]
        Size of the summed tangential forces.
    center : ndarray (n, 3) [m]
        Mean point of the contacts, weighed by their normal forces; nan where nothing presses. In steps by impulses it
        belongs to the start of the step that ends at the time, as ``gap`` does: see `Contacts`.
    gap : ndarray (n,) [m]
        The least of the contacts; nan where there is none.
    count : ndarray (n,) of int
    state : ndarray (n,) of int
        `STICK` if all that press stick, `SLIP` if one slips, `OPEN` if nothing presses.
    """

    def __init__(self, contacts: Contacts, on: str, by: str, rows: np.ndarray, sign: np.ndarray) -> None:
        self.on, self.by, self.t = on, by, contacts.t
        n, when = len(contacts.t), contacts.when[rows]

        def total(values: np.ndarray) -> np.ndarray:
            return np.bincount(when, values, n)

        def vector(values: np.ndarray) -> np.ndarray:
            return np.stack([total(values[:, c]) for c in range(3)], axis=1)

        pressing = contacts.normal_force[rows]
        axes = 2 if contacts.planar else 3
        self.force = vector(sign[:, None] * contacts.force[rows])[:, :axes]
        self.normal_force = total(pressing)
        tangential = vector(sign[:, None] * contacts.tangential_force[rows])
        self.tangential_force = np.sqrt((tangential**2).sum(axis=1))
        self.count = np.bincount(when, minlength=n)
        weighed = vector(pressing[:, None] * contacts.point[rows])
        presses = self.normal_force > 0.0
        self.center = np.full((n, 3), np.nan)
        self.center[presses] = weighed[presses] / self.normal_force[presses, None]
        self.center = self.center[:, :axes]
        self.gap = np.full(n, np.inf)
        np.minimum.at(self.gap, when, contacts.gap[rows])
        self.gap[self.count == 0] = np.nan
        state = contacts.state[rows]
        self.state = np.full(n, OPEN)
        self.state[total((state == STICK).astype(float)) > 0] = STICK
        self.state[total((state == SLIP).astype(float)) > 0] = SLIP

    @property
    def states(self) -> list[str]:
        """The states by name."""
        return [STATES[k] for k in self.state.tolist()]

    def impulse(self) -> np.ndarray:
        """Sum of force times step over all output times but the first [N s]; exact if every step is an output."""
        return (np.diff(self.t)[:, None] * self.force[1:]).sum(axis=0)

    @property
    def title(self) -> str:
        """Who on whom, in words."""
        return f"{self.by or 'all others'} on {self.on}"

    def __repr__(self) -> str:
        most = float(self.normal_force.max(initial=0.0))
        touching = int((self.state != OPEN).sum())
        return f"<contact force of {self.title}: pressing at {touching} of {len(self.t)} times, up to {most:.4g} N>"


def summed(contacts: Contacts, on: str, by: str | None) -> PairForce:
    """Sum what ``by`` (None: everyone else) does to ``on``.

    Raises
    ------
    ModelError
        If there is none of these names, or they share a body and are not the same set.
    """
    low, high = contacts.sides.span(on)
    own = [(k >= low) & (k < high) for k in contacts.pair.T]
    if by is None:
        other = [~own[0], ~own[1]]
    else:
        a, b = contacts.sides.span(by)
        if (a, b) == (low, high) and high - low > 1:
            raise ModelError(f"contacts between members of {on!r} cancel in their sum: name single ones")
        if a < high and low < b:
            raise ModelError(f"{by!r} and {on!r} share a body: a contact is between two bodies")
        other = [(k >= a) & (k < b) for k in contacts.pair.T]
    second, first = own[1] & other[0], own[0] & other[1]
    rows = np.flatnonzero(first | second)
    return PairForce(contacts, on, by or "", rows, np.where(second[rows], 1.0, -1.0))
