"""Energies, momenta, Newton's and Euler's equations of a result, from its poses, velocities and what parts carry."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

import flyball as fb

from .gaps import RATES, _axis, coordinate, dots, evaluated, gaps, norms
from .poses import Array, Motion, Z, spatial

EXACT = 1e-9  # of what is computed twice from the same poses, relative to its terms
HELD = 1e-6  # gaps relative to the mechanism's size; rates of slip to its fastest point
BALANCED = 1e-6  # force = mass x acceleration, relative to the largest force or torque
SOLVED = 1e-11  # of the inertial terms: residual of a solve for accelerations and reactions
DIGITS = 1e-15  # of the mechanism's size, or a radian: last digits of positions, from which stiff springs make forces
DRIFT = 3e-6  # energies and momenta over a motion at rtol 1e-9, relative to what moved
SLOW = 1e-3  # of the size, or of a radian, over the whole motion: no speed that is compared with is less


@dataclass
class Finding:
    """What disagrees: which relation, of what, by how much where how much is allowed."""

    relation: str
    what: str
    found: float
    allowed: float

    def __str__(self) -> str:
        return f"{self.relation}: {self.what}: {self.found:.3g} where {self.allowed:.3g} is allowed"


@dataclass
class Loads:
    """Sum of forces and of torques about the mass centre on each body; bodies of which something is not known."""

    x: Motion
    force: dict[str, Array] = field(default_factory=dict)
    torque: dict[str, Array] = field(default_factory=dict)
    size: dict[str, float] = field(default_factory=dict)
    loose: set[str] = field(default_factory=set)  # torques are not known
    unknown: set[str] = field(default_factory=set)

    def add(self, body: str, force: Array, at: Array | None = None, torque: Array | None = None) -> None:
        if body == "ground" or body not in self.x.drawn:
            return
        n = self.x.n
        f, t = self.force.setdefault(body, np.zeros((n, 3))), self.torque.setdefault(body, np.zeros((n, 3)))
        f += force
        if torque is not None:
            t += torque
        if at is not None:
            t += np.cross(at - self.x.at_centre(body)[0], force)
        self.size[body] = max(
            self.size.get(body, 0.0), np.abs(force).max(), 0.0 if torque is None else np.abs(torque).max()
        )

    def pair(self, i: str, j: str, force: Array, at: Array, torque: Array | None = None) -> None:
        """Force and torque on j at a place, and the opposite on i there."""
        self.add(j, force, at, torque)
        self.add(i, -force, at, None if torque is None else -torque)

    def along(self, name: str, effort: Array) -> None:
        """An effort along a coordinate."""
        part, _, what = name.partition(".")
        e, x = self.x.m.find(part), self.x
        kind = type(e).__name__
        if isinstance(e, fb.Body):
            if what in ("x", "y", "z"):
                self.add(part, effort[:, None] * np.eye(3)["xyz".index(what)], x.of(part, "position"))
            elif x.m.planar:
                self.add(part, np.zeros((x.n, 3)), None, effort[:, None] * Z)
            else:
                self.unknown.add(part)
            return
        if coordinate(x, name) is None or kind == "PointOnLine":
            self.unknown |= {e.body_i, e.body_j}
            return
        a = x.direction(e.body_i, _axis(x, e) if what == "angle" else e.axis)
        F, zero = effort[:, None] * a, np.zeros((x.n, 3))
        place = x.point(e.body_j, e.at)
        self.pair(e.body_i, e.body_j, *((zero, place, F) if what == "angle" else (F, place)))


def loads(x: Motion) -> Loads:
    """All forces on all bodies as the result has them."""
    out = Loads(x)
    g = spatial(np.asarray(x.m.gravity, float))
    for name, (mass, _) in x.masses.items():
        out.add(name, np.broadcast_to(mass * g, (x.n, 3)))
    for e in x.m.joints:
        _reaction(out, e)
    for e in (*x.m.forces, *x.m.limits):
        try:
            _acting(out, e)
        except KeyError:
            out.unknown |= set(x.drawn)
    for e in x.m.couplings:
        names = (
            (f"{e.joint_1}.angle", f"{e.joint_2}.angle") if isinstance(e, fb.GearPair)
            else (f"{e.rack}.displacement", f"{e.pinion}.angle") if isinstance(e, fb.RackAndPinion) else e.coordinates
        )  # fmt: skip
        for k, c in enumerate(names):
            out.along(c, np.asarray(x.run[f"{e.name}.effort_{k + 1}"]))
    for e in x.m.drivers:
        out.along(e.coordinate, np.asarray(x.run[e.name].effort))
    out.unknown |= set(x.drawn) - set(x.masses)
    return out


ONE_POINT = (
    "Revolute",
    "Spherical",
    "Universal",
    "Prismatic",
    "Translational",
    "Cylindrical",
    "Screw",
    "Fixed",
    "Planar",
)
ONE_POINT += ("PointOnLine", "PointInPlane", "Orientation", "PinInSlot", "KnifeEdge")


def _reaction(out: Loads, e: Any) -> None:
    x = out.x
    i, j = e.body_i, e.body_j
    if e.at is None or not {i, j} <= set(x.drawn):
        out.unknown |= set(x.drawn)
        return
    force = spatial(x.run[e.name].force)
    torque = np.asarray(x.run[e.name].torque)
    torque = torque[:, None] * Z if x.m.planar else torque
    kind = type(e).__name__
    if kind in ONE_POINT:
        out.pair(i, j, force, x.point(j, e.at), torque)
    elif kind == "Distance":
        out.pair(i, j, force, x.point(j, e.at[1]), torque)
    else:
        out.pair(i, j, force, x.of(j, "position") if j != "ground" else x.point(j, np.zeros(3)), torque)
        out.loose |= {i, j}


def _acting(out: Loads, e: Any) -> None:
    x, r = out.x, out.x.run[e.name]
    if isinstance(e, fb.SpringDamper):
        p, q = x.point(e.body_i, e.at[0]), x.point(e.body_j, e.at[1])
        d = q - p
        pull = np.asarray(r.force)[:, None] * d / norms(d)[:, None]
        out.add(e.body_j, -pull, q)
        out.add(e.body_i, pull, p)
    elif isinstance(e, fb.PointForce):
        at = x.drawn[e.body][0] if e.at is None else e.at
        if e.at is None:
            out.loose.add(e.body)
        out.add(e.body, spatial(r.force), x.point(e.body, at))
    elif isinstance(e, fb.PointTorque):
        t = np.asarray(r.torque)
        out.add(e.body, np.zeros((x.n, 3)), None, t[:, None] * Z if t.ndim == 1 else t)
    elif isinstance(e, fb.Motor | fb.TorsionalSpringDamper):
        out.along(f"{e.joint}.angle", np.asarray(r.torque))
    elif isinstance(e, fb.CoordinateSpring | fb.Actuator | fb.Detent):
        out.along(e.coordinate, np.asarray(r.force))
    elif isinstance(e, fb.Brake):
        out.along(e.coordinate, np.asarray(r.friction))
    elif isinstance(e, fb.JointFriction):
        j = x.m[e.joint]
        what = e.coordinate or next(iter(j.measured(x.m.planar)))
        out.along(f"{e.joint}.{what}", np.asarray(r.friction))
    elif isinstance(e, fb.Limit):
        out.along(e.coordinate, np.asarray(r.force))
    elif isinstance(e, fb.Bushing):
        out.pair(e.body_i, e.body_j, spatial(r.force), x.point(e.body_j, e.at))
        out.loose |= {e.body_i, e.body_j}
    else:
        raise KeyError(e.title)


def newton_euler(x: Motion) -> Iterator[Finding]:
    """Force = mass x acceleration and Euler's equation of every body at every output time."""
    out = loads(x)
    size = x_size(x)
    largest = max(out.size.values(), default=0.0)
    stiff = DIGITS * stiffest(x)
    for name, (mass, inertia) in x.masses.items():
        if name in out.unknown or name not in out.force:
            continue
        _, v, a = x.at_centre(name)
        rounding = EXACT * 1e-4 * mass * norms(v).max() ** 2 / size
        allowed = BALANCED * (np.abs(mass * a).max() + largest) + stiff / size + rounding + 1e-12
        bad = np.abs(out.force[name] - mass * a).max()
        if not bad <= allowed:
            yield Finding("force = mass x acceleration", name, float(bad), allowed)
        if name in out.loose:
            continue
        R, w, al = (x.of(name, k) for k in ("rotation", "angular_velocity", "angular_acceleration"))
        tensor = np.einsum("nij,jk,nlk->nil", R, inertia, R)
        L, Ia = (np.einsum("nij,nj->ni", tensor, v) for v in (w, al))
        want = Ia + np.cross(w, L)
        if x.m.planar:
            want, got = want[:, 2:], out.torque[name][:, 2:]
        else:
            got = out.torque[name]
        turning = norms(w).max() ** 2 + norms(al).max()  # about an origin off the mass centre: terms that cancel there
        cancelled = SOLVED * mass * size**2 * turning
        allowed = BALANCED * (np.abs(want).max() + largest * max(1.0, size)) + stiff + cancelled + 1e-12
        bad = np.abs(got - want).max()
        if not bad <= allowed:
            yield Finding("Euler's equation", name, float(bad), allowed)


def stiffest(x: Motion) -> float:
    """Stiffness of the stiffest spring times its size squared, or a radian's, which is one [J]."""
    out, size = 0.0, x_size(x)
    for e in (*x.m.forces, *x.m.limits):
        turns = str(getattr(e, "coordinate", "")).endswith("angle") or isinstance(e, fb.TorsionalSpringDamper)
        for name, by in (("stiffness", 1.0 if turns else size**2), ("torsional_stiffness", 1.0)):
            k = getattr(e, name, None)
            if k is not None and not isinstance(k, str):
                out = max(out, float(np.abs(k).max()) * by)
    return out


def x_size(x: Motion) -> float:
    """How far the mechanism reaches, from where it is drawn and where it goes [m]."""
    places = [x.of(b.name, "position") for b in x.m.bodies]
    points = [np.atleast_2d(np.asarray(e.at, float)) for e in x.m.joints if e.at is not None]
    reach = max((np.abs(spatial(p)).max() for p in points), default=0.0)
    return max(reach, max((np.ptp(p, axis=0).max() + np.abs(p[0]).max() for p in places), default=0.0), 1e-9)


def constraints(x: Motion) -> Iterator[Finding]:
    """Joints from the geometry of both bodies."""
    size = x_size(x)
    fast = max((np.abs(x.of(b.name, "velocity")).max() for b in x.m.bodies), default=0.0)
    fast = max(fast, *(size * np.abs(x.of(b.name, "angular_velocity")).max() for b in x.m.bodies))
    for title, what, gap in gaps(x):
        allowed = HELD * (fast + size if what in RATES else max(size, 1.0 if what in ANGULAR else 0.0))
        if not gap.max() <= allowed:
            yield Finding("constraint", f"{title} {what}", float(gap.max()), allowed)


ANGULAR = ("axes aslant", "turned", "axes not square", "coupling", "off its law")


def energies(x: Motion) -> Iterator[Finding]:
    """Kinetic energy, weight and springs, each from its formula; and the balance of these with the works."""
    run = x.run
    if set(x.masses) != {b.name for b in x.m.bodies}:
        return
    kinetic, weight = x.kinetic(), x.gravity()
    size = np.abs(kinetic).max() + np.abs(weight).max()
    for name, mine, its in (("kinetic", kinetic, run.energy.kinetic), ("gravity", weight, run.energy.gravity)):
        bad, allowed = float(np.abs(mine - its).max()), EXACT * size + 1e-14
        if not bad <= allowed:
            yield Finding("energy by formula", name, bad, allowed)
    elastic, every = springs(x)
    for name, mine in elastic.items():
        bad, allowed = float(np.abs(mine - run[name].energy).max()), EXACT * np.abs(mine).max() * 10 + 1e-14
        if not bad <= allowed:
            yield Finding("energy by formula", name, bad, allowed)
    if not every or x.m.events or run.events:
        return
    size += sum(np.abs(stored).max() for stored in elastic.values())
    total = kinetic + weight + sum(elastic.values(), np.zeros(x.n))
    works = sum(run.energy.work.values(), np.zeros(x.n))
    moved = np.ptp(kinetic) + np.ptp(weight) + sum(np.ptp(w) for w in run.energy.work.values())
    bad = float(np.abs(total - total[0] - works + works[0]).max())
    allowed = DRIFT * (moved + np.abs(kinetic).max()) + EXACT * size + 1e-13
    if not bad <= allowed:
        yield Finding("energy balance", "kinetic, weight and springs against works", bad, allowed)
    yield from powers(x)


def springs(x: Motion) -> tuple[dict[str, Array], bool]:
    """Energies of linear springs from distances and angles, and whether these are all that store energy."""
    out, every = {}, True
    for e in x.m.forces:
        if isinstance(e, fb.SpringDamper):
            d = norms(x.point(e.body_j, e.at[1]) - x.point(e.body_i, e.at[0]))
            rest = e.length if e.length is not None else np.linalg.norm(np.subtract(*e.at))
            out[e.name] = 0.5 * e.stiffness * (d - rest) ** 2
        elif isinstance(e, fb.CoordinateSpring | fb.TorsionalSpringDamper):
            name = getattr(e, "coordinate", None) or f"{e.joint}.angle"
            c = coordinate(x, name)
            if c is None:
                every = False
                continue
            rest = e.rest if isinstance(e, fb.CoordinateSpring) else e.angle
            out[e.name] = 0.5 * e.stiffness * (c - (rest or 0.0)) ** 2
        elif isinstance(e, fb.Bushing | fb.Rope | fb.Detent):
            every = False
    return out, every and not any(getattr(e, "stiffness", None) for e in x.m.limits)


def powers(x: Motion) -> Iterator[Finding]:
    """Joints at rest do no work: what a reaction gives one body it takes from the other."""
    fast = max((np.abs(x.of(b.name, "velocity")).max() for b in x.m.bodies), default=0.0)
    spin = max((np.abs(x.of(b.name, "angular_velocity")).max() for b in x.m.bodies), default=0.0)
    for e in x.m.joints:
        if e.at is None or type(e).__name__ not in ONE_POINT or type(e).__name__ == "KnifeEdge":
            continue
        if not {e.body_i, e.body_j} <= set(x.drawn):
            continue
        force = spatial(x.run[e.name].force)
        torque = np.asarray(x.run[e.name].torque)
        torque = torque[:, None] * Z if x.m.planar else torque
        place = x.point(e.body_j, e.at)
        v, w = x.speed(e.body_j, e.at), x.of(e.body_j, "angular_velocity") - x.of(e.body_i, "angular_velocity")
        v = (
            v
            - x.of(e.body_i, "velocity")
            - np.cross(x.of(e.body_i, "angular_velocity"), place - x.of(e.body_i, "position"))
        )
        power = dots(force, v) + dots(torque, w)
        terms = norms(force).max() * (fast + spin * x_size(x)) + norms(torque).max() * spin
        terms = (
            terms
            + (norms(force).max() * x_size(x) + norms(torque).max()) * SLOW / (x.t[-1] - x.t[0])
            + x.kinetic().max() * 1e-3
        )
        if not np.abs(power).max() <= 1e-6 * terms + 1e-12:
            yield Finding("power of a reaction", e.title, float(np.abs(power).max()), 1e-6 * terms)


def laws(x: Motion) -> Iterator[Finding]:
    """Forces of springs, dampers and given forces by their laws."""
    for e in x.m.forces:
        r = x.run[e.name]
        try:
            if isinstance(e, fb.SpringDamper):
                p, q = x.point(e.body_i, e.at[0]), x.point(e.body_j, e.at[1])
                d = q - p
                length = norms(d)
                rate = dots(x.speed(e.body_j, e.at[1]) - x.speed(e.body_i, e.at[0]), d) / length
                rest = e.length if e.length is not None else np.linalg.norm(np.subtract(*e.at))
                want = e.stiffness * (length - rest) + e.damping * rate
                want = want + (0.0 if e.force is None else evaluated(e.force, t=x.t, length=length, rate=rate))
                got = np.asarray(r.force)
            elif isinstance(e, fb.CoordinateSpring | fb.TorsionalSpringDamper | fb.Motor | fb.Actuator):
                want, got = _along_law(x, e)
            else:
                continue
        except KeyError:
            continue
        allowed = 1e-8 * (np.abs(want).max() + getattr(e, "stiffness", 0.0) * 1e-3) + 1e-13
        bad = np.where(on_corner(x, e.name), 0.0, np.abs(want - got))
        if np.quantile(bad, 0.9) > allowed:  # a law may jump at an output time
            yield Finding("law of a force", e.title, float(np.quantile(bad, 0.9)), allowed)


def on_corner(x: Motion, name: str) -> Array:
    """Times at which an element's law is held on a jump, where it takes any value between those of the two sides."""
    held = np.zeros(len(x.t), bool)
    for event in x.run.events:
        if event.name == name and event.kind in ("hold", "leave"):
            held[x.t >= event.t] = event.kind == "hold"
    return held


def _along_law(x: Motion, e: Any) -> tuple[Array, Array]:
    turning = hasattr(e, "joint")
    name = f"{e.joint}.angle" if turning else e.coordinate
    c = coordinate(x, name)
    if c is None:
        raise KeyError(name)
    part, _, what = name.partition(".")
    rate = (
        np.asarray(x.run[name + "_rate"])
        if not isinstance(x.m[part], fb.Body)
        else x.of(part, "velocity")[:, "xyz".index(what)]
    )
    own = {"angle": c} if turning else {"value": c}
    law = getattr(e, "torque", None) if turning else e.force
    rest = getattr(e, "angle", 0.0) if turning else getattr(e, "rest", 0.0)
    want = -getattr(e, "stiffness", 0.0) * (c - (rest or 0.0)) - getattr(e, "damping", 0.0) * rate
    want = want + (0.0 if law is None else evaluated(law, t=x.t, rate=rate, **own))
    return want, np.asarray(x.run[e.name].torque if turning else x.run[e.name].force)


def momenta(x: Motion) -> Iterator[Finding]:
    """Momenta change by the impulse of weight alone where nothing else acts from outside."""
    if set(x.masses) != {b.name for b in x.m.bodies} or x.m.events or outside(x.m):
        return
    P, L = x.momentum()
    g = spatial(np.asarray(x.m.gravity, float))
    mass = sum(v[0] for v in x.masses.values())
    t = (x.t - x.t[0])[:, None]
    C = sum(x.masses[b.name][0] * x.at_centre(b.name)[0] for b in x.m.bodies) / mass
    V = P[0] / mass
    about = L - np.cross(C, P)
    speed = sum(v[0] * norms(x.at_centre(k)[1]).max() for k, v in x.masses.items())
    size = x_size(x)
    for what, bad, terms in (
        ("linear", P - P[0] - mass * g * t, speed + mass * np.abs(g).max() * float(t[-1, 0])),
        ("centre", C - C[0] - V * t - 0.5 * g * t**2, size),
        ("angular", about - about[0], speed * size + np.abs(L).max()),
    ):
        worst = float(np.abs(bad).max())
        if not worst <= DRIFT * terms + 1e-13:
            yield Finding("momentum", what, worst, DRIFT * terms)


def outside(m: fb.Mechanism) -> bool:
    """Whether anything but weight acts from outside."""
    for e in m.elements():
        if e.category in ("drivers", "contacts") or isinstance(e, fb.PointForce | fb.PointTorque):
            return True
        ends = [getattr(e, k, None) for k in ("body_i", "body_j", "body")] + list(getattr(e, "bodies", ()))
        if "ground" in ends:
            return True
        c = getattr(e, "coordinate", None)
        if isinstance(c, str) and isinstance(m.find(c.partition(".")[0]), fb.Body):
            return True
    return False


def derivatives(x: Motion) -> Iterator[Finding]:
    """Velocities are the rates of positions, accelerations those of velocities, as far as outputs lie close."""
    if x.n < 9 or x.run.events or any(c.period is not None for c in x.m.controllers):
        return
    moved = max((np.abs(x.of(b.name, "acceleration")).max() for b in x.m.bodies), default=0.0)
    pull = max(float(np.linalg.norm(x.m.gravity)), moved)
    for b in x.m.bodies:
        for what, rate in (
            ("position", "velocity"),
            ("velocity", "acceleration"),
            ("angular_velocity", "angular_acceleration"),
        ):
            y, dy = x.of(b.name, what), x.of(b.name, rate)
            h = np.diff(x.t)[:, None]
            fine = 0.5 * h * (dy[1:] + dy[:-1])
            coarse = (x.t[2:] - x.t[:-2])[:, None] / 2 * (dy[2:] + dy[:-2])
            doubt = np.abs(fine[1:] + fine[:-1] - coarse).max(axis=1)
            bad = np.abs(np.diff(y, axis=0) - fine).max(axis=1)
            allowed = 2.0 * np.maximum(np.r_[doubt[0], doubt], np.r_[doubt, doubt[-1]])
            allowed += 1e-7 * (np.abs(y).max() + np.abs(fine).max()) + 1e-10
            if what != "position":  # of what weight gives, or the rest has: what a dead centre makes of rounding
                allowed += IDLE * h[:, 0].mean() * pull / (gyration(x, b.name) if what == "angular_velocity" else 1.0)
            if np.mean(bad > allowed) > SPIKES:
                k = int((bad / allowed).argmax())
                yield Finding("derivative", f"{rate} of {b.name}", float(bad[k]), float(allowed[k]))


def gyration(x: Motion, body: str) -> float:
    """Least radius of gyration of a body, the mechanism's reach where it is not known or none [m]."""
    mass, inertia = x.masses.get(body, (0.0, np.zeros((3, 3))))
    about = np.linalg.eigvalsh(inertia)
    return float(np.sqrt(about[about > 0.0].min() / mass)) if mass > 0.0 and about.max() > 0.0 else x_size(x)


IDLE = 1e-6  # of weight's acceleration or the largest: what a body may be said to have that stands still
SPIKES = 0.1  # part of the intervals between outputs in which something quick may happen


def findings(run: fb.Result, m: fb.Mechanism) -> list[Finding]:
    """All that is wrong by these laws."""
    x = Motion(run, m)
    if not len(x.t):
        return []
    return [f for judge in (constraints, energies, laws, momenta, newton_euler, derivatives) for f in judge(x)]
