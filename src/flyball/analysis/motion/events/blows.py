"""Blows as generalised impulses: what an impulse at a point of a body, or along a coordinate, does to each velocity."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ....equations.tree import column
from ....model.actions import Impulse
from ....model.body import Body, Frame
from ....model.element import si_numbers
from ....model.event import Event
from ....model.event_check import coordinate_of
from ....model.geometry import vector
from ....results.struck import Blow
from .here import Here

Three = np.ndarray


def generalised(
    here: Here, e: Event, a: Impulse, force: Sequence[float], torque: Sequence[float]
) -> tuple[np.ndarray, Blow]:
    """Its power at each unit velocity, (nv,), and what it is made of; kinematics of the state are in the scratch.

    Parameters
    ----------
    here : Here
    e, a : Event, Impulse
    force, torque : sequence of float
        Its components [N s], [N m s], as many as were written: none is no force; one number along a coordinate.
    """
    model = here.structure.model
    if not isinstance(model.find(a.on), (Body, Frame)):
        text = coordinate_of(model, e, a)
        return force[0] * _gradient(here, text), ("along", here.structure.measured[text], force[0], e.name)
    plane = model.planar
    F = np.array([*force, 0.0, 0.0, 0.0])[:3] if len(force) < 3 else np.array(force)
    T = np.array([0.0, 0.0, *torque]) if plane and len(torque) == 1 else np.array(list(torque) or [0.0] * 3)
    body, point, axes = _frame(here, a)
    if a.axes == "body":
        F, T = axes @ F, axes @ T
    about = T + np.cross(point - here.c.work.BK[body, :3], F)
    return _along(here, body, point, F, T), ("body", body, tuple(F.tolist()), tuple(about.tolist()), e.name)


def _gradient(here: Here, text: str) -> np.ndarray:
    """Gradient of a measured coordinate, (nv,)."""
    s, S = here.structure, here.c.system
    out = np.zeros(s.nv)
    row = len(S.rows.law) + s.measured[text]
    at = slice(S.row_start[row], S.row_start[row + 1])
    np.add.at(out, S.column[at], here.c.work.G[at])
    return out


def _frame(here: Here, a: Impulse) -> tuple[int, Three, np.ndarray]:
    """Row of the body, where it is struck, and the axes of the part that is named, in world axes now."""
    x, model = here.c.values, here.structure.model
    part = model[a.on]
    name = part.body if isinstance(part, Frame) else a.on
    b, drawn = here.structure.place[name], x.bodies[name]
    record = here.c.work.BK[b]
    R = record[3:12].reshape(3, 3)
    at, axes = drawn.c, R
    if isinstance(part, Frame):
        at, turned = x.poses.named(a.on)
        axes = R @ drawn.R.T @ turned
    if a.at is not None:
        given = si_numbers(a.at, x.env, "m", f"at of {a.title}")
        at = vector(given, model.planar, f"at of {a.title}") if len(given) < 3 else np.array(given)
    return b, record[:3] + R @ drawn.R.T @ (at - drawn.c), axes


def _along(here: Here, b: int, point: Three, force: Three, torque: Three) -> np.ndarray:
    """What a wrench on body b, force at ``point``, does along the velocities of it and of all that carry it."""
    S, W = here.c.system, here.c.work
    out = np.zeros(here.structure.nv)
    while b >= 0:
        arm = point - W.O[b]
        for k in range(S.tree.nv[b]):
            turn, shift = (np.array(part) for part in column(S, W, b, k))
            out[S.tree.v[b] + k] = force @ (shift + np.cross(turn, arm)) + torque @ turn
        b = int(S.tree.parent[b])
    return out
