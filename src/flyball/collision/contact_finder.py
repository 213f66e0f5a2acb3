"""Python side of contact detection: allocates the workspace, calls the search, enlarges tables that are full.

Bounding spheres and boxes of the shapes, and the collision classes that filter pairs, are computed here once, in
NumPy. `ContactFinder` holds the contacts of two successive searches.
"""

from __future__ import annotations

import numpy as np

from ..compiler.kernels import Kernel
from ..errors import ModelError
from .broad_phase.workspace import (
    BOUNDED,
    CLASSES_EXACT,
    COUNTS,
    IS_GENERIC,
    IS_PLANE,
    MAX_CLASSES,
    NARROW_PHASE,
    PAIRS_IN_LIST,
    REALS,
    SIZE_LEVELS,
    SLOT_CLASS,
    SLOT_FORM,
    SLOT_MOVER,
    SLOT_SHAPE,
    SPHERE_RADIUS,
    TYPICAL_RADIUS,
    WIDE,
    Search,
)
from .contact_search import REBUILD, STEP, search
from .narrow_phase.primitives import SCRATCH_ROWS
from .shape_kinds import BOX, CAPSULE, CONE, CYLINDER, ELLIPSOID, FIELD, HEMISPHERE, HULL, PLANE, POLYGON, SPHERE
from .tables import (
    AHEAD,
    AXES,
    COUNT,
    DONE,
    FIRST,
    FOUND,
    FULL_CONTACTS,
    FULL_PAIRS,
    KIND,
    MARGIN,
    MASK,
    MEMBER,
    MOVER,
    NOT_FINITE,
    PAR,
    PLACE,
    RADIUS,
    SKIN,
    Contacts,
    Geometry,
    Movers,
)


def bounding_volumes(G: Geometry) -> np.ndarray:
    """Bounding sphere and box of every shape, with a common centre.

    A kind without a rule here gets those of the sphere given in the table.

    Returns
    -------
    ndarray (ns, 8)
        Centre [m] in the mover's axes, radius [m] (inf for unbounded shapes), half edges of the box [m] along the
        shape's axes. For unbounded shapes the fifth number is the greatest height along the shape's z axis.
    """
    kind, par, radius = G.shape_i[:, KIND], G.shape_x[:, PAR : PAR + 3], G.shape_x[:, RADIUS]
    middle, wide = np.zeros((len(kind), 3)), ~np.isfinite(radius)
    half = np.repeat(np.where(wide, 0.0, radius)[:, None], 3, axis=1)
    size = np.full(len(kind), np.inf)
    for of, columns in _HALF_EDGES.items():
        half[kind == of] = np.stack(columns(*par[kind == of].T), axis=1)
    middle[kind == CONE, 2] = 0.5 * par[kind == CONE, 1]
    middle[kind == HEMISPHERE, 2] = 0.5 * par[kind == HEMISPHERE, 0]
    for i in np.flatnonzero((kind == HULL) | (kind == POLYGON)):
        first, count = G.shape_i[i, [FIRST, COUNT]]
        vertices = G.vertex[first : first + count]
        low, high = vertices.min(0), vertices.max(0)
        middle[i], half[i] = 0.5 * (low + high), 0.5 * (high - low) + par[i, 0]
        size[i] = np.linalg.norm(vertices - middle[i], axis=1).max() + par[i, 0]
    for i in np.flatnonzero((kind == FIELD) & wide):
        heights = G.vertex[G.shape_i[i, FIRST] :].ravel()[: int(par[i, 0] * par[i, 1])]
        half[i, 0] = heights.max()
    out = np.zeros((len(kind), 8))
    axes = G.shape_x[:, AXES : AXES + 9].reshape(-1, 3, 3)
    out[:, :3] = G.shape_x[:, PLACE : PLACE + 3] + np.einsum("nij,nj->ni", axes, middle)
    size = np.minimum(size, np.minimum(np.linalg.norm(half, axis=1), radius + np.linalg.norm(middle, axis=1)))
    out[:, 3] = np.where(wide, np.inf, np.where(kind == SPHERE, par[:, 0], size))
    out[:, 4:7] = half
    return out


_HALF_EDGES = {  # half edges from the parameters of each kind
    SPHERE: lambda r, a, b: (r, r, r),
    BOX: lambda x, y, z: (x, y, z),
    ELLIPSOID: lambda x, y, z: (x, y, z),
    CAPSULE: lambda r, h, z: (r, r, r + h),
    CYLINDER: lambda r, h, z: (r, r, h),
    CONE: lambda r, h, z: (r, r, 0.5 * h),
    HEMISPHERE: lambda r, a, b: (r, r, 0.5 * r),
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
    member, mask = G.shape_i[:, MEMBER], G.shape_i[:, MASK]
    still = (G.shape_i[:, MOVER] < 0).astype(np.int64)
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


def no_contacts(capacity: int) -> Contacts:
    """Create an empty table of contacts."""
    return Contacts(np.zeros(8, np.int64), np.full((capacity, 4), -1, np.int64), np.zeros((capacity, 10)))


def no_movers(count: int) -> Movers:
    """Create movers at the origin, at rest."""
    pose = np.zeros((count, 12))
    pose[:, [3, 7, 11]] = 1.0
    return Movers(pose, np.zeros((count, 6)))


def _power_of_two(least: int) -> int:
    """Smallest power of two (at least 16) that is not below ``least``."""
    return 1 << max(4, int(least - 1).bit_length())


def _pair_hash_table(contacts: int) -> dict[str, np.ndarray]:
    """Create a hash table of pairs that this many contacts fill at most by half."""
    n = _power_of_two(2 * contacts)
    return {"names": np.full(n, -1, np.int64), "firsts": np.zeros(n, np.int64), "taken": np.zeros(n // 2, np.int64)}


def search_workspace(G: Geometry, pairs: int, contacts: int) -> Search:
    """Create the tables of the search, with initial capacities for pairs and contacts."""
    ns, hold = len(G.shape_i), bounding_volumes(G)
    bounded = np.isfinite(hold[:, 3])
    kin, meets, exact = collision_classes(G)
    real, count = np.zeros(REALS), np.zeros(COUNTS, np.int64)
    moving = bounded & (G.shape_i[:, MOVER] >= 0)
    usual = hold[moving if moving.any() else bounded, 3]
    real[TYPICAL_RADIUS] = (np.median(usual) if len(usual) else 0.0) or 1.0
    count[[BOUNDED, WIDE, CLASSES_EXACT]] = bounded.sum(), ns - bounded.sum(), exact
    slot = np.zeros((ns, 5), np.int64)
    for s, i in enumerate(np.flatnonzero(~bounded), start=int(bounded.sum())):
        form = IS_PLANE if G.shape_i[i, KIND] == PLANE else IS_GENERIC
        slot[s, [SLOT_SHAPE, SLOT_MOVER, SLOT_FORM, SLOT_CLASS]] = i, G.shape_i[i, MOVER], form, kin[i]
    turning = ns if (G.shape_i[bounded, KIND] != SPHERE).any() else 0
    now = np.zeros((ns, 8))
    now[bounded.sum() :, SPHERE_RADIUS] = np.inf
    return Search(
        real=real,
        count=count,
        hold=hold,
        shape_class=np.where(bounded, kin, -1),
        meets=meets,
        slot=slot,
        now=now,
        envelope=np.zeros((ns, 8)),
        axes=np.zeros((turning, 9)),
        turn=np.zeros((turning, 9)),
        wide=np.zeros((ns - int(bounded.sum()), 20)),
        raw=np.zeros((ns, 18)),
        key=np.zeros(ns, np.int64),
        link=np.zeros(ns, np.int64),
        head=np.zeros(4 * ns + 2 * len(meets) * SIZE_LEVELS + 2, np.int64),
        level_i=np.zeros((len(meets) * SIZE_LEVELS, 6), np.int64),
        level_x=np.zeros((len(meets) * SIZE_LEVELS, 8)),
        sums=np.zeros((len(meets) * SIZE_LEVELS, 10)),
        pair=np.zeros((pairs, 3), np.int32),
        seen=np.full((2, pairs), -1, np.int32),
        mark=np.zeros(ns, np.int64),
        moved=np.zeros(ns, np.int64),
        room=np.zeros((SCRATCH_ROWS, 8)),
        kept=np.zeros((2, 12)),
        **_pair_hash_table(contacts),
    )


def narrow_phase_kernel(G: Geometry) -> Kernel:
    """Narrow-phase kernel for the kinds of these shapes; `no_pair_contacts` if no pair needs it."""
    from .narrow_phase.dispatch import kernel_for_kinds, no_pair_contacts

    kind, bounded = G.shape_i[:, KIND], np.isfinite(bounding_volumes(G)[:, 3])
    simple = (kind == SPHERE) | (~bounded & (kind == PLANE))
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
        ns = len(geometry.shape_i)
        self.geometry = geometry
        self.now, self.before, self.midway = (no_contacts(4 * ns + 64) for _ in range(3))
        self.search = search_workspace(geometry, 8 * ns + 64, 4 * ns + 64)
        self.search.real[[MARGIN, SKIN, AHEAD]] = margin, skin, ahead
        self.search.count[NARROW_PHASE] = narrow_phase_kernel(geometry).address
        self.address = search.address

    def find(self, movers: Movers, rebuild: bool = False) -> Contacts:
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

    def enlarge(self, status: int, count: np.ndarray) -> None:
        """Enlarge the table that a search reported as full; the new tuples are in the attributes.

        Parameters
        ----------
        status : int
            Status returned by the search.
        count : ndarray
            ``count`` of the contacts that the search filled.

        Raises
        ------
        ModelError
            If a larger table would not help.
        """
        if status == NOT_FINITE:
            raise ModelError(
                f"mover {count[FOUND]} has a position, orientation or velocity that is not a finite number: the motion "
                "has failed before contacts were looked for (a smaller step, or check masses and forces)"
            )
        if status == FULL_CONTACTS:
            capacity = int(1.5 * count[FOUND]) + 64
            self.now, self.before = _enlarged_contacts(self.now, capacity), _enlarged_contacts(self.before, capacity)
            self.midway = no_contacts(capacity)
            self.search = self.search._replace(**_pair_hash_table(capacity))
        elif status == FULL_PAIRS:
            self._more_pairs()
        else:
            raise ValueError(f"status {status} is no status of a full table")

    def _more_pairs(self) -> None:
        B, ns = self.search, len(self.geometry.shape_i)
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
        pair, seen = np.zeros((larger, 3), np.int32), np.full((2, larger), -1, np.int32)
        pair[:capacity], seen[:, :capacity] = B.pair, B.seen
        self.search = B._replace(pair=pair, seen=seen)

    def most_pairs(self) -> tuple[int, int]:
        """Shape with the most pairs in the list, and their number."""
        B = self.search
        slots = B.pair[: B.count[PAIRS_IN_LIST], :2].ravel()
        if not len(slots):
            return 0, 0
        many = np.bincount(slots)
        return int(B.slot[many.argmax(), SLOT_SHAPE]), int(many.max())


def _enlarged_contacts(C: Contacts, capacity: int) -> Contacts:
    """Copy contacts to a larger table."""
    out = no_contacts(capacity)
    n = min(len(C.at), capacity)
    out.count[:] = C.count
    out.at[:n], out.x[:n] = C.at[:n], C.x[:n]
    return out
