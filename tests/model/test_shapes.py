"""Every shape: its volume, centre and inertia against those of its surface, by another program, as it gets finer."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import trimesh
from scipy.integrate import dblquad, quad
from scipy.spatial.transform import Rotation

import flyball as fb
from flyball.model.element import Length, element, positive, resolve
from flyball.model.inertia import mass_properties
from flyball.model.model_files import dumps, loads
from flyball.model.shapes import SHAPES
from flyball.model.shapes.geometry import surface_defects, weld_vertices
from flyball.model.shapes.solid import Solid

ELL = ((0, 0), (2, 0), (2, 1), (0.5, 1), (0.5, 3), (0, 3))
TETRAHEDRON = {
    "vertices": [(0, 0, 0), (1, 0, 0), (0, 2, 0), (0, 0, 3)],
    "faces": [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)],
}
SAMPLES = [
    fb.Box(edges=(1, 2, 3)),
    fb.Sphere(radius=0.7),
    fb.Cylinder(radius=0.5, length=2),
    fb.Capsule(radius=0.5, length=2),
    fb.Cone(radius=0.5, height=2),
    fb.Ellipsoid(semi_axes=(1, 2, 3)),
    fb.Hemisphere(radius=1.3),
    fb.Tube(radius=0.5, inner_radius=0.3, length=1),
    fb.Torus(radius=1, tube_radius=0.4),
    fb.Rod(start=(1, 0, 0), end=(1, 2, 3), radius=0.3),
    fb.Rod(start=(0, 0, 2), end=(0, 0, -1), radius=0.3),
    fb.Link(start=(0, 0, 0), end=(1, 0.5, 0), width=0.4, thickness=0.1),
    fb.Link(start=(0, 0, 0), end=(1, 0.5, 2), width=0.9, thickness=0.1, normal=(0, 1, 0)),
    fb.Link(start=(0, 0, 0), end=(0, 0, 2), width=0.4, thickness=0.1),
    fb.Prism(outline=ELL, thickness=0.4),
    fb.Prism(outline=(*ELL[::-1], ELL[-1]), thickness=0.4),
    fb.Hull(vertices=[(0, 0, 0), (2, 0, 0), (0, 3, 0), (0, 0, 1), (1, 1, 1), (0.5, 0.5, 0.2)], scale="20 cm"),
    fb.Mesh(**TETRAHEDRON, scale="20 cm"),
]


def numbers(s: Solid) -> SimpleNamespace:
    n = resolve(s, {})
    s.check(n)
    return n


def limit(s: Solid, n: SimpleNamespace, what: str) -> np.ndarray:
    """What trimesh finds for the surface, as it gets finer: errors in h^2 and h^4 taken out (Richardson)."""
    found = []
    for fine in (64, 128, 256):
        v, f = s.surface(n, fine)
        m = trimesh.Trimesh(v, f, process=False)
        found.append(np.asarray(getattr(m, what)))
    a, b = (4 * found[1] - found[0]) / 3, (4 * found[2] - found[1]) / 3
    return (16 * b - a) / 15


def test_every_shape_is_tried() -> None:
    assert {type(s) for s in SAMPLES} == set(SHAPES)


@pytest.mark.parametrize("s", SAMPLES, ids=lambda s: type(s).__name__)
def test_volume_centre_and_inertia_are_those_of_the_surface(s: Solid) -> None:
    n = numbers(s)
    volume = limit(s, n, "volume")
    k = np.asarray(s.gyration(n))
    size = np.abs(k).max() ** 0.5
    assert s.volume(n) == pytest.approx(volume, rel=2e-8)
    assert np.asarray(s.centre(n)) == pytest.approx(limit(s, n, "center_mass"), abs=2e-8 * size)
    inertia = (np.diag(k) if k.ndim == 1 else k) * s.volume(n)
    assert inertia == pytest.approx(limit(s, n, "moment_inertia"), abs=2e-8 * size**2 * volume)


@pytest.mark.parametrize("s", SAMPLES, ids=lambda s: type(s).__name__)
@pytest.mark.parametrize("fine", [4, 7, 32])
def test_surfaces_are_closed_and_face_outwards(s: Solid, fine: int) -> None:
    v, f = s.surface(numbers(s), fine)
    assert f.min() == 0
    assert len(np.unique(f)) == len(v)
    assert surface_defects(*weld_vertices(v, f)) == ""


@pytest.mark.parametrize("s", SAMPLES, ids=lambda s: type(s).__name__)
def test_shapes_lie_where_they_are_put(s: Solid) -> None:
    """Moving a shape moves its mass centre and turns its inertia, as it does the surface that is drawn."""
    turn = Rotation.from_rotvec((0.4, -0.7, 1.1))
    put = {"position": (1.0, -2.0, 0.5), "orientation": tuple(turn.as_quat(scalar_first=True))}
    moved = replace(s, **put)
    R = turn.as_matrix()
    (c, k), (d, h) = s.placed(numbers(s)), moved.placed(numbers(moved))
    assert d == pytest.approx(R @ c + put["position"], abs=1e-12)
    assert h == pytest.approx(R @ k @ R.T, abs=1e-12)
    v, w = s.mesh(numbers(s))[0], moved.mesh(numbers(moved))[0]
    assert w == pytest.approx(v @ R.T + put["position"], abs=1e-12)


def test_moments_by_quadrature() -> None:
    """The shapes whose formulas few books print, against integrals over their sections."""
    a, r = 1.0, 0.4
    torus = fb.Torus(radius=a, tube_radius=r)
    n = numbers(torus)
    about_axis, _ = dblquad(lambda t, q: q * (a + q * np.cos(t)) ** 3 * 2 * np.pi, 0, r, 0, 2 * np.pi)
    assert torus.volume(n) * torus.gyration(n)[2] == pytest.approx(about_axis, rel=1e-9)
    along, w = 1.3, 0.5
    link = fb.Link(start=(0, 0, 0), end=(along, 0, 0), width=w, thickness=2.0)
    n = numbers(link)

    def across(x: float) -> float:
        """Width at a distance from the middle."""
        return w if abs(x) < along / 2 else 2 * np.sqrt(max(w**2 / 4 - (abs(x) - along / 2) ** 2, 0.0))

    edge = (along + w) / 2
    area, x2, y2 = (
        2 * sum(quad(g, *ends, epsabs=1e-13)[0] for ends in ((0, along / 2), (along / 2, edge)))
        for g in (across, lambda x: x**2 * across(x), lambda x: across(x) ** 3 / 12)
    )
    assert link.volume(n) == pytest.approx(2 * area, rel=1e-9)
    assert link.gyration(n) == pytest.approx((y2 / area + 1 / 3, x2 / area + 1 / 3, (x2 + y2) / area), rel=1e-9)


def test_one_solid_two_ways() -> None:
    """The same body by another shape: a rod is a cylinder, a rectangle's prism a box, a full ellipsoid a ball."""
    pairs = [
        (
            fb.Rod(start=(1, 1, 0), end=(1, 1, 4), radius=0.5),
            fb.Cylinder(radius=0.5, length=4, position=(1, 1, 2)),
        ),
        (
            fb.Prism(outline=((0, 0), (0, 2), (1, 2), (1, 1), (1, 0)), thickness=3),
            fb.Box(edges=(1, 2, 3), position=(0.5, 1, 0)),
        ),
        (fb.Ellipsoid(semi_axes=(2, 2, 2)), fb.Sphere(radius=2)),
    ]
    for a, b in pairs:
        n, m = numbers(a), numbers(b)
        assert a.volume(n) == pytest.approx(b.volume(m), rel=1e-14)
        for x, y in zip(a.placed(n), b.placed(m), strict=True):
            assert x == pytest.approx(y, abs=1e-14)


def test_link_lies_as_described() -> None:
    """Rounded ends about the pins, thickness along the normal; what is not across the bar of a normal does not count."""
    link = fb.Link(start=(0, 0, 0), end=(3, 0, 0), width=1, thickness=0.2, normal=(5, 1, 0))
    v, _ = link.mesh(numbers(link))
    assert v.min(axis=0) == pytest.approx([-0.5, -0.1, -0.5])
    assert v.max(axis=0) == pytest.approx([3.5, 0.1, 0.5])
    tall = fb.Link(start=(0, 0, 0), end=(0, 0, 1), width=1, thickness=0.2)
    assert np.ptp(tall.mesh(numbers(tall))[0], axis=0) == pytest.approx([0.2, 1, 2])


def test_a_comb_can_be_cut_into_triangles() -> None:
    """An outline with many corners that turn inwards keeps its area, with two triangles less than corners."""
    teeth = [p for k in range(12) for p in ((k, 0.0), (k + 0.3, 2.0 + 0.1 * (k % 3)), (k + 0.6, 0.0), (k + 0.8, 0.0))]
    s = fb.Prism(outline=[(0, -1), *teeth, (12, -1)], thickness=1)
    n = numbers(s)
    v, f = s.surface(n)
    corners = len(s.outline)
    assert len(f) == 2 * (corners - 2) + 2 * corners
    assert trimesh.Trimesh(v, f, process=False).volume == pytest.approx(s.volume(n), rel=1e-12)


def test_derivatives_by_complex_steps() -> None:
    """All formulas of masses pass complex numbers through, so that derivatives by parameters are exact."""
    sized = [
        fb.Box(edges=("r", 2, 3), orientation=("r", 0, 0)),
        fb.Capsule(radius="r", length=2, position=("r", 1, 1)),
        fb.Cone(radius="r", height=2),
        fb.Ellipsoid(semi_axes=("r", 2, 3)),
        fb.Hemisphere(radius="r"),
        fb.Tube(radius="2*r", inner_radius="r", length=1),
        fb.Torus(radius=1, tube_radius="r"),
        fb.Rod(start=("r", 0, 0), end=(1, 2, 3), radius=0.3),
        fb.Link(start=(0, 0, 0), end=(1, "r", 0.2), width=0.4, thickness=0.1),
        fb.Prism(outline=((0, 0), (2, 0), (2, 1), ("r", 1), (0, 2)), thickness="r"),
        fb.Mesh(**TETRAHEDRON, scale="r"),
    ]
    for s in sized:
        b = fb.Body("b", density=2, shape=[s, fb.Box(edges=(5, 5, 5), position=("r", 1, 1))])

        def at(r: complex, b: fb.Body = b) -> np.ndarray:
            m = mass_properties(b, resolve(b, {"r": r}), {"r": r}, False)
            return np.r_[m.mass, m.com, m.inertia.ravel()]

        step = at(0.3 + 1e-30j).imag / 1e-30
        assert step == pytest.approx((at(0.3 + 1e-6) - at(0.3 - 1e-6)) / 2e-6, rel=1e-6, abs=1e-6)


@element
class Pyramid(Solid):
    """A square pyramid."""

    edge: Length
    height: Length

    def check(self, n: SimpleNamespace) -> None:
        positive(self, n, "edge", "height")
        super().check(n)

    def volume(self, n: SimpleNamespace) -> float:
        return n.edge**2 * n.height / 3

    def centre(self, n: SimpleNamespace) -> tuple[float, float, float]:
        return 0.0, 0.0, n.height / 4

    def gyration(self, n: SimpleNamespace) -> tuple[float, float, float]:
        k = n.edge**2 / 20 + 3 * n.height**2 / 80
        return k, k, n.edge**2 / 10


def test_a_new_shape_is_one_class() -> None:
    m = fb.Mechanism("m", parameters={"h": 2.0})
    m.add(fb.Body("b", density=3, shape=[Pyramid(edge=1, height="h"), Pyramid(edge="5 mm", height=1)]))
    back = loads(dumps(m), fb.Mechanism)
    assert back == m
    with pytest.raises(fb.ModelError, match=r"Body 'c', shape 1: Pyramid: edge is -1 m; it must be greater than 0"):
        m.add(fb.Body("c", density=3, shape=[Pyramid(edge=-1, height="h"), Pyramid(edge="5 mm", height=1)]))
