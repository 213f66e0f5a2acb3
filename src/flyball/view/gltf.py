"""Animated scenes in glTF 2.0 (one binary file, .glb), which slides, Blender and web viewers open.

Every body is a node whose translation and rotation are keyframes at the recorded times; springs, dampers, ropes and
links are nodes that are stretched along their z axis as well. The scene is in metres and seconds. glTF has y up: a
spatial mechanism, which has z up, is turned by a root node.

Format: Khronos Group, *glTF 2.0 Specification*, 2021; chapters 3.6 (binary data), 3.7 (geometry), 3.11 (animation),
4.4 (GLB).
"""

from __future__ import annotations

import json
import struct
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..model.shapes.geometry import extrude
from .page import sign_continuous
from .recording import BODY_COLORS, RecordedBody, RecordedLine, RecordedSet, Recording, Shape

FLOAT, UNSIGNED = 5126, 5125  # component types
VERTICES, INDICES = 34962, 34963  # targets of buffer views
GLB_MAGIC, GLB_VERSION, JSON_CHUNK, BINARY_CHUNK = 0x46546C67, 2, 0x4E4F534A, 0x004E4942
ROUND, RINGS = 48, 24  # edges around an axis, and from pole to pole
COILS, COIL_POINTS, WIRE_POINTS = 8, 24, 8  # of a spring; points of a turn and of the wire's cross-section
WIRE_SHARE, WIRE_HEIGHT = 0.2, 0.05  # radius of the wire relative to the coil's, height relative to a turn's
LINE_COLOR = "#5b6770"
LINE_RADIUS = {"spring": 0.02, "damper": 0.015, "link": 0.01, "rope": 0.006, "arrow": 0.006}
"""Radius of lines, relative to the size of the mechanism."""
HOLE_COLOR = "#20262b"
Z_UP = (-np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5))  # quaternion (x, y, z, w): -90 deg about x turns z up into y up

Surface = tuple[np.ndarray, np.ndarray, np.ndarray | None]
"""Vertices (n, 3), triangles (m, 3), and normals (n, 3); without normals the faces are flat."""


def shape_surface(shape: Shape) -> Surface:
    """Return the surface of a shape in its own axes."""
    if shape.kind == "mesh":
        return np.asarray(shape.vertices, float), np.asarray(shape.triangles), None
    if shape.kind == "box":
        return _prism(0.5 * np.array(shape.size[:2]) * [[-1, -1], [1, -1], [1, 1], [-1, 1]], shape.size[2])
    if shape.kind == "plate":
        return _prism(np.array(shape.outline, float), shape.size[0])
    if shape.kind in ("sphere", "ellipsoid"):
        axes = np.array(shape.size * 3 if shape.kind == "sphere" else shape.size, float)
        a = np.linspace(-0.5 * np.pi, 0.5 * np.pi, RINGS + 1)
        vertices, triangles, normals = _revolved([np.stack([np.cos(a), np.sin(a)] * 2, axis=1)])
        assert normals is not None
        normals = normals / axes
        return vertices * axes, triangles, normals / np.linalg.norm(normals, axis=1, keepdims=True)
    r, h = shape.size
    if shape.kind == "capsule":
        a = np.linspace(0.0, 0.5 * np.pi, RINGS // 2 + 1)
        c, s = np.cos(a), np.sin(a)
        cap = np.stack([r * c, 0.5 * h + r * s, c, s], axis=1)
        return _revolved([np.concatenate([cap[::-1] * [1, -1, 1, -1], cap])])
    if shape.kind == "cone":
        slope = np.hypot(r, h)
        side = [(r, -0.5 * h, h / slope, r / slope), (0.0, 0.5 * h, h / slope, r / slope)]
        return _revolved([np.array([(0.0, -0.5 * h, 0.0, -1.0), (r, -0.5 * h, 0.0, -1.0)]), np.array(side)])
    ends = [(0.0, -0.5 * h, 0.0, -1.0), (r, -0.5 * h, 0.0, -1.0)]
    top = [(r, 0.5 * h, 0.0, 1.0), (0.0, 0.5 * h, 0.0, 1.0)]
    return _revolved([np.array(ends), np.array([(r, -0.5 * h, 1.0, 0.0), (r, 0.5 * h, 1.0, 0.0)]), np.array(top)])


def _revolved(profiles: Sequence[np.ndarray]) -> Surface:
    """Surface of revolution about z. Profiles have rows (radius, z, radial and axial part of the normal), upwards."""
    a = np.linspace(0.0, 2.0 * np.pi, ROUND + 1)
    vertices, normals, triangles = [], [], []
    first = 0
    for p in profiles:
        c, s = np.cos(a)[:, None], np.sin(a)[:, None]
        vertices.append(np.stack([c * p[:, 0], s * p[:, 0], np.broadcast_to(p[:, 1], (len(a), len(p)))], axis=2))
        normals.append(np.stack([c * p[:, 2], s * p[:, 2], np.broadcast_to(p[:, 3], (len(a), len(p)))], axis=2))
        triangles.append(first + _grid_triangles(len(a), len(p)))
        first += len(a) * len(p)
    v, n, t = (np.concatenate([x.reshape(-1, 3) for x in xs]) for xs in (vertices, normals, triangles))
    return v, _without_slivers(v, t), n


def _grid_triangles(rows: int, columns: int) -> np.ndarray:
    """Triangles of a grid of points, row by row, anticlockwise seen with rows to the right and columns up."""
    i, j = np.meshgrid(np.arange(rows - 1), np.arange(columns - 1), indexing="ij")
    k = (i * columns + j).ravel()
    return np.concatenate(
        [np.stack([k, k + columns, k + columns + 1], axis=1), np.stack([k, k + columns + 1, k + 1], axis=1)]
    )


def _without_slivers(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Leave out triangles without area, as at the poles."""
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    return triangles[area > 1e-12 * area.max(initial=0.0)]


def _prism(outline: np.ndarray, height: float) -> Surface:
    """Return the surface of a prism about the plane z = 0."""
    x, y = outline.T
    turns_left = (x * np.roll(y, -1) - np.roll(x, -1) * y).sum() > 0.0
    return *extrude(outline if turns_left else outline[::-1], height), None


def _coil(radius: float) -> Surface:
    """Return a helix of a round wire along z from 0 to 1."""
    a = np.linspace(0.0, 2.0 * np.pi * COILS, COILS * COIL_POINTS + 1)
    wire = np.linspace(0.0, 2.0 * np.pi, WIRE_POINTS + 1)
    out = radius * (1.0 + WIRE_SHARE * np.cos(wire))
    x, y = np.cos(a)[:, None] * out, np.sin(a)[:, None] * out
    # a small part of the distance of two coils is the wire's height: it is stretched with the spring along z
    z = np.broadcast_to((a / a[-1])[:, None], x.shape) + WIRE_HEIGHT / COILS * np.sin(wire)
    vertices = np.stack([x, y, z], axis=2).reshape(-1, 3)
    return vertices, _grid_triangles(len(a), len(wire)), None


class GltfScene:
    """A glTF document that is being made: its JSON tables and its binary buffer."""

    def __init__(self, t: np.ndarray, name: str, planar: bool) -> None:
        self.buffer = bytearray()
        root: dict[str, Any] = {"name": name, "children": []}
        if not planar:
            root["rotation"] = [float(x) for x in Z_UP]
        self.tables: dict[str, list[Any]] = {
            k: [] for k in ("nodes", "meshes", "materials", "accessors", "bufferViews")
        }
        self.tables["nodes"].append(root)
        self.samplers: list[dict[str, Any]] = []
        self.channels: list[dict[str, Any]] = []
        self.moves = len(t) > 1 and t[-1] > t[0]
        times = (t - t[0]).astype(np.float32)  # must ascend strictly as they are written
        self.rows = np.unique(times, return_index=True)[1] if self.moves else np.array([0])
        self.times = self._accessor(times[self.rows], bounds=True) if self.moves else -1
        self._materials: dict[str, int] = {}

    def _accessor(self, data: np.ndarray, target: int | None = None, bounds: bool = False) -> int:
        """Append an array to the buffer; returns the number of its accessor."""
        view: dict[str, Any] = {"buffer": 0, "byteOffset": len(self.buffer), "byteLength": data.nbytes}
        if target is not None:
            view["target"] = target
        self.buffer += np.ascontiguousarray(data).tobytes()  # all entries have four bytes: no padding is needed
        self.tables["bufferViews"].append(view)
        kinds = {1: "SCALAR", 3: "VEC3", 4: "VEC4"}
        width = 1 if data.ndim == 1 else data.shape[1]
        made = {
            "bufferView": len(self.tables["bufferViews"]) - 1,
            "componentType": UNSIGNED if data.dtype == np.uint32 else FLOAT,
            "count": len(data),
            "type": kinds[width],
        }
        if bounds:
            rows = data.reshape(len(data), -1)
            made |= {"min": rows.min(axis=0).tolist(), "max": rows.max(axis=0).tolist()}
        self.tables["accessors"].append(made)
        return len(self.tables["accessors"]) - 1

    def material(self, color: str) -> int:
        """Return the number of the material of a colour such as ``"#5b6770"``."""
        if color not in self._materials:
            self._materials[color] = len(self.tables["materials"])
            linear = ((np.array(_rgb(color)) / 255.0) ** 2.2).tolist()  # colours of materials are linear
            factor = {"baseColorFactor": [*linear, 1.0], "metallicFactor": 0.1, "roughnessFactor": 0.7}
            self.tables["materials"].append({"pbrMetallicRoughness": factor, "doubleSided": True})
        return self._materials[color]

    def mesh(self, surfaces: Sequence[tuple[Surface, str]], name: str) -> int:
        """Add a mesh of surfaces with their colours; returns its number."""
        parts = []
        for (vertices, triangles, normals), color in surfaces:
            if not len(triangles):
                continue
            if normals is None:  # flat faces need vertices of their own
                vertices, triangles = vertices[triangles.ravel()], np.arange(3 * len(triangles)).reshape(-1, 3)
            attributes = {"POSITION": self._accessor(vertices.astype(np.float32), VERTICES, bounds=True)}
            if normals is not None:
                attributes["NORMAL"] = self._accessor(normals.astype(np.float32), VERTICES)
            indices = self._accessor(triangles.astype(np.uint32).ravel(), INDICES)
            parts.append({"attributes": attributes, "indices": indices, "material": self.material(color)})
        self.tables["meshes"].append({"primitives": parts, "name": name})
        return len(self.tables["meshes"]) - 1

    def node(self, name: str, mesh: int, p: np.ndarray, q: np.ndarray, scale: np.ndarray | None = None) -> None:
        """Add a moving node: positions (n, 3), orientations (n, 4) scalar first, and scales (n, 3)."""
        at = len(self.tables["nodes"])
        turned = np.roll(sign_continuous(q), -1, axis=1)
        paths = {"translation": p, "rotation": turned} | ({} if scale is None else {"scale": scale})
        rest = {path: x[0].astype(np.float32).tolist() for path, x in paths.items()}
        self.tables["nodes"].append({"name": name, "mesh": mesh, **rest})
        self.tables["nodes"][0]["children"].append(at)
        for path, x in paths.items():
            if self.moves and (x != x[0]).any():
                output = self._accessor(x[self.rows].astype(np.float32))
                self.samplers.append({"input": self.times, "output": output, "interpolation": "LINEAR"})
                self.channels.append({"sampler": len(self.samplers) - 1, "target": {"node": at, "path": path}})

    def binary(self) -> bytes:
        """Return the document as a GLB file."""
        document: dict[str, Any] = {
            "asset": {"version": "2.0", "generator": "flyball"},
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            **{name: table for name, table in self.tables.items() if table},
        }
        if self.channels:
            document["animations"] = [{"name": "motion", "samplers": self.samplers, "channels": self.channels}]
        if self.buffer:
            document["buffers"] = [{"byteLength": len(self.buffer)}]
        text = json.dumps(document, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        chunks = [(JSON_CHUNK, text)] + ([(BINARY_CHUNK, bytes(self.buffer))] if self.buffer else [])
        body = b"".join(struct.pack("<II", len(data), kind) + data for kind, data in chunks)
        return struct.pack("<III", GLB_MAGIC, GLB_VERSION, 12 + len(body)) + body


def _rgb(color: str) -> list[int]:
    from matplotlib.colors import to_rgb

    return [round(255 * x) for x in to_rgb(color)]


def gltf_scene(recording: Recording) -> bytes:
    """Return a recording as an animated scene, the content of a .glb file."""
    scene = GltfScene(np.asarray(recording.t, float), recording.name, recording.planar)
    for k, body in enumerate(recording.bodies):
        _add_body(scene, body, BODY_COLORS[k % len(BODY_COLORS)])
    for many in recording.sets:
        _add_set(scene, many)
    for line in recording.lines:
        _add_line(scene, line, recording.size)
    return scene.binary()


def _placed(shape: Shape) -> Surface:
    """Return a shape's surface in the axes of its body."""
    vertices, triangles, normals = shape_surface(shape)
    R = _rotation(np.array(shape.quaternion))
    return vertices @ R.T + np.array(shape.position), triangles, None if normals is None else normals @ R.T


def _rotation(q: np.ndarray) -> np.ndarray:
    from ..model.geometry import quaternion_to_matrix

    return quaternion_to_matrix(q)


def _add_body(scene: GltfScene, body: RecordedBody, color: str) -> None:
    if not body.shapes:
        return
    own = [(_placed(s), HOLE_COLOR if s.hole else body.color or color) for s in body.shapes]
    own = [part for part in own if len(part[0][1])]
    if not own:
        return
    scene.node(body.name, scene.mesh(own, body.name), body.p, body.q)


def _add_set(scene: GltfScene, many: RecordedSet) -> None:
    colors = many.colors or (BODY_COLORS[0],)
    meshes = [scene.mesh([(_placed(s), color) for s in many.shapes], many.name) for color in colors]
    for k in range(many.p.shape[1]):
        p, q = many.p[:, k], many.q[:, k]
        if not np.isfinite(p).all():
            continue
        size = None if many.scale is None else np.tile(many.scale[k], (len(p), 3))
        scene.node(f"{many.name}[{k}]", meshes[k % len(meshes)], p, q, size)


def _add_line(scene: GltfScene, line: RecordedLine, size: float) -> None:
    radius = line.radius or LINE_RADIUS[line.kind] * size
    if line.kind == "spring":
        surface = _coil(radius)
    else:
        v, t, n = shape_surface(Shape("cylinder", (radius, 1.0)))
        surface = v + np.array([0.0, 0.0, 0.5]), t, n
    mesh = scene.mesh([(surface, LINE_COLOR)], line.name)
    for a, b in zip(line.points, line.points[1:], strict=False):
        way = np.asarray(b, float) - a
        length = np.linalg.norm(way, axis=1)
        if not (length > 0.0).all():
            continue
        scene.node(line.name, mesh, np.asarray(a, float), _towards(way / length[:, None]),
                   np.column_stack([np.ones((len(way), 2)), length]))  # fmt: skip


def _towards(direction: np.ndarray) -> np.ndarray:
    """Return rotations (n, 4), scalar first, of z onto unit vectors (n, 3)."""
    x, y, z = direction.T
    half = np.sqrt(np.maximum(0.5 * (1.0 + z), 0.0))
    q = np.stack([half, -y, x, np.zeros_like(z)], axis=1)
    q[:, 1:] /= np.maximum(2.0 * half, 1e-9)[:, None]
    q[half < 1e-9] = (0.0, 1.0, 0.0, 0.0)  # against z: half a turn about x
    return q / np.linalg.norm(q, axis=1, keepdims=True)
