"""Wheel on a rail or on a roller: contact geometry, Hertz's normal force, creep forces."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from functools import lru_cache
from types import SimpleNamespace
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import BeforeValidator

from ..compiler.formulas import formula
from ..errors import ModelError
from ..math.scalar import absolute, choose, maximum, nonpositive
from ..math.vec import add, col, cross, dot, scale, sub
from ..model.element import (
    Direction,
    Law,
    LawOf,
    Length,
    Number,
    Numbers,
    Ratio,
    Unit,
    element,
    nonnegative,
    positive,
    python_data,
)
from ..model.force import TwoFrameForce
from ..model.geometry import vector
from ..model.joint import WorldFrame
from .rolling_contact import hertz, kalker_coefficients, kalker_table, packed_cubic, polach
from .wheel_rail_geometry import (
    APART,
    BEND,
    DAMPING,
    DATA,
    FRICTION,
    LAST,
    MODULUS,
    PLACES_WIDTH,
    RADIUS,
    RAIL_WIDTH,
    SAMPLES,
    SHEAR,
    SIDE,
    STANDSTILL,
    TRAVEL,
    WHEEL_WIDTH,
    beyond_profile,
    contact_place,
    depth_at,
    greatest_depth,
    near_places,
    place_table,
    rail_axes,
    refined_place,
    track_place,
)

KIND = 12
SHALLOWEST = 1e-12  # depth [m] for which the ellipse is computed where there is no contact
LEAST_DAMPING = 1e-6  # of the elastic force: a contact that opens fast does not pull
LEAST_CROSS_CURVATURE = 0.01  # of that along: profiles that fit each other better are computed as this
ARC_POINTS = 16  # of each arc
CONE_WIDTH = 0.2  # [m] of a cone on either side of its origin


@formula
def inputs(par, F, M):
    """Distance along the track [m] and speed [m/s]; zero on a roller."""
    distance, speed, _ = track_place(par, F, M)
    rolling = 1.0 if par[BEND].real == 0.0 else 0.0
    return rolling * distance, rolling * speed


@formula
def rolling_speed(par, speed):
    """Return the rolling speed with its sign; near standstill a greater one, so that creepages are bounded."""
    least = par[STANDSTILL]
    size = choose(speed, speed, -speed)
    size = choose(size - least, size, (speed * speed + least * least) / (2.0 * least))
    return choose(speed, size, -size)


@formula
def contact_force(par, F, M, frame, axis, place, taken, data):
    """Return force on the wheel and its point from the wheel's centre in the world, and what curves show of it.

    ``place`` is near its place on the wheel's profile, or beyond that if there is none; ``taken`` is the place of
    another contact, which counts once.
    """
    t, l, n, y, z = frame
    o = 0.0 * y
    none = (o, o, o), (o, o, o), (o, o, o, o, o, o, o, o, o, o, o)
    if nonpositive(choose(place - par[LAST], o - 1.0, greatest_depth(par, axis, (y, z), place, data))):
        return none
    s = refined_place(par, axis, (y, z), place, data)
    if nonpositive(absolute(s - taken) - 0.5 * APART):
        return none
    p, normal, forward, depth, (A, B) = contact_place(par, axis, (y, z), s, data)
    depth = choose(place - par[LAST], o - 1.0, depth)
    if nonpositive(depth):
        return none
    ended = choose(beyond_profile(par, p[1], data), math.nan + o, o)
    arm = combined((t, l, n), (p[0], p[1] - y, p[2] - z))
    up, ahead = combined((t, l, n), normal), combined((t, l, n), forward)
    aside = scale(par[SIDE], combined((t, l, n), cross(normal, forward)))  # to the left, also where l is to the right
    wheel = add(M[3], cross(M[2], arm))
    rail = add(F[3], cross(F[2], sub(add(M[0], arm), F[0])))
    slip = sub(wheel, rail)
    speed = rolling_speed(par, dot(ahead, sub(M[3], scale(0.5, add(wheel, rail)))))
    size = choose(speed, speed, -speed)
    creepages = dot(ahead, slip) / speed, dot(aside, slip) / size, dot(up, sub(M[2], F[2])) / speed
    deep = maximum(depth, SHALLOWEST + 0.0 * depth)
    a, b, elastic = hertz(A, maximum(B, LEAST_CROSS_CURVATURE * A), par[MODULUS], deep)
    load = elastic * maximum(1.0 - par[DAMPING] * dot(up, slip), LEAST_DAMPING + 0.0 * depth)
    table = int(par[DATA].real) + int(par[WHEEL_WIDTH].real) + int(par[RAIL_WIDTH].real) + 2 * PLACES_WIDTH
    C = kalker_coefficients(data, table, a / b)
    fx, fy = polach(par[SHEAR], par[FRICTION] * load, a, b, C, creepages)
    way = choose(speed, 1.0 + 0.0 * depth, -1.0 + 0.0 * depth)
    out = par[SIDE]
    force = add(scale(load, up), add(scale(way * fx, ahead), scale(fy, aside)))
    load, force = load + ended, add(force, (ended, ended, ended))
    c, u = when(depth, (creepages[0], out * creepages[1], out * creepages[2])), when(depth, (load, fx, out * fy))
    e, q = when(depth, (a, b, deep)), when(depth, (s, p[1], s))
    shown = (u[0], c[0], c[1], c[2], u[1], u[2], e[0], e[1], q[0], q[1], e[2])
    return when(depth, force), when(depth, arm), shown


@formula
def when(x, a):
    """Return the vector a where x is greater than zero, else zeros."""
    o = 0.0 * x
    return choose(x, a[0], o), choose(x, a[1], o), choose(x, a[2], o)


@formula
def combined(axes, a):
    """Return the sum of three vectors with the weights a."""
    return add(scale(a[0], axes[0]), add(scale(a[1], axes[1]), scale(a[2], axes[2])))


@formula
def both_contacts(par, F, M, laws, data):
    """Return the forces of the deepest contact and of a second one, and the local axes."""
    t, l, n, y, z = rail_axes(par, F, M)
    frame = (t, l, n, y - laws[1], z - laws[0])
    a = scale(par[SIDE], col(M[1], 1))
    axis = (dot(a, t), dot(a, l), dot(a, n))
    one, other = near_places(par, axis, (frame[3], frame[4]), data)
    first = contact_force(par, F, M, frame, axis, one, par[LAST] + APART + 0.0 * y, data)
    taken = choose(first[2][0], first[2][8], par[LAST] + APART + 0.0 * y)
    second = contact_force(par, F, M, frame, axis, other, taken, data)
    return first, second, frame


@formula
def derailed(par, M, frame):
    """Return nan where the wheel is beside the rail by more than the search for contacts covers, else 0."""
    _, l, n, y, z = frame
    a = scale(par[SIDE], col(M[1], 1))
    o = 0.0 * y
    low = par[RADIUS] - z
    return choose(low, choose(absolute(y + par[RADIUS] * dot(a, n)) - TRAVEL, math.nan + o, o), o)


@formula
def wrench(par, F, M, laws, values, data):
    """Return the force of both contacts on M, and their torque about its origin."""
    (f, p, _), (g, q, _), frame = both_contacts(par, F, M, laws, data)
    lost = derailed(par, M, frame)
    return add(add(f, g), (lost, lost, lost)), add(cross(p, f), cross(q, g))


@formula
def figures(par, F, M, laws, data):
    """Return the values of the outputs (`WheelOnRail.outputs`)."""
    (f, _, shown), (g, _, second), (_, l, n, _, _) = both_contacts(par, F, M, laws, data)
    distance, speed = inputs(par, F, M)
    across, vertical = -dot(l, add(f, g)), dot(n, add(f, g))
    ratio = across / choose(vertical, vertical, 1.0 + 0.0 * vertical)
    return (distance, speed, *shown, second[0], second[8], across, vertical, ratio)


def _flat(values: Iterable[Any]) -> Iterator[Any]:
    """Yield the numbers of nested tuples."""
    for x in values:
        if isinstance(x, tuple):
            yield from _flat(x)
        else:
            yield x


def _points(value: Any) -> Any:
    """Accept a list of pairs."""
    value = python_data(value)
    if not isinstance(value, list | tuple) or not all(isinstance(p, list | tuple) and len(p) == 2 for p in value):
        raise ValueError("give pairs of numbers, such as (y, z)")
    return tuple(map(tuple, value))


Profile = Annotated[tuple[Numbers, ...], BeforeValidator(_points), Unit("m")]


@element
class WheelOnRail(TwoFrameForce):
    """A wheel on a rail, or on a roller: elastic contact with creep forces.

    The normal force is Hertz's, the creep force Polach's with Kalker's coefficients, in up to two contact points:
    tread and flange. A wheel that is lifted off has no force. Profiles are in axes through ``at``: y along ``axis``,
    away from the middle of the track, and z upwards.

    Parameters
    ----------
    name : str
    body_i : str
        Body that carries the rail, ``"ground"``, or the roller, which turns about a line along ``axis``.
    body_j : str
        Body with the wheel, such as a wheelset; it turns with the wheel.
    at : point [m]
        Place of the origin of both profiles in the drawn configuration, in world coordinates: on top of the rail.
    axis : direction
        From the middle of the track to the rail: the direction of the axle away from the flange.
    direction : direction
        Of the track, horizontal and perpendicular to ``axis``; (1, 0, 0) if not given.
    normal : direction
        Vertical direction, upwards; (0, 0, 1) if not given.
    radius : number [m]
        Radius of the wheel at y = 0; its centre is above ``at``.
    roller_radius : number [m]
        Radius of the roller beneath ``at``, in place of a rail.
    curve_radius : number [m]
        Radius of the rail in a horizontal curve that begins at ``at``: positive to the left of ``direction``, negative
        to the right; straight if not given. Cant is an ``axis`` that is not horizontal.
    inclination : number
        Slope by which the rail leans towards the middle of the track: 1/40.
    wheel_load : number [N]
        Normal force in the drawn configuration: the rail is raised or lowered so that the wheel presses so on it.
        If not given, the rail stays where it is drawn.
    conicity : number
        Rise of a conical tread with y.
    wheel_profile : list of (y, z) [m]
        Profile of the wheel in place of a cone, at least four points, y ascending; a C2 spline goes through them.
    rail_arcs : list of (radius, y) [m]
        Arcs of a symmetric rail head, from the middle outwards: radius, and the y where each ends. They continue one
        another without a corner. If there is nothing given: one of 0.3 m.
    rail_profile : list of (y, z) [m]
        Profile of the rail in place of arcs, at least four points, y ascending.
    friction : number
        Coefficient of friction.
    youngs_modulus : number [Pa]
    poissons_ratio : number
        Of wheel and rail, at most 0.5.
    dissipation : number [s/m]
        Damping of the normal force by the rate of approach: N (1 + dissipation ddot), as Hunt and Crossley's.
    standstill : number [m/s]
        Speed below which creepages are computed with a greater one, so that they stay finite.
    vertical, lateral : law [m]
        Irregularity of the rail: its shift upwards and along ``axis``, an expression of the ``distance`` from ``at``
        along the track, usually of a `Table`.

    Notes
    -----
    A result contains, of the deepest contact: ``normal_force``; creepages ``longitudinal_creepage``,
    ``lateral_creepage`` and ``spin``, ``longitudinal_force`` and ``lateral_force`` of creep on the wheel, in the
    direction of travel and along ``axis``; semi-axes of the ellipse; ``wheel_y`` and ``rail_y`` on the profiles;
    ``depth``. ``second_force`` and ``second_y`` are of a second contact. ``outward_force``
    and ``vertical_force`` are the whole load on the rail, ``derailment_ratio`` their ratio (Nadal's L/V).
    """

    axis: Direction
    radius: Length
    direction: Direction = (1.0, 0.0, 0.0)
    normal: Direction = (0.0, 0.0, 1.0)
    roller_radius: Length | None = None
    curve_radius: Length | None = None
    inclination: Ratio = 0.0
    wheel_load: Annotated[Number | None, Unit("N")] = None
    conicity: Ratio | None = None
    wheel_profile: Profile | None = None
    rail_arcs: Profile | None = None
    rail_profile: Profile | None = None
    friction: Ratio = 0.4
    youngs_modulus: Annotated[Number, Unit("Pa")] = 210e9
    poissons_ratio: Ratio = 0.28
    dissipation: Annotated[Number, Unit("s/m")] = 0.0
    standstill: Annotated[Number, Unit("m/s")] = 0.1
    vertical: Annotated[Law | None, LawOf("m", ("distance", "speed"))] = None
    lateral: Annotated[Law | None, LawOf("m", ("distance", "speed"))] = None

    kind: ClassVar[int] = KIND
    inputs: ClassVar = staticmethod(inputs)
    wrench: ClassVar = staticmethod(wrench)
    figures: ClassVar = staticmethod(figures)
    takes_splines: ClassVar[bool] = True
    in_own_axes: ClassVar[tuple[str, ...]] = ("wheel_profile", "rail_arcs", "rail_profile")
    outputs: ClassVar[dict[str, str]] = {
        "distance": "m", "speed": "m/s",
        "normal_force": "N", "longitudinal_creepage": "1", "lateral_creepage": "1", "spin": "rad/m",
        "longitudinal_force": "N", "lateral_force": "N", "semi_axis_along": "m", "semi_axis_across": "m",
        "wheel_y": "m", "rail_y": "m", "depth": "m", "second_force": "N", "second_y": "m",
        "outward_force": "N", "vertical_force": "N", "derailment_ratio": "1",
    }  # fmt: skip
    fails: ClassVar[str] = (
        "Its contact has reached the end of the rail's profile, or the wheel is beside the rail by more than 30 mm. "
        "Give the profile more points, or end the motion before"
    )

    def placed(self, n: SimpleNamespace, planar: bool) -> dict[str, WorldFrame] | None:
        """Return F on top of the rail, or in the centre of the roller, and M in the centre of the wheel.

        Both have x along the track and z upwards.
        """
        if planar:
            raise ModelError(f"{self.title}: a planar mechanism has no wheel on a rail; make the mechanism spatial")
        if n.at is None:
            raise ModelError(f"{self.title}: give at=, the place on top of the rail")
        R = self._axes(n)
        p, up = vector(n.at, False, f"'at' of {self.title}"), R[:, 2]
        below = 0.0 if n.roller_radius is None else n.roller_radius
        return {"F": (p - below * up, R), "M": (p + n.radius * up, R)}

    def _axes(self, n: SimpleNamespace) -> np.ndarray:
        """Return the directions along the track, to its left and upwards, as columns."""
        out = vector(n.axis, False, f"axis of {self.title}", direction=True)
        t = vector(n.direction, False, f"direction of {self.title}", direction=True)
        if not abs((t @ out).real) < 1e-6:
            raise ModelError(
                f"{self.title}: direction {tuple(n.direction)} is not perpendicular to axis {tuple(n.axis)}; give the "
                f"direction of the track"
            )
        up = np.array(cross(t, out))
        up = up if (up @ vector(n.normal, False, f"normal of {self.title}", direction=True)).real >= 0.0 else -up
        return np.column_stack([t, np.array(cross(up, t)), up])

    def _side(self, n: SimpleNamespace) -> float:
        """Return 1 for a rail left of the middle, -1 for one right of it."""
        out = vector(n.axis, False, f"axis of {self.title}", direction=True)
        return 1.0 if (self._axes(n)[:, 1] @ out).real > 0.0 else -1.0

    def _cant(self, n: SimpleNamespace) -> Any:
        """Return sine and cosine of the angle by which the track rises to its left."""
        R, up = self._axes(n), vector(n.normal, False, f"normal of {self.title}", direction=True)
        return np.array([up @ R[:, 1], up @ R[:, 2]])

    def check(self, n: SimpleNamespace) -> None:
        """Require valid numbers and profiles."""
        positive(self, n, "radius", "roller_radius", "youngs_modulus", "standstill")
        nonnegative(self, n, "dissipation", "friction", "wheel_load")
        if not n.friction > 0.0:
            raise ModelError(f"{self.title}: friction is 0; give a small one, such as 0.001")
        if not 0.0 <= n.poissons_ratio <= 0.5:
            raise ModelError(f"{self.title}: poissons_ratio is {n.poissons_ratio:g}; it is from 0 to 0.5")
        for one, other in (("conicity", "wheel_profile"), ("rail_arcs", "rail_profile")):
            if getattr(n, one) is not None and getattr(n, other) is not None:
                raise ModelError(f"{self.title}: both {one} and {other} are given; leave one out")
        if n.conicity is None and n.wheel_profile is None:
            raise ModelError(f"{self.title}: the wheel has no profile; give conicity= or wheel_profile=")
        if n.curve_radius is not None and (n.roller_radius is not None or not n.curve_radius != 0.0):
            raise ModelError(f"{self.title}: curve_radius is that of a track, not zero; leave it out")
        if not abs(n.inclination) < 0.5:
            raise ModelError(f"{self.title}: inclination is {n.inclination:g}; it is a slope, such as 1/40")
        if n.roller_radius is not None and (self.vertical is not None or self.lateral is not None):
            raise ModelError(
                f"{self.title}: irregularities are functions of the distance along a track; leave them out"
            )
        if n.rail_arcs is not None:
            self._check_arcs(n.rail_arcs)
        for name in ("wheel_profile", "rail_profile"):
            self._check_points(name, getattr(n, name))
        self._check_points("the inclined profile of the rail", rail_points(n))

    def _check_points(self, name: str, points: Any) -> None:
        if points is None:
            return
        if len(points) < 4:
            raise ModelError(f"{self.title}: {name} has {len(points)} points; give four or more, each (y, z)")
        for k in range(1, len(points)):
            if not points[k][0] > points[k - 1][0]:
                raise ModelError(
                    f"{self.title}: {name}: y = {points[k][0]:g} m of point {k} comes after {points[k - 1][0]:g} m; y "
                    f"must ascend: sort the points, and leave out where the profile turns back or crosses itself"
                )

    def _check_arcs(self, arcs: tuple) -> None:
        before, slope = 0.0, 0.0
        for k, (radius, y) in enumerate(arcs):
            if not radius > 0.0 or not y > before:
                raise ModelError(
                    f"{self.title}: rail_arcs: arc {k} has the radius {radius:g} m and ends at y = {y:g} m; radii are "
                    f"greater than zero, and ends ascend from zero"
                )
            slope, before = slope + (y - before) / radius, y
            if slope >= 1.0:
                raise ModelError(
                    f"{self.title}: rail_arcs: arc {k} with the radius {radius:g} m is vertical before it ends at y = "
                    f"{y:g} m; let it end nearer to the middle"
                )

    def curves(self, n: SimpleNamespace) -> tuple[list[float], ...]:
        """Return the splines of the profiles of wheel and rail, of contact places, and of Kalker's coefficients."""
        if any(hasattr(x, "called") and not x.known for x in _flat(vars(n).values())):
            raise ModelError(
                f"{self.title}: its profiles follow parameters, and curves through symbols are not written out; give "
                "these parameters as numbers"
            )
        try:
            profiles = profile_splines(n)
        except ModelError as error:
            raise ModelError(f"{self.title}: {error}") from None
        numbers = tuple(float(x.real) for x in self.parameters(n, 0.0))
        places = place_table(numbers, tuple(float(x.real) for profile in profiles for x in profile))
        return (*profiles, list(places), kalker_table(n.poissons_ratio))

    def parameters(self, n: SimpleNamespace, separation: float) -> tuple[float, ...]:
        """Return the numbers of the formulas; the engine writes the place of the splines into the first."""
        rail = rail_points(n)
        wheel = wheel_points(n)
        elastic = moduli(n)
        first = max(wheel[0, 0], rail[0, 0] - TRAVEL, key=lambda x: x.real)
        last = min(wheel[-1, 0], rail[-1, 0] + TRAVEL, key=lambda x: x.real)
        numbers = {
            "widths": (0.0, *(float(len(c)) for c in profile_splines(n))),
            "shape": (n.radius, bend(n), self._side(n), first, last),
            "elastic": elastic,
            "losses": (n.friction, n.dissipation, n.standstill),
            "curve": (0.0 if n.curve_radius is None else 1.0 / n.curve_radius, *self._cant(n)),
        }
        return tuple(x for part in numbers.values() for x in part)

    def laws(self) -> tuple[Law | None, ...]:
        """Return the irregularities."""
        return (self.vertical, self.lateral)


def moduli(n: SimpleNamespace) -> tuple[float, float]:
    """Return E* of Hertz's theory for two bodies of the material, and its shear modulus."""
    nu = n.poissons_ratio
    return 0.5 * n.youngs_modulus / (1.0 - nu * nu), 0.5 * n.youngs_modulus / (1.0 + nu)


SHAPING = (
    "radius", "roller_radius", "conicity", "wheel_profile", "rail_arcs", "rail_profile", "inclination", "wheel_load",
    "youngs_modulus", "poissons_ratio",
)  # fmt: skip
"""Fields that the splines of the profiles depend on."""


def bend(n: SimpleNamespace) -> Any:
    """Return the curvature of a roller; 0 for a rail."""
    return 0.0 if n.roller_radius is None else 1.0 / n.roller_radius


def profile_splines(n: SimpleNamespace) -> tuple[list[float], list[float]]:
    """Return the splines of the profiles of wheel and rail; the rail is raised so that it bears the given load."""
    return _profile_splines(tuple(getattr(n, name) for name in SHAPING))


@lru_cache(maxsize=64)
def _profile_splines(values: tuple) -> tuple[list[float], list[float]]:
    n = SimpleNamespace(**dict(zip(SHAPING, values, strict=True)))
    rail = rail_points(n)
    wheel = packed_cubic(*wheel_points(n).T)
    return wheel, packed_cubic(*(rail + np.array([0.0, _rise(n, rail, wheel)])).T)


def _rise(n: SimpleNamespace, rail: np.ndarray, wheel: list[float]) -> Any:
    """Return by how much a rail is raised so that the contact beneath the wheel's centre has the load."""
    if n.wheel_load is None:
        return 0.0
    data = np.array([*wheel, *packed_cubic(*rail.T)])
    par = (0.0, float(len(wheel)), 0.0, n.radius, bend(n))
    axis, centre = (0.0, 1.0, 0.0), (0.0, n.radius)
    s = np.linspace(rail[0, 0].real, rail[-1, 0].real, SAMPLES)
    depth = depth_at(tuple(x.real for x in par), axis, (0.0, n.radius.real), s, data.real)[0]
    deepest = int(np.argmax(depth))
    if deepest in (0, SAMPLES - 1):
        raise ModelError(
            f"its wheel is deepest at the end y = {s[deepest]:.4g} m of the rail's profile, where it has no contact; "
            "give the rail a profile or arcs that reach farther, or an inclination nearer to the conicity"
        )
    at = refined_place(par, axis, centre, float(s[deepest]), data)
    _, normal, _, deep, (A, B) = contact_place(par, axis, centre, at, data)
    _, _, force = hertz(A, maximum(B, LEAST_CROSS_CURVATURE * A), moduli(n)[0], 1.0)
    return ((n.wheel_load / force) ** (2.0 / 3.0) - deep) / normal[2]


def rail_points(n: SimpleNamespace) -> np.ndarray:
    """Return points (k, 2) of a rail's profile, inclined."""
    points = np.array(n.rail_profile) if n.rail_profile is not None else _arc_points(n)
    c = 1.0 / np.sqrt(1.0 + n.inclination**2)
    return points @ (c * np.array([[1.0, n.inclination], [-n.inclination, 1.0]]))  # type: ignore[no-any-return]


def _arc_points(n: SimpleNamespace) -> np.ndarray:
    """Return points (k, 2) of a rail head of arcs."""
    y, z = [0.0], [0.0]
    begin, height, sine = 0.0, 0.0, 0.0
    for radius, end in ((0.3, 0.035),) if n.rail_arcs is None else n.rail_arcs:
        middle, centre = begin - radius * sine, height - radius * np.sqrt(1.0 - sine * sine)
        places = begin + (end - begin) * np.arange(1, ARC_POINTS + 1) / ARC_POINTS
        heights = centre + np.sqrt(radius**2 - (places - middle) ** 2)
        y, z = [*y, *places], [*z, *heights]
        begin, height, sine = end, heights[-1], (end - middle) / radius
    right = np.column_stack([y, z])
    return np.vstack([right[:0:-1] * np.array([-1.0, 1.0]), right])


def wheel_points(n: SimpleNamespace) -> np.ndarray:
    """Return points (k, 2) of a wheel's profile."""
    if n.wheel_profile is not None:
        return np.array(n.wheel_profile)
    y = np.linspace(-CONE_WIDTH, CONE_WIDTH, 4)
    return np.column_stack([y, n.conicity * y])
