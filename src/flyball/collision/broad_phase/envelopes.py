"""Envelopes of shapes: computed from position and velocity, and checked every step.

An envelope is a capsule that contains a shape, with its motion, for several steps. Unbounded shapes (planes,
and height fields below a plane) store the position at which their pairs were listed, and a slack. `update_slots`
updates all shapes and marks those that have left their envelopes; `set_frame` decides whether the frame of the
envelopes moves.
"""

from __future__ import annotations

from ...compiler.formulas import formula
from ...math.scalar import sqrt
from ...math.vec import add, cross, load3, load9, mv, norm, scale, store3, sub
from ..tables import AHEAD, AXES, MARGIN, PLACE, SKIN
from .workspace import (
    BOUND_CENTRE,
    BOUND_RADIUS,
    BOUNDED,
    BOX_HALF,
    CENTRE,
    ENVELOPE_BOUND,
    ENVELOPE_RADIUS,
    FRAME_LAG,
    FRAME_MOVES,
    FRAME_ORIGIN,
    FRAME_STEP,
    FRAME_VELOCITY,
    HALF_LINE,
    IS_SPHERE,
    MIDDLE,
    MOVED_SLOTS,
    PLANE_NORMAL,
    PLANE_ORIGIN,
    PLANE_SPIN,
    PLANE_VELOCITY,
    REFERENCE_NORMAL,
    REFERENCE_ORIGIN,
    SLACK,
    SLOT_FORM,
    SLOT_MOVER,
    SLOT_SHAPE,
    SPHERE_RADIUS,
    TURNING_SPEED,
    TYPICAL_RADIUS,
    VELOCITY,
    WIDE,
)


@formula
def rotate_by_mover(M, m, a):
    """Convert a vector from the axes of mover m to world axes."""
    return mv(load9(M.pose, m, 3), a)


@formula
def velocity_at_offset(M, m, a):
    """Velocity of the point at a, in world axes, from the origin of mover m."""
    return add(load3(M.twist, m, 0), cross(load3(M.twist, m, 3), a))


@formula
def velocity_at_point(M, m, p):
    """Velocity of mover m at a point of the world; zero for fixed shapes (-1)."""
    if m < 0:
        return (0.0, 0.0, 0.0)
    return velocity_at_offset(M, m, sub(p, load3(M.pose, m, 0)))


LARGEST_SKIN = 3.0  # upper bound of the skin's reference radius, in typical radii
ENVELOPE_STEPS = 8.0  # number of steps that an envelope covers
ENVELOPE_LEAD = 0.5  # upper bound of the covered displacement, relative to the radius


@formula
def update_motion(M, B, i, m, ball, row, s):
    """Write centre and velocity of shape i to row s of ``row`` (columns as `Search.now`)."""
    c = load3(B.hold, i, BOUND_CENTRE)
    w = (0.0, 0.0, 0.0)
    p, v = c, w
    if m >= 0:
        p, v, w = load3(M.pose, m, 0), load3(M.twist, m, 0), load3(M.twist, m, 3)
        if c[0] != 0.0 or c[1] != 0.0 or c[2] != 0.0:
            a = rotate_by_mover(M, m, c)
            p, v = add(p, a), velocity_at_offset(M, m, a)
    store3(row, s, CENTRE, p)
    store3(row, s, VELOCITY, v)
    row[s, SPHERE_RADIUS] = B.hold[i, BOUND_RADIUS]
    row[s, TURNING_SPEED] = 0.0 if ball else B.hold[i, BOUND_RADIUS] * norm(w)


@formula
def update_axes(G, M, B, s, i, m):
    """Compute the axes of slot s, shape i of mover m, in world axes."""
    for c in range(3):
        a = (G.shape_x[i, AXES + c], G.shape_x[i, AXES + 3 + c], G.shape_x[i, AXES + 6 + c])
        if m >= 0:
            a = rotate_by_mover(M, m, a)
        B.axes[s, c], B.axes[s, 3 + c], B.axes[s, 6 + c] = a


@formula
def store_axes(B, s):
    """Store the axes for which an envelope is computed."""
    for c in range(9):
        B.turn[s, c] = B.axes[s, c]


@formula
def chord(B, s):
    """Displacement of the surface by rotation since the envelope was computed, over the radius: 2 sin(angle / 2)."""
    total = 0.0
    for c in range(9):
        total += (B.axes[s, c] - B.turn[s, c]) ** 2
    return sqrt(0.5 * total)


@formula
def write_envelope(B, rows, s, at, still):
    """Compute an envelope from row s (columns as `Search.now`) into columns from ``at`` on (as `Search.envelope`).

    Returns the largest radius of its bounding sphere after the shape has gained some speed.
    """
    r, spin = rows[s, SPHERE_RADIUS], rows[s, TURNING_SPEED]
    u = (
        rows[s, VELOCITY] - B.real[FRAME_VELOCITY],
        rows[s, VELOCITY + 1] - B.real[FRAME_VELOCITY + 1],
        rows[s, VELOCITY + 2] - B.real[FRAME_VELOCITY + 2],
    )
    speed = sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2])
    size = min(r, LARGEST_SKIN * B.real[TYPICAL_RADIUS])
    skin = B.real[SKIN] * size
    if still and B.count[FRAME_MOVES] == 0:
        skin = 0.0
    time = ENVELOPE_STEPS * B.real[AHEAD]
    if (speed + spin) * time > ENVELOPE_LEAD * size:
        time = ENVELOPE_LEAD * size / (speed + spin)
    time += B.real[AHEAD]
    half = 0.5 * time
    for c in range(3):
        rows[s, at + MIDDLE + c] = rows[s, CENTRE + c] - B.real[FRAME_ORIGIN + c] + half * u[c]
        rows[s, at + HALF_LINE + c] = half * u[c]
    rows[s, at + ENVELOPE_RADIUS] = r + 0.5 * B.real[MARGIN] + skin + spin * time
    whole = rows[s, at + ENVELOPE_RADIUS] + half * speed
    rows[s, at + ENVELOPE_BOUND] = whole
    later = r + 0.5 * B.real[MARGIN] + skin + 0.6 * ENVELOPE_LEAD * size
    return whole if still or whole > later else later


@formula
def squared_distance_to_axis(fat, s, x, y, z):
    """Squared distance of a point, relative to the capsule's middle, from its axis."""
    a, b, c = fat[s, HALF_LINE], fat[s, HALF_LINE + 1], fat[s, HALF_LINE + 2]
    e2 = a * a + b * b + c * c
    if e2 > 0.0:
        t = min(1.0, max(-1.0, (x * a + y * b + z * c) / e2))
        x, y, z = x - t * a, y - t * b, z - t * c
    return x * x + y * y + z * z


@formula
def is_inside_envelope(B, s, ball):
    """Whether a shape, with its motion in `AHEAD` seconds, is within its envelope."""
    now, fat, real = B.now, B.envelope, B.real
    allowed = fat[s, ENVELOPE_RADIUS] - now[s, SPHERE_RADIUS] - 0.5 * real[MARGIN]
    if not ball:
        allowed -= now[s, SPHERE_RADIUS] * chord(B, s)
    x = now[s, CENTRE] - real[FRAME_ORIGIN] - fat[s, MIDDLE]
    y = now[s, CENTRE + 1] - real[FRAME_ORIGIN + 1] - fat[s, MIDDLE + 1]
    z = now[s, CENTRE + 2] - real[FRAME_ORIGIN + 2] - fat[s, MIDDLE + 2]
    tiny = 1e-12 * now[s, SPHERE_RADIUS]
    if allowed < -tiny or squared_distance_to_axis(fat, s, x, y, z) > (allowed + tiny) ** 2:
        return False
    x += (now[s, VELOCITY] - real[FRAME_VELOCITY]) * real[AHEAD]
    y += (now[s, VELOCITY + 1] - real[FRAME_VELOCITY + 1]) * real[AHEAD]
    z += (now[s, VELOCITY + 2] - real[FRAME_VELOCITY + 2]) * real[AHEAD]
    allowed -= now[s, TURNING_SPEED] * real[AHEAD]
    return allowed >= -tiny and squared_distance_to_axis(fat, s, x, y, z) <= (allowed + tiny) ** 2


@formula
def squared_distance_to_box(B, axes, s, d):
    """Squared distance from the box of slot s, with these axes, of a point at d from its centre."""
    total, i = 0.0, B.slot[s, SLOT_SHAPE]
    for c in range(3):
        a = abs(axes[s, c] * d[0] + axes[s, 3 + c] * d[1] + axes[s, 6 + c] * d[2]) - B.hold[i, BOX_HALF + c]
        total += a * a if a > 0.0 else 0.0
    return total


@formula
def half_extent(B, axes, s, n):
    """Half extent of slot s along a unit vector."""
    if B.slot[s, SLOT_FORM] == IS_SPHERE:
        return B.now[s, SPHERE_RADIUS]
    total, i = 0.0, B.slot[s, SLOT_SHAPE]
    for c in range(3):
        a = axes[s, c] * n[0] + axes[s, 3 + c] * n[1] + axes[s, 6 + c] * n[2]
        total += B.hold[i, BOX_HALF + c] * abs(a)
    return min(total, B.now[s, SPHERE_RADIUS])


@formula
def boxes_meet(B, axes, s, t, d, reach):
    """Whether boxes with these axes, the second at d from the first, are within ``reach`` of each other.

    Tests the six axes of their faces only; boxes with crossing edges may be farther apart.
    """
    i, j = B.slot[s, SLOT_SHAPE], B.slot[t, SLOT_SHAPE]
    for side in range(2):
        u, v, k, m = (s, t, i, j) if side == 0 else (t, s, j, i)
        for c in range(3):
            a = (axes[u, c], axes[u, 3 + c], axes[u, 6 + c])
            whole = B.hold[k, BOX_HALF + c] + reach
            for e in range(3):
                b = a[0] * axes[v, e] + a[1] * axes[v, 3 + e] + a[2] * axes[v, 6 + e]
                whole += B.hold[m, BOX_HALF + e] * abs(b)
            if abs(d[0] * a[0] + d[1] * a[1] + d[2] * a[2]) > whole:
                return False
    return True


@formula
def bounds_meet(B, axes, s, t, d, reach):
    """Whether the boxes of two slots are within ``reach`` of each other; spheres are tested as such."""
    if B.slot[s, SLOT_FORM] == IS_SPHERE:
        if B.slot[t, SLOT_FORM] == IS_SPHERE:
            return True
        return squared_distance_to_box(B, axes, t, d) <= (reach + B.now[s, SPHERE_RADIUS]) ** 2
    if B.slot[t, SLOT_FORM] == IS_SPHERE:
        return squared_distance_to_box(B, axes, s, d) <= (reach + B.now[t, SPHERE_RADIUS]) ** 2
    return boxes_meet(B, axes, s, t, d, reach)


@formula
def update_plane(G, M, B, w, i, m):
    """Compute origin, normal and velocity of the plane of wide shape ``w``."""
    x, top = G.shape_x, B.hold[i, BOX_HALF]
    n = (x[i, AXES + 2], x[i, AXES + 5], x[i, AXES + 8])
    p = add(load3(x, i, PLACE), scale(top, n))
    v = (0.0, 0.0, 0.0)
    u = v
    if m >= 0:
        a, n = rotate_by_mover(M, m, p), rotate_by_mover(M, m, n)
        p, u, v = add(load3(M.pose, m, 0), a), load3(M.twist, m, 3), velocity_at_offset(M, m, a)
    store3(B.wide, w, PLANE_ORIGIN, p)
    store3(B.wide, w, PLANE_NORMAL, n)
    store3(B.wide, w, PLANE_VELOCITY, v)
    store3(B.wide, w, PLANE_SPIN, u)


@formula
def plane_advance(B, w):
    """Advance of a plane along its normal in `AHEAD` seconds, relative to the frame."""
    x = B.wide
    a = x[w, PLANE_NORMAL] * (x[w, PLANE_VELOCITY] - B.real[FRAME_VELOCITY])
    a += x[w, PLANE_NORMAL + 1] * (x[w, PLANE_VELOCITY + 1] - B.real[FRAME_VELOCITY + 1])
    a += x[w, PLANE_NORMAL + 2] * (x[w, PLANE_VELOCITY + 2] - B.real[FRAME_VELOCITY + 2])
    return B.real[AHEAD] * max(0.0, a)


@formula
def plane_exceeds_slack(B, w):
    """Whether a wide shape has moved so far that it may have new pairs."""
    x, along, turned = B.wide, 0.0, 0.0
    for c in range(3):
        along += x[w, PLANE_NORMAL + c] * (
            x[w, PLANE_ORIGIN + c] - B.real[FRAME_ORIGIN + c] - x[w, REFERENCE_ORIGIN + c]
        )
        turned += abs(x[w, PLANE_NORMAL + c] - x[w, REFERENCE_NORMAL + c]) + abs(x[w, PLANE_SPIN + c])
    return turned > 0.0 or abs(along) + plane_advance(B, w) > x[w, SLACK]


@formula
def store_reference_plane(B, w, still):
    """Store the position of a wide shape for which its pairs are listed."""
    for c in range(3):
        B.wide[w, REFERENCE_ORIGIN + c] = B.wide[w, PLANE_ORIGIN + c] - B.real[FRAME_ORIGIN + c]
        B.wide[w, REFERENCE_NORMAL + c] = B.wide[w, PLANE_NORMAL + c]
    B.wide[w, SLACK] = 0.0
    if not still or B.count[FRAME_MOVES] != 0:
        B.wide[w, SLACK] = B.real[SKIN] * B.real[TYPICAL_RADIUS] + plane_advance(B, w)


@formula
def envelope_reaches_plane(B, w, s):
    """Whether the envelope of slot s reaches below the plane of a wide shape."""
    x, gap, lead = B.wide, 0.0, 0.0
    far, turns = 0.0, 0.0
    for c in range(3):
        a = B.envelope[s, MIDDLE + c] + B.real[FRAME_ORIGIN + c] - x[w, PLANE_ORIGIN + c]
        gap += x[w, PLANE_NORMAL + c] * a
        lead += x[w, PLANE_NORMAL + c] * B.envelope[s, HALF_LINE + c]
        far += a * a
        turns += x[w, PLANE_SPIN + c] ** 2
    deep = half_extent(B, B.turn, s, (x[w, PLANE_NORMAL], x[w, PLANE_NORMAL + 1], x[w, PLANE_NORMAL + 2]))
    reach = B.envelope[s, ENVELOPE_RADIUS] + 0.5 * B.real[MARGIN] - B.now[s, SPHERE_RADIUS] + deep + x[w, SLACK]
    if turns > 0.0:
        reach += B.real[AHEAD] * sqrt(turns * far)
    return gap - abs(lead) <= reach


FRAME_STARTS, FRAME_STOPS = (
    0.6,
    0.4,
)  # squared common velocity over mean square velocity: above, the frame moves; below, it stops
SLOWEST_FRAME = 0.5  # smallest displacement of the frame over an envelope's steps, in skins


@formula
def set_frame(M, B):
    """Choose the frame's velocity: moving if all movers move together. Returns the first nonfinite mover, or -1."""
    v, v2, n = (0.0, 0.0, 0.0), 0.0, 1.0 * M.pose.shape[0]
    for m in range(M.pose.shape[0]):
        total = 0.0
        for c in range(12):
            total += 0.0 * M.pose[m, c]
        for c in range(6):
            total += 0.0 * M.twist[m, c]
        if not total == 0.0:
            return m
        a, b, c = M.twist[m, 0], M.twist[m, 1], M.twist[m, 2]
        v = (v[0] + a, v[1] + b, v[2] + c)
        v2 += a * a + b * b + c * c
    mean2 = (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]) / max(1.0, n)  # n times the square of the mean velocity
    goes = n > 1.0 and mean2 > (FRAME_STARTS if B.count[FRAME_MOVES] == 0 else FRAME_STOPS) * v2
    for s in range(B.count[BOUNDED] + B.count[WIDE]):  # fixed shapes may stop movers
        goes = goes and B.slot[s, SLOT_MOVER] >= 0
    slow = SLOWEST_FRAME * B.real[SKIN] * B.real[TYPICAL_RADIUS]
    goes = goes and mean2 * (ENVELOPE_STEPS * B.real[AHEAD]) ** 2 > n * slow * slow
    for c in range(3):
        B.real[FRAME_VELOCITY + c] = v[c] / n if goes else 0.0
    B.count[FRAME_MOVES] = 1 if goes else 0
    return -1


@formula
def advance_frame(B, n, displacement):
    """Compute the frame's displacement for the next search: the mean displacement of all n shapes, plus the lag.

    ``displacement`` is the sum of their displacements since the last search.
    """
    for c in range(3):
        if B.count[FRAME_MOVES] != 0 and n > 0.0:
            B.real[FRAME_LAG + c] += displacement[c] / n - B.real[FRAME_STEP + c]
            B.real[FRAME_STEP + c] = displacement[c] / n + B.real[FRAME_LAG + c]
        else:
            B.real[FRAME_LAG + c] = B.real[FRAME_STEP + c] = 0.0


@formula
def update_slots(G, M, B):
    """Update all slots; those that have left their envelopes are marked and listed in ``moved``.

    Returns the number of movable shapes, and the sum of their displacements.
    """
    moved, n, way = 0, 0.0, (0.0, 0.0, 0.0)
    now = B.now
    for s in range(B.count[BOUNDED]):
        m, i, ball = B.slot[s, SLOT_MOVER], B.slot[s, SLOT_SHAPE], B.slot[s, SLOT_FORM] == IS_SPHERE
        if m >= 0:
            x, y, z = now[s, CENTRE], now[s, CENTRE + 1], now[s, CENTRE + 2]
            update_motion(M, B, i, m, ball, now, s)
            way = (way[0] + now[s, CENTRE] - x, way[1] + now[s, CENTRE + 1] - y, way[2] + now[s, CENTRE + 2] - z)
            n += 1.0
            if not ball:
                update_axes(G, M, B, s, i, m)
        B.mark[s] = 0
        if not is_inside_envelope(B, s, ball):
            B.mark[s] = 1
            B.moved[moved] = s
            moved += 1
    for w in range(B.count[WIDE]):
        s = B.count[BOUNDED] + w
        update_plane(G, M, B, w, B.slot[s, SLOT_SHAPE], B.slot[s, SLOT_MOVER])
        B.mark[s] = 0
        if plane_exceeds_slack(B, w):
            B.mark[s] = 1
            B.moved[moved] = s
            moved += 1
    B.count[MOVED_SLOTS] = moved
    return n, way
