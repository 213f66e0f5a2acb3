"""Friction along one coordinate of a joint's surface where the surface slips along others too."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from .result import Result

ACROSS = 0.1  # part of the slip along a friction's coordinate above which that across it counts: it takes 0.5 % there
SLIPPED = 1e-3  # part of the mechanism's length above which slip across it is worth a word
TURNED = 1.0  # the same of a turn whose slip is unknown, since no radius is given [rad]


def one_way(result: Result) -> list[str]:
    """What is said of frictions on `Cylindrical`, `Planar` and `PointInPlane` that slip across their coordinate.

    A surface has one friction force, mu N against its whole slip. Friction in a joint knows the slip along its own
    coordinate only: there it is too large by |v| / v, so that it may stick where the surface creeps, and across there
    is none.
    """
    if len(result.t) < 2:
        return []
    model, found = result.model, []
    frictions: list[Any] = result.values.structure.loads
    for f in frictions:
        if not (hasattr(f, "load") and model[f.joint].one_surface):
            continue
        own = f.coordinate_text()
        slips = {f"{f.joint}.{what}": _slip(result, f, what) for what in model[f.joint].measured(result.planar)}
        along = slips[own][0]
        for text, (way, unit) in slips.items():
            least = max(ACROSS * along, SLIPPED * result.values.length) if unit == "m" else TURNED
            if text != own and way > least:
                found.append(
                    f"{f.title} acts along {own!r} only, where the surface slips {along:.3g} {slips[own][1]}; along "
                    f"{text!r} it slips {way:.3g} {unit} without friction. One surface has one friction force, mu N "
                    f"against its whole slip, so that while it slips along {text!r} little force moves it along "
                    f"{own!r}. Give the bodies shapes and a Contact(friction=...) in place of the joint, or put a body "
                    f"between them with a joint for each motion, if these are two surfaces"
                )
    return found


def _slip(result: Result, f: Any, what: str) -> tuple[float, str]:
    """How far the surfaces slip along a coordinate of the joint [m]; a turn without a radius [rad]."""
    angle, radius = what.startswith("angle"), result.values.numbers[f.name].radius
    arm = 1.0 if not angle or radius is None else float(radius)
    speed = np.abs(result[f.joint].quantity(f"{what}_rate")[1])
    return arm * float(0.5 * (speed[1:] + speed[:-1]) @ np.diff(result.t)), "rad" if angle and radius is None else "m"
