"""The animation page: a recording packed into one self-contained HTML document that needs no network.

The payload is a JSON header, then one block of numbers. Poses, points and curves are float32, times float64,
corners of triangles integers. Arrays lie column by column with their bytes shuffled (all first bytes, then all
second bytes, ...), which makes smooth motions much smaller once compressed. Equal arrays are stored once.

Poses of sets of bodies and contact forces are stored as small integers. Positions are steps of a grid; orientations are
rotation vectors in steps of 2 pi / 65535; forces are square roots of their fractions of the largest one. Poses are
stored as differences from the time before, modulo the width of the integer: a body at rest needs almost no space once
compressed. The page decodes them in `packed.js` and `touches.js`.
"""

from __future__ import annotations

import base64
import gzip
import html
import json
import re
import struct
from collections.abc import Iterable
from dataclasses import asdict
from functools import cache
from importlib.resources import files
from typing import Any

import numpy as np

from .recording import Channel, Compared, RecordedContacts, RecordedSet, Recording, Shape, check_recording, half_extent


def fill_template(template: str, parts: dict[str, str]) -> str:
    """Return the template with its marks replaced in one pass: inserted text is not searched again."""
    return re.sub(r"\{\{(\w+)\}\}", lambda match: parts.get(match[1], match[0]), template)


@cache
def static(name: str) -> str:
    """Return the text of a file in ``static/``."""
    return files(__package__).joinpath("static", name).read_text(encoding="utf-8")


POSITION_STEP = 1e-3  # step of positions relative to the size of a body: less than a pixel
RANGE_16_BIT, RANGE_32_BIT = 2**16, 2**32
NOT_DRAWN = 0  # marker in x: this body is not drawn


def pack_positions(p: np.ndarray, size: float) -> tuple[np.ndarray, dict[str, object]]:
    """Encode positions (n, m, 3) as differences on a grid that is fine relative to the bodies' size.

    Return integers, time by time, x of all, then y, then z; and the decoding data ``low``, ``step``, ``type``.
    """
    gone = ~np.isfinite(p).all(axis=2)
    inside = p[~gone]
    low = inside.min(axis=0) if len(inside) else np.zeros(3)
    extent = float((inside.max(axis=0) - low).max()) if len(inside) else 0.0
    step = max(POSITION_STEP * size, extent / (RANGE_32_BIT - 3.0))
    kind = "u2" if extent / step < RANGE_16_BIT - 2.0 else "u4"
    grid = np.rint(np.where(gone[:, :, None], 0.0, p - low) / step) + 1.0
    grid[gone] = NOT_DRAWN
    about = {"low": [float(x) for x in low - step], "step": step}
    return _time_differences(grid.astype(np.int64), RANGE_32_BIT if kind == "u4" else RANGE_16_BIT), about | {
        "type": kind
    }


def pack_orientations(q: np.ndarray) -> np.ndarray:
    """Encode quaternions (n, m, 4) as differences of rotation vectors, as for `pack_positions`."""
    q = np.where(np.isfinite(q).all(axis=2)[:, :, None], q, (1.0, 0.0, 0.0, 0.0))
    q = q * np.where(q[:, :, :1] < 0.0, -1.0, 1.0)
    sine = np.sqrt((q[:, :, 1:] ** 2).sum(axis=2))
    angle = 2.0 * np.arctan2(sine, q[:, :, 0])
    per = np.where(sine > 1e-12, angle / np.maximum(sine, 1e-12), 2.0)
    turn = q[:, :, 1:] * per[:, :, None]
    return _time_differences(np.rint(turn * ((RANGE_16_BIT - 1) / (2.0 * np.pi))).astype(np.int64), RANGE_16_BIT)


def _time_differences(grid: np.ndarray, width: int) -> np.ndarray:
    """Return the difference of each time from the one before, components of all bodies one after the other."""
    change = np.diff(grid, axis=0, prepend=np.zeros_like(grid[:1])) % width
    return change.transpose(0, 2, 1).reshape(-1)


def pack_forces(force: np.ndarray) -> tuple[np.ndarray, float]:
    """Encode forces (k, 3) as integers 0 to 65534, square roots of their fractions of the largest; return that too."""
    force = np.where(np.isfinite(force), force, 0.0)
    largest = float(np.abs(force).max(initial=0.0))
    part = np.sign(force) * np.sqrt(np.abs(force) / largest) if largest > 0.0 else force
    return np.rint(32767.0 * (part + 1.0)).astype(np.int64), largest


ALIGNMENT = 8


class _NumberBlock:
    """Concatenated numbers; each ``add`` returns their position."""

    def __init__(self) -> None:
        self.parts: list[bytes] = []
        self.length = 0
        self.known: dict[bytes, dict[str, object]] = {}

    def add(self, values: np.ndarray, kind: str = "f4") -> dict[str, object]:
        columns = np.ascontiguousarray(np.asarray(values).astype(f"<{kind}").T).reshape(-1)
        shuffled = columns.view(np.uint8).reshape(-1, columns.itemsize).T.tobytes()
        if shuffled not in self.known:
            padded = shuffled + bytes(-len(shuffled) % ALIGNMENT)
            self.known[shuffled] = {"at": self.length, "count": columns.size, "type": kind}
            self.parts.append(padded)
            self.length += len(padded)
        reference = self.known[shuffled]
        return reference if reference["type"] == kind else reference | {"count": columns.size, "type": kind}


def pack_recording(recording: Recording) -> bytes:
    """Pack a recording for the page.

    Parameters
    ----------
    recording : Recording
        The motion; it is checked first.

    Returns
    -------
    bytes
        Length of the header (uint32, little-endian), header (UTF-8 JSON), padding to 8 bytes, numbers.
    """
    check_recording(recording)
    block = _NumberBlock()
    header = _header(recording, block)
    text = json.dumps(header, allow_nan=False, separators=(",", ":")).encode()
    head = struct.pack("<I", len(text)) + text
    return head + bytes(-len(head) % ALIGNMENT) + b"".join(block.parts)


def _header(recording: Recording, block: _NumberBlock) -> dict[str, Any]:
    """Return a recording as plain data; its numbers are added to the block."""
    return {
        "name": recording.name,
        "planar": bool(recording.planar),
        "size": float(recording.size),
        "notes": {str(term): str(text) for term, text in recording.notes.items()},
        "shown": list(recording.plotted),
        "show": list(recording.show),
        "facts": {part: list(lines) for part, lines in recording.facts.items()},
        "down": _float_list(recording.down),
        "speed": float(recording.speed),
        "remark": recording.remark,
        "t": block.add(recording.t, "f8"),
        "bodies": [
            {
                "name": b.name,
                "color": b.color,
                "opacity": float(b.opacity),
                "ground": bool(b.ground),
                "shapes": [_shape_data(s, block) for s in b.shapes],
            }
            | {"p": block.add(b.p), "q": block.add(sign_continuous(b.q))}
            for b in recording.bodies
        ],
        "sets": [_set_data(many, block) for many in recording.sets],
        "contacts": None if recording.contacts is None else _contact_data(recording.contacts, block),
        "lines": [
            {"name": line.name, "kind": line.kind, "radius": _optional_float(line.radius)}
            | {"points": [block.add(p) for p in line.points]}
            | {"rest": None if line.rest is None else block.add(line.rest)}
            for line in recording.lines
        ],
        "joints": [_attached_data(j, "kind", "mate", "reach", "size", "scale", "axis") for j in recording.joints],
        "curves": [
            {"name": c.name, "body": c.body, "closed": bool(c.closed), "points": block.add(c.points)}
            for c in recording.curves
        ],
        "arrows": [_attached_data(a, "group", "what") | {"vector": block.add(a.vector)} for a in recording.arrows],
        "frames": [_attached_data(f, "of") for f in recording.frames],
        "paths": [_attached_data(p) for p in recording.paths],
        "marks": [asdict(m) | {"t": float(m.t)} for m in recording.marks],
        "modes": [asdict(mode) for mode in recording.modes],
        "channels": _channel_data(recording.channels, block),
        "figures": [
            {"name": f.name, "title": f.title, "note": f.note}
            | {
                "panels": [
                    {"label": p.label, "note": p.note, "curves": _channel_data(p.curves, block)} for p in f.panels
                ]
            }
            for f in recording.figures
        ],
        "compared": None if recording.compared is None else _comparison_data(recording.compared, block),
    }


def _comparison_data(compared: Compared, block: _NumberBlock) -> dict[str, Any]:
    """Return what a motion is compared with, as plain data."""
    return {
        "label": compared.label,
        "others": [{"label": k, "recording": _header(r, block)} for k, r in compared.others.items()],
        "source": compared.source,
        "measured": [
            {"name": m.name, "unit": m.unit, "t": block.add(m.t, "f8"), "values": block.add(m.values)}
            for m in compared.measured
        ],
        "tables": [asdict(table) for table in compared.tables],
    }


def _optional_float(value: float | None) -> float | None:
    return None if value is None else float(value)


def _float_list(values: Iterable[float]) -> list[float]:
    return [float(value) for value in values]


def _attached_data(thing: Any, *more: str) -> dict[str, object]:
    """Return an object fixed on a body: name, body, position, and further fields."""
    out: dict[str, object] = {"name": thing.name, "body": thing.body, "position": _float_list(thing.position)}
    if hasattr(thing, "quaternion"):
        out["quaternion"] = _float_list(thing.quaternion)
    for name in more:
        value = getattr(thing, name)
        out[name] = _float_list(value) if isinstance(value, (tuple, list)) else value
    return out


def _channel_data(channels: Iterable[Channel], block: _NumberBlock) -> list[dict[str, object]]:
    return [{"name": c.name, "unit": c.unit, "values": block.add(c.values)} for c in channels]


def _shape_data(shape: Shape, block: _NumberBlock) -> dict[str, object]:
    out: dict[str, object] = {
        "kind": shape.kind,
        "size": _float_list(shape.size),
        "position": _float_list(shape.position),
    }
    out |= {"quaternion": _float_list(shape.quaternion), "outline": [_float_list(point) for point in shape.outline]}
    out |= {"hole": bool(shape.hole), "link": bool(shape.link)}
    if shape.vertices is not None and shape.triangles is not None:
        kind = "u2" if len(shape.vertices) <= 65_535 else "u4"
        return out | {"vertices": block.add(shape.vertices), "triangles": block.add(shape.triangles, kind)}
    return out


def _set_data(many: RecordedSet, block: _NumberBlock) -> dict[str, object]:
    """Return a set of bodies, with encoded poses."""
    size = min((half_extent(shape) for shape in many.shapes), default=1.0)
    size *= 1.0 if many.scale is None else float(np.min(many.scale, initial=np.inf))
    p, about = pack_positions(np.asarray(many.p, float), size)
    kind = str(about.pop("type"))
    out: dict[str, object] = {"name": many.name, "colors": list(many.colors), "count": int(np.shape(many.p)[1])}
    out["names"] = list(many.names)
    out |= {"shapes": [_shape_data(s, block) for s in many.shapes], "p": block.add(p, kind)} | about
    out["q"] = block.add(pack_orientations(np.asarray(many.q, float)), "u2")
    return out | {"scale": None if many.scale is None else block.add(many.scale)}


def _contact_data(contacts: RecordedContacts, block: _NumberBlock) -> dict[str, object]:
    """Return contact forces, each component separately."""
    point = np.asarray(contacts.point, float)
    low = point.min(axis=0, initial=np.inf) if len(point) else np.zeros(3)
    step = float((point - low).max(initial=0.0)) / 65_535 or 1.0
    force, largest = pack_forces(np.asarray(contacts.force, float))
    return {
        "begin": block.add(contacts.begin, "u4"),
        "point": block.add(np.rint((point - low) / step).astype(np.int64), "u2"),
        "low": _float_list(low),
        "step": step,
        "force": block.add(force, "u2"),
        "largest": largest,
        "state": block.add(contacts.state, "u1"),
    }


def sign_continuous(q: np.ndarray) -> np.ndarray:
    """Flip signs of quaternions for continuity in time."""
    q = np.asarray(q, float)
    apart = np.einsum("ij,ij->i", q[1:], q[:-1]) < 0
    signs = np.where(np.cumsum(apart) % 2, -1.0, 1.0)
    return q * np.concatenate([[1.0], signs])[:, None]


# The player's modules, each after those that it imports.
PLAYER_MODULES = (
    "packed",
    "data",
    "format",
    "theme",
    "solids",
    "flats",
    "look",
    "coil",
    "tube",
    "lines",
    "travel",
    "gearshape",
    "joints3d",
    "parts2d",
    "joints2d",
    "framing",
    "ground",
    "touches",
    "arrows",
    "triads",
    "trails",
    "crowdshapes",
    "crowd",
    "batches",
    "mechanism",
    "stage",
    "marks",
    "plots",
    "report",
    "panels",
    "names",
    "select",
    "shown",
    "keys",
    "clock",
    "speeds",
    "bar",
    "swing",
    "modes",
    "overlay",
    "variants",
    "compared",
    "vector",
    "film",
    "save",
    "main",
)
LIVE_MODULES = ("grip", "transport", "live")
"""Those of a live page, which follow."""


def animation_page(recording: Recording) -> str:
    """Write a recording as a web page with the moving mechanism, linked plots and a summary.

    Parameters
    ----------
    recording : Recording
        The motion to show.

    Returns
    -------
    str
        One HTML document with everything in it: it can be opened from a file, mailed, or embedded, and loads nothing
        else. ``#t=5`` after its address opens it paused at 5 s, ``#t=5&theme=dark`` in the dark theme too.

    Raises
    ------
    ValueError
        If the recording is not complete and consistent; the message names the faulty element.
    """
    return player_page(recording, f"<h1>{html.escape(recording.name)}</h1>")


def player_page(recording: Recording, heading: str, before: str = "", after: str = "") -> str:
    """Return a page with a recording and its player.

    Parameters
    ----------
    recording : Recording
    heading : str
        Markup of the line above the picture.
    before, after : str
        Markup before and after the player.
    """
    title = html.escape(recording.name)
    stage = fill_template(static("player.html"), {"heading": heading, "title": title, "live": ""})
    parts = {
        "title": title,
        "connect": "",
        "licences": static("licences.txt").replace("--", "- -"),
        "style": static("uplot.min.css") + static("page.css"),
        "content": before + stage + after,
        "player": _player_script(),
        "recording": _compressed(pack_recording(recording)),
        "boot": static("boot.js"),
    }
    return fill_template(static("page.html"), parts)


def live_page(name: str, connect: str = "") -> str:
    """Return the page of a live session: the player without a recording, which a session sends.

    Parameters
    ----------
    name : str
        Of the mechanism.
    connect : str
        Address that the page may connect to; without it the page speaks with the window around it.
    """
    title = html.escape(name)
    places = {"heading": f"<h1>{title}</h1>", "title": title, "live": static("live.html")}
    parts = {
        "title": title,
        "connect": f"; connect-src {connect}" if connect else "",
        "licences": static("licences.txt").replace("--", "- -"),
        "style": static("uplot.min.css") + static("page.css") + static("live.css"),
        "content": fill_template(static("player.html"), places),
        "player": _player_script(LIVE_MODULES),
        "recording": "",
        "boot": static("boot.js"),
    }
    return fill_template(static("page.html"), parts)


def _compressed(data: bytes) -> str:
    # level 9 would take twice the time (for very many bodies ten times), and save less than 1 %
    return base64.b64encode(gzip.compress(data, 6, mtime=0)).decode()


@cache
def _player_script(more: tuple[str, ...] = ()) -> str:
    """Return the libraries and the player, with more modules of it, as one gzipped script."""
    names = (*PLAYER_MODULES, *more)
    modules = "\n".join(_module_as_function(name, static(f"player/{name}.js")) for name in names)
    head = '"use strict";\nconst THREE = LIB, uPlot = LIB.uPlot;\n'
    starts = "window.startLive = $live.start;\n" if "live" in more else ""
    script = (
        f"{static('libraries.min.js')}\n(() => {{\n{head}{modules}\nwindow.startPlayer = $main.start;\n{starts}}})();\n"
    )
    return _compressed(script.encode())


def _module_as_function(name: str, module: str) -> str:
    """Return a module as a function that returns its exports; only its named imports are supported."""
    exported = ", ".join(re.findall(r"^export (?:class|const|function) (\w+)", module, flags=re.M))
    body = re.sub(r'^import (\{[^}]*\}) from "\./(\w+)\.js";', r"const \1 = $\2;", module, flags=re.M)
    body = re.sub(r'^import (\{[^}]*\}) from "\w+";', r"const \1 = LIB;", body, flags=re.M)
    body = re.sub(r"^import .*;\n", "", body, flags=re.M)
    body = re.sub(r"^export ", "", body, flags=re.M)
    return f"const ${name} = (() => {{\n{body}\nreturn {{ {exported} }};\n}})();"


def notebook_iframe(document: str, height: int = 660) -> str:
    """Wrap an HTML document for ``_repr_html_``.

    Parameters
    ----------
    document : str
        A self-contained HTML document.
    height : int
        Height of the frame [px].

    Returns
    -------
    str
        An ``iframe`` that contains the document, so that it is kept when the notebook is saved or exported; the
        document runs its scripts but cannot access anything outside the frame.
    """
    style = f"width:100%;height:{int(height)}px;border:0"
    return (
        f'<iframe srcdoc="{html.escape(document)}" sandbox="allow-scripts" title="Animation" style="{style}"></iframe>'
    )
