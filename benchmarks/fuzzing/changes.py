"""The same mechanism described in another way: turned, mirrored, renamed, reordered, swapped, with parameters."""

from __future__ import annotations

import random
import re
from collections.abc import Callable
from typing import Any

import numpy as np

import flyball as fb
from flyball.model.element import Unit, fields_with

from .scaling import NAME, Laws, Unsupported, fields, is_angle, python_law, times, written

Numbers = np.ndarray
SKEWED = ("Cam",)  # whose curve lies in the plane by a rule that knows the world's axes
OWN_AXES = ("Planar", "PointInPlane", "Orientation")  # coordinates along axes that nobody gave


def again(m: fb.Mechanism, of: Callable[[Any], Any], gravity: Any = None, **settings: Any) -> fb.Mechanism:
    """A mechanism of changed elements."""
    settings = {"planar": m.planar, "parameters": dict(m.parameters)} | settings
    out = fb.Mechanism(m.name, gravity=m.gravity if gravity is None else gravity, **settings)
    out.add(*(of(e) for e in m.elements()))
    return out


def coordinates_used(m: fb.Mechanism) -> set[str]:
    """Coordinates that anything names; a controller's or an event's text included."""
    found: set[str] = set()
    for e in m.elements():
        for v in fields(e).values():
            for x in v if isinstance(v, tuple) else (v,):
                if isinstance(x, str):
                    found |= {y.group() for y in NAME.finditer(x) if "." in y.group()}
        for k in ("joint", "joint_1", "joint_2", "rack", "pinion"):
            name = getattr(e, k, None)
            if name is not None:
                found |= {f"{name}.{c}" for c in m[name].measured(m.planar)}
    return {c.removesuffix("_rate") for c in found}


def turned(m: fb.Mechanism, R: Numbers, shift: Numbers) -> fb.Mechanism:
    """The whole world turned and moved."""
    used = coordinates_used(m)
    bodies = {b.name for b in m.bodies}
    for c in used:
        name, _, what = c.partition(".")
        if name in bodies:
            raise Unsupported(f"{c} is measured along the world's axes")
        own = ("x", "y", "z") if type(m.find(name)).__name__ in OWN_AXES else ()
        if what in own or isinstance(m.find(name), fb.Spherical):
            raise Unsupported(f"{c} is measured along axes that are not given")
    angle = float(np.arctan2(R[1, 0], R[0, 0]))
    return again(m, lambda e: _turned(e, R, shift, angle, m.planar), gravity=tuple(R @ np.asarray(m.gravity)))


def _points(value: Any, R: Numbers, shift: Numbers) -> Any:
    a = np.asarray(value, float)
    return tuple((R @ a + shift).tolist()) if a.ndim == 1 else tuple(tuple((R @ p + shift).tolist()) for p in a)


def _mixed(R: Numbers, laws: Any) -> Any:
    """Components of a vector of laws along turned axes."""
    if any(callable(x) for x in laws):
        raise Unsupported("a vector of Python functions")
    return tuple(" + ".join(f"({float(R[i, j])!r})*({x})" for j, x in enumerate(laws)) for i in range(len(R)))


def _turned(e: Any, R: Numbers, shift: Numbers, angle: float, planar: bool) -> Any:
    kind, own = type(e).__name__, fields(e)
    if kind in SKEWED or kind == "Bodies":
        raise Unsupported(f"{kind} lies by the world's axes")
    nothing = np.zeros(len(R))
    if e.category in ("joints", "forces"):
        for k in ("at", "centre"):
            if own.get(k) is not None:
                own[k] = _points(own[k], R, shift)
        for k in ("axis", "axes", "normal"):
            v = getattr(e, k, None)
            if v is not None and not isinstance(v, str) and not (planar and np.shape(v)[-1] == 3):
                own[k] = _points(v, R, nothing)
    if kind in ("Body", "Ground", "Bushing"):
        if kind != "Bushing":
            own["position"] = _points(e.position[: len(R)], R, shift)
        if planar:
            own["angle"] = e.angle + angle
        else:
            own["orientation"] = tuple(map(tuple, (R @ matrix(e.orientation)).tolist()))
    if kind == "Body":
        if e.velocity is not None:
            own["velocity"] = _points(e.velocity, R, nothing)
        if e.angular_velocity is not None and not planar:
            own["angular_velocity"] = _points(e.angular_velocity, R, nothing)
    if kind in ("PointForce", "PointTorque") and e.axes == "world":
        k = "force" if kind == "PointForce" else "torque"
        if isinstance(own[k], tuple):
            own[k] = _mixed(R, own[k])
    if kind == "Event":
        own["do"] = tuple(_turned_action(a, R, shift) for a in e.do)
    return type(e)(**own)


def _turned_action(a: Any, R: Numbers, shift: Numbers) -> Any:
    if not isinstance(a, fb.Impulse):
        return a
    own = fields(a)
    if own.get("axes", "world") == "world":
        own["impulse"] = _points(a.impulse, R, 0.0 * shift)
        if "torque" in own and not isinstance(a.torque, int | float):
            own["torque"] = _points(a.torque, R, 0.0 * shift)
    if own.get("at") is not None:
        raise Unsupported("a blow at a point")
    return type(a)(**own)


def matrix(orientation: Any) -> Numbers:
    """Rotation matrix of what bodies take: nothing, a quaternion, Bryant angles, a matrix."""
    if orientation is None:
        return np.eye(3)
    a = np.asarray(orientation, float)
    if a.shape == (3, 3):
        return a
    if a.shape == (4,):
        return _of_quaternion(a / np.linalg.norm(a))
    turns = [_of_quaternion(np.r_[np.cos(x / 2), np.sin(x / 2) * np.eye(3)[k]]) for k, x in enumerate(a)]
    return turns[0] @ turns[1] @ turns[2]


def _of_quaternion(q: Numbers) -> Numbers:
    w, v = q[0], q[1:]
    cross = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    return np.eye(3) + 2 * w * cross + 2 * cross @ cross


def mirrored(m: fb.Mechanism) -> fb.Mechanism:
    """In space: the image in the plane x = 0. Axes of angles turn as angular velocities do, so angles stay."""
    if m.planar:
        return _mirrored_planar(m)
    S = np.diag([-1.0, 1.0, 1.0])
    for c in coordinates_used(m):
        name, _, what = c.partition(".")
        kind = type(m.find(name)).__name__
        if not (is_angle(what) or kind == "Prismatic") or kind not in (*AXIAL, *POLAR):
            raise Unsupported(f"{c} changes its sign in the mirror")
    return again(m, lambda e: _mirrored(e, S), gravity=tuple(S @ np.asarray(m.gravity)))


AXIAL = ("Revolute", "Universal", "GeneralUniversal", "Cylindrical", "Screw", "RollingDisk")
POLAR = ("Prismatic", "PointOnLine", "PointInPlane", "Spherical", "Fixed", "Distance", "Orientation", "RollingBall")
ACTING = ("SpringDamper", "PointForce", "PointTorque", "Motor", "TorsionalSpringDamper", "Rope", "CoordinateSpring")
ACTING += ("Actuator", "JointFriction", "Brake", "Clutch", "Detent")


def _mirrored(e: Any, S: Numbers) -> Any:
    kind, own, zero = type(e).__name__, fields(e), np.zeros(3)
    if e.category == "joints":
        if kind not in (*AXIAL, *POLAR):
            raise Unsupported(f"the mirror image of {kind}")
        for k in ("at", "centre", "normal"):
            v = getattr(e, k, None)
            if v is not None:
                own[k] = _points(v, S, zero)
        for k in ("axis", "axes"):
            if getattr(e, k, None) is not None:
                own[k] = _points(getattr(e, k), -S if kind in AXIAL else S, zero)
        if kind == "Screw":
            own["lead"] = -e.lead
    elif e.category == "forces":
        if kind not in ACTING:
            raise Unsupported(f"the mirror image of {kind}")
        if own.get("at") is not None:
            own["at"] = _points(e.at, S, zero)
        if kind == "PointForce":
            own["force"] = _mixed(S, e.force)
        if kind == "PointTorque":
            own["torque"] = _mixed(-S, e.torque)
    elif kind == "Body":
        if e.shape is not None:
            raise Unsupported("the mirror image of a shape")
        own |= {"position": _points(e.position, S, zero), "orientation": S @ matrix(e.orientation) @ S}
        own["orientation"] = tuple(map(tuple, own["orientation"].tolist()))
        for k, T in (("velocity", S), ("com", S), ("angular_velocity", -S), ("inertia_about", S)):
            if own.get(k) is not None:
                own[k] = _points(own[k], T, zero)
        if np.ndim(own.get("inertia", 0)) == 2 or "inertia_axes" in own:
            raise Unsupported("the mirror image of a tensor")
    elif e.category not in ("sensors", "tables", "drivers", "limits", "controllers", "initial"):
        raise Unsupported(f"the mirror image of {kind}")
    return type(e)(**own)


def _mirrored_planar(m: fb.Mechanism) -> fb.Mechanism:
    """The image in the line y = 0, of bodies, hinges, slides, springs and given forces: angles change their signs."""
    if coordinates_used(m):
        raise Unsupported("coordinates that change their signs in the mirror")
    S = np.diag([1.0, -1.0])

    def of(e: Any) -> Any:
        kind, own = type(e).__name__, fields(e)
        known = (
            "Revolute",
            "Translational",
            "Prismatic",
            "PointOnLine",
            "Distance",
            "Fixed",
            "SpringDamper",
            "PointForce",
        )
        known += ("PointTorque", "Rope")
        if kind == "Body":
            if e.shape is not None:
                raise Unsupported("the mirror image of a shape")
            own["position"], own["angle"] = _points(e.position[:2], S, np.zeros(2)), -e.angle
            for k in ("velocity", "com", "inertia_about"):
                if own.get(k) is not None:
                    own[k] = _points(own[k], S, np.zeros(2))
            if own.get("angular_velocity") is not None:
                own["angular_velocity"] = -e.angular_velocity
        elif kind in known:
            for k in ("at", "axis"):
                if own.get(k) is not None:
                    own[k] = _points(own[k], S, np.zeros(2))
            if kind == "PointForce":
                own["force"] = _mixed(S, e.force)
            if kind == "PointTorque":
                own["torque"] = f"-({e.torque})"
        elif kind != "Table":
            raise Unsupported(f"the mirror image of {kind}")
        return type(e)(**own)

    return again(m, of, gravity=tuple(S @ np.asarray(m.gravity)))


def renamed(m: fb.Mechanism) -> tuple[fb.Mechanism, dict[str, str]]:
    """Other names, which sort in another order."""
    names = [e.name for e in m.elements() if e.name and e.category not in ("initial", "material_pairs")]
    names = list(dict.fromkeys(names))
    new = {n: f"q{len(names) - k:03d}_{'xyz'[k % 3]}" for k, n in enumerate(names)}

    def word(x: str) -> str:
        head, dot, rest = x.partition(".")
        return new.get(x, new[head] + dot + rest if dot and head in new else x)

    def of(value: Any) -> Any:
        if isinstance(value, tuple):
            return tuple(of(v) for v in value)
        if isinstance(value, str):
            if word(value) != value:
                return word(value)
            return NAME.sub(
                lambda x: word(x.group()), re.sub(r"([A-Za-z_]\w*)(?=\()", lambda x: new.get(x[1], x[1]), value)
            )
        if callable(value) and hasattr(value, "written"):
            arguments, text = written(value)
            return python_law(tuple(map(word, arguments)), NAME.sub(lambda x: word(x.group()), text))
        if isinstance(value, fb.Impulse | fb.Lock | fb.Release):
            return type(value)(**{k: of(v) if k in ("on", "what") else v for k, v in fields(value).items()})
        return value

    keep = (
        "coordinate",
        "axes",
        "interpolation",
        "beyond",
        "anti_windup",
        "direction",
        "law",
        "color",
        "x_unit",
        "y_unit",
    )

    def element(e: Any) -> Any:
        own = fields(e)
        for k, v in own.items():
            plain = k in keep and isinstance(v, str) and word(v) == v
            own[k] = v if plain and (k != "law" or e.category == "contacts") else of(v)
        return type(e)(**own)

    return again(m, element), new


def reordered(m: fb.Mechanism, seed: int) -> fb.Mechanism:
    """Bodies, joints, forces and the rest each in another order."""
    shuffle = random.Random(seed).shuffle
    out = fb.Mechanism(m.name, planar=m.planar, gravity=m.gravity, parameters=dict(m.parameters))
    groups: dict[str, list[Any]] = {}
    for e in m.elements():
        groups.setdefault(e.category, []).append(e)
    for category, group in groups.items():
        if category not in ("sensors", "controllers", "contacts", "events"):
            shuffle(group)
    out.add(*(e for group in groups.values() for e in group))
    return out


def swapped(m: fb.Mechanism) -> fb.Mechanism:
    """Every joint and spring between the same bodies the other way round, its coordinate kept by turning its axis."""
    used = {c.partition(".")[0] for c in coordinates_used(m)}
    used |= {e.name.partition(".")[0] for e in m.initial} | {f.joint for f in m.forces if hasattr(f, "joint")}
    loaded = {f.joint for f in m.forces if isinstance(f, fb.JointFriction)}  # bending is about a point of body_j
    count = 0

    def of(e: Any) -> Any:
        nonlocal count
        if e.name in loaded:
            return e
        kind = type(e).__name__
        free = e.name not in used
        both = kind in ("Spherical", "Fixed", "Distance", "SpringDamper", "Orientation")
        turns = kind in ("Revolute", "Prismatic", "Translational", "Cylindrical", "Screw")
        if kind == "Universal" and free:
            own = fields(e) | {"axes": e.axes[::-1]}
        elif both and (free or kind in ("Distance", "SpringDamper")):
            own = fields(e)
            if e.at is not None and np.ndim(e.at) == 2:
                own["at"] = e.at[::-1]
        elif turns and (free or not (m.planar and kind == "Revolute")):
            own = fields(e)
            if e.axis is not None:
                own["axis"] = times(e.axis, -1.0)
            if m.planar and kind == "Revolute" and e.angle:
                return e
        else:
            return e
        count += 1
        return type(e)(**own | {"body_i": e.body_j, "body_j": e.body_i})

    out = again(m, of)
    if not count:
        raise Unsupported("no joint that can be swapped")
    return out


FIXED = ("teeth", "direction", "orientation", "inertia_axes", "axis", "axes", "normal")


def with_parameters(m: fb.Mechanism) -> fb.Mechanism:
    """Every number of a field with a unit, and every decimal number of a law, is a parameter."""
    values: dict[str, float] = dict(m.parameters)

    def name(x: float) -> str:
        values[f"par_{len(values)}"] = x
        return f"par_{len(values) - 1}"

    def number(value: Any) -> Any:
        if isinstance(value, tuple | list):
            return tuple(number(v) for v in value)
        if isinstance(value, float) and value:
            return name(value)
        return value

    def element(e: Any) -> Any:
        own = fields(e)
        for k in fields_with(type(e), Unit):
            if k in own and k not in FIXED and e.category not in ("contacts", "materials", "material_pairs", "ground"):
                own[k] = number(own[k])
        for k in ("law", "force", "torque", "capacity"):
            v = own.get(k)
            if isinstance(v, str) and e.category in ("forces", "drivers"):
                own[k] = re.sub(r"(?<![\w.])\d+\.\d+(?![\w.])", lambda x: name(float(x[0])), v)
        return type(e)(**own)

    elements = [element(e) for e in m.elements()]
    out = fb.Mechanism(m.name, planar=m.planar, gravity=m.gravity, parameters=values)
    out.add(*elements)
    return out


__all__ = ["Laws", "mirrored", "renamed", "reordered", "swapped", "turned", "with_parameters"]
