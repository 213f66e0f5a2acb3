"""A maker for every joint and coupling of the registry: drawn closed at a point, everything else by the dice."""

from __future__ import annotations

import math

import flyball as fb

from .dice import Dice, plus


def _at(kind: str):
    """A joint that needs a point only."""
    return lambda d, name, i, j, p: getattr(fb, kind)(name, i, j, at=p)


def _axis(kind: str):
    """A joint that needs a point and, where it has a meaning, an axis."""
    return lambda d, name, i, j, p: getattr(fb, kind)(name, i, j, at=p, axis=d.direction())


def _revolute(d: Dice, name: str, i: str, j: str, p):
    return fb.Revolute(name, i, j, at=p, axis=None if d.planar else d.direction(), angle=d.pick([0.0, 0.0, 1.0, 30.0]))


def _distance(d: Dice, name: str, i: str, j: str, p):
    return fb.Distance(name, i, j, at=(p, plus(p, d.size(1e-3, 1.0), d.direction())))


def _linear_actuator(d: Dice, name: str, i: str, j: str, p):
    return fb.LinearActuator(name, i, j, at=(p, plus(p, d.size(1e-3, 1.0), d.direction())))


def _rope_span(d: Dice, name: str, i: str, j: str, p):
    a = d.direction()
    axis = {} if d.planar else {"axis": a}
    side = d.direction() if d.planar else d.square_to(a)
    r = d.size(1e-3, 1.0)
    return fb.RopeSpan(name, i, j, at=(p, plus(p, 3.0 * r, side)), radii=(r, -0.5 * r), **axis)


def _universal(d: Dice, name: str, i: str, j: str, p):
    a = d.direction()
    return fb.Universal(name, i, j, at=p, axes=(a, d.square_to(a)))


def _general_universal(d: Dice, name: str, i: str, j: str, p):
    a = d.direction()
    b = plus(d.square_to(a), d.number(-1, 1), a)
    return fb.GeneralUniversal(name, i, j, at=(p, d.near(p, d.pick([0.0, 0.2]))), axes=(a, b))


def _screw(d: Dice, name: str, i: str, j: str, p):
    return fb.Screw(name, i, j, at=p, axis=d.direction(), lead=d.pick([-1, 1]) * d.size(1e-3, 1.0))


def _wheel(d: Dice, name: str, i: str, j: str, p):
    a = d.direction()
    centre = plus(p, d.pick([-1, 1]) * d.size(0.01, 0.5), d.square_to(a))
    return fb.WheelOnLine(name, i, j, at=p, axis=a, centre=centre)


def _knife_edge(d: Dice, name: str, i: str, j: str, p):
    a = d.direction()
    return fb.KnifeEdge(name, i, j, at=p, axis=a, **({} if d.planar else {"normal": d.square_to(a)}))


def _rolling_disk(d: Dice, name: str, i: str, j: str, p):
    a = d.direction()
    up = plus(d.square_to(a), d.number(-1.0, 1.0), a)
    tread = d.pick([0.0, 0.02])
    return fb.RollingDisk(name, i, j, at=p, axis=a, radius=d.size(0.02, 0.5), tread=tread, normal=up)


def _rolling_ball(d: Dice, name: str, i: str, j: str, p):
    return fb.RollingBall(name, i, j, at=p, radius=d.size(0.02, 0.5), normal=d.direction())


def _cam(d: Dice, name: str, i: str, j: str, p):
    n, r = d.whole(5, 16), d.size(0.1, 0.5)
    wave, count = d.number(0.0, 0.2), d.whole(1, 3)
    angles = [2 * math.pi * k / n for k in range(n)]
    lengths = [r * (1 + wave * math.sin(count * a)) for a in angles]
    points = [(s * math.cos(a), s * math.sin(a)) for s, a in zip(lengths, angles, strict=True)]
    off = plus((0.0,) * (2 if d.planar else 3), -1.2 * r, d.direction())
    axis = {} if d.planar else {"axis": d.direction()}
    return fb.Cam(name, i, j, points=points, centre=plus(p, 1.0, off), at=p, radius=d.pick([0.0, 0.02]), **axis)


def _flat_faced_cam(d: Dice, name: str, i: str, j: str, p):
    """An ellipse, touched at the end of an axis."""
    a, b = d.size(0.1, 0.5), d.size(0.1, 0.5)
    points = [(a * math.cos(u), b * math.sin(u)) for u in (2 * math.pi * k / 40 for k in range(40))]
    if d.planar:
        return fb.FlatFacedCam(name, i, j, points=points, centre=plus(p, -a, (1.0, 0.0)), at=p, normal=(1, 0))
    centre = plus(p, -a, (1.0, 0.0, 0.0))
    return fb.FlatFacedCam(name, i, j, points=points, centre=centre, at=p, normal=(1, 0, 0), axis=(0, 0, 1))


def _point_on_curve(d: Dice, name: str, i: str, j: str, p):
    """A closed curve, or an open one that begins before the point."""
    r, wave, closed = d.size(0.1, 0.5), d.number(0.0, 0.2), d.chance(0.5)
    angles = [2 * math.pi * k / 24 for k in range(24)] if closed else [0.3 * k - 1.5 for k in range(16)]
    points = [(r * math.cos(u), r * math.sin(u), r * wave * math.sin(2 * u))[: len(p)] for u in angles]
    centre = plus(p, -r, (1.0, 0.0, 0.0)[: len(p)])
    return fb.PointOnCurve(name, i, j, points=points, centre=centre, at=p, closed=closed)


PLANAR = {
    "Revolute": _revolute,
    "Translational": _axis("Translational"),
    "Prismatic": _axis("Prismatic"),
    "PointOnLine": _axis("PointOnLine"),
    "PinInSlot": _axis("PinInSlot"),
    "Distance": _distance,
    "LinearActuator": _linear_actuator,
    "RopeSpan": _rope_span,
    "Orientation": _at("Orientation"),
    "Fixed": _at("Fixed"),
    "WheelOnLine": _wheel,
    "KnifeEdge": _knife_edge,
    "Cam": _cam,
    "FlatFacedCam": _flat_faced_cam,
    "PointOnCurve": _point_on_curve,
}
SPATIAL = {
    "Revolute": _revolute,
    "Spherical": _at("Spherical"),
    "Universal": _universal,
    "GeneralUniversal": _general_universal,
    "Cylindrical": _axis("Cylindrical"),
    "Prismatic": _axis("Prismatic"),
    "Fixed": _at("Fixed"),
    "Orientation": _at("Orientation"),
    "Planar": _axis("Planar"),
    "PointInPlane": _axis("PointInPlane"),
    "PointOnLine": _axis("PointOnLine"),
    "Screw": _screw,
    "Distance": _distance,
    "LinearActuator": _linear_actuator,
    "RopeSpan": _rope_span,
    "RollingDisk": _rolling_disk,
    "RollingBall": _rolling_ball,
    "KnifeEdge": _knife_edge,
    "Cam": _cam,
    "FlatFacedCam": _flat_faced_cam,
    "PointOnCurve": _point_on_curve,
}
COUPLINGS = ("GearPair", "RackAndPinion", "Coupler", "Constraint")
NEW_KINDS = ("FlatFacedCam", "PointOnCurve", "LinearActuator", "RopeSpan", "Constraint")
"""Kinds of the family of curves alone, so that the seeds of other families keep their meaning."""


def joint(d: Dice, name: str, i: str, j: str, p, kinds=None):
    """A joint of a random kind (or of one of ``kinds``) between two bodies, closed at p as drawn."""
    makers = PLANAR if d.planar else SPATIAL
    return makers[d.pick(kinds or [k for k in makers if k not in NEW_KINDS])](d, name, i, j, p)


def coordinates(m: fb.Mechanism, ending: str = "") -> list[str]:
    """Names of all joint coordinates without singular positions, or of those with this ending."""
    found = [f"{j.name}.{c}" for j in m.joints for c in j.independent(m.planar)]
    return [c for c in found if c.endswith(ending)]


def rotations(m: fb.Mechanism) -> list[str]:
    """Names of the coordinates that have singular positions: of ball joints, of bodies in space."""
    owners = [*m.joints, *m.bodies]
    return [f"{e.name}.{k}" for e in owners for k, c in e.measured(m.planar).items() if c.singular]


def coupling(d: Dice, m: fb.Mechanism, name: str, kinds=None):
    """A coupling between joints that are there, or None if there are too few."""
    angles, slides, both = coordinates(m, ".angle"), coordinates(m, ".displacement"), coordinates(m)
    kind = d.pick(kinds or [k for k in COUPLINGS if k not in NEW_KINDS])
    if kind == "GearPair" and len(angles) > 1:
        one, two = (c.removesuffix(".angle") for c in d.random.sample(angles, 2))
        return fb.GearPair(name, one, two, teeth=(d.whole(10, 60), d.whole(10, 60)), internal=d.chance(0.3))
    if kind == "RackAndPinion" and angles and slides:
        rack, pinion = d.pick(slides).removesuffix(".displacement"), d.pick(angles).removesuffix(".angle")
        return fb.RackAndPinion(name, rack, pinion, radius=d.pick([-1, 1]) * d.size(0.01, 0.5))
    if kind == "Constraint" and len(both) > 1:
        one, two = d.random.sample(both, 2)
        return fb.Constraint(name, f"{one} - {d.number(-1, 1)}*{two}**2 - {d.number(0.2, 2)}*{two}")
    if kind == "Coupler" and len(both) > 1:
        chosen = d.random.sample(both, min(len(both), d.whole(2, 3)))
        return fb.Coupler(name, chosen, weights=[d.pick([-1, 1]) * d.size(0.1, 10.0) for _ in chosen])
    return None
