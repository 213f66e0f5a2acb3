"""Contacts that a joint holds on both sides while real ones push only: where they pull during a motion."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..model.joint import Joint

if TYPE_CHECKING:
    from .result import Result

PULL = 1e-5  # part of the largest force of the motion above which a pull is no error of the integration


def pulls(result: Result) -> list[str]:
    """A warning for each joint that stands for a one-sided contact and pulls at some output time.

    Its normal force is the multiplier of its first row. Where redundant constraints leave that undetermined, its sign
    says nothing.
    """
    x, undetermined = result.values, result.health.undetermined
    s = x.structure
    found = []
    for joint in s.model.joints:
        if joint.one_sided and not any(k.startswith("force") for k in undetermined.get(joint.name, ())):
            sign = joint.pushing_sign(x.numbers[joint.name], *x.poses.ends(joint))
            if sign is not None:
                found.append((joint, sign, result.multipliers[:, s.slices[joint.name].start]))
    if not found:
        return []
    near = PULL * _largest_force(result)
    return [text for joint, sign, force in found if (text := _warning(result, joint, sign, force, near))]


def _largest_force(result: Result) -> float:
    """The largest multiplier that is a force, or weight [N]."""
    s, x = result.values.structure, result.values
    metric = sorted({t.row for t in s.terms if not t.measured and t.formula.measure == "m"})
    weight = float(np.linalg.norm(x.system.gravity) * x.system.bodies.mass.max(initial=0.0))
    return max(weight, float(np.abs(result.multipliers[:, metric]).max(initial=0.0)))


def _warning(result: Result, joint: Joint, sign: float, force: np.ndarray, near: float) -> str:
    """Of one joint; ``sign`` is that of the force while it pushes, 0 if nothing tells the side."""
    remedy = f"press it on more strongly, or model the contact by shapes and Contact(...){joint.both_sides}"
    if sign == 0.0:
        if not min(force.max(), -force.min()) > near:
            return ""
        return (
            f"{joint.title} pushes to both sides, with {force.min():.4g} N to {force.max():.4g} N: a real follower "
            f"would lift off; {remedy}"
        )
    k = int(np.argmin(sign * force))
    if not -sign * force[k] > near:
        return ""
    return (
        f"{joint.title} pulls with up to {-sign * force[k]:.4g} N (at t = {result.t[k]:.6g} s): a real contact would "
        f"separate there; {remedy}"
    )


# Friction along one coordinate of a joint's surface where the surface slips along others too.


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
