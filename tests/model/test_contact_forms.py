"""What shapes are where they touch: as far in every direction as the surface that is drawn, and weighed."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb
from flyball.collision import shape_kinds
from flyball.collision import tables as ct
from flyball.errors import ModelError
from flyball.model.shapes.geometry import ConvexPart
from flyball.tables.contact_tables import contact_tables
from flyball.tables.element_numbers import element_numbers
from tests.model.test_shapes import SAMPLES

FORMLESS = {"Torus"}
FLAT = {"Torus", "Ellipsoid"}  # without an outline
SOME = {"position": (0.3, -0.2, 0.5), "orientation": (0.3, -0.7, 0.4)}
rng = np.random.default_rng(5)


def far(G: ct.Geometry, i: int, d: np.ndarray) -> float:
    """How far shape i goes along d, from its mover's origin."""
    x, first = G.dimensions[i], G.shape.first[i]
    u, par = x.axes.reshape(3, 3).T @ d, x.par
    kind, across = G.shape.kind[i], np.hypot(u[0], u[1])
    vertex = G.vertex[first : first + G.shape.count[i]]
    return (
        x.place @ d
        + {
            shape_kinds.SPHERE: lambda: par[0],
            shape_kinds.BOX: lambda: par[:3] @ np.abs(u),
            shape_kinds.CAPSULE: lambda: par[0] + par[1] * abs(u[2]),
            shape_kinds.CYLINDER: lambda: par[0] * across + par[1] * abs(u[2]),
            shape_kinds.CONE: lambda: max(par[0] * across, par[1] * u[2]),
            shape_kinds.ELLIPSOID: lambda: np.sqrt((par[:3] ** 2) @ u**2),
            shape_kinds.HULL: lambda: par[0] + (vertex @ u).max(),
            shape_kinds.POLYGON: lambda: par[0] + (vertex @ u).max(),
            shape_kinds.HEMISPHERE: lambda: par[0] * (1.0 if u[2] > 0 else across),
        }[kind]()
    )


def put(shape: fb.Mechanism, planar: bool, **fields: object) -> tuple[fb.Mechanism, ct.Geometry]:
    m = fb.Mechanism("one", planar=planar)
    m.add(fb.Body("b", shape=shape, mass=1, inertia=1 if planar else (1, 1, 1), **fields), fb.Contact(friction=0.1))
    return m, contact_tables(m.snapshot(), element_numbers(m), ["b"]).geometry


def test_a_misspelt_kind_of_a_convex_part_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fb.Sphere, "forms", lambda self, n: (ConvexPart("SPHER", (n.radius,), n.radius),))
    with pytest.raises(
        ModelError, match=r"Body 'b': Sphere\.forms gives a ConvexPart of kind 'SPHER'; kinds: SPHERE, "
    ):
        put(fb.Sphere(radius=1), False)


@pytest.mark.parametrize("shape", SAMPLES, ids=lambda s: type(s).__name__)
def test_forms_reach_as_far_as_the_surface(shape) -> None:
    if type(shape).__name__ in FORMLESS:
        with pytest.raises(ModelError, match="is not supported by contact detection"):
            put(shape, False)
        return
    _, G = put(shape, False)
    env = element_numbers(fb.Mechanism("none")).env
    n = fb.model.element.resolve(shape, env)
    p, R = shape.pose(n)
    v = p + shape.surface(n, 256)[0] @ R.T
    for d in rng.normal(size=(50, 3)):
        d /= np.linalg.norm(d)
        reach = [far(G, i, d) for i in range(len(G.shape))]
        assert max(reach) == pytest.approx((v @ d).max(), abs=3e-4 * np.ptp(v))
        for i, x in enumerate(G.dimensions):  # no form goes beyond the ball that is said to hold it
            assert reach[i] <= x.place @ d + x.radius * (1 + 1e-12)


@pytest.mark.parametrize("shape", SAMPLES, ids=lambda s: type(s).__name__)
def test_outlines_reach_as_far_as_the_surface(shape) -> None:
    if type(shape).__name__ in FLAT:
        with pytest.raises(ModelError, match="has no outline for contact detection"):
            put(shape, True)
        return
    try:
        _, G = put(shape, True)
    except ModelError as error:
        assert "it is oblique" in str(error) and isinstance(shape, (fb.Rod, fb.Link))
        return
    n = fb.model.element.resolve(shape, {})
    p, R = shape.pose(n)
    v = p + shape.surface(n, 256)[0] @ R.T
    for turn in rng.uniform(0, 2 * np.pi, 50):
        d = np.array([np.cos(turn), np.sin(turn), 0.0])
        reach = [far(G, i, d) for i in range(len(G.shape))]
        assert max(reach) == pytest.approx((v @ d).max(), abs=3e-4 * np.ptp(v))
    assert not G.vertex[:, 2].any()


@pytest.mark.parametrize("kind", [fb.Capsule, fb.Cylinder])
def test_round_bars_in_the_plane(kind) -> None:
    """Standing they are circles, lying a segment with round ends and a rectangle."""
    _, G = put(kind(radius=0.1, length=0.4), True)
    assert (G.shape.kind[0] == shape_kinds.SPHERE) == (kind is fb.Cylinder)
    m, G = put(kind(radius=0.1, length=0.4, orientation=(0, np.pi / 2, 0), position=(1, 2)), True)
    assert far(G, 0, np.array([1.0, 0, 0])) == pytest.approx(1 + (0.3 if kind is fb.Capsule else 0.2))
    assert far(G, 0, np.array([0.0, 1, 0])) == pytest.approx(2.1)
    corner = np.array([1.0, 1, 0]) / 2**0.5
    edge = 0.2 / 2**0.5 + (0.1 if kind is fb.Capsule else 0.1 / 2**0.5)
    assert far(G, 0, corner) == pytest.approx(3 / 2**0.5 + edge)


def test_polygons_go_round_counter_clockwise() -> None:
    _, G = put(fb.Box(edges=(2, 1, 1), orientation=(0, 0, 0.3)), True)
    v = G.vertex[:, :2]
    assert len(v) == 4
    after = np.roll(v, -1, axis=0)
    assert (v[:, 0] * after[:, 1] - v[:, 1] * after[:, 0]).sum() / 2 == pytest.approx(2.0)


def test_a_landscape() -> None:
    x, y = np.meshgrid(np.arange(4) * 0.5, np.arange(5) * 0.25, indexing="ij")
    m = fb.Mechanism("hills")
    m.add(fb.Ground("hills", shape=fb.HeightField(heights=x + y * y, dx=0.5, dy=0.25), position=(1, 0, 0)))
    m.add(fb.Contact(friction=0.5))
    G = contact_tables(m.snapshot(), element_numbers(m), []).geometry
    assert G.shape.kind[0] == shape_kinds.FIELD
    assert G.dimensions.par[0, :4].tolist() == [4, 5, 0.5, 0.25]
    assert G.dimensions.place[0].tolist() == [1, 0, 0]
    assert G.vertex.ravel()[:20] == pytest.approx((x + y * y).ravel())
    v, f = m["hills"].shape.surface(fb.model.element.resolve(m["hills"].shape, {}))
    a, b, c = (v[f[:, k]] for k in range(3))
    assert (np.cross(b - a, c - a)[:, 2] > 0).all()


def test_many_hulls_of_many_sizes() -> None:
    """Corners of each size are corners of its own; normals do not grow."""
    points = rng.normal(size=(12, 3))
    sizes = np.array([1.0, 2.0, 0.5])
    m = fb.Mechanism("stones")
    m.add(fb.Bodies("stones", shape=fb.Hull(vertices=points), density=2000, position=np.zeros((3, 3)), scale=sizes))
    m.add(fb.Contact(friction=0.5))
    t = contact_tables(m.snapshot(), element_numbers(m), ["stones"])
    com = t.carriers.com["stones"]
    for k, s in enumerate(sizes):
        d = rng.normal(size=3)
        assert far(t.geometry, k, d) == pytest.approx(s * ((points - com) @ d).max())
    equal = fb.Mechanism("stones")
    equal.add(fb.Bodies("stones", shape=fb.Hull(vertices=points), density=2000, position=np.zeros((100, 3))))
    equal.add(fb.Contact(friction=0.5))
    one = contact_tables(equal.snapshot(), element_numbers(equal), ["stones"])
    assert len(one.geometry.vertex) * 3 == len(t.geometry.vertex)
