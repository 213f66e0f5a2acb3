"""A mechanism with its closed contacts as joints, and what holds it as constraints."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...model.body import GROUND
from ...model.model import Model
from ..assembly.start import Assembly
from ..motion.impulse.scene import placed
from ..untouched import holding_parts
from .closed import Closed, Place
from .holds import Holds, holds
from .joints import Centres, ClosedContact, CommonPoint, PointOnFlat, Rolling, SlidingDisk
from .sides import BALL, CORNER, DISK, FLAT, SHARP, Side, side


def open_copy(model: Model, at: Assembly) -> tuple[Model, Holds]:
    """The model without contacts; what may hold at rest is a constraint there (`holds.holds`)."""
    gone = {e.name: None for e in (*model.contacts, *holding_parts(model))}
    out, held = model.changed(gone), holds(model, at)
    out.add(*held.parts)
    return out.snapshot(), held


def joined_copy(bare: Model, place: Place) -> tuple[Model, dict[str, str]]:
    """A copy of the model without contacts in which closed contacts are joints.

    Returns
    -------
    model : Model
    missing : dict
        Contact -> why there is no joint that moves as it does.
    """
    out, missing = bare.copy(), dict[str, str]()
    M = placed(place.scene, place.at)
    at = _Drawn(place)
    for c in place.contacts:
        G = place.scene.geometry
        a, b = side(G, M, c.shapes[0], c.point, c.normal), side(G, M, c.shapes[1], c.point, -c.normal)
        joint = _joint(c, a, b, at)
        if isinstance(joint, str):
            missing[c.name] = joint
        else:
            out.add(joint)
    return out.snapshot(), missing


class _Drawn:
    """Takes frames from where bodies are to where they are drawn."""

    def __init__(self, place: Place) -> None:
        self.axes = 2 if place.at.compiled.structure.model.planar else 3
        self.here, self.drawn = place.bodies, place.at.compiled.values.given.bodies

    def __call__(self, body: str, p: np.ndarray, R: np.ndarray) -> tuple[float, ...]:
        """Origin and rotation of a frame on a body, as drawn."""
        if body != GROUND:
            x, d = self.here[body], self.drawn[body]
            p, R = np.real(d.c) + np.real(d.R) @ (x.R.T @ (p - x.p)), np.real(d.R) @ (x.R.T @ R)
        return tuple(float(v) for v in (*p, *R.ravel()))


def _joint(c: Closed, a: Side, b: Side, at: _Drawn) -> ClosedContact | str:
    """The joint that moves as a contact does, or why there is none."""
    bodies, up = c.bodies, c.normal
    if b.form == FLAT and a.form != FLAT:  # the plane is F
        a, b, bodies, up = b, a, (bodies[1], bodies[0]), -c.normal
    kind, centre, radii = _kind(c.friction > 0.0, a, b)
    if kind is None:
        how = "sticking" if c.friction > 0.0 else "sliding"
        return f"{c.name} is a {how} contact of what is {a.form} with what is {b.form} there"
    axle = b.axle if b.form == DISK else up
    first = a.centre if kind is Centres and a.form == BALL else c.point
    second = c.point if centre is None else centre
    frames = at(bodies[0], first, _axes(up, c)), at(bodies[1], second, _triad(axle))
    return kind(c.name, bodies[0], bodies[1], at=tuple(c.point[: at.axes].tolist()), frames=frames, radii=radii)


def _kind(sticks: bool, a: Side, b: Side) -> tuple[type[ClosedContact] | None, np.ndarray | None, tuple[float, float]]:
    """Which joint, where its second origin is (None: where they touch), its radii; ``a`` is flat if one of them is."""
    forms = {a.form, b.form}
    if sticks:
        if CORNER in forms or forms <= set(SHARP):
            return CommonPoint, None, (0.0, 0.0)
        if a.form == FLAT and b.form in (BALL, DISK):
            return Rolling, b.centre, (0.0, b.radius) if b.form == BALL else (b.radius, 0.0)
        return None, None, (0.0, 0.0)
    if a.form == FLAT and b.form in SHARP:
        return PointOnFlat, None, (0.0, 0.0)
    if a.form == FLAT and b.form == BALL:
        return PointOnFlat, b.centre, (0.0, b.radius)
    if a.form == FLAT and b.form == DISK:
        return SlidingDisk, b.centre, (b.radius, 0.0)
    if forms <= {BALL, CORNER} and BALL in forms:
        return Centres, b.centre if b.form == BALL else None, (0.0, a.radius + b.radius)
    return None, None, (0.0, 0.0)


def _axes(up: np.ndarray, c: Closed) -> np.ndarray:
    """Axes of a frame: z along the normal; in the plane y is its normal."""
    t = c.frame[1]
    return np.column_stack([t, np.cross(up, t), up])


def _triad(z: np.ndarray) -> np.ndarray:
    """Axes with this z."""
    x = np.cross(z, np.eye(3)[int(np.argmin(np.abs(z)))])
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


def told(missing: Mapping[str, str]) -> str:
    """Why contacts are not known, in words."""
    return "; ".join(missing.values())
