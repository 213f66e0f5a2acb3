"""A tyre between a wheel and a road: contact, transient slips, forces and moments.

The W axes of ISO 8855 and TYDEX have their origin in the contact point: z along the road's normal, x along the line in
which the plane of the wheel meets the road, y to the left. V is the velocity of the contact point on the wheel's plane,
w the spin about the wheel's axis, Re the effective rolling radius; the slip velocities are Vsx = Vx - w Re and Vsy. The
deflections u, v of the contact patch develop over the relaxation lengths (Pacejka, *Tire and Vehicle Dynamics*, 2012,
section 8.6):

    u' = -Vsx - |Vx| u / sx,  v' = Vsy - |Vx| v / sy,  kappa = u / sx,  tan(alpha) = v / sy

In steady motion kappa = -Vsx / |Vx| and tan(alpha) = Vsy / |Vx|; at standstill u and v are the deflections of a spring.
At low speed a damper acts along the slip velocities (ibid., equation 8.127; Besselink 2000), and the deflections do not
grow beyond the slips at which the tyre slides.

The contact point is that of the disc on the plane that touches the road below it, found by a few passes; with several
points, on the plane of their mean height and mean slopes (Pacejka 2012, section 10.1, as a base for enveloping).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import SimpleNamespace
from typing import Annotated, Any, ClassVar, Literal

import numpy as np

from ..compiler.formulas import formula
from ..errors import ModelError
from ..math.scalar import absolute, asin, atan, choose, cos, integer_power, minimum, sqrt
from ..math.vec import add, col, cross, dot, mtv, mv, scale, sub
from ..model.body import GROUND
from ..model.element import (
    Direction,
    Length,
    Number,
    Unit,
    described_part,
    element,
    nonnegative,
    positive,
    resolve,
)
from ..model.force import TwoFrameForce
from ..model.geometry import triad, vector
from ..model.joint import WorldFrame
from . import tyres
from .tyres.road_height import road_height
from .tyres.tyre_model import RADIUS, TyreModel

KIND = 11
MODEL, SIDE, FRICTION, POINTS, PATCH, LOW_SPEED = range(6)  # parameters
ROAD, DATA = 14, 15  # parameters: places of the road and of the model's numbers; `tables.values` fills them in
PASSES = 3  # for the contact point on a road that is not plane
MOST_POINTS = 64
PI = 3.141592653589793
CREEP = 0.01  # of the low speed: below it, a wheel counts as standing
FLAT = 1e-6  # sine of the angle between axis and normal below which the wheel lies flat
DAMPING = 0.05  # of slip stiffness over low speed: the damper at standstill


@formula
def plane_below(par, surfaces, point, heading):
    """Return height and slopes of the road at a point of it, in its frame: means over points along ``heading``."""
    o = 0.0 * point[0]
    at = int(par[ROAD].real)
    if at < 0:
        return o, o, o
    count = int(par[POINTS].real)
    z, zx, zy = o, o, o
    for k in range(count):
        away = par[PATCH] * ((k + 0.5) / count - 0.5)
        x = point[0] + away * heading[0]
        y = point[1] + away * heading[1]
        a, b, c = road_height(surfaces, at, x, y)
        z, zx, zy = z + a / count, zx + b / count, zy + c / count
    return z, zx, zy


@formula
def contact(par, F, M, data, surfaces):
    """Return centre, contact point, W axes, sine of camber, loaded radius and distance, in the road's frame."""
    centre = mtv(F[1], sub(M[0], F[0]))
    axis = mtv(F[1], col(M[1], 1))
    o = 0.0 * centre[0]
    n = (o, o, o + 1.0)
    point = centre
    passes = 1 if par[ROAD].real < 0.0 else PASSES
    ahead, up, height, lean = n, n, o, o
    for _ in range(passes):
        ahead = cross(axis, n)
        ahead = scale(1.0 / sqrt(dot(ahead, ahead)), ahead)
        z, zx, zy = plane_below(par, surfaces, point, ahead)
        n = scale(1.0 / sqrt(1.0 + zx * zx + zy * zy), (-zx, -zy, 1.0 + 0.0 * zx))
        lean = dot(n, axis)
        up = sub(n, scale(lean, axis))
        upright = sqrt(1.0 - lean * lean)
        height = dot(n, sub(centre, (point[0], point[1], z)))
        up = scale(1.0 / upright, up)
        point = sub(centre, scale(height / upright, up))
    ahead = cross(axis, n)
    ahead = scale(1.0 / sqrt(dot(ahead, ahead)), ahead)
    return centre, point, (ahead, cross(n, ahead), n), lean, height, axis


@formula
def patch_motion(F, M, place):
    """Return velocities of the wheel in its contact: (Vx, Vsy), spin, rate of the distance to the road, and of lean."""
    centre, point, axes, lean, height, axis = place
    v = mtv(F[1], sub(sub(M[3], F[3]), cross(F[2], sub(M[0], F[0]))))
    w = mtv(F[1], sub(M[2], F[2]))
    aside = dot(axes[1], add(v, cross(w, sub(point, centre))))
    return dot(axes[0], v), aside, dot(axis, w), dot(axes[2], v), dot(axes[2], cross(w, axis))


@formula
def low_speed_share(par, vx):
    """Return 1 at standstill, 0 from the low speed on, smoothly."""
    part = minimum(absolute(vx) / par[LOW_SPEED], 0.0 * vx + 1.0)
    return 0.5 + 0.5 * cos(PI * part)


@formula
def deflection_rate(drive, speed, share, deflection, length, limit):
    """Return the rate of a deflection: the slip velocity less what the rolling carries away and what slides."""
    most = length * limit
    part = integer_power(deflection / most, 4)
    sliding = share * absolute(drive) * 2.0 * part / ((1.0 + part) * most)
    return drive - (speed / length + sliding) * deflection


@formula
def patch_state(par, F, M, states, data, surfaces):
    """Return the contact, its motion, (load, deflection), slips, forces and moments (Fx, ..., Mz), and the rates."""
    at, kind, side = int(par[DATA].real), int(par[MODEL].real), par[SIDE]
    place = contact(par, F, M, data, surfaces)
    vx, vsy, spin, sinking, leaning = patch_motion(F, M, place)
    lean, height = side * place[3], place[4]
    upright = sqrt(1.0 - lean * lean)
    loaded = height / upright
    rate = -sinking / upright - height * place[3] * leaning / (upright * upright * upright)
    deflection = data[at + RADIUS] - loaded
    load, radius = tyres.load(kind, data, at, deflection, rate, spin, lean)
    along, across, most, most_across = tyres.relaxation(kind, data, at, par[FRICTION], load, lean)
    creep = CREEP * par[LOW_SPEED]
    speed = vx * vx / sqrt(vx * vx + creep * creep)
    share = low_speed_share(par, vx)
    vsx = vx - spin * radius
    u, v = states
    rates = (
        deflection_rate(-vsx, speed, share, u, along, most),
        deflection_rate(vsy, speed, share, v, across, most_across),
    )
    damped = share * DAMPING / par[LOW_SPEED]
    slip, tangent = u / along - damped * vsx, v / across + damped * vsy
    motion = (vx / sqrt(vx * vx + vsy * vsy + creep * creep), vx, spin)
    fx, fy, mx, my, mz = tyres.slip_forces(kind, data, at, par[FRICTION], slip, side * tangent, lean, load, motion)
    forces = (fx, side * fy, side * mx, my, side * mz)
    return place, (vx, vsx, vsy, spin), (load, deflection, radius), (slip, tangent), forces, rates


@formula
def wrench_and_rates(par, F, M, states, data, surfaces):
    """Return force and torque on the wheel about its centre, and the rates of the two deflections."""
    place, _, state, _, forces, rates = patch_state(par, F, M, states, data, surfaces)
    x, y, z = place[2]
    fx, fy, mx, my, mz = forces
    o = 0.0 * fx
    force = add(add(scale(fx, x), scale(fy, y)), scale(state[0], z))
    torque = add(add(scale(mx, x), scale(my, y)), scale(mz, z))
    torque = add(torque, cross(sub(place[1], place[0]), force))
    below = choose(place[4], o, o + math.nan)  # a wheel whose centre is below the road is on no side of it
    return add(mv(F[1], force), (below, below, below)), mv(F[1], torque), rates


def figures(par: Any, F: Any, M: Any, states: Any, data: Any, surfaces: Any) -> tuple[Any, ...]:
    """Return the outputs of a `Tyre`, in their order, over time."""
    place, _, (load, deflection, radius), (slip, tangent), forces, _ = patch_state(par, F, M, states, data, surfaces)
    point = add(F[0], mv(F[1], place[1]))
    fx, fy, mx, my, mz = forces
    return load, fx, fy, mx, my, mz, slip, atan(tangent), asin(place[3]), deflection, radius, *point


@element
class Tyre(TwoFrameForce):
    """A tyre on a wheel, rolling, slipping and standing on a road; in space.

    It acts by one contact point: load (never pulling), longitudinal and lateral force, overturning moment, rolling
    resistance and aligning moment of its model. Slips develop over relaxation lengths, so it rolls, stops, stands on a
    slope and starts again without chatter. Two deflections of the contact patch are states, as those of controllers.

    Parameters
    ----------
    name : str
    body_i : str
        The road: a `Road`, or any frame or body whose x-y plane is one; ``"ground"`` is the plane z = 0.
    body_j : str
        The wheel, or a frame on it. Without ``at`` its origin is the centre, and its y axis the axis of rotation.
    at : point [m]
        Centre of the wheel, in world coordinates of the drawn configuration.
    axis : direction
        With ``at``: axis of rotation in the world, as drawn, to the left of the forward direction; y if not given.
    model : tyre model
        `LinearTyre`, `FialaTyre` or `MagicFormula`.
    side : ``"left"`` or ``"right"``
        Side of the vehicle, which mirrors a model that was measured on the other side; as measured if not given.
    points : int
        Number of points, along the contact patch, over which the road's height and slope are averaged.
    patch : number [m]
        Length over which they are spread.
    low_speed : number [m/s]
        Below this speed the slip velocities are damped.

    Notes
    -----
    A result contains, in W axes (x forward, y to the left, z up): ``load``, ``longitudinal_force``, ``lateral_force``,
    ``overturning_moment``, ``rolling_resistance``, ``aligning_moment``; ``slip`` (positive when driving),
    ``slip_angle`` (positive if the contact point moves to the left: the lateral force is then negative), ``camber``
    (positive if the wheel leans to the right), ``deflection`` (negative in the air), ``rolling_radius``, and the place
    of the contact ``contact_x``, ``contact_y``, ``contact_z`` in the world. ``force`` and ``torque`` act on the wheel
    about its centre, along the world's axes.
    """

    axis: Direction | None = None
    model: Annotated[TyreModel, described_part(TyreModel, "a tyre model such as FialaTyre(...)")]
    side: Literal["left", "right"] | None = None
    points: int = 1
    patch: Length = 0.0
    low_speed: Annotated[Number, Unit("m/s")] = 1.0

    kind: ClassVar[int] = KIND
    on_bodies: ClassVar[bool] = True
    wrench_and_rates: ClassVar = staticmethod(wrench_and_rates)
    figures: ClassVar = staticmethod(figures)
    outputs: ClassVar[dict[str, str]] = {
        "load": "N", "longitudinal_force": "N", "lateral_force": "N", "overturning_moment": "N*m",
        "rolling_resistance": "N*m", "aligning_moment": "N*m", "slip": "1", "slip_angle": "rad", "camber": "rad",
        "deflection": "m", "rolling_radius": "m", "contact_x": "m", "contact_y": "m", "contact_z": "m",
    }  # fmt: skip

    def needs(self) -> str:
        """Return the road, for its friction; ground has none of its own."""
        return "" if self.body_i == GROUND else self.body_i

    def failure(self, par: Any, F: Any, M: Any, surfaces: Any) -> str:
        """Return whether the wheel lies flat, there is no road below it, or its centre is beneath the road."""
        if float(np.hypot(*mtv(F[1], col(M[1], 1))[:2])) < FLAT:
            return (
                f"The wheel lies flat on {self.body_i!r}: its axis is along the road's normal, so that it has no "
                f"line of rolling. The axis is y of {self.body_j!r}, or axis= with at="
            )
        x, y = (float(v) for v in mtv(F[1], sub(M[0], F[0]))[:2])
        height = float(contact(par, F, M, (), surfaces)[4])
        if math.isnan(height):
            return (
                f"There is no road below the wheel: {self.body_i!r} ends before x = {x:.4g} m, y = {y:.4g} m (along "
                'its axes), or has no height there. Make it longer, give it beyond="hold", or end the motion earlier'
            )
        if height < 0.0:
            return (
                f"The centre of the wheel is {-height:.4g} m beneath {self.body_i!r}: the road is on the side to which "
                "its z axis points. Place the wheel there, or turn the road over"
            )
        return self.fails

    def states(self) -> tuple[str, ...]:
        """Return the deflections of the contact patch."""
        return ("longitudinal_deflection", "lateral_deflection")

    def derive(self, n: SimpleNamespace, env: Mapping[str, Any]) -> None:
        """Resolve the numbers of the model."""
        n.tyre = resolve(self.model, env)

    def placed(self, n: SimpleNamespace, planar: bool) -> dict[str, WorldFrame] | None:
        """Return the frame at the wheel's centre whose y axis is the axis of rotation."""
        if planar:
            raise ModelError(f"{self.title}: a tyre is for spatial mechanisms; give Mechanism(planar=False)")
        if n.at is None:
            return None
        p = vector(n.at, planar, f"'at' of {self.title}")
        y = vector((0.0, 1.0, 0.0) if n.axis is None else n.axis, planar, f"axis of {self.title}", direction=True)
        R = triad(y)  # its z axis is y
        return {"M": (p, np.stack([R[:, 0], y, -R[:, 1]], axis=1))}

    def check(self, n: SimpleNamespace) -> None:
        """Refuse wrong numbers, and options without effect."""
        self.model.check(n.tyre)
        positive(self, n, "low_speed")
        nonnegative(self, n, "patch")
        if n.axis is not None and n.at is None:
            raise ModelError(
                f"{self.title}: axis needs the wheel's centre, at=; without it, it is the y axis of {self.body_j!r}"
            )
        if not 1 <= self.points <= MOST_POINTS or (self.points > 1) != (n.patch.real > 0.0):
            raise ModelError(
                f"{self.title}: points is {self.points} and patch {n.patch:g} m; give one point without a patch, or 2 "
                f"to {MOST_POINTS} along one"
            )
        if self.side is not None and getattr(n.tyre, "right", None) is None:
            raise ModelError(f"{self.title}: {self.model.title} is symmetric, so side has no effect; leave it out")

    def parameters(self, n: SimpleNamespace, separation: float) -> tuple[float, ...]:
        """Return the parameters of the formulas."""
        mirrored = self.side is not None and n.tyre.right != (self.side == "right")
        friction = getattr(getattr(n, "of", None), "friction", 1.0)
        return (self.model.kind, -1.0 if mirrored else 1.0, friction, self.points, n.patch, n.low_speed)

    def data(self, n: SimpleNamespace) -> tuple[float, ...]:
        """Return the numbers of the model."""
        return self.model.numbers(n.tyre)
