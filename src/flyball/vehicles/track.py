"""Tracks in plane and space: hinged shoes around sprocket, idler, road wheels on torsion bars, support rollers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import acos, atan2, cos, hypot, pi, sin, tan
from typing import Any

import numpy as np
from scipy.optimize import brentq

from ..errors import ModelError
from ..forces import CoordinateSpring, TorsionalSpringDamper
from ..joints import PointOnLine, Prismatic, Revolute
from ..mechanism import Mechanism
from ..model.body import Body
from ..model.contact import Contact
from ..model.expressions import number
from ..model.shapes import Box, Capsule, Cylinder, Prism, Rod, Sphere

GAP = 0.25  # between the plates of two shoes, as a part of the pitch: room for a tooth
ARM = 0.2  # mass of an arm, as a part of that of its wheel
HORN, PLAY, GROUSER = 1.0, 0.3, 0.3  # radius of a guide horn, its play, radius of a grouser, as parts of a thickness
Given = Any  # a number, a quantity such as "22 cm", or a pair of these; later numbers
STEEL, RUST, SLATE = "#5b6770", "#a63d2f", "#3a4148"
UNITS = dict.fromkeys(("at", "radius", "arm", "pitch", "thickness", "width", "wheel_width"), "m")
UNITS |= {"mass": "kg", "load": "N", "slide": "1"}


@dataclass(frozen=True)
class TrackWheel:
    """A wheel inside a track: by what it has, a sprocket, the idler, a road wheel, or a support roller.

    A wheel with ``teeth`` is a sprocket. One with an ``arm`` is a road wheel on a torsion bar. One with a ``slide`` is
    the idler, whose place closes the track. Any other turns on the hull. Points and directions are those in the plane
    of the track: forward, upward. Numbers may be given with units, ``"22 cm"``.

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
    at: Given
    mass: Given
    radius: Given = None
    teeth: Given = None
    arm: Given = None
    slide: Given = None
    stiffness: Given = None
    damping: Given = 0.0
    load: Given = 0.0

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
        spring, damper = ("N/m", "N*s/m") if self.arm is None else ("N*m/rad", "N*m*s/rad")
        units = UNITS | {"stiffness": spring, "damping": damper}
        for f in ("at", "mass", "radius", "arm", "slide", "stiffness", "damping", "load"):
            if (x := getattr(self, f)) is not None:
                object.__setattr__(self, f, plain_numbers(x, units[f], f"{f} of {title}"))
        if self.teeth is not None:
            object.__setattr__(self, "teeth", whole_number(self.teeth, f"teeth of {title}"))
        for f in ("mass", "radius", "teeth", "stiffness"):
            if (x := getattr(self, f)) is not None and not x > (4 if f == "teeth" else 0):
                raise ModelError(f"{title}: {f} is {x:g}; it must be greater than {4 if f == 'teeth' else 0}")
        if self.damping < 0:
            raise ModelError(f"{title}: damping is {self.damping:g}; it must not be negative")


def plain_numbers(x: Given, unit: str, where: str) -> Any:
    """Return a number, or the two components of a point, in SI units."""
    if not isinstance(x, (list, tuple, np.ndarray)):
        return float(number(x, {}, unit, where))
    if len(x) != 2:
        raise ModelError(f"{where}: it has two components, in the plane of the track, got {x!r}")
    return tuple(float(number(c, {}, unit, where)) for c in x)


def whole_number(x: Given, where: str) -> int:
    """Return a count."""
    if float(number(x, {}, "1", where)) % 1.0 != 0.0:
        raise ModelError(f"{where} is {x}; give a whole number")
    return int(x)


@dataclass(frozen=True)
class Shoes:
    """The shoes of a track: their number, and the sizes [m] and mass [kg] of each."""

    shoes: int
    pitch: float
    thickness: float
    mass: float
    width: float
    wheel_width: float

    def shape(self, spatial: bool) -> tuple:
        """Plate, hinge, and in space two guide horns and a grouser; x along the track, y into it."""
        p, t, w = self.pitch, self.thickness, self.width
        plate = Box(edges=((1 - GAP) * p, t, w))
        hinge = Rod(start=(-p / 2, 0, -w / 2), end=(-p / 2, 0, w / 2), radius=t / 4, looks=True)
        if not spatial:
            return plate, hinge
        r, g = HORN * t, GROUSER * t
        side = self.wheel_width / 2 + PLAY * t + r
        horns = (Sphere(radius=r, position=(0, t / 2 + r, z)) for z in (-side, side))
        return plate, hinge, *horns, Capsule(radius=g, length=w - 2 * g, position=(0, -t / 2, 0))


@dataclass(frozen=True)
class Frame:
    """Where the plane of the track is: the x-y plane of a planar mechanism, or the x-z plane, with z upward."""

    spatial: bool

    def point(self, p: Any) -> tuple[float, ...]:
        """Return a point or direction of the plane."""
        x, y = (float(c) for c in p)
        return (x, 0.0, y) if self.spatial else (x, y)

    def pose(self, p: Any, angle: float = 0.0) -> dict[str, Any]:
        """Return place and orientation of a body whose z axis is normal to the plane."""
        if not self.spatial:
            return {"position": self.point(p), "angle": angle}
        c, s = cos(angle), sin(angle)
        return {"position": self.point(p), "orientation": ((c, -s, 0.0), (0.0, 0.0, -1.0), (s, c, 0.0))}

    @property
    def normal(self) -> dict[str, Any]:
        """Axis of a hinge: angles have the same sign in plane and space."""
        return {"axis": (0.0, -1.0, 0.0)} if self.spatial else {}

    def inertia(self, across: float, along: float, axis: tuple[float, float, float]) -> Any:
        """Return the inertia of a round body, about its axis ``along`` and normal to it ``across``."""
        u = np.array(axis) / hypot(*axis)
        J = across * np.eye(3) + (along - across) * np.outer(u, u)
        return tuple(map(tuple, J.tolist())) if self.spatial else float(J[2, 2])


def track(
    name: str,
    wheels: Sequence[TrackWheel],
    *,
    shoes: Given,
    pitch: Given,
    thickness: Given,
    mass: Given,
    width: Given = 0.3,
    friction: Given = 0.3,
    damping: Given = 0.0,
    spatial: bool = False,
    wheel_width: Given = None,
) -> Mechanism:
    """Return a track: shoes, hinged to a closed chain, around wheels on a hull.

    It is added to a vehicle with ``m.add(track, prefix="left", at=..., on="hull")``: what stands on ground in it stands
    on the hull. The shoes are ``shoe_0``, ``shoe_1``, ..., hinged by ``pin_0``, ``pin_1``, ... The wheel ``w`` turns on
    the joint ``w_axle``; an arm is ``w_arm`` on the joint ``w_pivot`` with the torsion bar ``w_bar``; the idler slides
    with the body ``w_slider`` on the joint ``w_slide`` with the spring ``w_spring``. The sprocket has teeth, which push
    the plates of the shoes: it drives by form. Contact of the shoes with the soil is that of the whole mechanism.

    A spatial track lies in the x-z plane, z upward; axles and pins are parallel to y. Between two horns on each shoe
    run the wheels, which keep the track in place sideways; a round bar across each shoe, the grouser, touches the
    ground. All pins are `Revolute` but ``pin_0``, a `PointOnLine`: in a closed chain of parallel hinges the last one
    has to fix two directions only.

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
        Of the hinges, where not zero: by ``pin_1_damper``, ..., in the plane also ``pin_0_damper``. It calms runs.
    spatial : bool
        Whether the mechanism is spatial.
    wheel_width : number [m]
        Of wheels and teeth; the shoe's width in the plane, 0.4 of it in space if not given.

    Raises
    ------
    ModelError
        If the number of shoes does not fit around the wheels with the idler within three quarters of a pitch of its
        place; if there is not exactly one idler; if two wheels have one name; if a wheel is too small for the shoes, or
        so far inside the track that it touches none.
    """
    across = (0.4 if spatial else 1.0) * plain_numbers(width, "m", f"track {name!r}: width")
    links = checked_shoes(
        name, shoes=shoes, pitch=pitch, thickness=thickness, mass=mass, width=width, wheel_width=wheel_width or across
    )
    pitch, thickness = links.pitch, links.thickness
    damping = plain_numbers(damping, "N*m*s/rad", f"track {name!r}: damping")
    check_wheels(name, wheels)
    sizes = [wheel_radius(name, w, pitch, thickness) for w in wheels]
    idler = next(k for k, w in enumerate(wheels) if w.slide is not None)
    shift, pins = closed_chain(name, wheels, sizes, idler, links.shoes, pitch, thickness)
    m, frame = Mechanism(name, planar=not spatial), Frame(spatial)
    add_shoes(m, frame, pins, links)
    for k, (w, r) in enumerate(zip(wheels, sizes, strict=True)):
        at = (w.at[0] + shift[0], w.at[1] + shift[1]) if k == idler else w.at
        nearest = pins[np.argmin(abs(np.hypot(*(pins - at).T) - hypot(r + thickness / 2, pitch / 2)))] - at
        teeth = () if w.teeth is None else tooth_shapes(w.teeth, atan2(*nearest[::-1]), links)
        add_wheel(m, frame, w, at, (r, links.wheel_width), teeth)
    if damping:
        hinges = [f"pin_{k}" for k in range(1 if spatial else 0, links.shoes)]
        m.add(*(TorsionalSpringDamper(f"{p}_damper", p, damping=damping) for p in hinges))
    plates = tuple(f"shoe_{k}" for k in range(links.shoes))
    m.add(Contact("wheel_contact", between=plates, others=tuple(w.name for w in wheels), friction=friction))
    return m


def checked_shoes(name: str, *, shoes: Any, **numbers: Any) -> Shoes:
    """Return the shoes, refusing impossible numbers."""
    got = {k: plain_numbers(x, UNITS[k], f"track {name!r}: {k}") for k, x in numbers.items()}
    out = Shoes(whole_number(shoes, f"track {name!r}: shoes"), **got)
    for key, x in {"shoes": out.shoes, **got}.items():
        if not x > 0:
            raise ModelError(f"track {name!r}: {key} is {x:g}; it must be greater than 0")
    if out.wheel_width > out.width:
        raise ModelError(
            f"track {name!r}: wheel_width is {out.wheel_width:g} m, and the width of the shoes {out.width:g} m; give "
            f"narrower wheels"
        )
    return out


def check_wheels(name: str, wheels: Sequence[TrackWheel]) -> None:
    """Refuse equal names, and any number of idlers but one."""
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


def wheel_radius(name: str, w: TrackWheel, pitch: float, thickness: float) -> float:
    """Return the radius of a wheel [m]: of a sprocket that on which shoes with their pins on the pitch circle lie.

    Neighbouring shoes on a wheel turn by 2 atan(pitch / (2 r + thickness)), at most a right angle.
    """
    if w.radius is None:
        assert w.teeth is not None
        return pitch / (2 * tan(pi / w.teeth)) - thickness / 2
    if not 2 * w.radius + thickness > pitch:
        raise ModelError(
            f"track {name!r}: wheel {w.name!r} of radius {w.radius:g} m is too small for a pitch of {pitch:g} m, since "
            f"shoes on it would turn by more than 90 deg; give a radius above {(pitch - thickness) / 2:g} m"
        )
    return w.radius


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

    refuse_inner_wheels(name, wheels, radii, pitch)
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


def refuse_inner_wheels(name: str, wheels: Sequence[TrackWheel], radii: Sequence[float], pitch: float) -> None:
    """Refuse a wheel that is farther inside the band than one pitch: no run that sags or swings touches it."""
    for k, w in enumerate(wheels):
        others = [(v.at, r) for v, r in zip(wheels, radii, strict=True) if v is not w]
        arcs = taut_band([w.at, *(at for at, _ in others)], [radii[k], *(r for _, r in others)])
        if any(a.circle == 0 for a in arcs):
            continue
        nearest = min(band_distance(a, w.at) for a in arcs) - radii[k]
        if nearest > pitch:
            raise ModelError(
                f"track {name!r}: wheel {w.name!r} is {nearest:.3g} m inside the track and touches no shoe; move it "
                f"outwards, or leave it out"
            )


def tooth_shapes(teeth: int, phase: float, links: Shoes) -> tuple[Prism, ...]:
    """Return the teeth of a sprocket, tapered, from its hub to beyond the pitch circle; one points along the phase.

    The plates of two shoes on the sprocket leave free, on each side of the line from its centre to their common pin,
    (gap cos a - thickness sin a) / 2 with a = pi / teeth. A tooth takes nine tenths of it.
    """
    half, pitch, thickness = pi / teeth, links.pitch, links.thickness
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
        out.append(
            Prism(outline=tuple(map(tuple, (outline @ [[c, s], [-s, c]]).tolist())), thickness=links.wheel_width)
        )
    return tuple(out)


def add_shoes(m: Mechanism, frame: Frame, pins: np.ndarray, links: Shoes) -> None:
    """Add the shoes and their hinges."""
    number, shape = len(pins), links.shape(frame.spatial)
    for k, (a, b) in enumerate(zip(pins, np.roll(pins, -1, axis=0), strict=True)):
        pose = frame.pose((a + b) / 2, atan2(b[1] - a[1], b[0] - a[0]))
        m.add(Body(f"shoe_{k}", mass=links.mass, shape=shape, color=STEEL, **pose))
    for k, p in enumerate(pins):
        joint = PointOnLine if frame.spatial and k == 0 else Revolute
        m.add(joint(f"pin_{k}", f"shoe_{(k - 1) % number}", f"shoe_{k}", at=frame.point(p), **frame.normal))


def add_wheel(
    m: Mechanism,
    frame: Frame,
    w: TrackWheel,
    at: tuple[float, float],
    size: tuple[float, float],
    teeth: tuple[Prism, ...],
) -> None:
    """Add a wheel of a radius and width with what carries it."""
    (radius, width), normal = size, (0.0, 0.0, 1.0)
    moments = w.mass * (3 * radius**2 + width**2) / 12, w.mass * radius**2 / 2
    shape = (Cylinder(radius=radius, length=width), *teeth)
    inertia = frame.inertia(*moments, normal)
    m.add(Body(w.name, mass=w.mass, inertia=inertia, shape=shape, color=SLATE, **frame.pose(at)))
    n, carrier, hub, stiffness = w.name, "ground", 0.3 * radius, w.stiffness or 0.0
    mass = ARM * w.mass
    if w.arm is not None:
        carrier = f"{n}_arm"
        lever = (w.arm[0] - at[0], w.arm[1] - at[1], 0.0)
        span, middle = hypot(*lever), ((at[0] + w.arm[0]) / 2, (at[1] + w.arm[1]) / 2)
        end = (lever[0] / 2, lever[1] / 2, 0.0)
        rod = Rod(start=(-end[0], -end[1], 0.0), end=end, radius=hub / 2, looks=True)
        inertia = frame.inertia(mass * (span**2 / 12 + hub**2 / 16), mass * hub**2 / 8, lever)
        m.add(Body(carrier, mass=mass, inertia=inertia, shape=rod, color=RUST, **frame.pose(middle)))
        m.add(Revolute(f"{n}_pivot", "ground", carrier, at=frame.point(w.arm), **frame.normal))
        free = lever[0] * w.load / stiffness
        m.add(TorsionalSpringDamper(f"{n}_bar", f"{n}_pivot", stiffness=stiffness, damping=w.damping, angle=free))
    elif w.slide is not None:
        carrier = f"{n}_slider"
        block = Box(edges=(hub, hub, hub), looks=True)
        inertia = frame.inertia(mass * hub**2 / 6, mass * hub**2 / 6, normal)
        m.add(Body(carrier, mass=mass, inertia=inertia, shape=block, color=RUST, **frame.pose(at)))
        m.add(Prismatic(f"{n}_slide", "ground", carrier, at=frame.point(at), axis=frame.point(w.slide)))
        spring: Any = {"stiffness": stiffness, "damping": w.damping, "rest": w.load / stiffness}
        m.add(CoordinateSpring(f"{n}_spring", f"{n}_slide.displacement", **spring))
    m.add(Revolute(f"{n}_axle", carrier, n, at=frame.point(at), **frame.normal))


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


def band_distance(arc: Arc, at: tuple[float, float]) -> float:
    """Return the distance of a point inside the band from the straight after an arc [m]."""
    normal = (cos(arc.last), sin(arc.last))
    return arc.radius + sum(n * (c - x) for n, c, x in zip(normal, arc.centre, at, strict=True))


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
