"""Shapes of bodies: as the user gave them, or from joints and inertia; simplification of meshes.

Meshes are simplified to fit into a page: the vertices in each cell of a grid are merged into the point nearest to the
planes of the cell's triangles (P. Lindstrom, "Out-of-core simplification of large polygonal models", SIGGRAPH 2000).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ..model.element import resolve
from ..model.geometry import matrix_to_quaternion, quaternion_to_matrix, triad
from ..model.shapes import Box, Capsule, Cone, Cylinder, Ellipsoid, Rod, Sphere
from .recording import RecordedJoint, Shape, half_extent, shape_box
from .symbols import BODY_SYMBOLS, AttachedFrame, AttachedFrames, cam_outline, float_triple

if TYPE_CHECKING:
    from ..results.result import Result


PLANE_TOLERANCE = (
    1e-3  # relative singular value below which a cell's planes do not determine a direction; the middle is used then
)


def simplify_mesh(vertices: np.ndarray, triangles: np.ndarray, most: int) -> tuple[np.ndarray, np.ndarray]:
    """A mesh of about the same shape with few triangles.

    Parameters
    ----------
    vertices : ndarray (k, 3) [m]
    triangles : ndarray (m, 3) of int
    most : int
        Largest number of triangles; a mesh with no more is unchanged.

    Returns
    -------
    vertices, triangles : ndarray
        Only vertices that are used; equal ones are one.
    """
    vertices, triangles = _weld_vertices(np.asarray(vertices, float), np.asarray(triangles, np.int64))
    if len(triangles) <= most:
        return vertices, triangles
    low = vertices.min(axis=0)
    extent = float((vertices.max(axis=0) - low).max())
    coarse, fine = 1, 1024  # number of cells along the longest side
    while fine - coarse > 1:
        middle = (coarse + fine) // 2
        cells = _cell_numbers(vertices - low, extent / middle)
        if _spans_three_cells(cells, triangles).sum() <= most:
            coarse = middle
        else:
            fine = middle
    cells = _cell_numbers(vertices - low, extent / coarse)
    points = _cell_vertices(vertices, triangles, cells, extent / coarse)
    return _weld_vertices(points, cells[triangles[_spans_three_cells(cells, triangles)]])


def _weld_vertices(vertices: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Merge equal vertices; remove unused ones and empty or repeated triangles."""
    used, index = np.unique(triangles, return_inverse=True)
    points, same = np.unique(vertices[used], axis=0, return_inverse=True)
    t = same.reshape(-1)[index.reshape(triangles.shape)]
    t = t[_spans_three_cells(np.arange(len(points)), t)]
    first = np.unique(np.sort(t, axis=1), axis=0, return_index=True)[1]
    t = t[np.sort(first)]
    used, index = np.unique(t, return_inverse=True)
    return points[used], index.reshape(-1, 3)


def _cell_numbers(p: np.ndarray, edge: float) -> np.ndarray:
    """Return the number of each point's cell, counted over non-empty cells."""
    k = (p / edge).astype(np.int64)
    n = k.max(axis=0) + 1
    return np.unique((k[:, 0] * n[1] + k[:, 1]) * n[2] + k[:, 2], return_inverse=True)[1].reshape(-1)


def _spans_three_cells(cells: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Return which triangles have their corners in three cells."""
    a, b, c = cells[triangles].T
    return (a != b) & (b != c) & (c != a)


def _cell_vertices(vertices: np.ndarray, triangles: np.ndarray, cells: np.ndarray, edge: float) -> np.ndarray:
    """Return for each cell the point in it with the least sum of squared distances from its triangles' planes."""
    count = int(cells.max()) + 1
    number = np.bincount(cells, minlength=count)
    middle = np.stack([np.bincount(cells, vertices[:, i], count) for i in range(3)], axis=1) / number[:, None]
    p, q, r = (vertices[triangles[:, k]] for k in range(3))
    normal = np.cross(q - p, r - p)  # its length weights a triangle by its area
    A, b = np.zeros((count, 3, 3)), np.zeros((count, 3))
    for k in range(3):
        home = cells[triangles[:, k]]
        height = np.einsum("ij,ij->i", normal, p - middle[home])
        np.add.at(A, home, normal[:, :, None] * normal[:, None, :])
        np.add.at(b, home, normal * height[:, None])
    w, V = np.linalg.eigh(A)
    firm = w > PLANE_TOLERANCE * w[:, -1:]
    inverse = np.where(firm, 1.0 / np.where(firm, w, 1.0), 0.0)
    shift = np.einsum("nij,nj,nkj,nk->ni", V, inverse, V, b)
    far = np.abs(shift).max(axis=1) > edge  # an intersection of planes outside the cell is meaningless
    shift[far] = 0.0
    return middle + shift


HELD_AT_POINT = ("revolute", "spherical", "universal", "fixed", "point_on_line", "point_in_plane", "link", "bushing")
"""Joints that hold both bodies at a point; elsewhere the place of a frame along a guide is arbitrary."""
MIN_GAP = 0.09  # distance of a joint from a shape that a link spans, relative to the mechanism's typical length
LINK_RADIUS = 0.045  # radius of a link, relative to the mechanism's typical length
MAX_TRIANGLES = 24_000  # number of triangles of all meshes of a recording
MIN_MESH_TRIANGLES = 300  # number of triangles that a mesh keeps in any case
MIN_VISIBLE = 0.012  # half the size of a body without a shape of its own, relative to the extent of the motion
MIN_SYMBOL_SCALE = 0.5  # size of a symbol on slender parts, relative to its usual size


class BodyShapes:
    """Shapes of every body, in the axes and from the origin of its reference frame.

    Attributes
    ----------
    size : float
        A typical length of the mechanism's parts [m].
    """

    def __init__(self, result: Result, places: AttachedFrames) -> None:
        self.result, self.places = result, places
        self.planar = result.planar
        self._env = dict(zip(result.model.parameters, result.values.system.const.tolist(), strict=False))
        self._solids = {b.name: b.shapes() for b in result.model.bodies}
        self._numbers = {id(s): resolve(s, self._env) for solids in self._solids.values() for s in solids}
        self._share = self._mesh_share()
        self.points: dict[str, list[np.ndarray]] = {b.name: [] for b in result.model.bodies}
        self.blocks: dict[str, list[AttachedFrame]] = {b.name: [] for b in result.model.bodies}
        self.cams: dict[str, list[Any]] = {b.name: [] for b in result.model.bodies}
        self.held: dict[str, list[np.ndarray]] = {b.name: [] for b in result.model.bodies}
        self.shown_by_symbol: set[str] = set()  # bodies represented by a symbol such as a gear wheel
        self.racks: dict[str, Shape] = {}  # boxes around racks
        for e in (*result.model.joints, *result.model.forces):
            self._attach(e)
        reach = {name: self._reach(name) for name in self.points}
        known = [r for r in reach.values() if r > 0.0]
        self.size = float(np.median(known)) if known else result.values.length

    def _attach(self, e: Any) -> None:
        """Store an element's points on its bodies; for a slide, the block on one and the guide's ends on the other."""
        ends = self.places.ends(e)
        if ends is None:
            k = 0
            while (end := self.places.end(e.name, f"P{k}")) is not None:
                self._add(end.body, end.p)
                k += 1
            return
        if e.symbol == "prismatic":
            self._slide(ends)
            return
        guide, runner = ends
        for end in ends if e.symbol in HELD_AT_POINT else ():
            if end.body in self.held and not (e.symbol == "point_on_line" and end is guide):
                self.held[end.body].append(end.p)
        if e.symbol == "cam" and not guide.grounded:
            self.cams[guide.body].append(e)
        if e.symbol in ("point_on_line", "screw") and not guide.grounded:
            reach = self.places.reach(guide, runner)
            for d in reach[4:]:
                self._add(guide.body, guide.p + d * guide.R[:, 2])
        elif e.symbol not in ("planar", "point_in_plane", "rolling", "cam"):
            self._add(guide.body, guide.p)
        self._add(runner.body, runner.p)

    def _slide(self, ends: tuple[AttachedFrame, AttachedFrame]) -> None:
        guide, block = ends if not ends[1].grounded else ends[::-1]
        self.blocks[block.body].append(block)
        if not guide.grounded:
            reach = self.places.reach(guide, block)
            for d in (min(reach[4], 0.0), max(reach[5], 0.0)):
                self._add(guide.body, guide.p + d * guide.R[:, 2])
        self._add(block.body, block.p)

    def _add(self, body: str, p: np.ndarray) -> None:
        if body not in self.points:
            return
        near = 1e-6 * self.result.values.length
        if np.isfinite(p).all() and all(np.abs(p - other).max() > near for other in self.points[body]):
            self.points[body].append(p)

    def _mass(self, name: str) -> tuple[np.ndarray, np.ndarray, float]:
        """Return centre of mass, inertia and mass of a body; 1 kg, without inertia, if it has none."""
        b = self.result.values.bodies[name]
        return b.com.real, np.asarray(b.inertia).real, float(np.real(b.mass)) or 1.0

    def _reach(self, name: str) -> float:
        """Return the length of a body, from its known points."""
        points = [*self.points[name], self._mass(name)[0]]
        if len(self.points[name]) == 1:
            com, J, m = self._mass(name)
            points.append(com + _unit_vector(com - points[0]) * np.sqrt(3.0 * J[2, 2] / m))
        if not self.points[name]:
            return float(np.sqrt(6.0 * np.trace(self._mass(name)[1]) / self._mass(name)[2]))
        a = np.array(points)
        return float(np.sqrt(((a[:, None] - a[None]) ** 2).sum(axis=2)).max())

    def given(self, name: str) -> bool:
        """Return whether the user gave the body a shape."""
        return bool(self._solids.get(name))

    def fit_symbol(self, symbol: RecordedJoint) -> RecordedJoint | None:
        """Return a joint's symbol as drawn: smaller on slender parts, and none if the body has its own shape."""
        if symbol.kind in BODY_SYMBOLS:
            if self.given(symbol.body):
                return None
            self.shown_by_symbol.add(symbol.body)
            if symbol.kind == "rack":
                self.racks[symbol.body] = _rack_box(symbol)
            return symbol
        widths = [self._width(name) for name in (symbol.body, symbol.mate) if name and self.given(name)]
        if not widths:
            return symbol
        return replace(
            symbol, scale=float(np.clip(min(widths) / (2.0 * LINK_RADIUS * self.size), MIN_SYMBOL_SCALE, 1.0))
        )

    def _width(self, name: str) -> float:
        """Return the middle one of the three extents of a body's slenderest given shape [m]."""
        out = []
        solids: tuple[Any, ...] = self._solids[name]
        for s in solids:
            if s.hole:
                continue
            n = self._numbers[id(s)]
            if _needs_mesh(s):
                extents = np.ptp(s.mesh(n)[0], axis=0).tolist()
            else:
                extents = _shape_extents("Cylinder" if isinstance(s, Rod) else type(s).__name__, s.size(n))
            out.append(float(np.median(extents)))
        return min(out, default=np.inf)

    def shapes(self, name: str) -> tuple[Shape, ...]:
        """Return the body's shapes."""
        if self.given(name):
            given = [self._given(s) for s in self._solids[name]]
            return (*given, *self._joining(given, self.held[name]))
        points = self.points[name]
        out = [self._block(end) for end in self.blocks[name] if name not in self.shown_by_symbol]
        out += self._rack_guides(name) if name in self.racks else []
        out += [shape for e in self.cams[name] for shape in self._cam(e)]
        bare = not out and name not in self.shown_by_symbol
        if len(points) >= 2:
            out += self._links(points)
        elif points and bare:
            out += self._hung(points[0], name)
        elif bare:
            out += [self._visible(self._solid(name))]
        return tuple(out)

    def _joining(self, shapes: list[Shape], points: list[np.ndarray]) -> Iterator[Shape]:
        """Return links from joints to the nearest shape, where that stands away from them."""
        for k, p in enumerate(points):
            targets = [_nearest_point(s, p) for s in shapes if not s.hole]
            gap, to = min(targets, key=lambda x: x[0], default=(0.0, p))
            if gap > MIN_GAP * self.size and all(np.abs(p - other).max() > 0.0 for other in points[:k]):
                yield replace(self._capsule(p, to, 0.6), link=True)

    def _rack_guides(self, name: str) -> Iterator[Shape]:
        """Return the blocks of a rack's guides that are not within the rack, joined to it."""
        for end in self.blocks[name]:
            if _nearest_point(self.racks[name], end.p)[0] > MIN_GAP * self.size:
                yield self._block(end)
                yield from self._joining([self.racks[name]], [end.p])

    def _mesh_share(self) -> float:
        """Return the fraction of their triangles that meshes may keep, so that the page stays small."""
        total = sum(
            len(s.mesh(self._numbers[id(s)])[1]) for solids in self._solids.values() for s in solids if _needs_mesh(s)
        )
        return min(1.0, MAX_TRIANGLES / total) if total else 1.0

    def _given(self, s: Any) -> Shape:
        """Return a shape as given by the user."""
        return shape_from_solid(s, self._numbers[id(s)], self._share)

    def _cam(self, e: Any) -> list[Shape]:
        """Return the disc bounded by a cam's outline."""
        ends = self.places.ends(e)
        n = self.result.values.numbers[e.name]
        outline = cam_outline(n)
        if outline is None or ends is None or not getattr(n, "closed", True):
            return []
        F = ends[0]
        turn = tuple(matrix_to_quaternion(F.R).tolist())
        return [
            Shape(
                "plate", (LINK_RADIUS * self.size,), float_triple(F.p), turn, tuple(map(tuple, outline[:, :2].tolist()))
            )
        ]

    def _radius(self, length: float) -> float:
        return min(LINK_RADIUS * self.size * (1.0 if self.planar else 0.7), 0.2 * length)

    def _capsule(self, a: np.ndarray, b: np.ndarray, slim: float = 1.0) -> Shape:
        d = b - a
        length = float(np.sqrt(d @ d))
        return Shape("capsule", (slim * self._radius(length), length), float_triple((a + b) / 2), _rotation_to(d))

    def _links(self, points: list[np.ndarray]) -> list[Shape]:
        """Return one link between two points (or along a line), a plate between those of a plane, else spokes."""
        a = np.array(points)
        middle = a.mean(axis=0)
        _, d, Vt = np.linalg.svd(a - middle)
        if d[1] < 0.02 * d[0]:
            along = (a - middle) @ Vt[0]
            return [self._capsule(a[along.argmin()], a[along.argmax()])]
        if self.planar:
            return [self._plate(a, np.zeros(3), np.eye(3))]
        if len(a) < 4 or d[2] < 0.02 * d[0]:
            R = np.column_stack([Vt[0], Vt[1], np.cross(Vt[0], Vt[1])])
            return [self._plate((a - middle) @ R, middle, R)]
        hub = Shape("sphere", (0.9 * self._radius(d[0]),), float_triple(middle))
        return [hub, *(self._capsule(middle, p) for p in a)]

    def _plate(self, a: np.ndarray, p: np.ndarray, R: np.ndarray) -> Shape:
        """Return the outline around points of the x-y plane of the axes R at p, with a margin for pins."""
        from scipy.spatial import ConvexHull

        r = 1.2 * LINK_RADIUS * self.size * (1.0 if self.planar else 0.8)
        turn = np.linspace(0.0, 2 * np.pi, 24, endpoint=False)
        rim = (a[:, None, :2] + r * np.stack([np.cos(turn), np.sin(turn)], axis=1)[None]).reshape(-1, 2)
        hull = rim[ConvexHull(rim).vertices]
        outline = tuple(tuple(x) for x in hull.tolist())
        return Shape("plate", (0.5 * r,), float_triple(p), tuple(matrix_to_quaternion(R).tolist()), outline)

    def _block(self, end: AttachedFrame) -> Shape:
        """Return the block of a slide, along its axis."""
        u = self.size
        edges = (0.16 * u, 0.16 * u, 0.26 * u) if not self.planar else (0.15 * u, 0.15 * u, 0.26 * u)
        return Shape("box", edges, float_triple(end.p), tuple(matrix_to_quaternion(end.R).tolist()))

    def _hung(self, p: np.ndarray, name: str) -> list[Shape]:
        """Return a body on one joint: a rod if it has a rod's inertia, else a rod and the equivalent solid."""
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

    def _visible(self, shape: Shape) -> Shape:
        """Return the shape, enlarged if it would not be seen on its way."""
        factor = MIN_VISIBLE * self._extent / half_extent(shape)
        return replace(shape, size=tuple(factor * x for x in shape.size)) if factor > 1.0 else shape

    @cached_property
    def _extent(self) -> float:
        """Return the extent of the motion [m]."""
        parts = [piece.motions.W.bodies.position.real for piece in self.result.pieces or (self.result,)]
        p = np.concatenate(parts, axis=2)
        return float(np.nanmax(np.nanmax(p, axis=(0, 2)) - np.nanmin(p, axis=(0, 2))))

    def _solid(self, name: str) -> Shape:
        """Return the homogeneous solid with the body's inertia: ball, cylinder or box; a disc in the plane."""
        com, J, m = self._mass(name)
        least = 0.08 * self.size
        if self.planar:
            if not self.points[name]:
                a = max(float(np.sqrt(6.0 * J[2, 2] / m)), least)
                return Shape("box", (a, a, 0.2 * a), float_triple(com))
            r = min(max(float(np.sqrt(2.0 * J[2, 2] / m)), least), 3.0 * self.size)
            return Shape("cylinder", (r, 0.2 * r), float_triple(com))
        w, V = np.linalg.eigh(J / m)
        if w[2] < 1e-9 * self.size**2 or w[2] - w[0] < 0.02 * w[2]:
            return Shape("sphere", (max(float(np.sqrt(2.5 * w[0])), least),), float_triple(com))
        for lone in (0, 2):
            i, j = (k for k in range(3) if k != lone)
            if abs(w[i] - w[j]) < 0.02 * w[2]:
                r = np.sqrt(2.0 * w[lone])
                length = np.sqrt(max(12.0 * w[i] - 3.0 * r * r, 0.0))
                size = max(float(r), 0.2 * least), max(float(length), 0.1 * float(r), 0.2 * least)
                return Shape("cylinder", size, float_triple(com), _rotation_to(V[:, lone]))
        edges = [float(np.sqrt(max(6.0 * (w.sum() - 2.0 * x), 0.0))) for x in w]
        V = V * np.sign(np.linalg.det(V))
        return Shape(
            "box", tuple(max(x, 0.2 * least) for x in edges), float_triple(com), tuple(matrix_to_quaternion(V).tolist())
        )


def shape_from_solid(s: Any, n: Any, share: float = 1.0) -> Shape:
    """Return a solid of the model as it is drawn; meshes keep a fraction of their triangles.

    The origin of a cone is its middle in pictures.
    """
    if _needs_mesh(s):
        v, t = s.mesh(n)
        most = max(int(share * len(t)), min(MIN_MESH_TRIANGLES, len(t)))
        v, t = simplify_mesh(v, np.asarray(t), most)
        return Shape("mesh", (), vertices=v, triangles=t, hole=s.hole)
    p, R = s.pose(n)
    if isinstance(s, Cone):
        p = p + R[:, 2] * n.height / 2
    kind = "cylinder" if isinstance(s, Rod) else type(s).__name__.lower()
    turn = tuple(matrix_to_quaternion(R).tolist())
    return Shape(kind, tuple(map(float, s.size(n))), float_triple(p), turn, hole=s.hole)


RACK_DEPTH = 4.2 / np.pi  # depth of a rack below its pitch line, in pitches


def _rack_box(symbol: RecordedJoint) -> Shape:
    """Return the box around a rack's symbol."""
    assert symbol.reach is not None
    _, pitch = symbol.size
    low, high = np.array([symbol.reach[0] - pitch, -RACK_DEPTH * pitch]), np.array([symbol.reach[1] + pitch, 0.0])
    at = np.array(symbol.position) + quaternion_to_matrix(np.array(symbol.quaternion)) @ np.r_[0.5 * (low + high), 0.0]
    return Shape("box", (*(high - low).tolist(), RACK_DEPTH * pitch), float_triple(at), symbol.quaternion)


def _nearest_point(shape: Shape, p: np.ndarray) -> tuple[float, np.ndarray]:
    """Return the distance of a point from the box around a shape, and a point in the shape near to it."""
    R, (low, high) = quaternion_to_matrix(np.array(shape.quaternion)), shape_box(shape)
    own = R.T @ (p - np.array(shape.position))
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    gap = own - np.clip(own, low, high)
    inside = np.clip(own, middle - 0.7 * half, middle + 0.7 * half)  # what is round does not fill its box
    return float(np.sqrt(gap @ gap)), np.array(shape.position) + R @ inside


def _shape_extents(kind: str, size: tuple[float, ...]) -> list[float]:
    """Return the lengths of a primitive along its own axes [m]."""
    if kind == "Box":
        return [float(x) for x in size]
    if kind == "Ellipsoid":
        return [2.0 * float(x) for x in size]
    r = float(size[0])
    length = float(size[1]) if len(size) > 1 else 2.0 * r
    return [2.0 * r, 2.0 * r, length + (2.0 * r if kind == "Capsule" else 0.0)]


def _unit_vector(d: np.ndarray) -> np.ndarray:
    size = np.sqrt(d @ d)
    return d / size if size > 0 else np.zeros(3)


def _rotation_to(d: np.ndarray) -> tuple[float, float, float, float]:
    """Return the quaternion that turns z to the direction d."""
    return tuple(matrix_to_quaternion(triad(_unit_vector(d))).tolist())  # type: ignore[return-value]


def _needs_mesh(s: Any) -> bool:
    """Return whether the player has no primitive for a shape."""
    return type(s) not in (Box, Capsule, Cone, Cylinder, Ellipsoid, Rod, Sphere)
