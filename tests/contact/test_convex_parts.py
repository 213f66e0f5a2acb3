"""Closed surfaces as convex parts: the same solid, to the tolerance; flat-sided ones exactly."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb
from flyball.collision.convex_decomposition import convex_parts, winding_number
from flyball.errors import ModelError, PerformanceNotice
from flyball.model.shapes.geometry import extrude
from flyball.tables.contact_tables import contact_tables
from flyball.tables.element_numbers import element_numbers
from tests.contact.against import rotation
from tests.contact.pairs import separations

STAR = [((1, 0.4)[k % 2] * np.cos(k * np.pi / 8), (1, 0.4)[k % 2] * np.sin(k * np.pi / 8)) for k in range(16)]
OUTLINES = {
    "L": ([(0, 0), (3, 0), (3, 1), (1, 1), (1, 4), (0, 4)], 2),
    "U": ([(0, 0), (3, 0), (3, 3), (2, 3), (2, 1), (1, 1), (1, 3), (0, 3)], 3),
    "cross": ([(1, 0), (2, 0), (2, 1), (3, 1), (3, 2), (2, 2), (2, 3), (1, 3), (1, 2), (0, 2), (0, 1), (1, 1)], 3),
    "arrow": ([(0, 0), (2, -1), (0, 3), (-2, -1)], 2),
    "star": (STAR, 9),
}


def solid(name, scale=1.0, at=0.0):
    v, f = extrude(np.array(OUTLINES[name][0], float), 1.0)
    return v * scale + at, f


def box(low, high):
    v, f = extrude(np.array([(low[0], low[1]), (high[0], low[1]), (high[0], high[1]), (low[0], high[1])]), 1.0)
    v[:, 2] = np.where(v[:, 2] < 0, low[2], high[2])
    return v, f


def volume(v, f):
    a, b, c = np.moveaxis(v[f], 1, 0)
    return np.einsum("ij,ij->", a, np.cross(b, c)) / 6


def inside(found, x):
    return np.min([h.outside(x) for h in found.hulls], axis=0)


@pytest.mark.parametrize("name", OUTLINES)
@pytest.mark.parametrize(("scale", "at"), [(1.0, 0.0), (1e-3, 0.0), (1.0, 100.0)])
def test_a_solid_with_flat_sides_is_the_union_of_its_parts(name, scale, at):
    v, f = solid(name, scale, at)
    found = convex_parts(v, f)
    assert len(found.hulls) <= OUTLINES[name][1]
    assert found.beyond < 1e-6 * scale
    assert sum(h.volume for h in found.hulls) == pytest.approx(volume(v - at, f), rel=1e-9)
    x = np.random.default_rng(0).uniform(v.min(axis=0), v.max(axis=0), (400, 3))
    np.testing.assert_array_equal(inside(found, x) < 0, winding_number(x, v[f]) > 0.5)


def test_a_convex_surface_is_one_hull_however_fine():
    v, f = fb.Sphere(radius=0.3).surface(fb.model.element.resolve(fb.Sphere(radius=0.3), {}), 24)
    assert len(convex_parts(v, f).hulls) == 1
    v, f = solid("L")
    e = convex_parts(np.concatenate([v, v + (10, 0, 0)]), np.concatenate([f, f + len(v)]))  # in two pieces
    assert len(e.hulls) == 4
    assert sum(h.volume for h in e.hulls) == pytest.approx(12)


def test_a_cavity_stays_empty():
    v, f = box((0, 0, 0), (3, 3, 3))
    w, g = box((1, 1, 1), (2, 2, 2))
    found = convex_parts(np.concatenate([v, w]), np.concatenate([f, g[:, ::-1] + len(v)]))
    assert sum(h.volume for h in found.hulls) == pytest.approx(26)
    assert inside(found, np.array([[1.5, 1.5, 1.5]]))[0] > 0.49


@pytest.mark.parametrize("tolerance", [0.15, 0.05])
def test_a_tube_stays_open_within_the_tolerance(tolerance):
    tube = fb.Tube(radius=1, inner_radius=0.5, length=0.7)
    v, f = tube.surface(fb.model.element.resolve(tube, {}), 32)
    found = convex_parts(v, f, tolerance)
    assert found.beyond <= tolerance
    x = np.random.default_rng(0).uniform(v.min(axis=0), v.max(axis=0), (2000, 3))
    filled = (inside(found, x) < 0) & (winding_number(x, v[f]) < 0.5)
    assert (np.hypot(*x[filled, :2].T) > 0.5 - tolerance - 0.01).all()
    assert (inside(found, x)[winding_number(x, v[f]) > 0.5] < 1e-9).all()  # nothing of the solid is lost


def test_what_has_no_solid_inside_or_no_tolerance_is_refused():
    v, f = box((0, 0, 0), (1, 1, 1))
    with pytest.raises(ModelError, match="flat"):
        convex_parts(v * (1, 1, 0), f)
    with pytest.raises(ModelError, match="greater than zero"):
        convex_parts(v, f, 0.0)


def touched(*shapes, planar=False):
    m = fb.Mechanism("solids", planar=planar)
    inertia = 1 if planar else (1, 1, 1)
    m.add(*(fb.Body(f"b{k}", shape=s, mass=1, inertia=inertia) for k, s in enumerate(shapes)), fb.Contact(friction=0.3))
    return contact_tables(m.snapshot(), element_numbers(m), [f"b{k}" for k in range(len(shapes))])


def mesh(name):
    v, f = solid(name)
    return fb.Mesh(vertices=v, faces=f)


def distance(G, pose):
    """Least separation of the parts of two bodies."""
    first, second = (np.flatnonzero(G.shape.mover[:] == k) for k in (0, 1))
    both = np.array([(a, b) for a in first for b in second]).ravel()
    mover = pose[G.shape.mover[both]]
    place = np.einsum("nij,nj->ni", mover[:, 3:].reshape(-1, 3, 3), G.dimensions.place[both])
    at = np.column_stack([mover[:, :3] + place, mover[:, 3:]])
    return separations(G._replace(shape=G.shape[both], dimensions=G.dimensions[both]), at)[:, 0].min()


def test_distance_of_meshes_is_that_of_coal():
    coal = pytest.importorskip("coal", reason="coal, of the dev extra, is not installed: pip install coal")

    def surface(name):
        v, f = solid(name)
        model = coal.BVHModelOBBRSS()
        model.beginModel(len(f), len(v))
        points, triangles = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
        for x in v:
            points.append(x)
        for t in f:
            triangles.append(coal.Triangle(*map(int, t)))
        model.addSubModel(points, triangles)
        model.endModel()
        return model

    rng = np.random.default_rng(2)
    for a, b in (("L", "U"), ("star", "cross"), ("U", "U")):
        t = touched(mesh(a), mesh(b))
        one, two = surface(a), surface(b)
        com = t.carriers.com
        for _ in range(60):
            R = [rotation(rng), rotation(rng)]
            p = [rng.normal(size=3) * 1.5, rng.normal(size=3) * 1.5]
            pose = np.array([[*(p[k] + R[k] @ com[f"b{k}"]), *R[k].ravel()] for k in (0, 1)])
            at = [coal.Transform3s(R[k], p[k]) for k in (0, 1)]
            result = coal.DistanceResult()
            there = coal.distance(one, at[0], two, at[1], coal.DistanceRequest(), result)
            ours = distance(t.geometry, pose)
            assert max(ours, 0) == pytest.approx(max(there, 0), abs=1e-7)


def test_an_open_mesh_touches_nothing_and_says_so():
    v, f = solid("L")
    with pytest.raises(ModelError, match="cannot touch anything"):
        touched(fb.Mesh(vertices=v, faces=f[:-1]))
    looks = fb.Mesh(vertices=v, faces=f[:-1], looks=True)
    assert len(touched(looks).geometry.shape) == 0


def test_hollows_that_stay_filled_are_told():
    rng = np.random.default_rng(0)
    a = np.arange(140) * 2 * np.pi / 140
    comb = np.column_stack([np.cos(a), np.sin(a)]) * np.where(np.arange(140) % 2, 1.0, 0.5)[:, None]
    v, f = extrude(comb + 1e-3 * rng.normal(size=comb.shape), 0.2)
    with pytest.warns(PerformanceNotice, match="fill up to"):
        touched(fb.Mesh(vertices=v, faces=f))


def test_a_plate_in_the_plane_is_polygons():
    G = touched(fb.Prism(outline=OUTLINES["L"][0], thickness=0.1), planar=True).geometry
    assert len(G.shape) == 2
    area = 0.0
    for row in G.shape:
        x, y, _ = G.vertex[row.first : row.first + row.count].T
        area += 0.5 * np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))
    assert area == pytest.approx(6)
