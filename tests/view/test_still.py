"""The picture that a notebook shows of a mechanism: in the right places, for everything that can be described."""

from __future__ import annotations

import itertools
import re
import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest

import flyball as fb
from flyball.view.animation import record_motion
from flyball.view.recording import Recording
from flyball.view.reference_picture import reference_result
from flyball.view.still_picture import BODY_COLORS, convex_polygon, still_svg

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*.toml"))
SVG = "{http://www.w3.org/2000/svg}"


def picture(m: fb.Mechanism) -> ET.Element:
    text = m._repr_html_()
    return ET.fromstring(re.search(r"<svg.*</svg>", text, re.S).group())


def pins(svg: ET.Element) -> np.ndarray:
    return np.array([[float(c.get("cx")), float(c.get("cy"))] for c in svg.iter(f"{SVG}circle")])


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda p: p.stem)
def test_every_example_is_drawn_inside_its_frame(path):
    svg = picture(fb.load(path))
    width, height = (float(x) for x in svg.get("viewBox").split()[2:])
    points = [p for e in svg.iter() if e.get("points") for p in e.get("points").split()]
    xy = np.array([[float(c) for c in p.split(",")] for p in points])
    marks = [[float(e.get("x")) + 5, float(e.get("y")) + 5] for e in svg.iter(f"{SVG}rect") if e.get("x")]
    xy = np.vstack([xy, pins(svg).reshape(-1, 2), np.reshape(marks, (-1, 2))])
    assert len(xy) > 3
    assert xy.min() >= 0.0
    assert (xy <= [width + 0.1, height + 0.1]).all()
    spread = np.ptp(xy, axis=0) / [width - 48, height - 48]
    assert spread.max() == pytest.approx(1.0, abs=0.01)  # as large as it can be


def test_hinges_are_where_they_are_to_scale():
    at = {"A": (0, 0), "B": (0, 0.2), "C": (0.5, 0.5), "D": (0.6, 0)}
    m = fb.Mechanism(planar=True)
    m.add(fb.Body("a", mass=1, inertia=1, position=(0, 0.1)), fb.Body("b", mass=1, inertia=1, position=(0.25, 0.35)))
    m.add(fb.Body("c", mass=1, inertia=1, position=(0.55, 0.25)))
    for name, (i, j) in zip("ABCD", (("ground", "a"), ("a", "b"), ("b", "c"), ("ground", "c")), strict=True):
        m.add(fb.Revolute(name, i, j, at=at[name]))
    seen, true = pins(picture(m)), np.array(list(at.values()))
    scale = (seen[3, 0] - seen[0, 0]) / 0.6
    assert scale > 400
    np.testing.assert_allclose((seen - seen[0]) / scale * [1, -1], true, atol=0.1 / scale)


def test_spatial_ones_are_seen_from_one_side():
    """Pixels of hinges are a parallel projection: two rows at right angles of one length."""
    m = fb.Mechanism()
    at = np.array([[0, 0, 0], [1, 0, 0], [0, 2, 0], [0, 0, 3], [1, 1, 1]], float)
    for k, p in enumerate(at):
        m.add(fb.Body(f"b{k}", mass=1, inertia=(1, 1, 1), position=p + [0.2, 0.1, 0]))
        m.add(fb.Spherical(f"j{k}", "ground", f"b{k}", at=p))
    seen = pins(picture(m))
    seen -= seen.mean(axis=0)
    # the drawing sorts by depth: find which pin is which by trying
    fits = []
    for order in itertools.permutations(range(len(at))):
        p = at[list(order)] - at.mean(axis=0)
        A, left, *_ = np.linalg.lstsq(p, seen, rcond=None)
        skew = A.T @ A / np.trace(A.T @ A) - np.eye(2) / 2
        fits.append(float(left.sum()) + np.abs(skew).max() * 1e3)
    assert min(fits) < 2.0  # pixels are written to 0.1


def unfinished() -> list[fb.Mechanism]:
    empty, alone, open_, wrong = (fb.Mechanism(str(k)) for k in range(4))
    alone.add(fb.Body("a", mass=1, inertia=(1, 1, 1)))
    open_.add(fb.Body("a", mass=1, inertia=(1, 1, 1)), fb.Frame("f", "a", position=(0, 0, 5)))
    open_.add(fb.Spherical("s", "ground", "f"), fb.Driver("d", "a.x", "sqrt(t - 1)"))
    wrong.add(fb.Body("a", mass=1, inertia=(1, 1, 1)))
    wrong.parameters["x"] = "no such(*"
    return [empty, alone, open_, wrong]


@pytest.mark.parametrize("m", unfinished(), ids=["empty", "alone", "open", "wrong"])
def test_what_is_not_finished_is_shown_without_complaint(m):
    html = m._repr_html_()
    assert "mechanism" in html
    assert ("<svg" in html) == (m.name in "12")


def test_names_cannot_break_the_page():
    m = fb.Mechanism("<script>alert(1)</script>", planar=True)
    m.add(fb.Body("a & b <i>", mass=1, inertia=1))
    assert "<script>" not in m._repr_html_()
    assert "<i>" not in m._repr_html_()
    assert picture(m) is not None


def test_a_picture_compiles_nothing_and_needs_no_heavy_package():
    """In a fresh process neither Numba nor Matplotlib is imported for it."""
    script = (
        f"import flyball as fb, sys; m = fb.load({str(EXAMPLES[0])!r}); repr(m); assert '<svg' in m._repr_html_(); "
        "print([k for k in ('numba', 'matplotlib', 'xarray') if k in sys.modules])"
    )
    out = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert out.stdout.strip() == "[]"


def test_hulls():
    square = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], float)
    inside = np.random.default_rng(0).uniform(0.01, 0.99, (50, 2))
    np.testing.assert_allclose(np.sort(convex_polygon(np.vstack([inside, square])), axis=0), np.sort(square, axis=0))
    assert len(convex_polygon(np.zeros((3, 2)))) == 1


def test_colours_are_those_of_the_page():
    theme = Path(fb.__file__).parent / "view" / "static" / "player" / "theme.js"
    listed = re.findall(r'"(#[0-9a-f]{6})"', theme.read_text(encoding="utf-8"))
    assert tuple(listed[: len(BODY_COLORS)]) == BODY_COLORS


def test_an_empty_recording_is_no_picture():
    assert still_svg(Recording("nothing", True, np.zeros(1), ())) == ""


def test_the_drawn_result_is_the_description():
    r = reference_result(fb.load(next(p for p in EXAMPLES if p.stem == "slider_crank")))
    assert r["slider.x"][0] == pytest.approx(0.7)
    assert r["crank.angle"][0] == 0.0
    assert record_motion(r, curves=False, with_notes=False).notes == {}
