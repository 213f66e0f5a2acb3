"""What bodies look like: the shapes the user gave, or else links and solids that follow from joints and inertia."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..joints.prismatic import Prismatic
from ..model.body import GROUND
from ..model.element import resolve
from ..model.force import TwoPointForce
from ..model.geometry import matrix_to_quaternion, triad
from ..model.shapes import Cone, Solid
from .recording import Shape

if TYPE_CHECKING:
    from ..model.joint import Joint
    from ..results.result import Result

End = tuple[str, np.ndarray, np.ndarray]
LINK = 0.045  # radius of a link, as part of the mechanism's typical length


class Looks:
    """Shapes of every body, in the axes and from the origin of its reference frame.

    Attributes
    ----------
    size : float
        A typical length of the mechanism's parts [m].
    """

    def __init__(self, result: Result) -> None:
        self.result = result
        self.planar = result.planar
        x = result.values
        self._names = {b: name for name, b in x.structure.place.items()}
        self._env = dict(zip(result.model.parameters, x.system.const.tolist(), strict=False))
        self._solids = {b.name: b.solids() for b in result.model.bodies}
        self.points: dict[str, list[np.ndarray]] = {b.name: [] for b in result.model.bodies}
        self.blocks: dict[str, list[End]] = {b.name: [] for b in result.model.bodies}
        for joint in result.model.joints:
            self._attach(joint)
        for force in result.model.forces:
            if isinstance(force, TwoPointForce):
                self._attach(force)
        reach = {name: self._reach(name) for name in self.points}
        known = [r for r in reach.values() if r > 0.0]
        self.size = float(np.median(known)) if known else x.length

    def end(self, name: str, role: str) -> End:
        """Body of an element's frame, and the frame's origin and axes from the body's reference frame."""
        x = self.result.values
        k = x.structure.frame_at[name, role, ""]
        body = self._names[int(x.system.frame_i[k])]
        row = x.system.frame_x[k].real
        return body, row[:3] + x.bodies[body].com.real, row[3:].reshape(3, 3)

    def _attach(self, e: Joint | TwoPointForce) -> None:
        """Note an element's points on its bodies; of a slide, the block on one and the guide's ends on the other."""
        ends = [self.end(e.name, role) for role in "FM"]
        if isinstance(e, Prismatic):
            guide, block = ends if ends[1][0] != GROUND else reversed(ends)
            self.blocks[block[0]].append(block)
            if guide[0] != GROUND:
                s = self.result[e.name].displacement
                s = s - self.result.values.numbers[e.name].displacement
                sign = 1.0 if guide is ends[0] else -1.0
                for d in (s.min(initial=0.0), s.max(initial=0.0)):
                    self._add(guide[0], guide[1] + sign * d * guide[2][:, 2])
            self._add(block[0], block[1])
            return
        for body, p, _ in ends:
            self._add(body, p)

    def _add(self, body: str, p: np.ndarray) -> None:
        if body == GROUND:
            return
        near = 1e-6 * self.result.values.length
        if np.isfinite(p).all() and all(np.abs(p - other).max() > near for other in self.points[body]):
            self.points[body].append(p)

    def _mass(self, name: str) -> tuple[np.ndarray, np.ndarray, float]:
        """Centre of mass, inertia and mass of a body."""
        b = self.result.values.bodies[name]
        return b.com.real, np.asarray(b.inertia).real, float(np.real(b.mass))

    def _reach(self, name: str) -> float:
        """How long a body is, from the points that are known on it."""
        points = [*self.points[name], self._mass(name)[0]]
        if len(self.points[name]) == 1:
            com, J, m = self._mass(name)
            points.append(com + _unit(com - points[0]) * np.sqrt(3.0 * J[2, 2] / m))
        if not self.points[name]:
            return float(np.sqrt(6.0 * np.trace(self._mass(name)[1]) / self._mass(name)[2]))
        a = np.array(points)
        return float(np.sqrt(((a[:, None] - a[None]) ** 2).sum(axis=2)).max())

    def shapes(self, name: str) -> tuple[Shape, ...]:
        """The body's shapes."""
        given = self._solids[name]
        if given:
            return tuple(_given(s, self._env) for s in given)
        points = self.points[name]
        out = [self._block(end) for end in self.blocks[name]]
        if len(points) >= 2:
            out += self._links(points)
        elif points and not out:
            out += self._hung(points[0], name)
        elif not points:
            out += [self._solid(name)]
        return tuple(out)

    def _radius(self, length: float) -> float:
        return min(LINK * self.size * (1.0 if self.planar else 0.7), 0.2 * length)

    def _capsule(self, a: np.ndarray, b: np.ndarray, slim: float = 1.0) -> Shape:
        d = b - a
        length = float(np.sqrt(d @ d))
        return Shape("capsule", (slim * self._radius(length), length), _three((a + b) / 2), _along(d))

    def _links(self, points: list[np.ndarray]) -> list[Shape]:
        """One link between two points (or along a line); else a plate (in the plane) or spokes."""
        a = np.array(points)
        middle = a.mean(axis=0)
        _, d, Vt = np.linalg.svd(a - middle)
        if d[1] < 0.02 * d[0]:
            along = (a - middle) @ Vt[0]
            return [self._capsule(a[along.argmin()], a[along.argmax()])]
        if self.planar:
            return [self._plate(a)]
        return [self._capsule(middle, p) for p in a]

    def _plate(self, a: np.ndarray) -> Shape:
        """The outline around the points, each with room for a pin."""
        from scipy.spatial import ConvexHull

        r = 1.2 * LINK * self.size
        turn = np.linspace(0.0, 2 * np.pi, 24, endpoint=False)
        rim = (a[:, None, :2] + r * np.stack([np.cos(turn), np.sin(turn)], axis=1)[None]).reshape(-1, 2)
        hull = rim[ConvexHull(rim).vertices]
        return Shape("plate", (0.5 * r,), outline=tuple(tuple(p) for p in hull.tolist()))

    def _block(self, end: End) -> Shape:
        """The block of a slide, along its axis."""
        _, p, R = end
        u = self.size
        edges = (0.16 * u, 0.16 * u, 0.26 * u) if not self.planar else (0.15 * u, 0.15 * u, 0.26 * u)
        return Shape("box", edges, _three(p), tuple(matrix_to_quaternion(R).tolist()))

    def _hung(self, p: np.ndarray, name: str) -> list[Shape]:
        """A body on one joint: a rod if its inertia is that of one, else a rod to the solid it is equivalent to."""
        com, J, m = self._mass(name)
        arm = com - p
        d = float(np.sqrt(arm @ arm))
        if d < 1e-6 * self.size:
            return [self._solid(name)]
        e = arm / d
        along = 0.0 if self.planar else float(e @ J @ e)
        across = J[2, 2] if self.planar else (np.trace(J) - along) / 2
        half = float(np.sqrt(3.0 * across / m))
        if along < 0.1 * across and half > 0.6 * d:
            return [self._capsule(p, com + half * e)]
        return [self._capsule(p, com, 0.4 if self.planar else 1.0), self._solid(name)]

    def _solid(self, name: str) -> Shape:
        """The homogeneous solid with the body's inertia: ball, cylinder or box; a disc in the plane."""
        com, J, m = self._mass(name)
        least = 0.08 * self.size
        if self.planar:
            if not self.points[name]:
                a = max(float(np.sqrt(6.0 * J[2, 2] / m)), least)
                return Shape("box", (a, a, 0.2 * a), _three(com))
            r = min(max(float(np.sqrt(2.0 * J[2, 2] / m)), least), 3.0 * self.size)
            return Shape("cylinder", (r, 0.2 * r), _three(com))
        w, V = np.linalg.eigh(J / m)
        if w[2] < 1e-9 * self.size**2 or w[2] - w[0] < 0.02 * w[2]:
            return Shape("sphere", (max(float(np.sqrt(2.5 * w[0])), least),), _three(com))
        for lone in (0, 2):
            i, j = (k for k in range(3) if k != lone)
            if abs(w[i] - w[j]) < 0.02 * w[2]:
                r = np.sqrt(2.0 * w[lone])
                length = np.sqrt(max(12.0 * w[i] - 3.0 * r * r, 0.0))
                size = max(float(r), 0.2 * least), max(float(length), 0.1 * float(r), 0.2 * least)
                return Shape("cylinder", size, _three(com), _along(V[:, lone]))
        edges = [float(np.sqrt(max(6.0 * (w.sum() - 2.0 * x), 0.0))) for x in w]
        V = V * np.sign(np.linalg.det(V))
        return Shape(
            "box", tuple(max(x, 0.2 * least) for x in edges), _three(com), tuple(matrix_to_quaternion(V).tolist())
        )


def _given(s: Solid, env: dict[str, float]) -> Shape:
    """A shape as the user gave it; a cone is counted from its middle in pictures."""
    n = resolve(s, env)
    p, R = s.pose(n)
    if isinstance(s, Cone):
        p = p + R[:, 2] * n.height / 2
    kind = type(s).__name__.lower()
    return Shape(kind, tuple(map(float, s.size(n))), _three(p), tuple(matrix_to_quaternion(R).tolist()))


def _unit(d: np.ndarray) -> np.ndarray:
    size = np.sqrt(d @ d)
    return d / size if size > 0 else np.zeros(3)


def _along(d: np.ndarray) -> tuple[float, float, float, float]:
    """Quaternion that turns z to the direction d."""
    return tuple(matrix_to_quaternion(triad(_unit(d))).tolist())  # type: ignore[return-value]


def _three(p: np.ndarray) -> tuple[float, float, float]:
    return tuple(float(c) for c in p)  # type: ignore[return-value]
