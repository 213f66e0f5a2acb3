"""Forms that are only described, as finished ones: hulls of points, closed surfaces in convex parts."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ...contact.solids.hull import Hull, hull
from ...contact.solids.parts import MOST, TOLERANCE, Parts, parts
from ...errors import PerformanceNotice, warn
from ...model.shapes.form import Form
from ...model.shapes.outline import polygon


def finished(form: Form) -> list[Form]:
    """The form as the tables of contact take it: one or several.

    Raises
    ------
    ModelError
        If points or a surface have no solid inside.
    """
    if form.kind == "HULL" and len(form.par) == 1:
        return [_form(hull(form.vertex), form, form.par[0])]
    if form.kind == "MESH":
        return [_form(h, form, 0.0) for h in _parts(form).hulls]
    return [form]


def outlined(form: Form) -> list[Form]:
    """The same in a planar mechanism: each part as seen along z."""
    if form.kind == "MESH":
        return [polygon(h.vertices) for h in _parts(form).hulls]
    return [form]


def _form(h: Hull, form: Form, rounding: float) -> Form:
    """A hull about the middle of its corners."""
    middle = (h.vertices.min(axis=0) + h.vertices.max(axis=0)) / 2
    h = Hull(h.vertices - middle, h.normals, h.sides)
    face, edges = h.table(0)
    return Form(
        "HULL",
        (rounding, float(edges)),
        np.sqrt((h.vertices**2).sum(axis=1)).max() + rounding,
        form.place + form.axes @ middle,
        form.axes,
        h.rows,
        face,
        len(h.vertices),
        len(h.sides),
    )


def _parts(form: Form) -> Parts:
    """Convex parts of a surface; what they take is told where they are poor."""
    v = np.ascontiguousarray(form.vertex, float)
    found = _once(v.tobytes(), np.ascontiguousarray(form.face, np.int64).tobytes())
    size = float(np.linalg.norm(np.ptp(v, axis=0)))
    if found.beyond > TOLERANCE * size:
        warn(
            f"a surface of {form.face.size // 3} triangles is {MOST} convex parts where it touches others, and these "
            f"still fill up to {found.beyond:.3g} m of its hollows; describe it by simpler shapes where that matters",
            PerformanceNotice,
        )
    return found


@lru_cache(maxsize=64)
def _once(vertices: bytes, faces: bytes) -> Parts:
    return parts(np.frombuffer(vertices).reshape(-1, 3), np.frombuffer(faces, np.int64).reshape(-1, 3))
