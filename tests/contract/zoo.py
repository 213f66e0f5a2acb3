"""For every joint a small mechanism in general position: two free bodies that it joins, falling and tumbling."""

from __future__ import annotations

import numpy as np

import flyball as fb
from flyball import joints as room
from flyball.model.geometry import triad
from flyball.model.joint import Joint
from tests.layers import cached

GRAVITY = (0.7, -1.5, -9.3)
P = (0.4, 0.1, 0.5)
Q = (0.7, -0.2, 0.3)
AXIS = (1.0, 2.0, -2.0)
ACROSS = (2.0, 1.0, 2.0)  # square to AXIS
SKEW = (0.3, 1.0, 0.4)
NORMAL = triad(np.array(AXIS) / 3.0)  # axes with AXIS as z
ELLIPSE = [(0.3 * np.cos(u), 0.2 * np.sin(u)) for u in np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)]
OVAL = [(0.3 * np.cos(u), 0.2 * np.sin(u)) for u in np.linspace(0.0, 2.0 * np.pi, 96, endpoint=False)]
LOOP = [(x, y, 0.1 * np.sin(4.0 * np.pi * k / 96)) for k, (x, y) in enumerate(OVAL)]
C, S = np.cos(0.14181), np.sin(0.14181)  # in the middle between two knots of a curve

JOINTS = [c for c in Joint.registry.values() if issubclass(c, Joint) and c.__module__.startswith(f"{room.__name__}.")]

SPATIAL = {
    "Cam": {"points": ELLIPSE, "centre": P, "axis": AXIS, "at": tuple(P + NORMAL @ (0.33, 0.0, 0.05)), "radius": 0.03},
    "Cylindrical": {"at": P, "axis": AXIS, "angle": 0.3, "displacement": -0.2},
    "Distance": {"at": (P, Q)},
    "Fixed": {"at": P},
    "FlatFacedCam": {
        "points": OVAL,
        "centre": P,
        "axis": AXIS,
        "at": tuple(P + NORMAL @ (0.3, 0.02, 0.05)),
        "normal": tuple(NORMAL @ (np.cos(0.0785), np.sin(0.0785), 0.0)),
    },
    "GeneralUniversal": {"at": (P, Q), "axes": (AXIS, SKEW)},
    "KnifeEdge": {"at": P, "axis": AXIS, "normal": SKEW},
    "LinearActuator": {"at": (P, Q)},
    "Orientation": {"at": P},
    "Planar": {"at": P, "axis": AXIS, "angle": -0.4},
    "PointInPlane": {"at": P, "axis": AXIS},
    "PointOnCurve": {"points": LOOP, "centre": P, "at": (P[0] + 0.3 * C, P[1] + 0.2 * S, P[2] + 0.05), "closed": True},
    "PointOnLine": {"at": P, "axis": AXIS, "displacement": 0.1},
    "Prismatic": {"at": P, "axis": AXIS, "displacement": 0.2},
    "RopeSpan": {"at": (P, Q), "radii": (0.02, -0.03), "axis": AXIS},
    "Revolute": {"at": P, "axis": AXIS, "angle": 2.0},
    "RollingBall": {"at": Q, "radius": 0.15, "normal": AXIS},
    "RollingDisk": {"at": Q, "radius": 0.15, "tread": 0.04, "axis": SKEW, "normal": AXIS},
    "Screw": {"at": P, "axis": AXIS, "lead": 0.07, "angle": 0.5},
    "Spherical": {"at": P},
    "Universal": {"at": P, "axes": (AXIS, ACROSS), "angle_1": 0.2},
}

PLANAR = {
    "Cam": {"points": ELLIPSE, "centre": P[:2], "at": (P[0] + 0.33, P[1]), "radius": 0.03},
    "Distance": {"at": (P[:2], Q[:2])},
    "Fixed": {"at": P[:2]},
    "FlatFacedCam": {
        "points": OVAL,
        "centre": P[:2],
        "at": (P[0] + 0.3, P[1] + 0.05),
        "normal": (np.cos(0.0785), np.sin(0.0785)),
    },
    "KnifeEdge": {"at": P[:2], "axis": (1.0, 2.0)},
    "LinearActuator": {"at": (P[:2], Q[:2])},
    "Orientation": {"at": P[:2]},
    "PinInSlot": {"at": P[:2], "axis": (1.0, 2.0), "angle": 0.3},
    "PointOnCurve": {"points": OVAL, "centre": P[:2], "at": (P[0] + 0.3 * C, P[1] + 0.2 * S), "closed": True},
    "PointOnLine": {"at": P[:2], "axis": (1.0, 2.0)},
    "Prismatic": {"at": P[:2], "axis": (1.0, 2.0), "displacement": 0.2},
    "RopeSpan": {"at": (P[:2], Q[:2]), "radii": (0.02, -0.03)},
    "Revolute": {"at": P[:2], "angle": 2.0},
    "Translational": {"at": P[:2], "axis": (1.0, 2.0)},
    "WheelOnLine": {"at": P[:2], "axis": (1.0, 2.0), "centre": (P[0] - 0.2, P[1] + 0.1), "angle": 0.2},
}

SPLINED = ("Cam", "FlatFacedCam", "PointOnCurve")  # third derivatives of their curves jump
AS_DRAWN = {
    "LinearActuator": lambda e, what: np.linalg.norm(np.subtract(*e.at)),
    "RopeSpan": lambda e, what: _span_as_drawn(e)[what],
}
"""Value of the coordinate as drawn, of joints whose coordinates are not 0 there."""


def _span_as_drawn(e) -> dict[str, float]:
    """Length of the tangent of two circles, less the difference of their radii times its direction; position."""
    d, b = np.subtract(*e.at[::-1]), e.radii[1] - e.radii[0]
    x, y, z = d @ NORMAL if len(d) == 3 else (*d, 0.0)
    along, across = np.sqrt(x * x + y * y - b * b), np.arctan2(y, x)
    length = np.hypot(along, z) - b * (across - np.arcsin(b / np.hypot(x, y)))
    return {"length": length, "angle": 0.0, "x": x, "y": y}


CASES = [("space", name) for name in sorted(SPATIAL)] + [("plane", name) for name in sorted(PLANAR)]

MASS = {"a": 1.7, "b": 1.1}

REMOVED = {
    "space": {
        "Cam": 1,
        "Cylindrical": 4,
        "Distance": 1,
        "Fixed": 6,
        "FlatFacedCam": 1,
        "GeneralUniversal": 4,
        "KnifeEdge": 1,
        "LinearActuator": 0,
        "Orientation": 3,
        "Planar": 3,
        "PointInPlane": 1,
        "PointOnCurve": 2,
        "PointOnLine": 2,
        "Prismatic": 5,
        "RopeSpan": 0,
        "Revolute": 5,
        "RollingBall": 3,
        "RollingDisk": 3,
        "Screw": 5,
        "Spherical": 3,
        "Universal": 4,
    },
    "plane": {
        "Cam": 1,
        "Distance": 1,
        "Fixed": 3,
        "FlatFacedCam": 1,
        "KnifeEdge": 1,
        "LinearActuator": 0,
        "Orientation": 1,
        "PinInSlot": 1,
        "PointOnCurve": 1,
        "PointOnLine": 1,
        "Prismatic": 2,
        "RopeSpan": 0,
        "Revolute": 2,
        "Translational": 2,
        "WheelOnLine": 2,
    },
}
"""Freedoms that each joint takes, from textbooks."""


def declared(where: str, name: str) -> dict:
    """What a joint takes besides its bodies."""
    return (SPATIAL if where == "space" else PLANAR)[name]


def two_bodies(where: str, gravity=GRAVITY, names=("a", "b")) -> fb.Mechanism:
    """The bodies, each with its centre of mass beside its origin; ``names`` is the order in which they are added."""
    planar = where == "plane"
    m = fb.Mechanism("zoo", planar=planar, gravity=gravity[:2] if planar else gravity)
    if planar:
        made = {
            "a": fb.Body(
                "a",
                mass=1.7,
                inertia=0.09,
                position=(0.1, -0.2),
                com=(0.03, -0.02),
                angle=0.4,
                velocity=(0, 0),
                angular_velocity=0.9,
            ),
            "b": fb.Body(
                "b",
                mass=1.1,
                inertia=0.05,
                position=(0.6, 0.3),
                com=(-0.04, 0.05),
                angle=-0.7,
                velocity=(0, 0),
                angular_velocity=-50.0,
            ),
        }
    else:
        made = {
            "a": fb.Body(
                "a",
                mass=1.7,
                inertia=(0.05, 0.08, 0.11),
                position=(0.1, -0.2, 0.3),
                com=(0.03, -0.02, 0.05),
                orientation=(0.3, -0.5, 0.8),
                velocity=(0.2, -0.1, 0.4),
                angular_velocity=(0.6, -1.1, 0.9),
            ),
            "b": fb.Body(
                "b",
                mass=1.1,
                inertia=(0.03, 0.04, 0.02),
                position=(0.6, 0.3, 0.4),
                com=(-0.04, 0.05, 0.02),
                orientation=(-0.6, 0.2, 0.1),
                velocity=(-0.3, 0.2, 0.1),
                angular_velocity=(8.0, 17.0, -14.0),
            ),
        }
    m.add(*(made[n] for n in names))
    return m


def joined(where: str, name: str, **more) -> fb.Mechanism:
    """Two bodies and the joint ``J`` between them."""
    m = two_bodies(where, **more)
    m.add(getattr(room, name)("J", "a", "b", **declared(where, name)))
    return m


TIMES = np.linspace(0.0, 0.4, 401)
STEP = 5e-4
MOMENTS = np.array([0.05, 0.21, 0.33])
STENCIL = np.unique(np.r_[0.0, (MOMENTS[:, None] + STEP * np.arange(-3, 4)).ravel(), 0.4])


@cached
def motion(where: str, name: str) -> fb.Result:
    """Its motion at even times. Joint coordinates keep momenta as well as they are integrated: hence the tolerance."""
    return joined(where, name).simulate(0.4, outputs=TIMES, rtol=1e-12, atol=1e-14)


@cached
def closely(where: str, name: str) -> fb.Result:
    """Its motion at a few moments, with neighbouring times for numerical differences."""
    return joined(where, name).simulate(0.4, outputs=STENCIL, rtol=1e-11, atol=1e-13)


def difference(x: np.ndarray) -> np.ndarray:
    """Rate of x (over STENCIL) at the three moments, by central differences of order six."""
    w = np.array([-1.0, 9.0, -45.0, 0.0, 45.0, -9.0, 1.0]) / (60.0 * STEP)
    return np.array([w @ x[1 + 7 * k : 8 + 7 * k] for k in range(3)])


def at_moments(x: np.ndarray) -> np.ndarray:
    """X (over STENCIL) at the three moments."""
    return x[4::7][:3]


def centre(result: fb.Result, body: str) -> tuple[np.ndarray, ...]:
    """Position and velocity of a body's centre of mass, its angular velocity (three components) and rotation."""
    p, R, w, v, _, _ = result.records.body(result.values.structure.place[body])
    return *(np.stack(x, axis=1) for x in (p, v, w)), np.stack(R, axis=1).reshape(-1, 3, 3)


def wrench(result: fb.Result, body: str) -> tuple[np.ndarray, np.ndarray]:
    """Reaction of the joint on a body: force, and torque about the body's centre of mass."""
    if not result["J"].element.blocks:
        return np.zeros((len(result.t), 3)), np.zeros((len(result.t), 3))
    force, torque = result["J"].reaction(on=body)
    s = result.values.structure
    point = np.stack(result.records.frame(s.frame_at["J", "M", ""])[0], axis=1)
    return force, torque + np.cross(point - centre(result, body)[0], force)
