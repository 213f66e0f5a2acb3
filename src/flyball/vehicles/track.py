"""Tracks: hinged shoes around sprocket, idler, road wheels on torsion bars, and support rollers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import acos, atan2, cos, hypot, pi, sin, tan
from typing import Any

import numpy as np
from scipy.optimize import brentq

from ..errors import ModelError
from ..forces import CoordinateSpring, TorsionalSpringDamper
from ..joints import Prismatic, Revolute
from ..mechanism import Mechanism
from ..model.body import Body
from ..model.contact import Contact
from ..model.shapes import Box, Cylinder, Prism, Rod

GAP = 0.25  # between the plates of two shoes, as a part of the pitch: room for a tooth
ARM = 0.2  # mass of an arm, as a part of that of its wheel
STEEL, RUST, SLATE = "#5b6770", "#a63d2f", "#3a4148"


@dataclass(frozen=True)
class TrackWheel:
    """A wheel inside a track: by what it has, a sprocket, the idler, a road wheel, or a support roller.

    A wheel with ``teeth`` is a sprocket. One with an ``arm`` is a road wheel on a torsion bar. One with a ``slide`` is
    the idler, whose place closes the track. Any other turns on the hull.

    Parameters
    ----------
    name : str
    at : point [m]
        Its centre; of the idler approximately.
    mass : number [kg]
        That of a disk.
    radius : number [m]
        Of a sprocket it follows from teeth and pitch.
    teeth : int
    arm : point [m]
        Pivot of its arm on the hull.
    slide : direction
        In which the idler is pushed, outwards.
    stiffness, damping : numbers [N m/rad], [N m s/rad] or [N/m], [N s/m]
        Of the torsion bar; of the spring behind the idler.
    load : number [N]
        At the drawn place: vertical force of the shoes on a road wheel; force of the spring on the idler, about twice
        the tension of the track.
    """

    name: str
    at: tuple[float, float]
    mass: float
    radius: float | None = None
    teeth: int | None = None
    arm: tuple[float, float] | None = None
    slide: tuple[float, float] | None = None
    stiffness: float | None = None
    damping: float = 0.0
    load: float = 0.0

    def __post_init__(self) -> None:
        """Refuse a wheel of two kinds, and numbers that are missing or have no effect."""
        title = f"track wheel {self.name!r}"
        given = [f for f in ("teeth", "arm", "slide") if getattr(self, f) is not None]
        if len(given) > 1:
            raise ModelError(f"{title}: {' and '.join(given)} exclude each other: a wheel has one of them, or none")
        if (self.radius is None) != (self.teeth is not None):
            raise ModelError(f"{title}: give radius, or teeth, of which the radius follows")
        sprung = self.arm is not None or self.slide is not None
        if sprung != (self.stiffness is not None) or (not sprung and (self.damping or self.load)):
            raise ModelError(f"{title}: stiffness belongs to arm or slide, damping and load to stiffness")
        for f in ("mass", "radius", "teeth", "stiffness"):
            if (x := getattr(self, f)) is not None and not x > (4 if f == "teeth" else 0):
                raise ModelError(f"{title}: {f} is {x:g}; it must be greater than {4 if f == 'teeth' else 0}")


def track(
    name: str,
    wheels: Sequence[TrackWheel],
    *,
    shoes: int,
    pitch: float,
    thickness: float,
    mass: float,
    width: float = 0.3,
    friction: float = 0.3,
    damping: float = 0.0,
) -> Mechanism:
    """Return a track in the plane: shoes, hinged to a closed chain, around wheels on a hull.

    It is added to a vehicle with ``m.add(track, prefix="left", at=..., on="hull")``: what stands on ground in it stands
    on the hull. The shoes are ``shoe_0``, ``shoe_1``, ..., hinged by ``pin_0``, ``pin_1``, ... The wheel ``w`` turns on
    the joint ``w_axle``; an arm is ``w_arm`` on the joint ``w_pivot`` with the torsion bar ``w_bar``; the idler slides
    with the body ``w_slider`` on the joint ``w_slide`` with the spring ``w_spring``. The sprocket has teeth, which push
    the plates of the shoes: it drives by form. Contact of the shoes with the soil is that of the whole mechanism.

    Parameters
    ----------
    name : str
    wheels : list of TrackWheel
        In any order; one with a slide.
    shoes : int
        Number of links.
    pitch : number [m]
        Distance of neighbouring pins.
    thickness, width : numbers [m]
        Of a shoe's plate; the pins are in its middle.
    mass : number [kg]
        Of a shoe.
    friction : number [1]
        Between shoes and wheels.
    damping : number [N m s/rad]
        Of the hinges, where not zero: by ``pin_0_damper``, ...; it calms the free runs.

    Raises
    ------
    ModelError
        If the number of shoes does not fit around the wheels with the idler within three quarters of a pitch of its
        place; if there is not exactly one idler; if two wheels have one name.
    """
    check_track(name, wheels, shoes=shoes, pitch=pitch, thickness=thickness, mass=mass, width=width)
    idler = next(k for k, w in enumerate(wheels) if w.slide is not None)
    sizes = [wheel_radius(w, pitch, thickness) for w in wheels]
    shift, pins = closed_chain(name, wheels, sizes, idler, shoes, pitch, thickness)
    m = Mechanism(name, planar=True)
    add_shoes(m, pins, pitch, thickness, mass, width)
    for k, (w, r) in enumerate(zip(wheels, sizes, strict=True)):
        at = (w.at[0] + shift[0], w.at[1] + shift[1]) if k == idler else w.at
        nearest = pins[np.argmin(abs(np.hypot(*(pins - at).T) - hypot(r + thickness / 2, pitch / 2)))] - at
        teeth = () if w.teeth is None else tooth_shapes(w.teeth, atan2(*nearest[::-1]), pitch, thickness, width)
        add_wheel(m, w, at, r, (Cylinder(radius=r, length=width), *teeth))
    if damping:
        m.add(*(TorsionalSpringDamper(f"pin_{k}_damper", f"pin_{k}", damping=damping) for k in range(shoes)))
    plates = tuple(f"shoe_{k}" for k in range(shoes))
    m.add(Contact("wheel_contact", between=plates, others=tuple(w.name for w in wheels), friction=friction))
    return m


def check_track(name: str, wheels: Sequence[TrackWheel], **numbers: float) -> None:
    """Refuse impossible numbers, equal names, and any number of idlers but one."""
    for key, x in numbers.items():
        if not x > 0:
            raise ModelError(f"track {name!r}: {key} is {x:g}; it must be greater than 0")
    names = [w.name for w in wheels]
    if twice := next((n for n in names if names.count(n) > 1), None):
        raise ModelError(f"track {name!r}: two wheels are named {twice!r}; give each a name of its own")
    if flat := next((w for w in wheels if w.slide is not None and not hypot(*w.slide) > 0.0), None):
        raise ModelError(f"track {name!r}: the slide of {flat.name!r} is {flat.slide}, which is no direction")
    if (idlers := sum(w.slide is not None for w in wheels)) != 1 or len(wheels) < 2:
        raise ModelError(
            f"track {name!r}: {idlers} of its {len(wheels)} wheels have a slide; give it to one, the idler, and add "
            f"others: its place closes the track"
        )


def wheel_radius(w: TrackWheel, pitch: float, thickness: float) -> float:
    """Return the radius of a wheel [m]: of a sprocket that on which shoes with their pins on the pitch circle lie."""
    if w.radius is not None:
        return w.radius
    assert w.teeth is not None
    return pitch / (2 * tan(pi / w.teeth)) - thickness / 2


def closed_chain(
    name: str,
    wheels: Sequence[TrackWheel],
    sizes: Sequence[float],
    idler: int,
    shoes: int,
    pitch: float,
    thickness: float,
) -> tuple[tuple[float, float], np.ndarray]:
    """Return the shift of the idler with which the chain closes, and the pins (shoes, 2); it touches each wheel.

    Pins lie on circles about the wheels whose chords of one pitch touch the wheels from outside: those of a sprocket
    are its pitch circle.
    """
    radii = [hypot(r + thickness / 2, pitch / 2) for r in sizes]
    dx, dy = wheels[idler].slide or (0.0, 0.0)
    unit = (dx / hypot(dx, dy), dy / hypot(dx, dy))

    def chain(x: float) -> tuple[np.ndarray, float]:
        centres = [w.at for w in wheels]
        centres[idler] = (centres[idler][0] + x * unit[0], centres[idler][1] + x * unit[1])
        arcs = taut_band(centres, radii)
        driven = next((k for k, a in enumerate(arcs) if wheels[a.circle].teeth is not None), 0)
        start = (
            sum(a.length for a in arcs[:driven]) + arcs[driven].radius * (arcs[driven].last - arcs[driven].first) / 2
        )
        return chords(arcs, start, pitch, shoes)

    reach = 0.75 * pitch
    inner, outer = chain(-reach)[1], chain(reach)[1]
    if not inner > 0 > outer:
        needed = shoes - round(chain(0.0)[1] / pitch)
        raise ModelError(
            f"track {name!r}: {shoes} shoes do not fit around its wheels; with the idler {wheels[idler].name!r} near "
            f"its place it has {needed}: give shoes={needed}, or move the idler"
        )
    x = brentq(lambda x: chain(x)[1], -reach, reach, xtol=1e-13)
    return (x * unit[0], x * unit[1]), chain(x)[0]


def tooth_shapes(teeth: int, phase: float, pitch: float, thickness: float, width: float) -> tuple[Prism, ...]:
    """Return the teeth of a sprocket, tapered, from its hub to beyond the pitch circle; one points along the phase.

    The plates of two shoes on the sprocket leave free, on each side of the line from its centre to their common pin,
    (gap cos a - thickness sin a) / 2 with a = pi / teeth. A tooth takes nine tenths of it.
    """
    half = pi / teeth
    room = 0.45 * (GAP * pitch * cos(half) - thickness * sin(half))
    if room <= 0:
        raise ModelError(
            f"a sprocket of {teeth} teeth: shoes of {thickness:g} m thickness leave no room for teeth at a pitch of "
            f"{pitch:g} m; give thinner shoes, a greater pitch, or more teeth"
        )
    outer = pitch / (2 * sin(half)) + thickness / 4
    inner = pitch / (2 * tan(half)) - thickness
    outline = np.array([(inner, -room), (outer, -room / 2), (outer, room / 2), (inner, room)])
    out = []
    for k in range(teeth):
        c, s = cos(phase + 2 * half * k), sin(phase + 2 * half * k)
        out.append(Prism(outline=tuple(map(tuple, (outline @ [[c, s], [-s, c]]).tolist())), thickness=width))
    return tuple(out)


def add_shoes(m: Mechanism, pins: np.ndarray, pitch: float, thickness: float, mass: float, width: float) -> None:
    """Add the shoes and their hinges."""
    number = len(pins)
    for k, (a, b) in enumerate(zip(pins, np.roll(pins, -1, axis=0), strict=True)):
        angle = atan2(b[1] - a[1], b[0] - a[0])
        plate = Box(edges=((1 - GAP) * pitch, thickness, width))
        hinge = Rod(start=(-pitch / 2, 0, -width / 2), end=(-pitch / 2, 0, width / 2), radius=thickness / 4, looks=True)
        middle = tuple(((a + b) / 2).tolist())
        m.add(Body(f"shoe_{k}", mass=mass, shape=(plate, hinge), color=STEEL, position=middle, angle=angle))
    for k, p in enumerate(pins):
        m.add(Revolute(f"pin_{k}", f"shoe_{(k - 1) % number}", f"shoe_{k}", at=tuple(p.tolist())))


def add_wheel(m: Mechanism, w: TrackWheel, at: tuple[float, float], radius: float, shape: tuple) -> None:
    """Add a wheel with what carries it."""
    m.add(Body(w.name, mass=w.mass, inertia=w.mass * radius**2 / 2, position=at, shape=shape, color=SLATE))
    n, carrier, hub, stiffness = w.name, "ground", 0.3 * radius, w.stiffness or 0.0
    if w.arm is not None:
        carrier = f"{n}_arm"
        lever = (w.arm[0] - at[0], w.arm[1] - at[1])
        mass, span = ARM * w.mass, hypot(*lever)
        middle = ((at[0] + w.arm[0]) / 2, (at[1] + w.arm[1]) / 2)
        rod = Rod(start=(-lever[0] / 2, -lever[1] / 2), end=(lever[0] / 2, lever[1] / 2), radius=hub / 2, looks=True)
        m.add(Body(carrier, mass=mass, inertia=mass * span**2 / 12, position=middle, shape=rod, color=RUST))
        m.add(Revolute(f"{n}_pivot", "ground", carrier, at=w.arm))
        free = lever[0] * w.load / stiffness
        m.add(TorsionalSpringDamper(f"{n}_bar", f"{n}_pivot", stiffness=stiffness, damping=w.damping, angle=free))
    elif w.slide is not None:
        carrier = f"{n}_slider"
        mass = ARM * w.mass
        block = Box(edges=(hub, hub, hub), looks=True)
        m.add(Body(carrier, mass=mass, inertia=mass * hub**2 / 6, position=at, shape=block, color=RUST))
        m.add(Prismatic(f"{n}_slide", "ground", carrier, at=at, axis=w.slide))
        spring: Any = {"stiffness": stiffness, "damping": w.damping, "rest": w.load / stiffness}
        m.add(CoordinateSpring(f"{n}_spring", f"{n}_slide.displacement", **spring))
    m.add(Revolute(f"{n}_axle", carrier, n, at=at))


# Closed chains of equal chords around circles: where the pins of a track lie.

FULL_TURN = 2.0 * pi


@dataclass(frozen=True)
class Arc:
    """The part of a circle on which a taut band lies, by the angles of its outward normals, and the straight after."""

    circle: int
    centre: tuple[float, float]
    radius: float
    first: float
    last: float
    straight: float

    @property
    def length(self) -> float:
        """Length of the arc and of the straight part after it [m]."""
        return self.radius * (self.last - self.first) + self.straight

    def point(self, s: float) -> tuple[float, float]:
        """Return the point at the length s behind the arc's start."""
        angle = min(self.first + s / self.radius, self.last)
        beyond = max(s - self.radius * (self.last - self.first), 0.0)
        x, y = self.centre
        c, s_ = cos(angle), sin(angle)
        return x + self.radius * c - beyond * s_, y + self.radius * s_ + beyond * c


def taut_band(centres: Sequence[tuple[float, float]], radii: Sequence[float]) -> list[Arc]:
    """Return the arcs of the shortest band around circles, counterclockwise from the lowest point.

    The straight parts are outer common tangents, n (c_j - c_i) = R_i - R_j with the outward normal n; of all tangents
    the band takes that with the least turn. Circles inside the band have no arc.
    """
    start = min(range(len(radii)), key=lambda k: centres[k][1] - radii[k])
    arcs: list[Arc] = []
    here, angle, end = start, -pi / 2, 1.5 * pi
    while angle < end:
        turn, there, straight = end - angle, start, 0.0
        for k, (c, r) in enumerate(zip(centres, radii, strict=True)):
            dx, dy = c[0] - centres[here][0], c[1] - centres[here][1]
            d, less = hypot(dx, dy), radii[here] - r
            if k == here or d <= abs(less):
                continue
            normal = (atan2(dy, dx) - acos(less / d) - angle + 1e-12) % FULL_TURN - 1e-12
            if normal < turn:
                turn, there, straight = normal, k, (d * d - less * less) ** 0.5
        arcs.append(Arc(here, centres[here], radii[here], angle, angle + turn, straight))
        here, angle = there, angle + turn
    return arcs


def chords(arcs: Sequence[Arc], start: float, pitch: float, number: int) -> tuple[np.ndarray, float]:
    """Return the ends (number, 2) of equal chords along a band from a length on, and what the last one is too far.

    The number is positive if the chain is longer than the band, so that it closes at zero.
    """
    ends = np.cumsum([a.length for a in arcs])
    around = float(ends[-1])

    def point(s: float) -> tuple[float, float]:
        s %= around
        k = min(int(np.searchsorted(ends, s, side="right")), len(arcs) - 1)
        return arcs[k].point(s - float(ends[k]) + arcs[k].length)

    def surplus(s: float, p: tuple[float, float]) -> float:
        q = point(s)
        return hypot(q[0] - p[0], q[1] - p[1]) - pitch

    s, points = start, []
    for _ in range(number):
        p = point(s)
        points.append(p)
        s = brentq(surplus, s + 0.999 * pitch, s + 1.6 * pitch, args=(p,), xtol=1e-14 * around)
    return np.array(points), s - start - around
