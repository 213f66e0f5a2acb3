"""What Python does for the search: makes its tables, calls it, enlarges what is full, and says so where too much is."""

from __future__ import annotations

import numpy as np

from ..compiler.kernels import Kernel
from ..errors import ModelError
from .broad.bounds import holds
from .broad.classes import classes
from .broad.desk import (
    BOUNDED,
    CLASS,
    COUNTS,
    FLAT,
    FORM,
    LISTED,
    MOVES,
    NARROW,
    OTHER,
    REALS,
    SHAPE,
    SIZE,
    SIZES,
    TOLD,
    USUAL,
    WIDE,
    Search,
)
from .broad.search import AFRESH, STEP, search
from .kinds import PLANE, SPHERE
from .narrow.room import ROOM
from .tables import (
    AHEAD,
    DONE,
    FOUND,
    FULL_CONTACTS,
    FULL_PAIRS,
    KIND,
    MARGIN,
    MOVER,
    NOT_FINITE,
    SKIN,
    Contacts,
    Geometry,
    Movers,
)

PAIRS_EACH, PAIRS_ANYWAY = 30, 2_000_000  # pairs for each shape and in all, above which too many are in one place
THICK = 0.1  # skins, in radii


def no_contacts(capacity: int) -> Contacts:
    """An empty table of contacts."""
    return Contacts(np.zeros(8, np.int64), np.full((capacity, 4), -1, np.int64), np.zeros((capacity, 10)))


def no_movers(count: int) -> Movers:
    """Movers at the origin, at rest."""
    pose = np.zeros((count, 12))
    pose[:, [3, 7, 11]] = 1.0
    return Movers(pose, np.zeros((count, 6)))


def _power(least: int) -> int:
    """The least power of two that is not below."""
    return 1 << max(4, int(least - 1).bit_length())


def _hashing(contacts: int) -> dict[str, np.ndarray]:
    """A table of pairs that as many contacts never fill by more than half."""
    n = _power(2 * contacts)
    return {"names": np.full(n, -1, np.int64), "firsts": np.zeros(n, np.int64), "taken": np.zeros(n // 2, np.int64)}


def search_room(G: Geometry, pairs: int, contacts: int) -> Search:
    """The search's own tables, for this many pairs and contacts at first."""
    ns, hold = len(G.shape_i), holds(G)
    bounded = np.isfinite(hold[:, 3])
    kin, meets, exact = classes(G)
    real, count = np.zeros(REALS), np.zeros(COUNTS, np.int64)
    moving = bounded & (G.shape_i[:, MOVER] >= 0)
    usual = hold[moving if moving.any() else bounded, 3]
    real[USUAL] = (np.median(usual) if len(usual) else 0.0) or 1.0
    count[[BOUNDED, WIDE, TOLD]] = bounded.sum(), ns - bounded.sum(), exact
    slot = np.zeros((ns, 5), np.int64)
    for s, i in enumerate(np.flatnonzero(~bounded), start=int(bounded.sum())):
        form = FLAT if G.shape_i[i, KIND] == PLANE else OTHER
        slot[s, [SHAPE, MOVES, FORM, CLASS]] = i, G.shape_i[i, MOVER], form, kin[i]
    turning = ns if (G.shape_i[bounded, KIND] != SPHERE).any() else 0
    now = np.zeros((ns, 8))
    now[bounded.sum() :, SIZE] = np.inf
    return Search(
        real=real,
        count=count,
        hold=hold,
        kin=np.where(bounded, kin, -1),
        meets=meets,
        slot=slot,
        now=now,
        fat=np.zeros((ns, 8)),
        axes=np.zeros((turning, 9)),
        turn=np.zeros((turning, 9)),
        wide=np.zeros((ns - int(bounded.sum()), 20)),
        raw=np.zeros((ns, 18)),
        key=np.zeros(ns, np.int64),
        link=np.zeros(ns, np.int64),
        head=np.zeros(4 * ns + 2 * len(meets) * SIZES + 2, np.int64),
        level_i=np.zeros((len(meets) * SIZES, 6), np.int64),
        level_x=np.zeros((len(meets) * SIZES, 8)),
        sums=np.zeros((len(meets) * SIZES, 10)),
        pair=np.zeros((pairs, 3), np.int32),
        seen=np.full((2, pairs), -1, np.int32),
        mark=np.zeros(ns, np.int64),
        moved=np.zeros(ns, np.int64),
        room=np.zeros((ROOM, 8)),
        kept=np.zeros((2, 12)),
        **_hashing(contacts),
    )


def narrow(G: Geometry) -> Kernel:
    """The narrow phase that shapes like these ask for; `nothing` where no pair does."""
    from .between import door_for, nothing

    kind, bounded = G.shape_i[:, KIND], np.isfinite(holds(G)[:, 3])
    simple = (kind == SPHERE) | (~bounded & (kind == PLANE))
    return nothing if simple.all() else door_for(set(kind.tolist()))


class Finder:
    """Contacts between shapes, step by step.

    Parameters
    ----------
    geometry : Geometry
    margin : float
        Gap [m] up to which shapes that do not approach have contacts.
    ahead : float
        Time [s] that movers go on for before the next search: what may meet within it is a contact.
    skin : float
        How far shapes may move, as a part of their radius, before their pairs are looked for again.

    Attributes
    ----------
    now, before : Contacts
        Contacts of the last search and of the one before it.
    midway : Contacts
        As large; of searches between two of these.
    search : Search
    address : int
        Of the search. A compiled loop calls ``call(address, geometry, movers, before, now, search, STEP)``, in which
        the third structure gets the contacts, and has these two change places after each call that returned DONE; at
        another status it returns to Python, which calls `enlarge` and goes on with the tuples that are then in
        ``now``, ``before`` and ``search``.
    """

    def __init__(self, geometry: Geometry, *, margin: float = 0.0, ahead: float = 0.0, skin: float = THICK) -> None:
        ns = len(geometry.shape_i)
        self.geometry = geometry
        self.now, self.before, self.midway = (no_contacts(4 * ns + 64) for _ in range(3))
        self.search = search_room(geometry, 8 * ns + 64, 4 * ns + 64)
        self.search.real[[MARGIN, SKIN, AHEAD]] = margin, skin, ahead
        self.search.count[NARROW] = narrow(geometry).address
        self.address = search.address

    def find(self, movers: Movers, afresh: bool = False) -> Contacts:
        """Contacts at these poses, into ``now``; ``now`` becomes ``before``.

        Parameters
        ----------
        movers : Movers
        afresh : bool
            Whether to look for all pairs anew. Contacts are the same either way.

        Raises
        ------
        ModelError
            If a pose is not finite, or too many shapes are in one place.
        """
        self.now, self.before = self.before, self.now
        while True:
            task = AFRESH if afresh else STEP
            status = search(self.geometry, movers, self.now, self.before, self.search, task)
            if status == DONE:
                return self.now
            self.now, self.before = self.before, self.now
            self.enlarge(status, self.before.count)
            self.now, self.before = self.before, self.now

    def enlarge(self, status: int, count: np.ndarray) -> None:
        """Make room for what a search said that it lacked; new tuples then stand in the attributes.

        Parameters
        ----------
        status : int
            What the search returned.
        count : ndarray
            ``count`` of the contacts that it was to fill.

        Raises
        ------
        ModelError
            If no room would help.
        """
        if status == NOT_FINITE:
            raise ModelError(
                f"mover {count[FOUND]} has a position, orientation or velocity that is not a finite number: the motion "
                "has failed before contacts were looked for (a smaller step, or check masses and forces)"
            )
        if status == FULL_CONTACTS:
            capacity = int(1.5 * count[FOUND]) + 64
            self.now, self.before = _more_contacts(self.now, capacity), _more_contacts(self.before, capacity)
            self.midway = no_contacts(capacity)
            self.search = self.search._replace(**_hashing(capacity))
        elif status == FULL_PAIRS:
            self._more_pairs()
        else:
            raise ValueError(f"status {status} is none that asks for room")

    def _more_pairs(self) -> None:
        B, ns = self.search, len(self.geometry.shape_i)
        capacity = len(B.pair)
        most = max(PAIRS_EACH * ns, PAIRS_ANYWAY)
        if capacity >= most:
            i, many = self.most_pairs()
            raise ModelError(
                f"too many shapes are in one place: {capacity} pairs of {ns} shapes are near each other, "
                f"{many} of them with shape {i} alone; move bodies that start at the same place apart, or use groups "
                "for those that may go through each other"
            )
        larger = min(2 * capacity, most)
        pair, seen = np.zeros((larger, 3), np.int32), np.full((2, larger), -1, np.int32)
        pair[:capacity], seen[:, :capacity] = B.pair, B.seen
        self.search = B._replace(pair=pair, seen=seen)

    def most_pairs(self) -> tuple[int, int]:
        """The shape that stands in most pairs of the list, and in how many."""
        B = self.search
        slots = B.pair[: B.count[LISTED], :2].ravel()
        if not len(slots):
            return 0, 0
        many = np.bincount(slots)
        return int(B.slot[many.argmax(), SHAPE]), int(many.max())


def _more_contacts(C: Contacts, capacity: int) -> Contacts:
    """The same contacts in a larger table."""
    out = no_contacts(capacity)
    n = min(len(C.at), capacity)
    out.count[:] = C.count
    out.at[:n], out.x[:n] = C.at[:n], C.x[:n]
    return out
