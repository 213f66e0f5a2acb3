"""Where the frames of elements are when a mechanism is drawn."""

from __future__ import annotations

import itertools
from types import SimpleNamespace
from typing import Any

import numpy as np

from ..math.products import product
from ..model.body import GROUND, Body
from ..model.force import BodyForce
from ..model.geometry import vector
from ..model.joint import Joint
from .numbers import Numbers
from .specs import FrameSpec, Structure, TermSpec


class Poses:
    """Where the frames of elements are when the mechanism is drawn."""

    def __init__(self, s: Structure, given: Numbers) -> None:
        self.s, self.numbers, self.bodies = s, given.of, given.bodies
        self.model = s.model
        self._given = given

    def row(self, f: FrameSpec) -> np.ndarray:
        """Position (3) from the body's centre of mass and rotation (9), in body axes."""
        key = (f.element.name, f.role, f.coordinate) if f.element is not None else ()
        found = self._given.local.get(key)
        if found is None:
            p, R, name = self.world(f)
            b = self.bodies[name]
            back = b.R.T
            found = self._given.local[key] = np.concatenate((product(back, p - b.c), product(back, R).ravel()))
        return found

    def local(self, f: FrameSpec) -> tuple[np.ndarray, np.ndarray]:
        """Position from the body's centre of mass and rotation, in body axes."""
        row = self.row(f)
        return row[:3], row[3:].reshape(3, 3)

    def world(self, f: FrameSpec) -> tuple[np.ndarray, np.ndarray, str]:
        """Position, rotation and carrier of a frame in the drawn configuration."""
        if f.element is None:
            return np.zeros(3), np.eye(3), GROUND
        key = f.element.name, f.role, f.coordinate
        found = self._given.world.get(key)
        if found is None:
            found = self._given.world[key] = self._drawn(f)
        return found

    def _drawn(self, f: FrameSpec) -> tuple[np.ndarray, np.ndarray, str]:
        e = f.element
        n = self.numbers[e.name]
        end = e.ends()[f.role]
        name = self.model.carrier(end, e)
        if isinstance(e, BodyForce):
            p, R = self.named(end)
            if isinstance(self.model[end], Body):
                at = getattr(n, "at", None)
                p = self.bodies[name].c if at is None else vector(at, self.model.planar, e.title)
            return p, R, name
        p, R = self._placed(e, n)[f.role] if hasattr(e, "placed") and n.at is not None else self.named(end)
        if f.coordinate:
            R = product(R, np.array(getattr(e.coordinates[f.coordinate], f"turn_{f.role}")))
        return p, R, name

    def _placed(self, e: Any, n: SimpleNamespace) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        found = self._given.placed.get(e.name)
        if found is None:
            found = self._given.placed[e.name] = e.placed(n, self.model.planar)
        return found

    def named(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        """Drawn pose of a body's reference frame or of a named frame."""
        if name in self.bodies:
            return self.bodies[name].p, self.bodies[name].R
        e = self.model[name]
        n = self.numbers[name]
        b = self.bodies[e.body]
        return b.p + product(b.R, vector(n.position, self.model.planar, e.title)), product(b.R, e.rotation(n))

    def separation(self, e: Any) -> float:
        """Drawn distance from the first of an element's frames to the last, by way of all between."""
        points = [self.world(FrameSpec(0, e, role))[0] for role in e.ends()]
        return sum(np.sqrt(((b - a) ** 2).sum()) for a, b in itertools.pairwise(points))

    def apart(self, e: Any) -> float:
        """The same of an element that has several frames; 0 of others."""
        return self.separation(e) if hasattr(e, "ends") and len(e.ends()) > 1 else 0.0

    def ends(self, e: Any) -> tuple[tuple[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]:
        """Drawn frames F and M of a joint."""
        F, M = (self.world(FrameSpec(0, e, role))[:2] for role in "FM")
        return F, M

    def axis(self, joint: str) -> np.ndarray:
        """Axis of a joint's angle in the world as drawn."""
        e = self.model[joint]
        R = self.ends(e)[0][1]
        turn = e.coordinates["angle"].turn_F if "angle" in e.coordinates else ()
        return (product(R, np.array(turn)) if len(turn) else R)[:, 2]

    def drawn(self, t: TermSpec) -> float:
        """What a term's formula gives in the drawn configuration."""
        poses = (self.world(self.s.frames[k]) for k in (t.F, t.M))
        F, M = ((tuple(p), tuple(R.ravel()), *((0.0,) * 3,) * 4) for p, R, _ in poses)
        par = (1.0, *t.formula.par[1:6], 0.0, 0.0) if t.formula.of_kind.turns else (*t.formula.par[:6], 0.0, 0.0)
        return t.formula.of_kind.row(par, F, M, self.turned(t.owner), None)[0]

    def turned(self, owner: Any) -> float:
        """Angle of a body or frame in the plane as drawn, whole turns counted; 0 for joints, which begin there."""
        if isinstance(owner, Joint) or not self.model.planar:
            return 0.0
        own = self.numbers[owner.name].angle
        return own if isinstance(owner, Body) or owner.body == GROUND else own + self.numbers[owner.body].angle
