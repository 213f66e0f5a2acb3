"""Numbers of elements in other units: exponents of length, mass and time, and laws whose inputs are converted."""

from __future__ import annotations

import dataclasses
import re
from dataclasses import dataclass
from typing import Any

import flyball as fb
from flyball.model.element import LawOf, Unit, fields_with
from flyball.model.expressions import number

BASE = {
    "m": (1, 0, 0), "kg": (0, 1, 0), "s": (0, 0, 1), "N": (1, 1, -2), "J": (2, 1, -2), "Pa": (-1, 1, -2),
    "rad": (0, 0, 0), "1": (0, 0, 0), "": (0, 0, 0),
}  # fmt: skip
NAME = re.compile(r"(?<![\w.])[A-Za-z_]\w*(?:\.\w+)?(?!\w*\()")
ANGLES = ("angle", "angle_1", "angle_2", *fb.Spherical.coordinates)


class Unsupported(Exception):
    """The relation has no meaning for a mechanism, or is not known for one of its elements."""


def exponents(unit: str) -> tuple[int, int, int]:
    """Of length, mass and time in an SI unit such as ``N*m*s/rad``."""
    total, sign = [0, 0, 0], 1
    for part in re.split(r"([*/])", unit):
        if part in "*/" and part:
            sign = 1 if part == "*" else -1
            continue
        name, _, power = part.strip().partition("^")
        for k, e in enumerate(BASE[name.strip()]):
            total[k] += sign * e * int(power or 1)
    return total[0], total[1], total[2]


def is_angle(coordinate: str) -> bool:
    """Whether a coordinate, by its name, is an angle."""
    return coordinate.rpartition(".")[2].removesuffix("_rate") in ANGLES


@dataclass
class Scale:
    """New units: numbers of lengths, masses and times are multiplied by these."""

    length: float = 1.0
    mass: float = 1.0
    time: float = 1.0

    def of(self, unit: str) -> float:
        a, b, c = exponents(unit)
        return self.length**a * self.mass**b * self.time**c

    def coordinate(self, name: str) -> float:
        """Of a coordinate, or of its rate, by its name."""
        size = 1.0 if is_angle(name) else self.length
        return size / self.time if name.endswith("_rate") else size

    def effort(self, name: str) -> float:
        """Of a force or torque along a coordinate."""
        return self.of("J") / self.coordinate(name)


def times(value: Any, factor: float) -> Any:
    """A number, or nested tuples of them, multiplied."""
    if value is None or factor == 1.0:
        return value
    if isinstance(value, tuple | list):
        return tuple(times(v, factor) for v in value)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise Unsupported(f"a value that is no number: {value!r}")
    return value * factor


class Laws:
    """Rewrites laws: each name is replaced by an expression, each result multiplied."""

    def __init__(self, known: dict[str, str]) -> None:
        self.known = known  # replaced everywhere: time, sensors, curves

    def __call__(self, law: Any, factor: float = 1.0, **own: str) -> Any:
        if law is None:
            return None
        if callable(law):
            return self.function(law, factor, own)
        if isinstance(law, int | float):
            return law * factor
        text = self.text(law, own)
        return text if factor == 1.0 else f"{factor!r}*({text})"

    def text(self, law: str, own: dict[str, str]) -> str:
        known = self.known | own
        return NAME.sub(lambda x: known.get(x.group(), x.group()), law)

    def function(self, law: Any, factor: float, own: dict[str, str]) -> Any:
        arguments, text = written(law)
        return python_law(arguments, f"{factor!r}*({self.text(text, own)})")


def python_law(arguments: tuple[str, ...], text: str) -> Any:
    """A Python function of these arguments; its text stays with it."""
    space: dict[str, Any] = {}
    exec(f"from math import *\ndef law({', '.join(arguments)}):\n    return {text}", space)
    law = space["law"]
    law.written = (arguments, text)
    return law


def written(law: Any) -> tuple[tuple[str, ...], str]:
    """Arguments and text of a function made by `python_law`."""
    if not hasattr(law, "written"):
        raise Unsupported("a Python function without its text")
    return law.written


def scaled(m: fb.Mechanism, s: Scale) -> fb.Mechanism:
    """The same mechanism as it is written in other units."""
    env = m.environment()
    gravity = tuple(number(x, env, "m/s^2", "gravity") for x in m.gravity)
    out = fb.Mechanism(m.name, planar=m.planar, gravity=times(gravity, s.of("m/s^2")))
    known = {k: f"({v!r})" for k, v in env.items()} | {"t": f"(t/{s.time!r})"}
    for e in m.sensors:
        if isinstance(e, fb.Sensor):
            known[e.name] = f"({e.name}/{_of_curve(m, e.of, s)!r})"
    for c in _curves(m):
        known[c] = f"({c}/{s.coordinate(c)!r})"
    laws = Laws(known)
    out.add(*(_scaled(m, e, s, laws) for e in m.elements()))
    return out


def _of_curve(m: fb.Mechanism, curve: str, s: Scale) -> float:
    name, _, what = curve.partition(".")
    if what == "length":
        return s.length
    if m.find(name) is not None and (curve in _curves(m) or what in ("x", "y", "z")):
        return s.coordinate(curve)
    if what in ("vx", "vy", "vz"):
        return s.length / s.time
    raise Unsupported(f"a sensor of {curve}")


def _curves(m: fb.Mechanism) -> set[str]:
    joints = {f"{j.name}.{c}" for j in m.joints for c in j.measured(m.planar)}
    bodies = {f"{b.name}.{c}" for b in m.bodies for c in ("x", "y", "z", *(("angle",) if m.planar else ()))}
    both = joints | bodies
    return both | {f"{c}_rate" for c in both}


def fields(e: Any) -> dict[str, Any]:
    """Fields that are not their defaults, to make an element again."""
    return {f.name: getattr(e, f.name) for f in dataclasses.fields(e) if getattr(e, f.name) is not f.default}


def _resolved(value: Any, env: dict[str, float], dimension: str | None) -> Any:
    """A number, or nested tuples of them, without parameters and units."""
    if isinstance(value, tuple | list):
        return tuple(_resolved(v, env, dimension) for v in value)
    return number(value, env, dimension, "a number") if isinstance(value, str) else value


def _scaled(m: fb.Mechanism, e: Any, s: Scale, laws: Laws) -> Any:
    own = fields(e)
    env = m.environment()
    for k, unit in fields_with(type(e), Unit).items():
        if k in own and k not in fields_with(type(e), LawOf):
            own[k] = _resolved(own[k], env, unit.dimension)
    for k, unit in fields_with(type(e), Unit).items():
        if k in own and unit.dimension is not None and k not in ("orientation", "inertia_axes"):
            own[k] = times(own[k], s.of(unit.dimension))
    if isinstance(own.get("shape"), tuple) or hasattr(own.get("shape"), "looks"):
        shape = own["shape"]
        every = shape if isinstance(shape, tuple) else (shape,)
        own["shape"] = tuple(_scaled(m, x, s, laws) for x in every)
    special = SPECIAL.get(type(e).__name__)
    if special:
        special(m, e, own, s, laws)
    elif unknown := set(fields_with(type(e), LawOf)) - set(LAWS.get(type(e).__name__, ())):
        raise Unsupported(f"laws of {e.title}: {unknown}")
    elif any(u.dimension is None and k in own for k, u in fields_with(type(e), Unit).items()):
        raise Unsupported(f"numbers of {e.title}")
    return type(e)(**own)


def _along(m: fb.Mechanism, e: Any, own: dict, s: Scale, laws: Laws) -> None:
    """Springs, actuators, stops and notches along a coordinate."""
    first, *_ = along = (e.coordinate,) if isinstance(e.coordinate, str) else e.coordinate
    x, f = s.coordinate(first), s.effort(first)
    if "weights" in own:
        own["weights"] = tuple(times(w, x / s.coordinate(c)) for w, c in zip(own["weights"], along, strict=True))
    per = {"stiffness": f / x, "damping": f / x * s.time, "holding": f}
    for k in ("rest", "lower", "upper", "pitch", "notch", "tooth"):
        per[k] = x
    for k, factor in per.items():
        if k in own:
            own[k] = times(own[k], factor)
    for k in ("force", "capacity"):
        if k in own:
            own[k] = laws(own[k], f, value=f"(value/{x!r})", rate=f"(rate/{x / s.time!r})")


def _clutch(m: fb.Mechanism, e: Any, own: dict, s: Scale, laws: Laws) -> None:
    c = e.coordinate_i
    x = s.coordinate(c)
    own["capacity"] = laws(own["capacity"], s.effort(c), slip=f"(slip/{x!r})", rate=f"(rate/{x / s.time!r})")


def _torsion(m: fb.Mechanism, e: Any, own: dict, s: Scale, laws: Laws) -> None:
    if "torque" in own:
        own["torque"] = laws(own["torque"], s.of("J"), rate=f"(rate*{s.time!r})")


def _spring(m: fb.Mechanism, e: Any, own: dict, s: Scale, laws: Laws) -> None:
    if "force" in own:
        length, speed = f"(length/{s.length!r})", f"(rate/{s.length / s.time!r})"
        own["force"] = laws(own["force"], s.of("N"), length=length, rate=speed)


def _point(m: fb.Mechanism, e: Any, own: dict, s: Scale, laws: Laws) -> None:
    for k, unit in (("force", "N"), ("torque", "J")):
        if k in own:
            v = own[k]
            own[k] = tuple(laws(x, s.of(unit)) for x in v) if isinstance(v, tuple) else laws(v, s.of(unit))


def _joint_friction(m: fb.Mechanism, e: Any, own: dict, s: Scale, laws: Laws) -> None:
    c = e.coordinate or ("displacement" if hasattr(m[e.joint], "displacement") else "angle")
    if e.stick_speed is not None and e.kinetic is not None and e.stribeck_speed is None:
        own["stribeck_speed"] = 0.01 * s.of("m/s")  # what it is unless given
    if "viscous" in own:
        own["viscous"] = times(own["viscous"], s.effort(c) / s.coordinate(c) * s.time)


def _driver(m: fb.Mechanism, e: Any, own: dict, s: Scale, laws: Laws) -> None:
    own["law"] = laws(own["law"], s.coordinate(e.coordinate))


def _initial(m: fb.Mechanism, e: Any, own: dict, s: Scale, laws: Laws) -> None:
    x = s.coordinate(e.name)
    for k, factor in (("value", x), ("rate", x / s.time)):
        if k in own:
            own[k] = times(_resolved(own[k], m.environment(), None), factor)


def _coupler(m: fb.Mechanism, e: Any, own: dict, s: Scale, laws: Laws) -> None:
    """The sum keeps its number: each weight is that of its coordinate in the new unit."""
    own["weights"] = tuple(w / s.coordinate(c) for w, c in zip(e.weights, e.coordinates, strict=True))
    if "value" in own:
        raise Unsupported("a coupler with a value")


def _backlash(m: fb.Mechanism, e: Any, own: dict, s: Scale, laws: Laws) -> None:
    x, f = s.coordinate(e.coordinates[0]), s.effort(e.coordinates[0])
    if e.weights is not None or "middle" in own:
        raise Unsupported("play with weights")
    for k, factor in (("gap", x), ("stiffness", f / x), ("damping", f / x * s.time)):
        if k in own:
            own[k] = times(own[k], factor)


def _contact(m: fb.Mechanism, e: Any, own: dict, s: Scale, laws: Laws) -> None:
    n = {"linear": 1.0, "hertz": 1.5}.get(e.law, 1.5 if e.exponent is None else e.exponent)
    if "stiffness" in own:
        own["stiffness"] = times(own["stiffness"], s.of("N") / s.length**n)


def _controller(m: fb.Mechanism, e: Any, own: dict, s: Scale, laws: Laws) -> None:
    """Signals keep their numbers: what a controller reads is converted, and its gains are per time."""
    for k in ("setpoint", "measured", "of", "rate", "next", "kp", "lower", "upper", "bias"):
        if k in own and not isinstance(own[k], int | float):
            own[k] = laws(own[k])
    for k, power in (("ki", -1), ("kd", 1)):
        if k in own:
            own[k] = laws(own[k], s.time**power)
    if isinstance(e, fb.State):
        own["rate"] = laws(e.rate, 1.0 / s.time) if e.rate is not None else None
    if isinstance(e, fb.Integrator):
        own["gain"] = laws(e.gain, 1.0 / s.time)
    elif isinstance(e, fb.Lag):
        own["gain"] = laws(e.gain)
    if isinstance(e, fb.StateSpace):
        own["inputs"] = tuple(laws(u) for u in e.inputs)
        if e.period is None:
            own["A"], own["B"] = times(e.A, 1.0 / s.time), times(e.B, 1.0 / s.time)
    if isinstance(e, fb.Transfer) and e.period is None:
        for k in ("num", "den"):
            v = getattr(e, k)
            own[k] = tuple(c * s.time ** (len(v) - 1 - i) for i, c in enumerate(v))


def _event(m: fb.Mechanism, e: Any, own: dict, s: Scale, laws: Laws) -> None:
    own["when"] = laws(e.when)
    own["do"] = tuple(_action(a, s) for a in e.do)


def _action(a: Any, s: Scale) -> Any:
    own = fields(a)
    if isinstance(a, fb.Impulse):
        for k, unit in (("impulse", "N*s"), ("at", "m"), ("torque", "N*m*s")):
            if k in own:
                own[k] = times(own[k], s.of(unit))
    elif isinstance(a, fb.Set):
        raise Unsupported("an event that sets a parameter")
    return type(a)(**own)


def _as_it_is(m: fb.Mechanism, e: Any, own: dict, s: Scale, laws: Laws) -> None:
    """Nothing else to convert."""


def _bodies(m: fb.Mechanism, e: Any, own: dict, s: Scale, laws: Laws) -> None:
    raise Unsupported("sets of bodies")


SPECIAL = {
    **dict.fromkeys(("CoordinateSpring", "Actuator", "Detent", "Limit", "Brake", "Ratchet", "OneWay"), _along),
    **dict.fromkeys(("PID", "StateSpace", "Lag", "Integrator", "Transfer", "State"), _controller),
    **dict.fromkeys(("Motor", "TorsionalSpringDamper"), _torsion),
    **dict.fromkeys(("PointForce", "PointTorque"), _point),
    **dict.fromkeys(("SpringDamper", "PathSpring"), _spring),
    "Clutch": _clutch, "JointFriction": _joint_friction, "Driver": _driver,
    "Initial": _initial, "Coupler": _coupler, "Backlash": _backlash, "Contact": _contact, "MaterialPair": _contact,
    "Event": _event, "Bodies": _bodies, "Table": _as_it_is, "GearPair": _as_it_is,
}  # fmt: skip
LAWS: dict[str, tuple[str, ...]] = {}
