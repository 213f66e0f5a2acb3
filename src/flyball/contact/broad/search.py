"""The search for contacts, behind a door: any compiled loop calls it by its address.

::

    status = enter(address, G, M, C, O, B, STEP)      # held tuples: see compiler/door.py

`C` gets the contacts of the movers' poses in `M`; `O` are those that the last search that was `DONE` filled (the two
change places from step to step). A status `FULL_*` or `NOT_FINITE` leaves `O` and what is known of it as it was: what
is named is enlarged (`finder.Finder.enlarge`) and the search is called again. Of `C.count`: `FOUND` contacts (with
FULL_CONTACTS: how many there would be; with NOT_FINITE: the mover). While it runs, poses in `M` may be
others; they are put back.
"""

from __future__ import annotations

from ...compiler.formulas import formula
from ...compiler.kernels import kernel
from ..tables import (
    AHEAD,
    DONE,
    FOUND,
    FULL_CONTACTS,
    FULL_PAIRS,
    NOT_FINITE,
    NUMBER,
    PAIRS,
    REBUILT,
    STATUS,
    Contacts,
    Geometry,
    Movers,
)
from .desk import (
    AFRESH_SO_FAR,
    BOUNDED,
    FRAME,
    HALF,
    LISTED,
    LISTED_ALL,
    LOOKED_AT,
    MOVED,
    MOVES,
    PASSED,
    SEARCHES,
    SHAPE,
    STRIDE,
    TRUE,
    WIDE,
    Search,
)
from .listed import touch
from .listing import drop, list_all, list_moved, refit
from .same import forget, keep_all
from .sorting import sort_all
from .unbounded import place_wide
from .watch import census, follow, look

STEP, AFRESH, FASTER, MIDWAY = range(4)
"""Tasks: contacts at new poses, with the list of pairs mended where it must be; the same, all pairs looked for anew;
contacts at the poses of the last search with other velocities; contacts of the known pairs within the margin, at poses
between those of this search and of the next one. Of the last two, `O` are the contacts of the last search."""
MANY = 0.3  # where more shapes than this part have left their envelopes, all pairs are looked for anew


@formula
def anew(G, M, O, B):
    """Look for all pairs: whether there was room."""
    B.count[TRUE] = 0
    forget(B)
    keep_all(O, B)
    sort_all(G, M, B)
    for w in range(B.count[WIDE]):
        s = B.count[BOUNDED] + w
        place_wide(G, M, B, w, B.slot[s, SHAPE], B.slot[s, MOVES])
        B.mark[s] = 0
    room = list_all(G, B)
    forget(B)
    B.count[AFRESH_SO_FAR] += 1
    B.count[LISTED_ALL] = B.count[LISTED]
    B.count[TRUE] = 1 if room else 0
    return room


@formula
def mend(G, B):
    """Look again for pairs of what has left its envelope: 1 if that was done, 0 without room, -1 if all must."""
    if B.count[MOVED] > MANY * B.count[BOUNDED] + 8.0:
        return -1
    B.count[TRUE] = 0
    for k in range(B.count[MOVED]):
        s = B.moved[k]
        if s < B.count[BOUNDED] and not refit(B, s):
            return -1
    drop(B)
    room = list_moved(G, B)
    forget(B)
    B.count[TRUE] = 1 if room else 0
    return 1 if room else 0


@formula
def pass_on(B, way):
    """Add displacements to those that were seen since the frame went on."""
    for c in range(3):
        B.real[PASSED + c] += way[c]


@formula
def pairs(G, M, O, B, task):
    """Bring the list of pairs up to now: whether there was room."""
    for c in range(3 if task != FASTER else 0):
        B.real[FRAME + c] += B.real[STRIDE + c]
    if B.count[TRUE] == 0:
        return anew(G, M, O, B)
    n, way = look(G, M, B)
    pass_on(B, way)
    mended = 1
    if task == AFRESH or O.count[NUMBER] != B.count[SEARCHES] or B.count[LISTED] > 2 * B.count[LISTED_ALL] + 64:
        mended = -1
    elif B.count[MOVED] > 0:
        mended = mend(G, B)
    if mended < 0:
        return anew(G, M, O, B)
    if task != FASTER:
        follow(B, n, (B.real[PASSED], B.real[PASSED + 1], B.real[PASSED + 2]))
        for c in range(3):
            B.real[PASSED + c] = 0.0
    return mended == 1


@formula
def midway(G, M, C, O, B):
    """Contacts of the listed pairs at these poses: what is remembered of the last search stays as it was."""
    ahead = B.real[AHEAD]
    B.real[AHEAD] = 0.0
    _, way = look(G, M, B)
    pass_on(B, way)
    n = touch(G, M, C, O, B)
    B.real[AHEAD] = ahead
    C.count[FOUND] = n
    return DONE if n <= C.x.shape[0] else FULL_CONTACTS


@formula
def find(G, M, C, O, B, task):
    """See `search`."""
    if task == MIDWAY:
        return midway(G, M, C, O, B)
    bad = census(M, B)
    if bad >= 0:
        C.count[FOUND] = bad
        return NOT_FINITE
    if not pairs(G, M, O, B, task):
        C.count[FOUND] = 0
        return FULL_PAIRS
    n = touch(G, M, C, O, B)
    B.count[LOOKED_AT] += B.count[LISTED]
    C.count[FOUND] = n
    if n > C.x.shape[0]:
        return FULL_CONTACTS
    B.count[HALF] = 1 - B.count[HALF]
    B.count[SEARCHES] += 1
    C.count[NUMBER] = B.count[SEARCHES]
    return DONE


@kernel
def search(G: Geometry, M: Movers, C: Contacts, O: Contacts, B: Search, task: int) -> int:
    """Contacts at the movers' poses: a status (DONE, FULL_*, NOT_FINITE), also in ``C.count[STATUS]``."""
    C.count[STATUS] = find(G, M, C, O, B, task)
    C.count[REBUILT] = B.count[AFRESH_SO_FAR]
    C.count[PAIRS] = B.count[LISTED]
    return C.count[STATUS]
