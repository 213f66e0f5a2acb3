"""PathDriver: preview steering of a vehicle along a path."""

from __future__ import annotations

from dataclasses import field
from types import SimpleNamespace
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from pydantic import BeforeValidator

from ..errors import ModelError
from ..model.body import Frame
from ..model.controller import Controller, ControlState, Sensor
from ..model.element import Element, Length, Name, Number, Point, Unit, element, positive, python_data
from ..model.expression_parser import SyntaxNode
from ..model.table import Table

if TYPE_CHECKING:
    from ..model.model import Model

FOLLOW = 10.0  # rate, by preview time, at which the place on the path follows the vehicle
SPACING = 8  # points of the tables for each point of the path
MOST_POINTS = 4000  # of a table
COLUMNS = ("x", "y", "along_x", "along_y")  # tables of the path: place and direction
SENSORS = {"x": "rear.x", "y": "rear.y", "vx": "rear.vx", "vy": "rear.vy", "nose_x": "nose.x", "nose_y": "nose.y"}
Places = Annotated[tuple[tuple[float, ...], ...], BeforeValidator(python_data)]


@element
class PathDriver(Controller):
    """A driver who steers along a path: a point of the path ahead, at a preview distance, is aimed at.

    With l the distance of that point and y its offset to the left of the vehicle's x axis, the circle through the
    vehicle, tangent to its axis, and the point has the curvature k = 2 y / l^2 (pure pursuit; Coulter 1992). The angle
    of the front wheels that the vehicle needs for it in steady cornering is atan(L k) + K v^2 k with the wheelbase L
    and the understeer gradient K [rad s^2/m]. So the steering is that of MacAdam's optimal preview control (1981) with
    one preview point and the steady turn as the driver's model of the vehicle. The preview distance is sqrt(least^2 +
    (preview v)^2).

    The path is a cubic spline through the points, straight beyond its ends. Laws name the output by ``NAME`` [rad,
    positive to the left], and ``NAME.error`` (distance of the vehicle to the left of the path) and ``NAME.place`` (arc
    length on the path), which is a state that follows the vehicle.

    Its parts belong to it: the frames ``NAME_rear`` and ``NAME_nose``, sensors ``NAME_x``, ..., and the tables
    ``NAME_path_x``, ...

    Parameters
    ----------
    name : str
        One word, as the parts are named in expressions.
    body : str
        Body of the vehicle: x forward, y to the left.
    rear : point [m]
        Middle of the rear axle in the body's reference frame; its origin if not given.
    path : list of points (x, y) [m]
        Four or more, in the world's x-y plane. They may lie densely; a full turn passes them again.
    wheelbase : number [m]
    understeer : number [rad s^2/m]
        Understeer gradient that the driver knows.
    preview : number [s]
        Preview time; usually 0.5 s to 1.5 s.
    least : number [m]
        Preview distance at standstill.
    limit : number [rad]
        Largest angle.
    start : number [m]
        Arc length of the path at the start, next to the vehicle.
    period, offset : number [s], optional
        It is sampled at offset, offset + period, ...

    Notes
    -----
    For a kinematic vehicle near a straight path, e'' + 2 (v / l) e' + 2 (v / l)^2 e = 0: the deviation decays with the
    damping ratio 0.707 at any speed. On a circle it is zero if the vehicle turns as the driver thinks.
    Sources: R. C. Coulter, *Implementation of the pure pursuit path tracking algorithm*, CMU-RI-TR-92-01, 1992. C. C.
    MacAdam, *Application of an optimal preview control for simulation of closed-loop automobile driving*, IEEE Trans.
    Systems, Man, and Cybernetics 11, 1981.
    """

    body: Name = field(kw_only=False)
    path: Places
    wheelbase: Length
    understeer: Annotated[Number, Unit("rad*s^2/m")] = 0.0
    rear: Point | None = None
    preview: Annotated[Number, Unit("s")] = 1.0
    least: Length = 2.0
    limit: Annotated[Number | None, Unit("rad")] = None
    start: Length = 0.0

    def check(self, n: SimpleNamespace) -> None:
        """Refuse paths without direction, and numbers of the wrong sign."""
        super().check(n)
        if not all(word.isidentifier() for word in self.name.split(".")):
            raise ModelError(f"{self.title}: its parts occur in expressions; give it a name of one word")
        positive(self, n, "wheelbase", "preview", "least", "limit")
        if len(self.path) < 4 or {len(p) for p in self.path} != {2} or not np.isfinite(self.path).all():
            raise ModelError(f"{self.title}: path is a list of four or more points (x, y)")
        apart = np.hypot(*np.diff(self.path, axis=0).T)
        if not apart.all():
            k = int(np.argmin(apart))
            raise ModelError(
                f"{self.title}: points {k + 1} and {k + 2} of the path are both at {self.path[k]} m; leave one out"
            )

    def given(self) -> dict[str, Any]:
        """Return the constants."""
        own = ("wheelbase", "understeer", "preview", "least", "limit", "period")
        return {k: getattr(self, k) for k in own if getattr(self, k) is not None}

    def derived(self, name: str, wiring: Any) -> SyntaxNode | None:
        """Return a sensor of the vehicle, or place and direction of the path at ``place`` or ``ahead``."""
        if name in SENSORS:
            return SyntaxNode("name", (), f"{self.name}_{name}")
        at, _, what = name.partition("_")
        if what not in COLUMNS:
            return None
        return SyntaxNode("table", (wiring.template(self, at),), f"{self.name}_path_{what}")

    def signals(self) -> dict[str, str]:
        """Return the angle, the deviation, the place aimed at, and what they follow from."""
        angle = "atan(wheelbase*curvature) + understeer*(vx**2 + vy**2)*curvature"
        toward = "(ahead_x - x)", "(ahead_y - y)"
        pull = f"{FOLLOW}/preview"
        return {
            "output": angle if self.limit is None else f"max(min({angle}, limit), -limit)",
            "error": "place_along_x*(y - place_y) - place_along_y*(x - place_x)",
            "ahead": "place + sqrt(least**2 + preview**2*(vx**2 + vy**2))",
            "curvature": f"2*((nose_x - x)*{toward[1]} - (nose_y - y)*{toward[0]})/({toward[0]}**2 + {toward[1]}**2)",
            "progress": (f"place_along_x*(vx + {pull}*(x - place_x)) + place_along_y*(vy + {pull}*(y - place_y))"),
        }

    def states(self, n: SimpleNamespace) -> tuple[ControlState, ...]:
        """Return the place on the path."""
        return (ControlState("place", "place + period*progress" if self.sampled else "progress", n.start),)

    def parts(self, model: Model) -> tuple[Element, ...]:
        """Return the sensors of the vehicle and the tables of the path."""
        rear = self.rear or (0.0,) * (2 if model.planar else 3)
        first = rear[0] + 1.0 if isinstance(rear[0], float) else f"({rear[0]}) + (1 m)"
        frames = [Frame(f"{self.name}_rear", self.body, position=rear)]
        frames.append(Frame(f"{self.name}_nose", self.body, position=(first, *rear[1:])))
        sensors = [Sensor(f"{self.name}_{k}", f"{self.name}_{of}") for k, of in SENSORS.items()]
        s, columns = path_columns(np.array(self.path))
        tables = [
            Table(f"{self.name}_path_{k}", x=s, y=y, beyond="line" if k in "xy" else "hold")
            for k, y in zip(COLUMNS, columns, strict=True)
        ]
        return (*frames, *sensors, *tables)


def path_columns(points: np.ndarray) -> tuple[tuple[float, ...], list[tuple[float, ...]]]:
    """Return arc lengths of a spline through points (n, 2), equally spaced, and x, y and the direction there."""
    from scipy.interpolate import CubicSpline

    chord = np.r_[0.0, np.cumsum(np.hypot(*np.diff(points, axis=0).T))]
    curve = CubicSpline(chord, points)
    fine = np.linspace(0.0, chord[-1], min(SPACING * len(points), MOST_POINTS) * SPACING)
    middle = 0.5 * (fine[1:] + fine[:-1])
    speed = [np.hypot(*curve(u, 1).T) for u in (fine, middle)]
    length = np.r_[0.0, np.cumsum(np.diff(fine) * (speed[0][1:] + speed[0][:-1] + 4.0 * speed[1]) / 6.0)]
    s = np.linspace(0.0, length[-1], min(SPACING * len(points), MOST_POINTS))
    u = CubicSpline(length, fine)(s)
    tangent = curve(u, 1)
    tangent /= np.hypot(*tangent.T)[:, None]
    return tuple(s.tolist()), [tuple(c.tolist()) for c in (*curve(u).T, *tangent.T)]
