"""Envelopes of shapes: computed from position and velocity, and checked every step.

An envelope is a capsule that contains a shape, with its motion, for several steps. Unbounded shapes (planes,
and height fields below a plane) store the position at which their pairs were listed, and a slack. `update_slots`
updates all shapes and marks those that have left their envelopes; `set_frame` decides whether the frame of the
envelopes moves.
"""

from __future__ import annotations

from ..compiler.formulas import formula
from ..math.scalar import sqrt
from ..math.vec import add, cross, load3, load9, mv, norm, scale, store3, sub
from .tables import IS_SPHERE


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
    """Write centre and velocity of shape i to row s of ``row``."""
    c = load3(B.hold.centre, i, 0)
    w = (0.0, 0.0, 0.0)
    p, v = c, w
    if m >= 0:
        p, v, w = load3(M.pose, m, 0), load3(M.twist, m, 0), load3(M.twist, m, 3)
        if c[0] != 0.0 or c[1] != 0.0 or c[2] != 0.0:
            a = rotate_by_mover(M, m, c)
            p, v = add(p, a), velocity_at_offset(M, m, a)
    store3(row.centre, s, 0, p)
    store3(row.velocity, s, 0, v)
    row.radius[s] = B.hold.radius[i]
    row.turning_speed[s] = 0.0 if ball else B.hold.radius[i] * norm(w)


@formula
def update_axes(G, M, B, s, i, m):
    """Compute the axes of slot s, shape i of mover m, in world axes."""
    for c in range(3):
        a = (G.dimensions.axes[i, c], G.dimensions.axes[i, 3 + c], G.dimensions.axes[i, 6 + c])
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
def write_envelope(B, now, envelope, s, still):
    """Compute envelope s from the motion in row s of ``now``.

    Returns the largest radius of its bounding sphere after the shape has gained some speed.
    """
    r, spin = now.radius[s], now.turning_speed[s]
    u = (
        now.velocity[s, 0] - B.frame.velocity[0],
        now.velocity[s, 1] - B.frame.velocity[1],
        now.velocity[s, 2] - B.frame.velocity[2],
    )
    speed = sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2])
    size = min(r, LARGEST_SKIN * B.real.typical_radius)
    skin = B.real.skin * size
    if still and B.count.frame_moves == 0:
        skin = 0.0
    time = ENVELOPE_STEPS * B.real.horizon
    if (speed + spin) * time > ENVELOPE_LEAD * size:
        time = ENVELOPE_LEAD * size / (speed + spin)
    time += B.real.horizon
    half = 0.5 * time
    for c in range(3):
        envelope.middle[s, c] = now.centre[s, c] - B.frame.origin[c] + half * u[c]
        envelope.half_line[s, c] = half * u[c]
    envelope.radius[s] = r + 0.5 * B.real.margin + skin + spin * time
    whole = envelope.radius[s] + half * speed
    envelope.bound[s] = whole
    later = r + 0.5 * B.real.margin + skin + 0.6 * ENVELOPE_LEAD * size
    return whole if still or whole > later else later


@formula
def squared_distance_to_axis(fat, s, x, y, z):
    """Squared distance of a point, relative to the capsule's middle, from its axis."""
    a, b, c = fat.half_line[s, 0], fat.half_line[s, 1], fat.half_line[s, 2]
    e2 = a * a + b * b + c * c
    if e2 > 0.0:
        t = min(1.0, max(-1.0, (x * a + y * b + z * c) / e2))
        x, y, z = x - t * a, y - t * b, z - t * c
    return x * x + y * y + z * z


@formula
def is_inside_envelope(B, s, ball):
    """Whether a shape, with its motion in ``ahead`` seconds, is within its envelope."""
    now, fat, real, frame = B.now, B.envelope, B.real, B.frame
    allowed = fat.radius[s] - now.radius[s] - 0.5 * real.margin
    if not ball:
        allowed -= now.radius[s] * chord(B, s)
    x = now.centre[s, 0] - frame.origin[0] - fat.middle[s, 0]
    y = now.centre[s, 1] - frame.origin[1] - fat.middle[s, 1]
    z = now.centre[s, 2] - frame.origin[2] - fat.middle[s, 2]
    tiny = 1e-12 * now.radius[s]
    if allowed < -tiny or squared_distance_to_axis(fat, s, x, y, z) > (allowed + tiny) ** 2:
        return False
    x += (now.velocity[s, 0] - frame.velocity[0]) * real.horizon
    y += (now.velocity[s, 1] - frame.velocity[1]) * real.horizon
    z += (now.velocity[s, 2] - frame.velocity[2]) * real.horizon
    allowed -= now.turning_speed[s] * real.horizon
    return allowed >= -tiny and squared_distance_to_axis(fat, s, x, y, z) <= (allowed + tiny) ** 2


@formula
def squared_distance_to_box(B, axes, s, d):
    """Squared distance from the box of slot s, with these axes, of a point at d from its centre."""
    total, i = 0.0, B.slot.shape_index[s]
    for c in range(3):
        a = abs(axes[s, c] * d[0] + axes[s, 3 + c] * d[1] + axes[s, 6 + c] * d[2]) - B.hold.half_edges[i, c]
        total += a * a if a > 0.0 else 0.0
    return total


@formula
def half_extent(B, axes, s, n):
    """Half extent of slot s along a unit vector."""
    if B.slot.form[s] == IS_SPHERE:
        return B.now.radius[s]
    total, i = 0.0, B.slot.shape_index[s]
    for c in range(3):
        a = axes[s, c] * n[0] + axes[s, 3 + c] * n[1] + axes[s, 6 + c] * n[2]
        total += B.hold.half_edges[i, c] * abs(a)
    return min(total, B.now.radius[s])


@formula
def boxes_meet(B, axes, s, t, d, reach):
    """Whether boxes with these axes, the second at d from the first, are within ``reach`` of each other.

    Tests the six axes of their faces only; boxes with crossing edges may be farther apart.
    """
    i, j = B.slot.shape_index[s], B.slot.shape_index[t]
    for side in range(2):
        u, v, k, m = (s, t, i, j) if side == 0 else (t, s, j, i)
        for c in range(3):
            a = (axes[u, c], axes[u, 3 + c], axes[u, 6 + c])
            whole = B.hold.half_edges[k, c] + reach
            for e in range(3):
                b = a[0] * axes[v, e] + a[1] * axes[v, 3 + e] + a[2] * axes[v, 6 + e]
                whole += B.hold.half_edges[m, e] * abs(b)
            if abs(d[0] * a[0] + d[1] * a[1] + d[2] * a[2]) > whole:
                return False
    return True


@formula
def bounds_meet(B, axes, s, t, d, reach):
    """Whether the boxes of two slots are within ``reach`` of each other; spheres are tested as such."""
    if B.slot.form[s] == IS_SPHERE:
        if B.slot.form[t] == IS_SPHERE:
            return True
        return squared_distance_to_box(B, axes, t, d) <= (reach + B.now.radius[s]) ** 2
    if B.slot.form[t] == IS_SPHERE:
        return squared_distance_to_box(B, axes, s, d) <= (reach + B.now.radius[t]) ** 2
    return boxes_meet(B, axes, s, t, d, reach)


@formula
def update_plane(G, M, B, w, i, m):
    """Compute origin, normal and velocity of the plane of wide shape ``w``."""
    x, top = G.dimensions, B.hold.half_edges[i, 0]
    n = (x.axes[i, 2], x.axes[i, 5], x.axes[i, 8])
    p = add(load3(x.place, i, 0), scale(top, n))
    v = (0.0, 0.0, 0.0)
    u = v
    if m >= 0:
        a, n = rotate_by_mover(M, m, p), rotate_by_mover(M, m, n)
        p, u, v = add(load3(M.pose, m, 0), a), load3(M.twist, m, 3), velocity_at_offset(M, m, a)
    store3(B.wide.origin, w, 0, p)
    store3(B.wide.normal, w, 0, n)
    store3(B.wide.velocity, w, 0, v)
    store3(B.wide.spin, w, 0, u)


@formula
def plane_advance(B, w):
    """Advance of a plane along its normal in ``ahead`` seconds, relative to the frame."""
    x = B.wide
    a = x.normal[w, 0] * (x.velocity[w, 0] - B.frame.velocity[0])
    a += x.normal[w, 1] * (x.velocity[w, 1] - B.frame.velocity[1])
    a += x.normal[w, 2] * (x.velocity[w, 2] - B.frame.velocity[2])
    return B.real.horizon * max(0.0, a)


@formula
def plane_exceeds_slack(B, w):
    """Whether a wide shape has moved so far that it may have new pairs."""
    x, along, turned = B.wide, 0.0, 0.0
    for c in range(3):
        along += x.normal[w, c] * (x.origin[w, c] - B.frame.origin[c] - x.reference_origin[w, c])
        turned += abs(x.normal[w, c] - x.reference_normal[w, c]) + abs(x.spin[w, c])
    return turned > 0.0 or abs(along) + plane_advance(B, w) > x.slack[w]


@formula
def store_reference_plane(B, w, still):
    """Store the position of a wide shape for which its pairs are listed."""
    for c in range(3):
        B.wide.reference_origin[w, c] = B.wide.origin[w, c] - B.frame.origin[c]
        B.wide.reference_normal[w, c] = B.wide.normal[w, c]
    B.wide.slack[w] = 0.0
    if not still or B.count.frame_moves != 0:
        B.wide.slack[w] = B.real.skin * B.real.typical_radius + plane_advance(B, w)


@formula
def envelope_reaches_plane(B, w, s):
    """Whether the envelope of slot s reaches below the plane of a wide shape."""
    x, gap, lead = B.wide, 0.0, 0.0
    far, turns = 0.0, 0.0
    for c in range(3):
        a = B.envelope.middle[s, c] + B.frame.origin[c] - x.origin[w, c]
        gap += x.normal[w, c] * a
        lead += x.normal[w, c] * B.envelope.half_line[s, c]
        far += a * a
        turns += x.spin[w, c] ** 2
    deep = half_extent(B, B.turn, s, (x.normal[w, 0], x.normal[w, 1], x.normal[w, 2]))
    reach = B.envelope.radius[s] + 0.5 * B.real.margin - B.now.radius[s] + deep + x.slack[w]
    if turns > 0.0:
        reach += B.real.horizon * sqrt(turns * far)
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
    goes = n > 1.0 and mean2 > (FRAME_STARTS if B.count.frame_moves == 0 else FRAME_STOPS) * v2
    for s in range(B.count.bounded + B.count.wide):  # fixed shapes may stop movers
        goes = goes and B.slot.mover[s] >= 0
    slow = SLOWEST_FRAME * B.real.skin * B.real.typical_radius
    goes = goes and mean2 * (ENVELOPE_STEPS * B.real.horizon) ** 2 > n * slow * slow
    for c in range(3):
        B.frame.velocity[c] = v[c] / n if goes else 0.0
    B.count.frame_moves = 1 if goes else 0
    return -1


@formula
def advance_frame(B, n, displacement):
    """Compute the frame's displacement for the next search: the mean displacement of all n shapes, plus the lag.

    ``displacement`` is the sum of their displacements since the last search.
    """
    for c in range(3):
        if B.count.frame_moves != 0 and n > 0.0:
            B.frame.lag[c] += displacement[c] / n - B.frame.step[c]
            B.frame.step[c] = displacement[c] / n + B.frame.lag[c]
        else:
            B.frame.lag[c] = B.frame.step[c] = 0.0


@formula
def update_slots(G, M, B):
    """Update all slots; those that have left their envelopes are marked and listed in ``moved``.

    Returns the number of movable shapes, and the sum of their displacements.
    """
    moved, n, way = 0, 0.0, (0.0, 0.0, 0.0)
    now = B.now
    for s in range(B.count.bounded):
        m, i, ball = B.slot.mover[s], B.slot.shape_index[s], B.slot.form[s] == IS_SPHERE
        if m >= 0:
            x, y, z = now.centre[s, 0], now.centre[s, 1], now.centre[s, 2]
            update_motion(M, B, i, m, ball, now, s)
            way = (way[0] + now.centre[s, 0] - x, way[1] + now.centre[s, 1] - y, way[2] + now.centre[s, 2] - z)
            n += 1.0
            if not ball:
                update_axes(G, M, B, s, i, m)
        B.mark[s] = 0
        if not is_inside_envelope(B, s, ball):
            B.mark[s] = 1
            B.moved[moved] = s
            moved += 1
    for w in range(B.count.wide):
        s = B.count.bounded + w
        update_plane(G, M, B, w, B.slot.shape_index[s], B.slot.mover[s])
        B.mark[s] = 0
        if plane_exceeds_slack(B, w):
            B.mark[s] = 1
            B.moved[moved] = s
            moved += 1
    B.count.moved_slots = moved
    return n, way
