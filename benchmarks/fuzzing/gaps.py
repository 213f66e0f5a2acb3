"""Gaps of joints, couplings and drivers from the poses of both bodies, by geometry alone."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

import flyball as fb

from .poses import Array, Motion, Uncounted, Z, turn
from .scaling import NAME

Gap = tuple[str, Array]


def dots(a: Array, b: Array) -> Array:
    return np.einsum("ni,ni->n", a, b)


def norms(a: Array) -> Array:
    return np.sqrt(dots(a, a))


def _apart(x: Motion, e: Any) -> Array:
    """From the joint's point on i to that on j."""
    p, q = (e.at, e.at) if np.ndim(e.at) == 1 else e.at
    return x.point(e.body_j, q) - x.point(e.body_i, p)


def _axis(x: Motion, e: Any) -> Any:
    return Z if x.m.planar else e.axis


def _common(x: Motion, e: Any) -> Iterator[Gap]:
    yield "points apart", norms(_apart(x, e))


def _parallel(x: Motion, e: Any) -> Iterator[Gap]:
    a = _axis(x, e)
    yield "axes aslant", norms(np.cross(x.direction(e.body_i, a), x.direction(e.body_j, a)))


def _same_turn(x: Motion, e: Any) -> Iterator[Gap]:
    relative = np.stack([x.direction(e.body_i, d) - x.direction(e.body_j, d) for d in np.eye(3)])
    yield "turned", np.abs(relative).max(axis=(0, 2))


def _line(x: Motion, e: Any) -> Iterator[Gap]:
    a = x.direction(e.body_i, e.axis)
    d = _apart(x, e)
    yield "off the line", norms(d - dots(d, a)[:, None] * a)


def _plane(x: Motion, e: Any) -> Iterator[Gap]:
    yield "off the plane", np.abs(dots(_apart(x, e), x.direction(e.body_i, e.axis)))


def _distance(x: Motion, e: Any) -> Iterator[Gap]:
    length = e.length if e.length is not None else math.dist(*e.at)
    yield "length", np.abs(norms(_apart(x, e)) - length)


def _crossed(x: Motion, e: Any) -> Iterator[Gap]:
    yield "axes not square", np.abs(dots(x.direction(e.body_i, e.axes[0]), x.direction(e.body_j, e.axes[1])))


def _thread(x: Motion, e: Any) -> Iterator[Gap]:
    s = dots(_apart(x, e), x.direction(e.body_i, e.axis))
    yield "off the thread", np.abs(s - e.lead * turn(x, e.body_i, e.body_j, e.axis) / (2 * np.pi))


def _rolled(x: Motion, e: Any) -> Iterator[Gap]:
    """The wheel's centre keeps its distance from the line, and no point of it slips where it touches."""
    a, at = x.direction(e.body_i, e.axis), x.point(e.body_i, e.at)
    centre = x.point(e.body_j, e.centre)
    r = np.asarray(e.at, float) - np.asarray(e.centre, float)
    down = x.direction(e.body_i, r)
    d = centre - at
    yield "off the line", np.abs(dots(d, down) + np.linalg.norm(r))
    touch = centre + np.linalg.norm(r) * down
    yield "slip", np.abs(dots(_slip(x, e.body_i, e.body_j, touch), a))


def _slip(x: Motion, i: str, j: str, place: Array) -> Array:
    """Velocity of j's material relative to i's at a place."""
    v = [x.of(b, "velocity") + np.cross(x.of(b, "angular_velocity"), place - x.of(b, "position")) for b in (i, j)]
    return v[1] - v[0]


def _ball(x: Motion, e: Any) -> Iterator[Gap]:
    n = x.direction(e.body_i, e.normal)
    centre = x.point(e.body_j, e.at)
    yield "off the plane", np.abs(dots(centre - x.point(e.body_i, e.at), n))
    slip = _slip(x, e.body_i, e.body_j, centre - e.radius * n)
    yield "slip", norms(slip)


def _disk(x: Motion, e: Any) -> Iterator[Gap]:
    n, axle = x.direction(e.body_i, e.normal), x.direction(e.body_j, e.axis)
    down = -(n - dots(n, axle)[:, None] * axle)
    down /= norms(down)[:, None]
    touch = x.point(e.body_j, e.at) + e.radius * down - e.tread * n
    yield "slip", norms(_slip(x, e.body_i, e.body_j, touch))
    height = dots(touch - x.of(e.body_i, "position"), n)
    drawn = np.asarray(e.normal, float) / np.linalg.norm(e.normal)
    a = np.asarray(e.axis, float) / np.linalg.norm(e.axis)
    d = -(drawn - (drawn @ a) * a)
    start = np.asarray(e.at, float) + e.radius * d / np.linalg.norm(d) - e.tread * drawn
    p, R = x.drawn[e.body_i]
    del R
    yield "off the plane", np.abs(height - (start - p) @ drawn)


def _edge(x: Motion, e: Any) -> Iterator[Gap]:
    edge = x.direction(e.body_j, e.axis)
    up = x.direction(e.body_j, Z if x.m.planar else e.normal)
    across = np.cross(up, edge)
    across /= norms(across)[:, None]
    yield "slip", np.abs(dots(_slip(x, e.body_i, e.body_j, x.point(e.body_j, e.at)), across))


JOINTS: dict[str, tuple[Callable, ...]] = {
    "Revolute": (_common, _parallel), "Spherical": (_common,), "Fixed": (_common, _same_turn),
    "Cylindrical": (_line, _parallel),
    "Universal": (_common, _crossed), "Prismatic": (_line, _same_turn), "Translational": (_line, _same_turn),
    "Orientation": (_same_turn,), "Planar": (_plane, _parallel), "PointInPlane": (_plane,), "PointOnLine": (_line,),
    "PinInSlot": (_line,), "Screw": (_line, _parallel, _thread), "Distance": (_distance,), "WheelOnLine": (_rolled,),
    "RollingBall": (_ball,), "RollingDisk": (_disk,), "KnifeEdge": (_edge,),
}  # fmt: skip
RATES = ("slip",)


def coordinate(x: Motion, name: str) -> Array | None:
    """A coordinate from poses, counted from the drawn configuration and its offset; None if it is not simple."""
    part, _, what = name.partition(".")
    e = x.m.find(part)
    if isinstance(e, fb.Body):
        if what in ("x", "y", "z"):
            return x.of(part, "position")[:, "xyz".index(what)]
        return None
    kind = type(e).__name__
    if what == "angle" and kind in ("Revolute", "Cylindrical", "Screw") and e.at is not None:
        try:
            return _as_driven(x, name, turn(x, e.body_i, e.body_j, _axis(x, e)) + e.angle)
        except (Uncounted, KeyError):
            return None
    if (
        what == "displacement"
        and kind in ("Prismatic", "Translational", "Cylindrical", "Screw", "PointOnLine")
        and e.at
    ):
        return dots(_apart(x, e), x.direction(e.body_i, e.axis)) + e.displacement
    return None


def _as_driven(x: Motion, name: str, angle: Array) -> Array:
    """An angle with the whole turns that its driver's law counts at the start, whatever it is drawn with."""
    for driver in (d for d in x.m.drivers if d.coordinate == name):
        angle = angle + 2.0 * np.pi * np.rint((evaluated(driver.law, t=x.t)[0] - angle[0]) / (2.0 * np.pi))
    return angle


def evaluated(law: Any, **names: Array) -> Array:
    """A law of numbers and functions of mathematics, by NumPy."""
    if callable(law):
        law = law.written[1]
    if not isinstance(law, str):
        return np.full_like(names["t"], float(law))
    known = {k: getattr(np, k) for k in ("sin", "cos", "tan", "exp", "sqrt", "tanh", "log", "pi", "where")}
    known |= {"step5": _step5, "step": _step3, "abs": np.abs}
    if unknown := {x.group() for x in NAME.finditer(law)} - set(known) - set(names):
        raise KeyError(f"{law}: {unknown}")
    if unknown := set(re.findall(r"([A-Za-z_]\w*)\(", law)) - set(known):
        raise KeyError(f"{law}: {unknown}")
    with np.errstate(all="ignore"):
        return np.asarray(eval(law, {"__builtins__": {}}, known | names)) + 0.0 * names["t"]


def _step5(x: Array, x0: float, y0: float, x1: float, y1: float) -> Array:
    s = np.clip((x - x0) / (x1 - x0), 0, 1)
    return y0 + (y1 - y0) * s**3 * (10 - 15 * s + 6 * s**2)


def _step3(x: Array, x0: float, y0: float, x1: float, y1: float) -> Array:
    s = np.clip((x - x0) / (x1 - x0), 0, 1)
    return y0 + (y1 - y0) * s**2 * (3 - 2 * s)


def gaps(x: Motion) -> Iterator[tuple[str, str, Array]]:
    """(element, what, gap over time) of everything that is known here."""
    for e in x.m.joints:
        if e.at is None or type(e).__name__ not in JOINTS or not {e.body_i, e.body_j} <= set(x.drawn):
            continue
        for measure in JOINTS[type(e).__name__]:
            try:
                yield from ((e.title, what, gap) for what, gap in measure(x, e))
            except Uncounted:
                continue
    for e in x.m.couplings:
        yield from _coupled(x, e)
    for e in x.m.drivers:
        c = coordinate(x, e.coordinate)
        try:
            if c is not None:
                yield e.title, "off its law", _modulo(c - evaluated(e.law, t=x.t), e.coordinate)
        except KeyError:
            continue


def _modulo(d: Array, name: str) -> Array:
    """Of angles without whole turns: fast ones are not counted by the outputs."""
    return np.abs(np.mod(d + np.pi, 2 * np.pi) - np.pi) if name.endswith("angle") else np.abs(d)


def _coupled(x: Motion, e: Any) -> Iterator[tuple[str, str, Array]]:
    if isinstance(e, fb.GearPair):
        one, two = x.m[e.joint_1], x.m[e.joint_2]
        carrier = ({one.body_i, one.body_j} & {two.body_i, two.body_j}).pop()
        way = np.prod([1.0 if j.body_i == carrier else -1.0 for j in (one, two)])
        if not x.m.planar and np.dot(one.axis, two.axis) < 0.0:
            way = -way
        z1, z2 = e.teeth
        parts = [(z1, f"{e.joint_1}.angle"), (way * (-z2 if e.internal else z2), f"{e.joint_2}.angle")]
    elif isinstance(e, fb.RackAndPinion):
        if x.m[e.rack].body_i != x.m[e.pinion].body_i:
            return
        parts = [(1.0, f"{e.rack}.displacement"), (-e.radius, f"{e.pinion}.angle")]
    elif e.value is None:
        parts = list(zip(e.weights, e.coordinates, strict=True))
    else:
        return
    every = [(w, coordinate(x, c)) for w, c in parts]
    if any(c is None for _, c in every):
        return
    total = sum(w * c for w, c in every)
    size = sum(abs(w) for w, _ in every)
    yield e.title, "coupling", np.abs(total - total[0]) / size
