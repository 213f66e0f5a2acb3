"""Python side of contact detection: allocates the workspace, calls the search, enlarges tables that are full.

Bounding spheres and boxes of the shapes, and the collision classes that filter pairs, are computed here once, in
NumPy. `ContactFinder` holds the contacts of two successive searches.
"""

from __future__ import annotations

import numpy as np

from ..compiler.kernels import Kernel
from ..errors import ModelError
from . import shape_kinds
from .contact_search import REBUILD, STEP, search
from .narrow_phase.primitives import SCRATCH_ROWS
from .tables import (
    DONE,
    FULL_CONTACTS,
    FULL_PAIRS,
    IS_GENERIC,
    IS_PLANE,
    MAX_CLASSES,
    NOT_FINITE,
    SIZE_LEVELS,
    Bounds,
    ContactCounts,
    ContactTable,
    Envelopes,
    Geometry,
    LevelCells,
    LevelGrid,
    Motions,
    Movers,
    MovingFrame,
    PairTable,
    Planes,
    Search,
    SearchCounts,
    SearchReals,
    SizeGroups,
    SlotPairs,
    Slots,
    no_contacts,
)


def bounding_volumes(G: Geometry) -> Bounds:
    """Bounding sphere and box of every shape, with a common centre.

    A kind without a rule here gets those of the sphere given in the table.

    Returns
    -------
    Bounds
        Centre [m] in the mover's axes, radius [m] (inf for unbounded shapes), half edges of the box [m] along the
        shape's axes. For unbounded shapes the first half edge is the greatest height along the shape's z axis.
    """
    kind, par, radius = G.shape.kind[:], G.dimensions.par[:, :3], G.dimensions.radius[:]
    middle, wide = np.zeros((len(kind), 3)), ~np.isfinite(radius)
    half = np.repeat(np.where(wide, 0.0, radius)[:, None], 3, axis=1)
    size = np.full(len(kind), np.inf)
    for of, columns in _HALF_EDGES.items():
        half[kind == of] = np.stack(columns(*par[kind == of].T), axis=1)
    middle[kind == shape_kinds.CONE, 2] = 0.5 * par[kind == shape_kinds.CONE, 1]
    middle[kind == shape_kinds.HEMISPHERE, 2] = 0.5 * par[kind == shape_kinds.HEMISPHERE, 0]
    for i in np.flatnonzero((kind == shape_kinds.HULL) | (kind == shape_kinds.POLYGON)):
        first, count = G.shape.first[i], G.shape.count[i]
        vertices = G.vertex[first : first + count]
        low, high = vertices.min(0), vertices.max(0)
        middle[i], half[i] = 0.5 * (low + high), 0.5 * (high - low) + par[i, 0]
        size[i] = np.linalg.norm(vertices - middle[i], axis=1).max() + par[i, 0]
    for i in np.flatnonzero((kind == shape_kinds.FIELD) & wide):
        heights = G.vertex[G.shape.first[i] :].ravel()[: int(par[i, 0] * par[i, 1])]
        half[i, 0] = heights.max()
    out = Bounds.blank(len(kind))
    axes = G.dimensions.axes.reshape(-1, 3, 3)
    out.centre = G.dimensions.place + np.einsum("nij,nj->ni", axes, middle)
    size = np.minimum(size, np.minimum(np.linalg.norm(half, axis=1), radius + np.linalg.norm(middle, axis=1)))
    out.radius = np.where(wide, np.inf, np.where(kind == shape_kinds.SPHERE, par[:, 0], size))
    out.half_edges = half
    return out


_HALF_EDGES = {  # half edges from the parameters of each kind
    shape_kinds.SPHERE: lambda r, a, b: (r, r, r),
    shape_kinds.BOX: lambda x, y, z: (x, y, z),
    shape_kinds.ELLIPSOID: lambda x, y, z: (x, y, z),
    shape_kinds.CAPSULE: lambda r, h, z: (r, r, r + h),
    shape_kinds.CYLINDER: lambda r, h, z: (r, r, h),
    shape_kinds.CONE: lambda r, h, z: (r, r, 0.5 * h),
    shape_kinds.HEMISPHERE: lambda r, a, b: (r, r, 0.5 * r),
}


def collision_classes(G: Geometry) -> tuple[np.ndarray, np.ndarray, bool]:
    """Divide the shapes into collision classes.

    Returns
    -------
    kin : ndarray (ns,)
        Class of every shape.
    meets : ndarray (classes, classes)
        1 where shapes of two classes may touch.
    exact : bool
        Whether classes represent all groups. If there are too many combinations of groups, classes only separate fixed
        from movable shapes.
    """
    member, mask = G.shape.member[:], G.shape.mask[:]
    still = (G.shape.mover[:] < 0).astype(np.int64)
    (of, one), (to, other) = np.unique(member, return_inverse=True), np.unique(mask, return_inverse=True)
    codes, kin = np.unique((one * len(to) + other) * 2 + still, return_inverse=True)
    exact = len(codes) <= MAX_CLASSES
    if not exact:
        of, to, codes, kin = np.array([-1]), np.array([-1]), np.array([0, 1]), still
    of, to, still = of[codes // 2 // len(to)], to[codes // 2 % len(to)], codes % 2
    met = of[:, None] & to[None, :] != 0
    meets = met & met.T & (still[:, None] & still[None, :] == 0)
    return np.ascontiguousarray(kin, np.int64), meets.astype(np.int64), exact


PAIR_LIMIT_PER_SHAPE, PAIR_LIMIT = (
    30,
    2_000_000,
)  # largest numbers of pairs per shape and in total; more means that too many shapes overlap
SKIN_RATIO = 0.1  # skin thickness relative to the radius


def no_movers(count: int) -> Movers:
    """Create movers at the origin, at rest."""
    pose = np.zeros((count, 12))
    pose[:, [3, 7, 11]] = 1.0
    return Movers(pose, np.zeros((count, 6)))


def _power_of_two(least: int) -> int:
    """Smallest power of two (at least 16) that is not below ``least``."""
    return 1 << max(4, int(least - 1).bit_length())


def _pair_hash_table(contacts: int) -> PairTable:
    """Create a hash table of pairs that this many contacts fill at most by half."""
    n = _power_of_two(2 * contacts)
    return PairTable(np.full(n, -1, np.int64), np.zeros(n, np.int64), np.zeros(n // 2, np.int64))


def search_workspace(G: Geometry, pairs: int, contacts: int) -> Search:
    """Create the tables of the search, with initial capacities for pairs and contacts."""
    ns, hold = len(G.shape), bounding_volumes(G)
    bounded = np.isfinite(hold.radius)
    kin, meets, exact = collision_classes(G)
    real, count = SearchReals.blank(), SearchCounts.blank()
    moving = bounded & (G.shape.mover[:] >= 0)
    usual = hold.radius[moving if moving.any() else bounded]
    real.typical_radius = (np.median(usual) if len(usual) else 0.0) or 1.0
    count.bounded, count.wide, count.classes_exact = bounded.sum(), ns - bounded.sum(), exact
    slot = Slots.blank(ns)
    for s, i in enumerate(np.flatnonzero(~bounded), start=int(bounded.sum())):
        form = IS_PLANE if G.shape.kind[i] == shape_kinds.PLANE else IS_GENERIC
        slot[s] = i, G.shape.mover[i], 0, form, kin[i]
    turning = ns if (G.shape.kind[bounded] != shape_kinds.SPHERE).any() else 0
    now = Motions.blank(ns)
    now.radius[bounded.sum() :] = np.inf
    return Search(
        real=real,
        frame=MovingFrame.blank(),
        count=count,
        hold=hold,
        shape_class=np.where(bounded, kin, -1),
        meets=meets,
        slot=slot,
        now=now,
        envelope=Envelopes.blank(ns),
        axes=np.zeros((turning, 9)),
        turn=np.zeros((turning, 9)),
        wide=Planes.blank(ns - int(bounded.sum())),
        raw_now=Motions.blank(ns),
        raw_envelope=Envelopes.blank(ns),
        raw_bound=np.zeros(ns),
        key=np.zeros(ns, np.int64),
        link=np.zeros(ns, np.int64),
        head=np.zeros(4 * ns + 2 * len(meets) * SIZE_LEVELS + 2, np.int64),
        level_cells=LevelCells.blank(len(meets) * SIZE_LEVELS),
        level_grid=LevelGrid.blank(len(meets) * SIZE_LEVELS),
        sums=SizeGroups.blank(len(meets) * SIZE_LEVELS),
        pair=SlotPairs.blank(pairs),
        first_contacts=np.full((2, pairs), -1, np.int32),
        mark=np.zeros(ns, np.int64),
        moved=np.zeros(ns, np.int64),
        narrow_phase_contacts=np.zeros((SCRATCH_ROWS, 8)),
        stored_pose=np.zeros((2, 12)),
        table=_pair_hash_table(contacts),
    )


def narrow_phase_kernel(G: Geometry) -> Kernel:
    """Narrow-phase kernel for the kinds of these shapes; `no_pair_contacts` if no pair needs it."""
    from .narrow_phase.dispatch import kernel_for_kinds, no_pair_contacts

    kind, bounded = G.shape.kind[:], np.isfinite(bounding_volumes(G).radius)
    simple = (kind == shape_kinds.SPHERE) | (~bounded & (kind == shape_kinds.PLANE))
    return no_pair_contacts if simple.all() else kernel_for_kinds(set(kind.tolist()))


class ContactFinder:
    """Finds contacts between shapes, step by step.

    Parameters
    ----------
    geometry : Geometry
    margin : float
        Largest gap [m] of contacts between shapes that do not approach.
    ahead : float
        Time [s] until the next search: shapes that may touch within it have a contact.
    skin : float
        Distance that shapes may move before their pairs are listed again, relative to their radius.

    Attributes
    ----------
    now, before : Contacts
        Contacts of the last search and of the one before it.
    midway : Contacts
        Contacts of searches between two regular ones; same capacity.
    search : Search
    address : int
        Address of the search kernel. A compiled loop calls ``call(address, geometry, movers, before, now, search,
        STEP)``. The third structure receives the contacts; the loop exchanges it with the fourth after each call that
        returned DONE. For another status it returns to Python, which calls `enlarge` and continues with the tuples that
        are then in ``now``, ``before`` and ``search``.
    """

    def __init__(
        self, geometry: Geometry, *, margin: float = 0.0, ahead: float = 0.0, skin: float = SKIN_RATIO
    ) -> None:
        ns = len(geometry.shape)
        self.geometry = geometry
        self.now, self.before, self.midway = (no_contacts(4 * ns + 64) for _ in range(3))
        self.search = search_workspace(geometry, 8 * ns + 64, 4 * ns + 64)
        real = self.search.real
        real.margin, real.skin, real.horizon = margin, skin, ahead
        self.search.count.narrow_phase = narrow_phase_kernel(geometry).address
        self.address = search.address

    def find(self, movers: Movers, rebuild: bool = False) -> ContactTable:
        """Find the contacts at these poses; writes them to ``now``, and the old ``now`` becomes ``before``.

        Parameters
        ----------
        movers : Movers
        rebuild : bool
            Whether to list all pairs anew. The contacts are the same either way.

        Raises
        ------
        ModelError
            If a pose is not finite, or too many shapes overlap.
        """
        self.now, self.before = self.before, self.now
        while True:
            task = REBUILD if rebuild else STEP
            status = search(self.geometry, movers, self.now, self.before, self.search, task)
            if status == DONE:
                return self.now
            self.now, self.before = self.before, self.now
            self.enlarge(status, self.before.count)
            self.now, self.before = self.before, self.now

    def enlarge(self, status: int, count: ContactCounts) -> None:
        """Enlarge the table that a search reported as full; the new tuples are in the attributes.

        Parameters
        ----------
        status : int
            Status returned by the search.
        count : ContactCounts
            ``count`` of the contacts that the search filled.

        Raises
        ------
        ModelError
            If a larger table would not help.
        """
        if status == NOT_FINITE:
            raise ModelError(
                f"mover {count.found} has a position, orientation or velocity that is not a finite number: the motion "
                "has failed before contacts were looked for (a smaller step, or check masses and forces)"
            )
        if status == FULL_CONTACTS:
            capacity = int(1.5 * count.found) + 64
            self.now, self.before = _enlarged_contacts(self.now, capacity), _enlarged_contacts(self.before, capacity)
            self.midway = no_contacts(capacity)
            self.search = self.search._replace(table=_pair_hash_table(capacity))
        elif status == FULL_PAIRS:
            self._more_pairs()
        else:
            raise ValueError(f"status {status} is no status of a full table")

    def _more_pairs(self) -> None:
        B, ns = self.search, len(self.geometry.shape)
        capacity = len(B.pair)
        most = max(PAIR_LIMIT_PER_SHAPE * ns, PAIR_LIMIT)
        if capacity >= most:
            i, many = self.most_pairs()
            raise ModelError(
                f"too many shapes are close together: {capacity} pairs of {ns} shapes are near each other, {many} of "
                f"them with shape {i} alone; move bodies that start at the same place apart, or use groups for those "
                "that may go through each other"
            )
        larger = min(2 * capacity, most)
        pair, first_contacts = SlotPairs.blank(larger), np.full((2, larger), -1, np.int32)
        pair[:capacity], first_contacts[:, :capacity] = B.pair, B.first_contacts
        self.search = B._replace(pair=pair, first_contacts=first_contacts)

    def most_pairs(self) -> tuple[int, int]:
        """Shape with the most pairs in the list, and their number."""
        B = self.search
        slots = np.concatenate([B.pair.first[: B.count.pairs], B.pair.second[: B.count.pairs]])
        if not len(slots):
            return 0, 0
        many = np.bincount(slots)
        return int(B.slot.shape_index[many.argmax()]), int(many.max())


def _enlarged_contacts(C: ContactTable, capacity: int) -> ContactTable:
    """Copy contacts to a larger table."""
    out = no_contacts(capacity)
    n = min(len(C.at), capacity)
    out.count[:] = C.count
    out.at[:n], out.x[:n] = C.at[:n], C.x[:n]
    return out
