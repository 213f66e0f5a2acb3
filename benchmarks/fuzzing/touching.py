"""Contact judged from outside: gaps by simple geometry, cones, force = mass x acceleration, losses, closed forms."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from typing import Any

import numpy as np

import flyball as fb

from .gaps import dots, norms
from .physics import ANGULAR, BALANCED, DRIFT, SLOW, Finding, constraints, energies, momenta, springs, x_size
from .poses import Array, Motion, spatial

OVERLAP = 1e-6  # of the size, from touch to touch
OVERLAP_STEPS = 5e-3  # of the size, in impulse time stepping
CONE = 1e-6  # of the largest contact force
CONE_STEPS = 1e-4
SLIDES = 1e-3  # of the fastest speed: what slides faster has friction against its slip
LOSS = 1e-2  # of what energy may be gained
GAIN, GAIN_STEPS = 1e-6, 5e-3  # of energy, relative to what moves
KNOWN = 1e-6  # deviation from a closed form, of its size
Z = np.array([0.0, 0.0, 1.0])


def by_steps(x: Motion) -> bool:
    """Whether the motion was stepped by impulses."""
    return str(x.run.health.method).startswith("impulse time stepping")


def corners(x: Motion, name: str, edges: Any) -> Array:
    """Of a box over time, (n, 8, 3)."""
    signs = np.array(list(itertools.product((-0.5, 0.5), repeat=3)))
    if x.m.planar:
        signs[:, 2] = 0.0
    local = signs * np.asarray(edges, float)
    return x.of(name, "position")[:, None, :] + np.einsum("nij,kj->nki", x.of(name, "rotation"), local)


def shapes(x: Motion) -> dict[str, Any]:
    return {b.name: (b.shape[0] if isinstance(b.shape, tuple) else b.shape) for b in x.m.bodies if b.shape is not None}


def plane(x: Motion) -> tuple[str, Array] | None:
    """The only ground, through the origin: its name and normal."""
    for e in x.m.ground:
        s = e.shape[0] if isinstance(e.shape, tuple) else e.shape
        if isinstance(s, fb.Plane):
            n = (0.0, 1.0, 0.0) if x.m.planar else Z
            n = n if s.normal is None else s.normal
            return e.name, spatial(n) / np.linalg.norm(n)
    return None


def _ends(x: Motion, name: str, s: Any) -> Array:
    """Of a capsule's axis, (n, 2, 3): along its own z, in the plane along x."""
    a = np.array([1.0, 0, 0]) if x.m.planar else Z
    return (
        x.of(name, "position")[:, None, :]
        + np.array([-0.5, 0.5])[:, None] * s.length * (x.of(name, "rotation") @ a)[:, None, :]
    )


def gaps(x: Motion) -> Iterator[tuple[str, str, Array]]:
    """(first, second, gap over time) of pairs whose distance is simple."""
    every, floor = shapes(x), plane(x)
    for name, s in every.items():
        if floor is None:
            break
        ground, n = floor
        if isinstance(s, fb.Sphere):
            yield ground, name, x.of(name, "position") @ n - s.radius
        elif isinstance(s, fb.Box):
            yield ground, name, (corners(x, name, s.edges) @ n).min(axis=1)
        elif isinstance(s, fb.Capsule):
            yield ground, name, (_ends(x, name, s) @ n).min(axis=1) - s.radius
    for (a, s), (b, q) in itertools.combinations(every.items(), 2):
        if isinstance(s, fb.Sphere) and isinstance(q, fb.Sphere):
            yield a, b, norms(x.of(b, "position") - x.of(a, "position")) - s.radius - q.radius
        elif isinstance(s, fb.Sphere) or isinstance(q, fb.Sphere):
            box, ball = (b, a) if isinstance(s, fb.Sphere) else (a, b)
            if isinstance(every[box], fb.Box):
                yield box, ball, _box_ball(x, box, every[box], ball, every[ball])


def _box_ball(x: Motion, box: str, s: Any, ball: str, q: Any) -> Array:
    local = np.einsum("nji,nj->ni", x.of(box, "rotation"), x.of(ball, "position") - x.of(box, "position"))
    half = 0.5 * np.asarray(s.edges, float)
    if x.m.planar:
        local, half = local[:, :2], half[:2]
    out = np.abs(local) - half
    outside = np.sqrt((np.maximum(out, 0.0) ** 2).sum(axis=1))
    return np.where(out.max(axis=1) > 0, outside, out.max(axis=1)) - q.radius


def tolerated(x: Motion, size: float) -> float:
    """How far a hard thing may be inside another, and a gap of the table from that of the poses [m].

    A step by impulses keeps a gap to its first order: along the tangent plane at the step's begin a ball of radius r
    that moves by d leaves its plane by d^2 / (2 r).
    """
    if not by_steps(x):
        return OVERLAP * size
    least = min((s.radius for s in shapes(x).values() if hasattr(s, "radius")), default=np.inf)
    fast = max(norms(x.of(b.name, "velocity")).max() for b in x.m.bodies)
    return OVERLAP_STEPS * size + float((fast * np.diff(x.t).max()) ** 2 / (2.0 * least))


def overlaps(x: Motion) -> Iterator[Finding]:
    """Nothing hard is inside another; gaps of the table of contacts are those of the poses."""
    size = max(max((getattr(s, "radius", 0.1) for s in shapes(x).values()), default=0.1), 1e-9)
    hard = all(c.law in (None, "hard") for c in x.m.contacts)
    allowed = tolerated(x, size)
    c, names = x.run.contacts, None
    for a, b, gap in gaps(x):
        if hard and not -gap.min() <= allowed:
            yield Finding("overlap", f"{a} and {b}", float(-gap.min()), allowed)
        if c is None or not len(c) or len(x.m.ground) > 1:
            continue
        names = names if names is not None else list(c.names())
        for k, pair in enumerate(names):
            if {_plain(p, x) for p in pair} == {_plain(a, x), b}:
                if by_steps(x) and not _every_step(x):
                    continue
                # a step's contacts are those that it began with
                bad = abs(float(c.gap[k]) - float(gap[max(c.when[k] - by_steps(x), 0)]))
                of_table = allowed if by_steps(x) else 1e-8 * size
                if isinstance(shapes(x)[b], fb.Sphere) and bad > of_table:
                    yield Finding("gap in the table", f"{a} and {b} at {x.t[c.when[k]]:.6g} s", bad, of_table)
                    return


def _plain(name: str, x: Motion) -> str:
    return "ground" if name in {e.name for e in x.m.ground} or name == "ground" else name


def _slip(x: Motion, k: int, pair: tuple[str, str], point: Array) -> Array:
    """Velocity of the second side relative to the first at a point."""
    v = []
    for name in pair:
        body = name if name in x.drawn and name != "ground" else "ground"
        v.append(
            x.of(body, "velocity")[k] + np.cross(x.of(body, "angular_velocity")[k], point - x.of(body, "position")[k])
        )
    return v[1] - v[0]


def cones(x: Motion) -> Iterator[Finding]:
    """Normal forces press, friction is within its cone, and against the slip where it slides."""
    c = x.run.contacts
    if c is None or not len(c) or len(x.m.contacts) != 1 or x.m.materials:
        return
    mu = x.m.contacts[0].friction or 0.0
    force, normal, steps = np.asarray(c.force), np.asarray(c.normal), by_steps(x)
    pressed = dots(force, normal)
    sideways = force - pressed[:, None] * normal
    largest = norms(force).max()
    tol = (CONE_STEPS if steps else CONE) * largest + 1e-12
    if pressed.min() < -tol:
        yield Finding("contact pulls", str(list(c.names())[int(pressed.argmin())]), float(-pressed.min()), tol)
    over = norms(sideways) - mu * pressed
    if over.max() > tol:
        k = int(over.argmax())
        yield Finding("outside the cone", f"{list(c.names())[k]} at {x.t[c.when[k]]:.6g} s", float(over.max()), tol)
    fast = max(np.abs(x.of(b.name, "velocity")).max() for b in x.m.bodies) + SLOW * x_size(x) / (x.t[-1] - x.t[0])
    names, worst, where = list(c.names()), 0.0, 0
    for k in range(len(c)):
        if pressed[k] <= 10 * tol or steps:
            continue
        slip = _slip(x, int(c.when[k]), names[k], np.asarray(c.point[k]))
        slip = slip - (slip @ normal[k]) * normal[k]
        if np.linalg.norm(slip) > SLIDES * fast:
            bad = np.linalg.norm(sideways[k] + mu * pressed[k] * slip / np.linalg.norm(slip))
            if bad > worst:
                worst, where = bad, k
    if worst > 1e-5 * largest:
        yield Finding(
            "friction not against the slip", f"{names[where]} at {x.t[c.when[where]]:.6g} s", worst, 1e-5 * largest
        )


def _impacts(x: Motion) -> Array:
    return np.array([h.t for h in x.run.events])


def balances(x: Motion) -> Iterator[Finding]:
    """Force = mass x acceleration of free bodies; in steps the change of momentum is the impulse of the step."""
    c = x.run.contacts
    joined = {b for e in x.m.joints for b in (e.body_i, e.body_j)} | {b for f in x.m.forces for b in _on(f)}
    g = spatial(np.asarray(x.m.gravity, float))
    for name, (mass, inertia) in x.masses.items():
        if name in joined or c is None:
            continue
        force, torque, terms = _sums(x, name)
        centre, v, a = x.at_centre(name)
        del centre
        if by_steps(x):
            if not _every_step(x):
                continue
            want = mass * np.diff(v, axis=0)
            got = (force[1:] + mass * g) * np.diff(x.t)[:, None]
            allowed = 1e-6 * (mass * np.abs(v).max() + np.abs(got).max() + mass * np.abs(g).max() * np.diff(x.t).max())
            what = "impulse = change of momentum"
        else:
            want, got = mass * a, force + mass * g
            allowed = BALANCED * (np.abs(want).max() + np.abs(force).max() + mass * np.abs(g).max())
            what = "force = mass x acceleration"
            quiet = ~np.isin(np.round(x.t, 12), np.round(_impacts(x), 12))
            want, got, torque = want[quiet], got[quiet], torque[quiet]
            yield from _euler(x, name, inertia, (torque, terms), quiet)
        bad = float(np.abs(want - got).max(initial=0.0))
        if not bad <= allowed:
            yield Finding(what, name, bad, float(allowed))


def _euler(x: Motion, name: str, inertia: Array, sums: tuple[Array, float], quiet: Array) -> Iterator[Finding]:
    """``sums``: the sum of torques, and how large they are together that it is the difference of."""
    torque, terms = sums
    R, w, al = (x.of(name, k)[quiet] for k in ("rotation", "angular_velocity", "angular_acceleration"))
    tensor = np.einsum("nij,jk,nlk->nil", R, inertia, R)
    want = np.einsum("nij,nj->ni", tensor, al) + np.cross(w, np.einsum("nij,nj->ni", tensor, w))
    if x.m.planar:
        want, torque = want[:, 2:], torque[:, 2:]
    size = np.abs(want).max(initial=0.0) + terms + np.abs(tensor).max(initial=0.0) * np.abs(w).max(initial=0.0) ** 2
    bad = np.abs(want - torque).max(initial=0.0)
    if bad > 1e-6 * size + 1e-11:
        yield Finding("Euler's equation", name, float(bad), 1e-6 * float(size))


def _every_step(x: Motion) -> bool:
    method = x.run.health.steps
    return method is not None and abs(int(method) - (x.n - 1)) <= 0


def _on(f: Any) -> list[str]:
    return [getattr(f, k) for k in ("body_i", "body_j", "body") if hasattr(f, k)]


def _sums(x: Motion, name: str) -> tuple[Array, Array, float]:
    """Sum of contact forces on a body, and of their torques about its mass centre, from the table of contacts.

    Last the largest sum of the sizes of these torques.
    """
    c = x.run.contacts
    force, torque, terms = np.zeros((x.n, 3)), np.zeros((x.n, 3)), np.zeros(x.n)
    centre = x.at_centre(name)[0]
    for k, (a, b) in enumerate(c.names()):
        sign = 1.0 if b == name else -1.0 if a == name else 0.0
        if sign:
            F = sign * np.asarray(c.force[k])
            i = int(c.when[k])
            force[i] += F
            one = np.cross(np.asarray(c.point[k]) - centre[i], F)
            torque[i] += one
            terms[i] += np.abs(one).max()
    return force, torque, float(terms.max(initial=0.0))


def losses(x: Motion) -> Iterator[Finding]:
    """Friction and impacts take energy and give none; what is lost is what mechanical energy lacks."""
    if set(x.masses) != {b.name for b in x.m.bodies} or x.m.materials:
        return
    elastic, every = springs(x)
    if not every or any(c.law not in (None, "hard") for c in x.m.contacts):
        return
    kinetic, weight = x.kinetic(), x.gravity()
    total = kinetic + weight + sum(elastic.values(), np.zeros(x.n))
    works = sum(x.run.energy.work.values(), np.zeros(x.n))
    at_rest = (
        sum(v[0] for v in x.masses.values()) * float(np.abs(x.m.gravity).max()) * 1e-4
    )  # a weight, a tenth of a millimetre
    moved = kinetic.max() + np.ptp(weight) + at_rest + 1e-12
    tol = (GAIN_STEPS if by_steps(x) else GAIN) * moved
    gain = float((total - np.minimum.accumulate(total)).max())
    if gain > tol and not any(isinstance(f, fb.Motor | fb.Actuator) for f in x.m.forces):
        yield Finding("energy is gained", "kinetic and potential", gain, tol)
    lost = {k: np.asarray(getattr(x.run.energy, k)) for k in ("friction_loss", "impact_loss")}
    alone = np.abs(np.diff(lost["impact_loss"], prepend=0.0)) <= LOSS * tol  # an impact takes from both at once
    lost["sum"] = lost["friction_loss"] + lost["impact_loss"]
    for k, v in lost.items():
        if k == "impact_loss" and by_steps(x):
            continue  # how a step's loss is shared between both is a convention
        fall = float(-np.diff(v, prepend=0.0)[alone if k == "friction_loss" else slice(None)].min(initial=0.0))
        allowed = tol if by_steps(x) else LOSS * tol
        if fall > allowed:
            yield Finding("a loss falls", k, fall, allowed)
    del works
    if "numerical_loss" in x.run.energy.names:  # of the steps themselves
        lost["sum"] = lost["sum"] + np.asarray(x.run.energy.numerical_loss)
    missing = total[0] - total - lost["sum"] + _damped(x)
    bad = float(np.abs(missing).max())
    allowed = 4.0 * tol if by_steps(x) else max(tol, DRIFT * moved)
    if bad > allowed:
        yield Finding("losses and energy", "total", bad, allowed)


def _damped(x: Motion) -> Array:
    """Work of dampers that the result has, without that of friction at places of contact."""
    names = {f.name for f in x.m.forces}
    return sum((w for k, w in x.run.energy.work.items() if k in names), np.zeros(x.n))


def known(x: Motion, family: str) -> Iterator[Finding]:
    """Closed forms."""
    form = FORMS.get(family)
    if form is None:
        return
    for what, mine, its, size in form(x):
        bad = float(np.abs(mine - its).max(initial=0.0))
        step = np.median(np.diff(x.t)) if by_steps(x) else 0.0
        allowed = KNOWN * size if not by_steps(x) else STEP_ERROR * step * size
        if not bad <= allowed:
            yield Finding("closed form", what, bad, float(allowed))


STEP_ERROR = 30.0  # 1/s: error of a motion by impulses per second of step, relative to the motion's size


def _blow(vn: float, vt: Array, e: float, mu: float, give_n: float, give_t: float) -> tuple[float, Array]:
    """Normal and tangential impulse of two balls that approach with vn > 0 and slip by vt."""
    jn = (1.0 + e) * vn / give_n
    slip = np.linalg.norm(vt)
    jt = min(mu * jn, slip / give_t)
    return jn, -jt * vt / slip if slip > 0 else 0.0 * vt


def _bounce(x: Motion) -> Iterator[tuple]:
    """A ball on the floor by parabolas and impulses, until it hardly bounces."""
    (name, s), (_, n) = next(iter(shapes(x).items())), plane(x)  # type: ignore[misc]
    c = x.m.contacts[0]
    mass, inertia = x.masses[name]
    I, r, g = inertia[2, 2], s.radius, spatial(np.asarray(x.m.gravity, float))
    p, v, w, t = (x.of(name, k)[0].copy() for k in ("position", "velocity", "angular_velocity")), None, None, 0.0
    p, v, w = p
    places, speeds = np.full((x.n, 3), np.nan), np.full((x.n, 3), np.nan)
    while True:
        a, b, h = 0.5 * (g @ n), v @ n, p @ n - r
        root = b * b - 4 * a * max(h, 0.0)
        hit = t + (-b - math.sqrt(root)) / (2 * a)
        inside = (x.t >= t) & (x.t < hit - 1e-9)
        s_ = (x.t[inside] - t)[:, None]
        places[inside], speeds[inside] = p + v * s_ + 0.5 * g * s_**2, v + g * s_
        if hit > x.t[-1]:
            break
        p, v = p + v * (hit - t) + 0.5 * g * (hit - t) ** 2, v + g * (hit - t)
        t, vn = hit, -(v @ n)
        if vn < 0.2:
            break
        slip = v + np.cross(w, -r * n)
        slip = slip - (slip @ n) * n
        jn, jt = _blow(vn, slip, c.restitution or 0.0, c.friction or 0.0, 1 / mass, 1 / mass + r * r / I)
        v = v + (jn * n + jt) / mass
        w = w + np.cross(-r * n, jt) / I
        if (c.restitution or 0.0) * vn < 0.2:
            break
    done = np.isfinite(places).all(axis=1)
    yield "position", places[done], x.of(name, "position")[done], np.abs(places[done]).max()
    if not by_steps(x):  # whose instants are off by a step
        yield "velocity", speeds[done], x.of(name, "velocity")[done], np.abs(speeds[done]).max()


def _roll(x: Motion) -> Iterator[tuple]:
    """A sliding ball: mu g until it rolls."""
    (name, s), c = next(iter(shapes(x).items())), x.m.contacts[0]
    mass, inertia = x.masses[name]
    I, r, g = inertia[2, 2], s.radius, float(np.abs(x.m.gravity).max())
    v = x.of(name, "velocity")[0, 0]
    w = -x.of(name, "angular_velocity")[0, 2] if x.m.planar else x.of(name, "angular_velocity")[0, 1]
    slip = v - r * w
    a = -np.sign(slip) * c.friction * g
    stop = abs(slip) / (c.friction * g * (1 + mass * r * r / I))
    s_ = np.minimum(x.t, stop)
    speed = v + a * s_
    yield "speed", speed, x.of(name, "velocity")[:, 0], max(abs(v), r * abs(w))
    place = v * s_ + 0.5 * a * s_**2 + (v + a * stop) * (x.t - s_)
    yield "way", place, x.of(name, "position")[:, 0], max(abs(v), r * abs(w)) * x.t[-1]
    energy = 0.5 * mass * (v**2 - speed**2) + 0.5 * I * (w**2 - (w - mass * r / I * a * s_) ** 2)
    yield "friction_loss", energy, np.asarray(x.run.energy.friction_loss), 0.5 * mass * v**2 + 0.5 * I * w**2


def _slide(x: Motion) -> Iterator[tuple]:
    """A box on a slope: it slides with g (sin - mu cos), or stays."""
    (name, _), (_, n), c = next(iter(shapes(x).items())), plane(x), x.m.contacts[0]  # type: ignore[misc]
    g = float(np.abs(x.m.gravity).max())
    sine, cosine = -n[0], float(n[1] if x.m.planar else n[2])
    down = np.array([-cosine, -sine, 0]) if x.m.planar else np.array([-cosine, 0, -sine])
    v0 = float(x.of(name, "velocity")[0] @ down)
    v, t, way = v0, 0.0, np.zeros(x.n)
    mu, start = c.friction, x.of(name, "position")[0]
    u, place, begin = v, 0.0, 0.0
    del v, t
    while True:
        sign = np.sign(u)
        pulls = g * sine
        if sign == 0:
            a = 0.0 if pulls <= mu * g * cosine else pulls - mu * g * cosine
        else:
            a = pulls - sign * mu * g * cosine
        end = begin - u / a if sign and u * a < 0 else np.inf
        now = (x.t >= begin) & (x.t <= end)
        s_ = x.t[now] - begin
        way[now] = place + u * s_ + 0.5 * a * s_**2
        if end > x.t[-1]:
            break
        place, u, begin = place + u * (end - begin) + 0.5 * a * (end - begin) ** 2, 0.0, end
    size = max(abs(v0) * x.t[-1], 0.5 * g * x.t[-1] ** 2)
    yield "way", way, (x.of(name, "position") - start) @ down, size


def _collide(x: Motion) -> Iterator[tuple]:
    """Two balls: before they meet and after, by restitution and Coulomb's law."""
    (a, s), (b, q) = shapes(x).items()
    c, g = x.m.contacts[0], spatial(np.asarray(x.m.gravity, float))
    P, V, W = ([x.of(k, what)[0] for k in (a, b)] for what in ("position", "velocity", "angular_velocity"))
    d, u, R = P[1] - P[0], V[1] - V[0], s.radius + q.radius
    A, B, C = u @ u, d @ u, d @ d - R * R
    if B >= 0 or B * B - A * C <= 1e-4 * B * B or C <= 0:
        return
    hit = (-B - math.sqrt(B * B - A * C)) / A
    n = (d + u * hit) / R
    radius, m = (s.radius, q.radius), [x.masses[k][0] for k in (a, b)]
    I = [x.masses[k][1][2, 2] for k in (a, b)]
    slip = u + np.cross(W[1], -radius[1] * n) - np.cross(W[0], radius[0] * n)
    slip = slip - (slip @ n) * n
    give_t = 1 / m[0] + 1 / m[1] + radius[0] ** 2 / I[0] + radius[1] ** 2 / I[1]
    jn, jt = _blow(-(u @ n), slip, c.restitution or 0.0, c.friction or 0.0, 1 / m[0] + 1 / m[1], give_t)
    late = x.t > hit + 2e-2
    for k, (name, sign) in enumerate(((a, -1.0), (b, 1.0))):
        v = V[k] + sign * (jn * n + jt) / m[k] + g * x.t[late][:, None]
        yield f"velocity of {name}", v, x.of(name, "velocity")[late], np.abs(V).max() + np.abs(v).max(initial=0.0)
        spin = W[k] + np.cross((radius[0] if k == 0 else -radius[1]) * n, sign * jt) / I[k]
        its = x.of(name, "angular_velocity")[late]
        yield f"spin of {name}", np.broadcast_to(spin, its.shape), its, np.abs(W).max() + np.abs(spin).max() + 1e-3


def _slow(x: Motion) -> Iterator[tuple]:
    """A ball that rolls, or spins on the spot, is slowed evenly by a torque of an arm times its weight."""
    (name, s), c, g = next(iter(shapes(x).items())), x.m.contacts[0], float(np.abs(x.m.gravity).max())
    mass, inertia = x.masses[name]
    I, v0, w0 = inertia[2, 2], x.of(name, "velocity")[0, 0], x.of(name, "angular_velocity")[0, 2]
    a = c.rolling_friction * g / s.radius / (1.0 + I / (mass * s.radius**2))
    yield "speed", np.maximum(v0 - a * x.t, 0.0), x.of(name, "velocity")[:, 0], max(v0, 0.1)
    b = c.spinning_friction * mass * g / I
    yield "spin", np.maximum(w0 - b * x.t, 0.0), x.of(name, "angular_velocity")[:, 2], max(w0, 0.1)


def _carry(x: Motion) -> Iterator[tuple]:
    """A box on a belt: friction times weight along the belt until it has the belt's speed."""
    belt, g = np.asarray(x.m["belt"].surface_velocity, float), float(np.abs(x.m.gravity).max())
    mu = math.sqrt(x.m["belt"].friction * x.m["dry"].friction)
    speed = np.linalg.norm(belt)
    want = np.minimum(mu * g * x.t, speed)[:, None] * belt / speed
    yield "velocity", want, x.of("a", "velocity"), speed


FORMS = {
    "slowed": _slow,
    "carried": _carry,
    "bouncing": _bounce,
    "rolling": _roll,
    "sliding": _slide,
    "colliding": _collide,
}


def findings(run: fb.Result, m: fb.Mechanism, family: str) -> list[Finding]:
    """All that is wrong with a contact scene."""
    x = Motion(run, m)
    judges = [constraints(x), overlaps(x), cones(x), balances(x), losses(x), momenta(x), known(x, family)]
    found = [f for judge in judges for f in judge]
    return found + [f for f in energies(x) if f.relation == "energy by formula"]


__all__ = ["ANGULAR", "findings", "x_size"]
