"""Contacts that a joint holds on both sides while real ones push only: where they pull during a motion."""

from __future__ import annotations

from typing import TYPE_CHECKING

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
