"""The compiled contact search, and the contacts of the listed pairs.

::

    status = call(address, G, M, C, O, B, STEP)      # structures are passed by pointer: see `compiler.struct_layout`

`search` updates the list of pairs (`broad_phase`), then computes the contacts of every listed pair:
spheres and planes directly, other pairs by the narrow phase. A fast pair is advanced along its motion to the place
where it first touches (conservative advancement: Mirtich 1996, "Impulse-based dynamic simulation of rigid body
systems", 2.3), because the nearest points of distant shapes are not those where they will touch.

`C` receives the contacts for the poses in `M`; `O` holds those of the last search that returned `DONE` (the two
are exchanged from step to step). With status `FULL_*` or `NOT_FINITE`, `O` and the workspace are unchanged:
the caller enlarges the table (`ContactFinder.enlarge`) and calls again. ``C.count.found`` is the number of
contacts (with FULL_CONTACTS: the required number; with NOT_FINITE: the mover). Poses in `M` may change
while the search runs; they are restored.
"""

from __future__ import annotations

from ..compiler.formulas import call, formula
from ..compiler.kernels import kernel
from ..math.scalar import cos, sin, sqrt
from ..math.vec import add, dot, load3, load9, mm, norm, quaternion_matrix, scale, store3, store9, sub
from .broad_phase import drop_moved, list_all, list_moved, renew_envelope, sort_shapes
from .contact_matching import clear_table, matching_contact, store_all_pairs
from .envelopes import (
    advance_frame,
    bounds_meet,
    half_extent,
    set_frame,
    update_plane,
    update_slots,
    velocity_at_point,
)
from .tables import (
    DONE,
    FULL_CONTACTS,
    FULL_PAIRS,
    GENERIC_PAIR,
    IS_PLANE,
    NOT_FINITE,
    SPHERE_PLANE,
    SPHERE_SPHERE,
    ContactTable,
    Geometry,
    Movers,
    Search,
)


@formula
def write_contact(C, n, point, normal, gap, offset):
    """Write row n of the contacts, if the table has one."""
    if n < C.x.shape[0]:
        C.x.point[n, 0], C.x.point[n, 1], C.x.point[n, 2] = point
        C.x.normal[n, 0], C.x.normal[n, 1], C.x.normal[n, 2] = normal
        C.x.gap[n] = gap
        C.x.half_separation[n, 0], C.x.half_separation[n, 1], C.x.half_separation[n, 2] = offset


@formula
def write_contact_identity(C, n, i, j, feature, first):
    """Write the shapes and the feature of contact n, and its index in the last search."""
    if n < C.at.shape[0]:
        C.at.shape_1[n], C.at.shape_2[n], C.at.feature[n], C.at.before[n] = i, j, feature, first


@formula
def approach_time(d, r, reach, u, horizon):
    """Time at which spheres with relative position d and velocity u touch, or are nearest; -1 if beyond ``reach``."""
    du, u2, d2 = dot(d, u), dot(u, u), dot(d, d)
    if du >= 0.0:
        return -1.0
    time = min(horizon, -du / u2)
    if d2 + time * (2.0 * du + time * u2) >= reach * reach:
        return -1.0
    deep = du * du - u2 * (d2 - r * r)  # discriminant of the time of touching
    if deep > 0.0:
        time = min(time, (d2 - r * r) / (sqrt(deep) - du))
    return time


@formula
def sphere_sphere_contact(C, B, s, t, n):
    """Write the contact of two spheres to row n; returns the number of contacts.

    Spheres whose surfaces come within the margin in ``ahead`` seconds, with their velocities or if one of them is
    stopped, have a contact: along the normal at the instant at which they will (first) be nearest, with the present gap
    between their tangent planes across it. A sphere that passes another one has no contact with it.
    """
    now, far = B.now, 0.0
    x, y, z = (
        now.centre[t, 0] - now.centre[s, 0],
        now.centre[t, 1] - now.centre[s, 1],
        now.centre[t, 2] - now.centre[s, 2],
    )
    r = now.radius[s] + now.radius[t]
    reach = r + B.real.margin
    d2 = x * x + y * y + z * z
    a, b, c = x, y, z
    if d2 >= reach * reach:
        D = (B.frame.velocity[0], B.frame.velocity[1], B.frame.velocity[2])
        v, w = sub(load3(now.velocity, s, 0), D), sub(load3(now.velocity, t, 0), D)
        u = sub(w, v)
        time = approach_time((x, y, z), r, reach, u, B.real.horizon)
        if time < 0.0:
            u = w
            time = approach_time((x, y, z), r, reach, u, B.real.horizon)
        if time < 0.0:
            u = scale(-1.0, v)
            time = approach_time((x, y, z), r, reach, u, B.real.horizon)
        if time < 0.0:
            return 0
        a, b, c = x + time * u[0], y + time * u[1], z + time * u[2]
        d2 = a * a + b * b + c * c
        far = 1.0
    d = sqrt(d2)
    if d > 1e-150:
        a, b, c = a / d, b / d, c / d
    else:
        a, b, c = 1.0, 0.0, 0.0
    gap = d - r if far == 0.0 else a * x + b * y + c * z - r
    p = now.radius[s] - 0.5 * r
    point = (
        now.centre[s, 0] + 0.5 * x + p * a,
        now.centre[s, 1] + 0.5 * y + p * b,
        now.centre[s, 2] + 0.5 * z + p * c,
    )
    # half the distance of the centres across the normal: each sphere is touched on the line through its own centre
    along = 0.5 * (a * x + b * y + c * z)
    apart = 0.5 * x - along * a, 0.5 * y - along * b, 0.5 * z - along * c
    if B.slot.mover[t] < 0:
        point, apart = sub(point, apart), (0.0, 0.0, 0.0)
    elif B.slot.mover[s] < 0:
        point, apart = add(point, apart), (0.0, 0.0, 0.0)
    write_contact(C, n, point, (a, b, c), gap, apart)
    return 1


@formula
def plane_sphere_contact(C, B, w, s, side, n):
    """Write the contact of wide slot w, a plane, and slot s, a sphere; ``side`` is -1 if the sphere is shape 1."""
    k = w - B.count.bounded
    q = B.wide
    x = (
        B.now.centre[s, 0] - q.origin[k, 0],
        B.now.centre[s, 1] - q.origin[k, 1],
        B.now.centre[s, 2] - q.origin[k, 2],
    )
    a, b, c = q.normal[k, 0], q.normal[k, 1], q.normal[k, 2]
    gap = a * x[0] + b * x[1] + c * x[2] - B.now.radius[s]
    if gap >= B.real.margin:
        u = (q.spin[k, 0], q.spin[k, 1], q.spin[k, 2])
        closing = a * (q.velocity[k, 0] + u[1] * x[2] - u[2] * x[1] - B.now.velocity[s, 0])
        closing += b * (q.velocity[k, 1] + u[2] * x[0] - u[0] * x[2] - B.now.velocity[s, 1])
        closing += c * (q.velocity[k, 2] + u[0] * x[1] - u[1] * x[0] - B.now.velocity[s, 2])
        if gap >= B.real.margin + closing * B.real.horizon:
            return 0
    p = B.now.radius[s] + 0.5 * gap
    point = (B.now.centre[s, 0] - p * a, B.now.centre[s, 1] - p * b, B.now.centre[s, 2] - p * c)
    write_contact(C, n, point, (side * a, side * b, side * c), gap, (0.0, 0.0, 0.0))
    return 1


MAX_ADVANCES = 40  # iterations of conservative advancement
TOUCHING_GAP = 0.01  # gap that counts as touching, relative to the radius of the smaller shape


@formula
def store_pose(M, B, row, m):
    """Store the pose of a mover."""
    if m >= 0:
        for c in range(12):
            B.stored_pose[row, c] = M.pose[m, c]


@formula
def restore_pose(M, B, row, m):
    """Restore the stored pose of a mover."""
    if m >= 0:
        for c in range(12):
            M.pose[m, c] = B.stored_pose[row, c]


@formula
def advance_pose(M, B, row, m, time):
    """Set a mover to its pose after some time."""
    if m >= 0:
        w = load3(M.twist, m, 3)
        half = 0.5 * time * norm(w)
        store3(M.pose, m, 0, add(load3(B.stored_pose, row, 0), scale(time, load3(M.twist, m, 0))))
        if half > 0.0:
            e = scale(0.5 * time * sin(half) / half, w)
            store9(M.pose, m, 3, mm(quaternion_matrix(cos(half), e[0], e[1], e[2]), load9(B.stored_pose, row, 3)))


@formula
def query_narrow_phase(G, M, B, s, t, reach):
    """Find contacts of a pair of slots at the present poses, up to this gap; writes ``room``, returns their number."""
    B.count.query_shape_1, B.count.query_shape_2, B.real.query_reach = (
        B.slot.shape_index[s],
        B.slot.shape_index[t],
        reach,
    )
    return call(B.count.narrow_phase, G, M, B, B, B, 0)


@formula
def smallest_gap(B, found):
    """Index of the contact with the smallest gap."""
    best = 0
    for k in range(found):
        if B.narrow_phase_contacts[k, 6] < B.narrow_phase_contacts[best, 6]:
            best = k
    return best


@formula
def closing_speed(B, s, t, k):
    """Largest speed at which two bounded shapes can approach along the normal of contact k."""
    v = B.now.turning_speed[s] + B.now.turning_speed[t]
    for c in range(3):
        v += B.narrow_phase_contacts[k, 3 + c] * (B.now.velocity[s, c] - B.now.velocity[t, c])
    return v


@formula
def advance_to_touch(G, M, B, s, t, reach, size):
    """Find contacts where a fast pair first touches within ``ahead`` seconds: their number, and the time.

    They are in ``room``, the poses at that time in M; `restore_pose` restores these. ``reach``: ``margin`` plus the
    largest displacement.
    """
    a, b = B.slot.mover[s], B.slot.mover[t]
    ahead, time = B.real.horizon, 0.0
    fastest = (reach - B.real.margin) / ahead
    enough = B.real.margin + TOUCHING_GAP * size
    for _ in range(MAX_ADVANCES):
        found = query_narrow_phase(G, M, B, s, t, B.real.margin + fastest * (ahead - time))
        if found == 0:
            return 0, time
        k = smallest_gap(B, found)
        gap = B.narrow_phase_contacts[k, 6]
        if gap <= enough:
            return found, time
        speed = fastest
        if s < B.count.bounded and t < B.count.bounded:
            speed = min(fastest, closing_speed(B, s, t, k))
        if gap - B.real.margin >= speed * (ahead - time):
            return 0, time
        time += (gap - 0.5 * enough) / speed
        if time >= ahead:
            return 0, time
        advance_pose(M, B, 0, a, time)
        advance_pose(M, B, 1, b, time)
    return found, time


FAST_STEP = (
    0.25  # displacement per step, relative to the radius of the smaller shape, above which a pair is advanced to touch
)


@formula
def frame_velocity(B):
    """Velocity of the frame, with which all movers move if they move together."""
    return (B.frame.velocity[0], B.frame.velocity[1], B.frame.velocity[2])


@formula
def largest_approach(B, s, t):
    """Largest decrease of the distance of two bounded slots in ``ahead`` seconds."""
    u = norm(sub(load3(B.now.velocity, t, 0), load3(B.now.velocity, s, 0)))
    return B.real.horizon * (u + B.now.turning_speed[s] + B.now.turning_speed[t])


@formula
def pair_reach(B, s, t):
    """Largest gap at which a pair of bounded slots may touch within ``ahead`` seconds; negative if it cannot."""
    now = B.now
    reach = B.real.margin
    D = frame_velocity(B)
    v, w = sub(load3(now.velocity, s, 0), D), sub(load3(now.velocity, t, 0), D)
    u = max(norm(sub(w, v)), norm(v), norm(w))
    d = sub(load3(now.centre, t, 0), load3(now.centre, s, 0))
    reach += B.real.horizon * (u + now.turning_speed[s] + now.turning_speed[t])
    whole = reach + now.radius[s] + now.radius[t]
    return reach if dot(d, d) < whole * whole and bounds_meet(B, B.axes, s, t, d, reach) else -1.0


@formula
def plane_reach(M, B, w, s):
    """As `pair_reach`, for wide slot w and slot s."""
    k = w - B.count.bounded
    q = B.wide
    p, n = load3(B.now.centre, s, 0), load3(q.normal, k, 0)
    u = norm(sub(velocity_at_point(M, B.slot.mover[w], p), load3(B.now.velocity, s, 0)))
    gap = dot(n, sub(p, load3(q.origin, k, 0))) - half_extent(B, B.axes, s, n)
    reach = B.real.margin + B.real.horizon * (u + B.now.turning_speed[s] + norm(load3(q.spin, k, 0)) * B.now.radius[s])
    return -1.0 if gap > reach else reach


@formula
def point_before_motion(M, p, a, b, time):
    """Point at which movers a and b will touch after some time, as of now, and half its distance on the two movers.

    Relative to each mover's origin, the point has its position at the time of touching.
    """
    v = load3(M.twist, a, 0) if a >= 0 else (0.0, 0.0, 0.0)
    u = load3(M.twist, b, 0) if b >= 0 else (0.0, 0.0, 0.0)
    if a < 0 or b < 0:
        return sub(p, scale(time, add(v, u))), (0.0, 0.0, 0.0)
    return sub(p, scale(0.5 * time, add(v, u))), scale(0.5 * time, sub(v, u))


@formula
def accept_contacts(M, C, O, B, pair, rows, time, found):
    """Write the contacts in ``room``, found after some time of motion, to C if they may touch, as they are before it.

    ``rows``: the pair's first contact in the last search and the next row of C. Returns their number.
    """
    many, used, ahead = 0, 0, B.real.horizon
    s, t = pair
    i, j = B.slot.shape_index[s], B.slot.shape_index[t]
    size = min(B.now.radius[s], B.now.radius[t])
    for k in range(found):
        p, e = load3(B.narrow_phase_contacts, k, 0), load3(B.narrow_phase_contacts, k, 3)
        v, u = velocity_at_point(M, B.slot.mover[s], p), velocity_at_point(M, B.slot.mover[t], p)
        closing = dot(e, sub(v, u))
        gap = B.narrow_phase_contacts[k, 6] + time * closing
        D = frame_velocity(B)
        if s < B.count.bounded and t < B.count.bounded:  # another contact may stop one of them
            closing = max(closing, dot(e, sub(v, D)), dot(e, sub(D, u)))
        if gap < B.real.margin + ahead * max(0.0, closing):
            p, apart = point_before_motion(M, p, B.slot.mover[s], B.slot.mover[t], time)
            feature = int(B.narrow_phase_contacts[k, 7])
            c, bit = matching_contact(O, (i, j), rows[0], feature, sub(p, scale(ahead, v)), size, used)
            used |= bit
            write_contact(C, rows[1] + many, p, e, gap, apart)
            write_contact_identity(C, rows[1] + many, i, j, feature, c)
            many += 1
    return many


@formula
def generic_contacts(G, M, C, O, B, pair, first, n):
    """Write the contacts of any pair of slots from row n on; returns their number. ``first``: of the last search."""
    s, t = pair
    bounded = B.count.bounded
    reach = pair_reach(B, s, t) if s < bounded and t < bounded else plane_reach(M, B, max(s, t), min(s, t))
    if reach < 0.0:
        return 0
    a, b, size = B.slot.mover[s], B.slot.mover[t], min(B.now.radius[s], B.now.radius[t])
    flat = (s >= bounded and B.slot.form[s] == IS_PLANE) or (t >= bounded and B.slot.form[t] == IS_PLANE)
    near = largest_approach(B, s, t) if s < bounded and t < bounded else reach - B.real.margin
    if flat or near <= FAST_STEP * size:
        return accept_contacts(M, C, O, B, pair, (first, n), 0.0, query_narrow_phase(G, M, B, s, t, reach))
    found = query_narrow_phase(G, M, B, s, t, B.real.margin)
    if found > 0:
        return accept_contacts(M, C, O, B, pair, (first, n), 0.0, query_narrow_phase(G, M, B, s, t, reach))
    store_pose(M, B, 0, a)
    store_pose(M, B, 1, b)
    found, time = advance_to_touch(G, M, B, s, t, B.real.margin + near, size)
    found = accept_contacts(M, C, O, B, pair, (first, n), time, found)
    restore_pose(M, B, 0, a)
    restore_pose(M, B, 1, b)
    return found


@formula
def contacts_of_pairs(G, M, C, O, B):
    """Find all contacts; returns their number, even if the table is too small for them."""
    n, half = 0, B.count.current_half
    for k in range(B.count.pairs):
        s, t, way = B.pair.first[k] + 0, B.pair.second[k] + 0, B.pair.kind[k]  # + 0: all integers of one type
        first = B.first_contacts[half, k] + 0
        if way == GENERIC_PAIR:
            found = generic_contacts(G, M, C, O, B, (s, t), first, n)
        else:
            if way == SPHERE_SPHERE:
                found = sphere_sphere_contact(C, B, s, t, n)
            elif way == SPHERE_PLANE:
                found = plane_sphere_contact(C, B, t, s, -1.0, n)
            else:
                found = plane_sphere_contact(C, B, s, t, 1.0, n)
            if found != 0:
                write_contact_identity(C, n, B.slot.shape_index[s], B.slot.shape_index[t], 0, first)
        B.first_contacts[1 - half, k] = n if found > 0 else -1
        n += found
    return n


STEP, REBUILD, NEW_VELOCITIES, MIDWAY = range(4)
"""Tasks: contacts at new poses, with a partial update of the pair list; the same with all pairs listed anew; contacts
at the poses of the last search with other velocities; contacts of listed pairs within the margin, at poses between
those of this search and of the next one. For the last two, `O` are the contacts of the last search."""
REBUILD_FRACTION = 0.3  # fraction of shapes outside their envelopes above which all pairs are listed anew


@formula
def rebuild_list(G, M, O, B):
    """List all pairs; returns whether the table was large enough."""
    B.count.list_valid = 0
    clear_table(B)
    store_all_pairs(O, B)
    sort_shapes(G, M, B)
    for w in range(B.count.wide):
        s = B.count.bounded + w
        update_plane(G, M, B, w, B.slot.shape_index[s], B.slot.mover[s])
        B.mark[s] = 0
    room = list_all(G, B)
    clear_table(B)
    B.count.rebuilds += 1
    B.count.pairs_at_rebuild = B.count.pairs
    B.count.list_valid = 1 if room else 0
    return room


@formula
def repair_list(G, B):
    """List pairs of shapes outside their envelopes again: 1 on success, 0 if the table is full, -1 to rebuild all."""
    if B.count.moved_slots > REBUILD_FRACTION * B.count.bounded + 8.0:
        return -1
    B.count.list_valid = 0
    for k in range(B.count.moved_slots):
        s = B.moved[k]
        if s < B.count.bounded and not renew_envelope(B, s):
            return -1
    drop_moved(B)
    room = list_moved(G, B)
    clear_table(B)
    B.count.list_valid = 1 if room else 0
    return 1 if room else 0


@formula
def add_displacement(B, displacement):
    """Add to the displacements since the frame last advanced."""
    for c in range(3):
        B.frame.displacement[c] += displacement[c]


@formula
def update_list(G, M, O, B, task):
    """Update the list of pairs; returns whether the table was large enough."""
    for c in range(3 if task != NEW_VELOCITIES else 0):
        B.frame.origin[c] += B.frame.step[c]
    if B.count.list_valid == 0:
        return rebuild_list(G, M, O, B)
    n, way = update_slots(G, M, B)
    add_displacement(B, way)
    mended = 1
    if task == REBUILD or O.count.number != B.count.searches or B.count.pairs > 2 * B.count.pairs_at_rebuild + 64:
        mended = -1
    elif B.count.moved_slots > 0:
        mended = repair_list(G, B)
    if mended < 0:
        return rebuild_list(G, M, O, B)
    if task != NEW_VELOCITIES:
        advance_frame(B, n, (B.frame.displacement[0], B.frame.displacement[1], B.frame.displacement[2]))
        for c in range(3):
            B.frame.displacement[c] = 0.0
    return mended == 1


@formula
def midway_contacts(G, M, C, O, B):
    """Find contacts of the listed pairs at these poses; the data of the last search are unchanged."""
    ahead = B.real.horizon
    B.real.horizon = 0.0
    _, way = update_slots(G, M, B)
    add_displacement(B, way)
    n = contacts_of_pairs(G, M, C, O, B)
    B.real.horizon = ahead
    C.count.found = n
    return DONE if n <= C.x.shape[0] else FULL_CONTACTS


@formula
def find_contacts(G, M, C, O, B, task):
    """Find contacts; see `search`."""
    if task == MIDWAY:
        return midway_contacts(G, M, C, O, B)
    bad = set_frame(M, B)
    if bad >= 0:
        C.count.found = bad
        return NOT_FINITE
    if not update_list(G, M, O, B, task):
        C.count.found = 0
        return FULL_PAIRS
    n = contacts_of_pairs(G, M, C, O, B)
    B.count.pairs_examined += B.count.pairs
    C.count.found = n
    if n > C.x.shape[0]:
        return FULL_CONTACTS
    B.count.current_half = 1 - B.count.current_half
    B.count.searches += 1
    C.count.number = B.count.searches
    return DONE


@kernel
def search(G: Geometry, M: Movers, C: ContactTable, O: ContactTable, B: Search, task: int) -> int:
    """Find contacts at the movers' poses. Returns a status (DONE, FULL_*, NOT_FINITE), also in ``C.count.status``."""
    C.count.status = find_contacts(G, M, C, O, B, task)
    C.count.rebuilt = B.count.rebuilds
    C.count.pairs = B.count.pairs
    return C.count.status
