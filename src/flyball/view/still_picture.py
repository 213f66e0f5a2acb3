"""Still pictures: a scene in polygons and lines at one of its times, from back to front, and as SVG."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from html import escape
from typing import NamedTuple

import numpy as np

from ..model.body import GROUND
from ..model.geometry import quaternion_to_matrix
from .body_shapes import simplify_mesh
from .recording import (
    BODY_COLORS,
    RecordedBody,
    RecordedJoint,
    RecordedLine,
    Recording,
    Shape,
    scaled_shape,
)

CIRCLE_POINTS = 40  # points of a circle
MAX_STILL_TRIANGLES = 300  # of a mesh
LIGHT_DIRECTION = np.array([-0.35, 0.75, 0.56])  # towards the light, as seen
THIN_EDGE, NORMAL_EDGE = 0.4, 1.2  # width of an edge [px]


class Face(NamedTuple):
    """A visible polygon: points (k, 3), lightness (-1 to 1), depth before its middle [m], edge width [px]."""

    points: np.ndarray
    light: float = 0.0
    nearer: float = 0.0
    rim: float = NORMAL_EDGE


def circle_points(radius: float, at: float = 0.0) -> np.ndarray:
    """Return points of a circle about z, at a height."""
    turn = np.linspace(0.0, 2.0 * np.pi, CIRCLE_POINTS, endpoint=False)
    return np.column_stack([radius * np.cos(turn), radius * np.sin(turn), np.full(CIRCLE_POINTS, at)])


def convex_polygon(points: np.ndarray) -> np.ndarray:
    """Return the convex polygon around points of the plane (A. M. Andrew's monotone chain, 1979)."""
    ordered = sorted(set(map(tuple, np.round(points, 12).tolist())))
    half: list[list[tuple[float, ...]]] = []
    for run in (ordered, ordered[::-1]):
        out: list[tuple[float, ...]] = []
        for p in run:
            while len(out) > 1 and _cross_product(out[-2], out[-1], p) <= 0.0:
                out.pop()
            out.append(p)
        half.append(out[:-1])
    return np.array(half[0] + half[1] or ordered[:1])


def _cross_product(a: tuple[float, ...], b: tuple[float, ...], c: tuple[float, ...]) -> float:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def visible_faces(shape: Shape, view: np.ndarray) -> Iterator[Face]:
    """The visible faces of a shape from the body's origin; the columns of ``view`` are the body's axes as seen."""
    turn = view @ quaternion_to_matrix(np.array(shape.quaternion))
    at = view @ np.array(shape.position)
    for f in _shape_faces(shape, turn):
        yield f._replace(points=f.points + at)


def _shape_faces(shape: Shape, turn: np.ndarray) -> Iterator[Face]:
    if shape.kind == "box":
        yield from _box_faces(np.array(shape.size) / 2, turn)
    elif shape.kind in ("mesh", "plate"):
        yield from _plate_faces(shape, turn) if shape.kind == "plate" else _mesh_faces(shape, turn)
    elif shape.kind in ("sphere", "ellipsoid"):
        half = np.array(shape.size if shape.kind == "ellipsoid" else shape.size * 3)
        flat = turn[:2] * half  # x = turn half u with |u| = 1 is seen as the ellipse L u, L L^T = flat flat^T
        outline = circle_points(1.0)[:, :2] @ np.linalg.cholesky(flat @ flat.T).T
        yield Face(np.column_stack([outline, np.zeros(len(outline))]))
    elif shape.kind == "capsule":
        radius, length = shape.size
        ends = np.array([[0.0, 0.0, -length / 2], [0.0, 0.0, length / 2]]) @ turn.T
        yield _silhouette(np.concatenate([circle_points(radius) + end for end in ends]))
    elif shape.kind in ("cylinder", "cone"):
        yield from _round_faces(shape, turn)


def _silhouette(points: np.ndarray, light: float = 0.0) -> Face:
    outline = convex_polygon(points[:, :2])
    return Face(np.column_stack([outline, np.full(len(outline), points[:, 2].mean())]), light)


def _lightness(normal: np.ndarray) -> float:
    return float(np.clip(0.45 * (normal @ LIGHT_DIRECTION), -0.35, 0.45))


def _box_faces(half: np.ndarray, turn: np.ndarray) -> Iterator[Face]:
    for axis in range(3):
        for side in (-1.0, 1.0):
            normal = side * turn[:, axis]
            if normal[2] > 1e-9:
                i, j = (k for k in range(3) if k != axis)
                corners = np.zeros((4, 3))
                corners[:, axis] = side * half[axis]
                corners[:, i], corners[:, j] = half[i] * np.array([1, -1, -1, 1]), half[j] * np.array([1, 1, -1, -1])
                flat = abs(normal[2] - 1.0) < 1e-9  # seen from the front: nothing else is visible
                yield Face(corners @ turn.T, 0.0 if flat else _lightness(normal))


def _round_faces(shape: Shape, turn: np.ndarray) -> Iterator[Face]:
    """Return the faces of a cylinder or a cone: its outline, and the cap towards the viewer."""
    radius, length = shape.size
    low, high = circle_points(radius, -length / 2), circle_points(radius, length / 2)
    tip = high if shape.kind == "cylinder" else np.array([[0.0, 0.0, length / 2]])
    yield _silhouette(np.concatenate([low, tip]) @ turn.T)
    toward = turn[2, 2]
    for cap, side in ((low, -1.0), (high, 1.0)):
        if side * toward > 1e-6 and (side < 0.0 or shape.kind == "cylinder") and abs(toward) < 1.0 - 1e-9:
            yield Face(cap @ turn.T, 0.3, length)


def _plate_faces(shape: Shape, turn: np.ndarray) -> Iterator[Face]:
    thick = shape.size[0] if shape.size else 0.0
    flat = np.array(shape.outline)
    both = [np.column_stack([flat, np.full(len(flat), z)]) @ turn.T for z in (-thick / 2, thick / 2)]
    toward = turn[2, 2]
    if abs(toward) > 1.0 - 1e-9:
        yield Face(both[1])
        return
    yield _silhouette(np.concatenate(both), -0.15)
    yield Face(both[int(toward > 0.0)], 0.15, thick)


def coarse_shape(shape: Shape) -> Shape:
    """Return a mesh with few triangles; other shapes unchanged."""
    if shape.kind != "mesh" or len(np.asarray(shape.triangles)) <= MAX_STILL_TRIANGLES:
        return shape
    v, triangles = simplify_mesh(np.asarray(shape.vertices), np.asarray(shape.triangles), MAX_STILL_TRIANGLES)
    return replace(shape, vertices=v, triangles=triangles)


def _mesh_faces(shape: Shape, turn: np.ndarray) -> Iterator[Face]:
    shape = coarse_shape(shape)
    corners = (np.asarray(shape.vertices) @ turn.T)[np.asarray(shape.triangles)]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    sizes = np.sqrt((normals**2).sum(axis=1))
    for points, normal, size in zip(corners, normals, sizes, strict=True):
        if normal[2] > 0.0:
            yield Face(points, _lightness(normal / size), rim=THIN_EDGE)


INK_COLOR, GUIDE_COLOR, PAPER_COLOR = "#1d2733", "#8b96a3", "#ffffff"
PICTURE_WIDTH, PICTURE_HEIGHT, PICTURE_MARGIN = 420.0, 280.0, 24.0  # [px]
AZIMUTH, ELEVATION = np.radians(-58.0), np.radians(22.0)  # view direction of spatial mechanisms
PIN_RADIUS, BLOCK_HALF_SIZE = 4.5, 5.0  # radius of a hinge, half a slide's block [px]
SPRING_COILS = 7
UNMARKED_SYMBOLS = ("gear", "rack", "wheel", "ball", "roller", "plane", "rail", "cam", "knife_edge", "bushing")


class Stroke(NamedTuple):
    """An object to draw: points on the paper [m], depth towards the viewer, and style."""

    points: np.ndarray
    depth: float
    fill: str = "none"
    stroke: str = INK_COLOR
    width: float = 1.2
    closed: bool = True
    dash: str = ""
    pin: str = ""  # a symbol of fixed size at a single point: "circle", "block" or "ground"


def still_svg(recording: Recording, title: str = "") -> str:
    """Return the picture of the first time of a recording, as the text of an SVG element; with a title for readers."""
    drawn = scene_strokes(recording)
    if not drawn:
        return ""
    every = np.concatenate([s.points for s in drawn])
    low, high = every.min(axis=0), every.max(axis=0)
    extent = np.maximum(high - low, 1e-9 * max(recording.size, 1e-300))
    scale = min((PICTURE_WIDTH - 2 * PICTURE_MARGIN) / extent[0], (PICTURE_HEIGHT - 2 * PICTURE_MARGIN) / extent[1])
    height = min(PICTURE_HEIGHT, max(extent[1] * scale + 2 * PICTURE_MARGIN, 90.0))
    middle = (low + high) / 2

    def placed(p: np.ndarray) -> np.ndarray:
        return np.array([PICTURE_WIDTH, height]) / 2 + (p - middle) * scale * [1.0, -1.0]

    body = "".join(_stroke_svg(s, placed(s.points)) for s in drawn)
    title = escape(title or f"{recording.name} in the reference configuration")
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {PICTURE_WIDTH:g} {height:.0f}" '
        f'width="{PICTURE_WIDTH:g}" '
        f'height="{height:.0f}" role="img" stroke-linejoin="round" stroke-linecap="round"><title>{title}</title>'
        f'<rect width="100%" height="100%" fill="{PAPER_COLOR}"/>{body}</svg>'
    )


def _view_axes(planar: bool) -> np.ndarray:
    """Rows: to the right, up, and towards the eye."""
    if planar:
        return np.eye(3)
    ca, sa, ce, se = np.cos(AZIMUTH), np.sin(AZIMUTH), np.cos(ELEVATION), np.sin(ELEVATION)
    toward = np.array([ca * ce, sa * ce, se])
    right = np.array([-sa, ca, 0.0])
    return np.array([right, np.cross(toward, right), toward])


def scene_strokes(recording: Recording, at: int = 0) -> list[Stroke]:
    """Return what is drawn of the scene at one of its times, from back to front."""
    drawn = _all_strokes(recording, _view_axes(recording.planar), at)
    return sorted(drawn, key=lambda s: (bool(s.pin) and recording.planar, round(s.depth, 9)))


def _all_strokes(recording: Recording, eye: np.ndarray, at: int) -> Iterator[Stroke]:
    poses = {GROUND: (np.zeros(3), np.eye(3))}
    for k, body in enumerate(recording.bodies):
        poses[body.name] = body.p[at], quaternion_to_matrix(body.q[at])
        order = k - len(recording.bodies) if body.ground else k
        layer = 1e-6 * order * recording.size if recording.planar else 0.0
        for stroke in _body_strokes(body, eye, BODY_COLORS[k % len(BODY_COLORS)], *poses[body.name]):
            yield stroke._replace(depth=stroke.depth + layer)
    for curve in recording.curves:
        p, R = poses[curve.body]
        seen = (p + curve.points @ R.T) @ eye.T
        yield Stroke(seen[:, :2], float(seen[:, 2].mean()), closed=curve.closed)
    for line in recording.lines:
        yield _line_stroke(line, eye, recording.size, at)
    for many in recording.sets:
        for k, (p, q) in enumerate(zip(many.p[at], many.q[at], strict=True)):
            if np.isfinite(p).all():
                size = 1.0 if many.scale is None else float(many.scale[k])
                shapes = many.shapes if size == 1.0 else tuple(scaled_shape(s, size) for s in many.shapes)
                member = RecordedBody(many.name, shapes, p[None], q[None])
                color = (many.colors or BODY_COLORS)[k % len(many.colors or BODY_COLORS)]
                yield from _body_strokes(member, eye, color, p, quaternion_to_matrix(q))
    for joint in recording.joints:
        yield from _joint_strokes(joint, eye, recording.size, *poses[joint.body])


def _body_strokes(body: RecordedBody, eye: np.ndarray, color: str, p: np.ndarray, R: np.ndarray) -> Iterator[Stroke]:
    for shape in body.shapes:
        for f in visible_faces(shape, eye @ R):
            seen = (p @ eye.T) + f.points
            fill = PAPER_COLOR if shape.hole else _face_color(body.color or color, f)
            yield Stroke(seen[:, :2], float(seen[:, 2].mean()) + f.nearer, fill, INK_COLOR, f.rim)


def _face_color(color: str, face: Face) -> str:
    """Return the colour of a face, shaded by mixing it with white or ink."""
    if not color.startswith("#"):
        return color
    digits = color[1:] if len(color) == 7 else "".join(2 * c for c in color[1:])
    rgb = np.array([int(digits[k : k + 2], 16) for k in (0, 2, 4)], float)
    other, part = (255.0, face.light) if face.light > 0.0 else (20.0, -face.light)
    return "#" + "".join(f"{round(c):02x}" for c in rgb + part * (other - rgb))


def _line_stroke(line: RecordedLine, eye: np.ndarray, size: float, time: int) -> Stroke:
    """Return a spring as a zigzag, anything else as a line."""
    seen = np.array([p[time] for p in line.points]) @ eye.T
    points, depth = seen[:, :2], float(seen[:, 2].mean())
    if line.kind == "spring":
        d = points[-1] - points[0]
        length = float(np.sqrt(d @ d))
        if length > 0.0:
            aside = np.array([-d[1], d[0]]) / length * min(0.05 * size, 0.25 * length)
            at = np.r_[0.0, 0.15, np.linspace(0.2, 0.8, 2 * SPRING_COILS), 0.85, 1.0]
            swing = np.r_[0.0, 0.0, np.tile([1.0, -1.0], SPRING_COILS), 0.0, 0.0]
            points = points[0] + at[:, None] * d + swing[:, None] * aside
    width, dash = {"link": (3.0, ""), "rope": (2.0, ""), "damper": (2.5, "7 4")}.get(line.kind, (1.4, ""))
    return Stroke(points, depth, width=width, closed=False, dash=dash)


def _joint_strokes(
    joint: RecordedJoint, eye: np.ndarray, size: float, p: np.ndarray, R: np.ndarray
) -> Iterator[Stroke]:
    at = p + R @ np.array(joint.position)
    seen = eye @ at
    depth = float(seen[2]) + 0.05 * size
    if joint.kind in ("wheel", "ball", "roller", "gear") and joint.size and joint.size[0] > 0.0:
        turned = R @ quaternion_to_matrix(np.array(joint.quaternion))
        rim = (at + circle_points(joint.size[0]) @ turned.T) @ eye.T
        yield Stroke(convex_polygon(rim[:, :2]), float(seen[2]), width=1.6)
    if joint.kind in ("prismatic", "cylindrical", "screw", "rail", "plane"):
        axis = R @ np.array(joint.axis)
        if joint.kind == "plane":
            axis = R @ quaternion_to_matrix(np.array(joint.quaternion))[:, 0]
        reach = 0.45 * size
        ends = np.array([at - reach * axis, at + reach * axis]) @ eye.T
        yield Stroke(ends[:, :2], float(ends[:, 2].mean()) - size, "none", GUIDE_COLOR, 1.5, False, "5 4")
    if joint.kind not in UNMARKED_SYMBOLS:
        if GROUND in (joint.body, joint.mate):
            yield Stroke(seen[None, :2], depth - 1e-3 * size, pin="ground")
        yield Stroke(seen[None, :2], depth, pin="block" if joint.kind in ("prismatic", "fixed") else "circle")


def _stroke_svg(s: Stroke, points: np.ndarray) -> str:
    if s.pin:
        return _pin_svg(s.pin, *points[0].tolist())
    dash = f' stroke-dasharray="{s.dash}"' if s.dash else ""
    shape = "polygon" if s.closed else "polyline"
    text = " ".join(f"{x:.1f},{y:.1f}" for x, y in points.tolist())
    return f'<{shape} points="{text}" fill="{s.fill}" stroke="{s.stroke}" stroke-width="{s.width:g}"{dash}/>'


def _pin_svg(pin: str, x: float, y: float) -> str:
    if pin == "circle":
        return (
            f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{PIN_RADIUS}" fill="{PAPER_COLOR}" '
            f'stroke="{INK_COLOR}" stroke-width="1.6"/>'
        )
    if pin == "block":
        at = (
            f'x="{x - BLOCK_HALF_SIZE:.1f}" y="{y - BLOCK_HALF_SIZE:.1f}" width="{2 * BLOCK_HALF_SIZE}" '
            f'height="{2 * BLOCK_HALF_SIZE}"'
        )
        return f'<rect {at} rx="1.5" fill="{PAPER_COLOR}" stroke="{INK_COLOR}" stroke-width="1.6"/>'
    foot, half = y + 12.0, 9.0
    ticks = "".join(f"M{x + d:.1f} {foot:.1f}l-4 5" for d in (-5.0, 0.0, 5.0, 10.0))
    path = f"M{x:.1f} {y:.1f}L{x - half:.1f} {foot:.1f}H{x + half:.1f}Z"
    return (
        f'<path d="{path}" fill="#e9edf1" stroke="{INK_COLOR}" stroke-width="1.2"/>'
        f'<path d="{ticks}" fill="none" stroke="{GUIDE_COLOR}" stroke-width="1.1"/>'
    )
