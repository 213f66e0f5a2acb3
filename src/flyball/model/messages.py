"""Parts of messages: suggestions for misspelt names, lists of what exists, the summary of a mechanism."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .model import Model


def suggest(name: object, known: Iterable[str]) -> str:
    """Return ' (did you mean ...?)' if a similar name is known; nothing for non-strings."""
    if not isinstance(name, str):
        return ""
    names = list(known)
    same = [k for k in names if k.lower() == name.lower() and k != name]
    close = same or difflib.get_close_matches(name, names, 1)
    return f" (did you mean {close[0]!r}?)" if close else ""


NAMES_ELSEWHERE = {
    "ball": "Spherical", "balljoint": "Spherical", "sphericaljoint": "Spherical", "hinge": "Revolute",
    "pin": "Revolute", "pinjoint": "Revolute", "revolutejoint": "Revolute", "rotationaljoint": "Revolute",
    "slider": "Prismatic", "slidejoint": "Prismatic", "prismaticjoint": "Prismatic", "translationaljoint": "Prismatic",
    "weld": "Fixed", "weldjoint": "Fixed", "fixedjoint": "Fixed", "rigid": "Fixed", "cardan": "Universal",
    "hooke": "Universal", "universaljoint": "Universal",
    "spring": "SpringDamper", "damper": "SpringDamper", "linearspring": "SpringDamper", "dashpot": "SpringDamper",
    "torsionspring": "TorsionalSpringDamper", "rotaryspring": "TorsionalSpringDamper",
    "torsionaldamper": "TorsionalSpringDamper",
    "force": "PointForce", "torque": "PointTorque", "motion": "Driver", "jointmotion": "Driver",
    "gear": "GearPair", "gears": "GearPair", "belt": "GearPair", "chain": "GearPair", "rack": "RackAndPinion",
    "rackpinion": "RackAndPinion", "coupling": "Coupler", "part": "Body", "rigidbody": "Body",
    "solidbody": "Body", "marker": "Frame", "site": "Frame", "point": "Frame", "system": "Mechanism",
    "multibodysystem": "Mechanism", "world": "Mechanism", "model": "Mechanism", "brick": "Box", "cuboid": "Box",
    "stop": "Limit", "endstop": "Limit", "jointlimit": "Limit", "friction": "JointFriction",
    "hydrauliccylinder": "LinearActuator", "pneumaticcylinder": "LinearActuator", "ram": "LinearActuator",
    "piston": "LinearActuator", "linearmotor": "LinearActuator", "winch": "Rope",
    "simulator": "Stepper", "environment": "Stepper",
}  # fmt: skip
"""Names of parts in other programs, in lower case, and the names here."""
FIELDS_ELSEWHERE = {
    "m": "mass", "k": "stiffness", "c": "damping", "d": "damping", "b": "damping", "j": "inertia", "i": "inertia",
    "i_zz": "inertia", "izz": "inertia", "moment_of_inertia": "inertia", "pos": "position", "origin": "position",
    "rpy": "orientation", "quaternion": "orientation", "rotation": "orientation", "l0": "length", "rest_length":
    "length", "free_length": "length", "body1": "body_i", "body2": "body_j", "body_a": "body_i", "body_b": "body_j",
    "parent": "body_i", "child": "body_j", "location": "at", "anchor": "at", "mu": "friction", "e": "restitution",
    "r": "radius", "size": "edges", "ratio": "teeth", "min": "lower", "max": "upper", "tau": "torque", "v": "velocity",
}  # fmt: skip
"""Names of fields in formulas and other programs, in lower case, and the names here."""


def suggest_part(name: str, known: Iterable[str]) -> str:
    """Return ' (did you mean ...?)' for the name of a class: as other programs call it, or a similar name."""
    here, known = NAMES_ELSEWHERE.get(name.lower()), list(known)
    return f" (did you mean {here!r}?)" if here in known else suggest(name, known)


def listing(names: list[str]) -> str:
    """List existing names, for messages."""
    if not names:
        return "there is none yet; add it first"
    shown = ", ".join(names[:12]) + (", ..." if len(names) > 12 else "")
    return f"known: {shown}"


def shortened_list(names: Iterable[str], most: int = 60) -> str:
    """Join names with commas, in about ``most`` characters; the last name is kept if three or more are left out."""
    every = list(names)
    if len(", ".join(every)) <= most or len(every) < 4:
        return ", ".join(every)
    kept: list[str] = []
    for name in every[:-1]:
        if kept and len(", ".join([*kept, name, every[-1]])) > most - 5:
            break
        kept.append(name)
    if len(every) - len(kept) <= 3:
        return ", ".join(every)
    return f"{', '.join(kept)}, ... {every[-1]}"


def kind_in_words(cls: type) -> str:
    """Return the name of a class as words: ``point in plane``."""
    return re.sub(r"(?<=[a-z])(?=[A-Z])", " ", cls.__name__).lower()


def abbreviated(text: str, most: int = 200) -> str:
    """Return a text, shortened in the middle if it is long."""
    return text if len(text) <= most else f"{text[: 2 * most // 3]} ... {text[-most // 4 :]}"


LINE_WIDTH = 100  # characters per line


def summary_lines(model: Model) -> list[tuple[str, str]]:
    """Return labels and texts: the number of parts of each kind, and their names."""
    gravity = ", ".join(str(x) for x in model.gravity)
    head = ("planar" if model.planar else "spatial") + (f", gravity ({gravity})" if model.gravity_told else "")
    out = [("mechanism", f"{model.name!r}, {head}")]
    for category in ("ground", "bodies"):
        out += _line(category, _folded(e.name for e in getattr(model, category)), len(getattr(model, category)), ", ")
    out += _line("bulk", (f"{e.count} {e.name}" for e in model.bulk))
    out += _line("frames", _folded(e.name for e in model.frames), len(model.frames), ", ")
    for category in ("joints", "couplings", "controllers", "forces"):
        kinds: dict[str, list[str]] = {}
        for e in getattr(model, category):
            kinds.setdefault(type(e).__name__, []).append(e.name)
        out += _line(
            category,
            (f"{kind} {shortened_list(_folded(names))}" for kind, names in kinds.items()),
            len(getattr(model, category)),
        )
    out += _line("drivers", (f"{d.name} ({d.coordinate} = {d.law})" for d in model.drivers))
    for category in ("sensors", "tables", "initial", "materials", "contacts", "limits"):
        names = _folded((e.name for e in getattr(model, category)), 2 if category == "initial" else 1)
        out += _line(category, names, len(getattr(model, category)), ", ")
    out += _line("events", (f"{e.name} ({e.when})" for e in model.events))
    own = [f"{k} = {v}" for k, v in model.parameters.items() if "." not in k]
    own += _folded(k for k in model.parameters if "." in k)
    return out + _line("parameters", own, len(model.parameters), ", ")


def _folded(names: Iterable[str], depth: int = 1) -> list[str]:
    """Return names with several of one group as one, ``left.* (4)``; the last ``depth`` words are no groups."""
    groups: dict[str, list[str]] = {}
    for name in names:
        groups.setdefault(name.partition(".")[0] + ".*" if name.count(".") >= depth else name, []).append(name)
    return [inner[0] if len(inner) == 1 else f"{group} ({len(inner)})" for group, inner in groups.items()]


def _line(label: str, texts: Iterable[str], count: int | None = None, between: str = "; ") -> list[tuple[str, str]]:
    """Return one line, shortened if it is long; empty if there is nothing."""
    every = list(texts)
    text = "; ".join(every) if count is not None and between == "; " else shortened_list(every, LINE_WIDTH)
    return [(label, f"{len(every) if count is None else count}: {text}")] if every else []


def summary(model: Model) -> str:
    """Return the lines as a text."""
    return "\n".join(f"{label:<10} {text}" for label, text in summary_lines(model))
