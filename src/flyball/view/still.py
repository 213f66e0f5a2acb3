"""A still picture of a recording as SVG: its first time, drawn with plain polygons and lines."""

from __future__ import annotations

from collections.abc import Iterator
from html import escape
from typing import NamedTuple

import numpy as np

from ..model.body import GROUND
from ..model.geometry import quaternion_to_matrix
from .outlines import Face, circle, faces, hull
from .recording import RecordedBody, RecordedJoint, RecordedLine, Recording

COLORS = ("#2f6fb7", "#e58a2b", "#2a9d83", "#c8465a", "#7d63b8", "#d9b02c", "#58b0d8", "#a2572f")  # as on the page
INK, STEEL, PAPER = "#1d2733", "#8b96a3", "#ffffff"
WIDTH, HEIGHT, EDGE = 420.0, 280.0, 24.0  # [px]
AZIMUTH, ELEVATION = np.radians(-58.0), np.radians(22.0)  # from where spatial mechanisms are seen
PIN, BLOCK = 4.5, 5.0  # radius of a hinge, half a slide's block [px]
COILS = 7
UNDRAWN = ("gear", "rack", "wheel", "ball", "roller", "plane", "rail", "cam", "knife_edge", "bushing")


class Stroke(NamedTuple):
    """Something to draw: points on the paper [m], how far it stands towards the eye, and how it looks."""

    points: np.ndarray
    depth: float
    fill: str = "none"
    stroke: str = INK
    width: float = 1.2
    closed: bool = True
    dash: str = ""
    pin: str = ""  # a symbol of fixed size at the only point: "circle", "block" or "ground"


def still(recording: Recording) -> str:
    """The picture of the first time of a recording, as the text of an SVG element."""
    eye = _eye(recording.planar)
    drawn = list(_strokes(recording, eye))
    if not drawn:
        return ""
    every = np.concatenate([s.points for s in drawn])
    low, high = every.min(axis=0), every.max(axis=0)
    extent = np.maximum(high - low, 1e-9 * max(recording.size, 1e-300))
    scale = min((WIDTH - 2 * EDGE) / extent[0], (HEIGHT - 2 * EDGE) / extent[1])
    height = min(HEIGHT, max(extent[1] * scale + 2 * EDGE, 90.0))
    middle = (low + high) / 2

    def placed(p: np.ndarray) -> np.ndarray:
        return np.array([WIDTH, height]) / 2 + (p - middle) * scale * [1.0, -1.0]

    back_to_front = sorted(drawn, key=lambda s: (bool(s.pin) and recording.planar, round(s.depth, 9)))
    body = "".join(_svg(s, placed(s.points)) for s in back_to_front)
    title = escape(f"{recording.name} as drawn")
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH:g} {height:.0f}" width="{WIDTH:g}" '
        f'height="{height:.0f}" role="img" stroke-linejoin="round" stroke-linecap="round"><title>{title}</title>'
        f'<rect width="100%" height="100%" fill="{PAPER}"/>{body}</svg>'
    )


def _eye(planar: bool) -> np.ndarray:
    """Rows: to the right, up, and towards the eye."""
    if planar:
        return np.eye(3)
    ca, sa, ce, se = np.cos(AZIMUTH), np.sin(AZIMUTH), np.cos(ELEVATION), np.sin(ELEVATION)
    toward = np.array([ca * ce, sa * ce, se])
    right = np.array([-sa, ca, 0.0])
    return np.array([right, np.cross(toward, right), toward])


def _strokes(recording: Recording, eye: np.ndarray) -> Iterator[Stroke]:
    poses = {GROUND: (np.zeros(3), np.eye(3))}
    for k, body in enumerate(recording.bodies):
        poses[body.name] = body.p[0], quaternion_to_matrix(body.q[0])
        layer = 1e-6 * k * recording.size if recording.planar else 0.0
        for stroke in _body(body, eye, COLORS[k % len(COLORS)], *poses[body.name]):
            yield stroke._replace(depth=stroke.depth + layer)
    for curve in recording.curves:
        p, R = poses[curve.body]
        seen = (p + curve.points @ R.T) @ eye.T
        yield Stroke(seen[:, :2], float(seen[:, 2].mean()), closed=curve.closed)
    for line in recording.lines:
        yield _line(line, eye, recording.size)
    for joint in recording.joints:
        yield from _joint(joint, eye, recording.size, *poses[joint.body])


def _body(body: RecordedBody, eye: np.ndarray, color: str, p: np.ndarray, R: np.ndarray) -> Iterator[Stroke]:
    for shape in body.shapes:
        for f in faces(shape, eye @ R):
            seen = (p @ eye.T) + f.points
            fill = PAPER if shape.hole else _lit(body.color or color, f)
            yield Stroke(seen[:, :2], float(seen[:, 2].mean()) + f.nearer, fill, INK, f.rim)


def _lit(color: str, face: Face) -> str:
    """The colour of a face: lighter towards the light, by mixing it with white or ink."""
    if not color.startswith("#"):
        return color
    digits = color[1:] if len(color) == 7 else "".join(2 * c for c in color[1:])
    rgb = np.array([int(digits[k : k + 2], 16) for k in (0, 2, 4)], float)
    other, part = (255.0, face.light) if face.light > 0.0 else (20.0, -face.light)
    return "#" + "".join(f"{round(c):02x}" for c in rgb + part * (other - rgb))


def _line(line: RecordedLine, eye: np.ndarray, size: float) -> Stroke:
    """A spring as a zigzag, anything else as a line."""
    seen = np.array([p[0] for p in line.points]) @ eye.T
    points, depth = seen[:, :2], float(seen[:, 2].mean())
    if line.kind == "spring":
        d = points[-1] - points[0]
        length = float(np.sqrt(d @ d))
        if length > 0.0:
            aside = np.array([-d[1], d[0]]) / length * min(0.05 * size, 0.25 * length)
            at = np.r_[0.0, 0.15, np.linspace(0.2, 0.8, 2 * COILS), 0.85, 1.0]
            swing = np.r_[0.0, 0.0, np.tile([1.0, -1.0], COILS), 0.0, 0.0]
            points = points[0] + at[:, None] * d + swing[:, None] * aside
    width, dash = {"link": (3.0, ""), "rope": (2.0, ""), "damper": (2.5, "7 4")}.get(line.kind, (1.4, ""))
    return Stroke(points, depth, width=width, closed=False, dash=dash)


def _joint(joint: RecordedJoint, eye: np.ndarray, size: float, p: np.ndarray, R: np.ndarray) -> Iterator[Stroke]:
    at = p + R @ np.array(joint.position)
    seen = eye @ at
    depth = float(seen[2]) + 0.05 * size
    if joint.kind in ("wheel", "ball", "roller", "gear") and joint.size and joint.size[0] > 0.0:
        turned = R @ quaternion_to_matrix(np.array(joint.quaternion))
        rim = (at + circle(joint.size[0]) @ turned.T) @ eye.T
        yield Stroke(hull(rim[:, :2]), float(seen[2]), width=1.6)
    if joint.kind in ("prismatic", "cylindrical", "screw", "rail", "plane"):
        axis = R @ np.array(joint.axis)
        if joint.kind == "plane":
            axis = R @ quaternion_to_matrix(np.array(joint.quaternion))[:, 0]
        reach = 0.45 * size
        ends = np.array([at - reach * axis, at + reach * axis]) @ eye.T
        yield Stroke(ends[:, :2], float(ends[:, 2].mean()) - size, "none", STEEL, 1.5, False, "5 4")
    if joint.kind not in UNDRAWN:
        if GROUND in (joint.body, joint.mate):
            yield Stroke(seen[None, :2], depth - 1e-3 * size, pin="ground")
        yield Stroke(seen[None, :2], depth, pin="block" if joint.kind in ("prismatic", "fixed") else "circle")


def _svg(s: Stroke, points: np.ndarray) -> str:
    if s.pin:
        return _symbol(s.pin, *points[0].tolist())
    dash = f' stroke-dasharray="{s.dash}"' if s.dash else ""
    shape = "polygon" if s.closed else "polyline"
    text = " ".join(f"{x:.1f},{y:.1f}" for x, y in points.tolist())
    return f'<{shape} points="{text}" fill="{s.fill}" stroke="{s.stroke}" stroke-width="{s.width:g}"{dash}/>'


def _symbol(pin: str, x: float, y: float) -> str:
    if pin == "circle":
        return f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{PIN}" fill="{PAPER}" stroke="{INK}" stroke-width="1.6"/>'
    if pin == "block":
        at = f'x="{x - BLOCK:.1f}" y="{y - BLOCK:.1f}" width="{2 * BLOCK}" height="{2 * BLOCK}"'
        return f'<rect {at} rx="1.5" fill="{PAPER}" stroke="{INK}" stroke-width="1.6"/>'
    foot, half = y + 12.0, 9.0
    ticks = "".join(f"M{x + d:.1f} {foot:.1f}l-4 5" for d in (-5.0, 0.0, 5.0, 10.0))
    path = f"M{x:.1f} {y:.1f}L{x - half:.1f} {foot:.1f}H{x + half:.1f}Z"
    return (
        f'<path d="{path}" fill="#e9edf1" stroke="{INK}" stroke-width="1.2"/>'
        f'<path d="{ticks}" fill="none" stroke="{STEEL}" stroke-width="1.1"/>'
    )
