"""Meshes: masses of polyhedra against closed forms, files and their paths."""

from __future__ import annotations

import os
import pickle
import sys
from pathlib import Path

import numpy as np
import pytest
import trimesh

import flyball as fb
from flyball.model.element import resolve
from flyball.model.model_files import dumps
from flyball.model.shapes.geometry import polyhedron_integrals

TETRAHEDRON = {
    "vertices": [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)],
    "faces": [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)],
}


def body(shape: object, **fields: object) -> fb.Mechanism:
    m = fb.Mechanism("m")
    m.add(fb.Body("b", shape=shape, **fields))
    return m


def weight(shape: object, **fields: object):
    return body(shape, **(fields or {"density": 1.0})).mass_properties(drawn=True)["b"]


@pytest.fixture
def there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_a_tetrahedron_exactly() -> None:
    """x_i >= 0, sum x_i <= 1: the integrals of 1, x, x^2 and x y are 1/6, 1/24, 1/60 and 1/120."""
    b = weight(fb.Mesh(**TETRAHEDRON), density=5.0)
    x2, xy = 1 / 60 - 1 / 6 / 16, 1 / 120 - 1 / 6 / 16
    assert b.mass == pytest.approx(5 / 6, rel=1e-15)
    assert b.com == pytest.approx([0.25] * 3, rel=1e-15)
    assert b.inertia == pytest.approx(5 * (2 * x2 * np.eye(3) - xy * (1 - np.eye(3))), rel=1e-13)


def test_a_box_far_away_exactly() -> None:
    """A closed form that must not suffer from a distance much larger than the box."""
    mesh = trimesh.creation.box((1, 2, 3))
    b = weight(fb.Mesh(vertices=mesh.vertices + (1000, 0, -500), faces=mesh.faces))
    assert b.com == pytest.approx([1000, 0, -500], abs=1e-10)
    assert b.inertia == pytest.approx(6 * np.diag([13, 10, 5]) / 12, abs=1e-10)


def test_icospheres_come_to_the_sphere() -> None:
    """Errors of volume and inertia fall by four with each halving of the edges."""
    errors = []
    for n in (2, 3, 4):
        mesh = trimesh.creation.icosphere(subdivisions=n, radius=2.0)
        i = polyhedron_integrals(mesh.vertices, mesh.faces)
        assert i.centre == pytest.approx([0] * 3, abs=1e-13)
        errors.append([1 - i.volume / (4 / 3 * np.pi * 8), *(1 - np.diag(i.gyration) / 1.6)])
        assert (np.array(errors[-1]) > 0).all()  # its corners lie on the sphere, all else inside
    ratio = np.array(errors[:-1]) / np.array(errors[1:])
    assert ratio == pytest.approx(4.0, abs=0.1)
    assert max(errors[-1]) < 0.003


def test_cavities_and_parts_count() -> None:
    outer, inner = trimesh.creation.box((4, 4, 4)), trimesh.creation.box((2, 2, 2))
    inner.invert()
    hollow = trimesh.util.concatenate([outer, inner])
    b = weight(fb.Mesh(vertices=hollow.vertices, faces=hollow.faces))
    assert b.volume == pytest.approx(64 - 8)
    assert b.moments == pytest.approx([(64 * 32 - 8 * 8) / 12] * 3)
    inner.invert()
    inner.apply_translation((9, 0, 0))
    two = trimesh.util.concatenate([outer, inner])
    b = weight(fb.Mesh(vertices=two.vertices, faces=two.faces))
    assert b.com == pytest.approx([1, 0, 0])


@pytest.mark.parametrize("kind", ["stl", "obj", "ply", "off"])
def test_files(there: Path, kind: str) -> None:
    """Millimetres in the file; STL and PLY hold single precision, so numbers that it holds exactly."""
    mesh = trimesh.creation.box((8, 16, 32))
    mesh.apply_translation((4, 0, 0))
    mesh.export(there / f"part.{kind}")
    b = weight(fb.Mesh(path=f"part.{kind}", scale="1 mm", position=(0, 0, 1)), density=1000.0)
    assert b.mass == pytest.approx(1000 * 8 * 16 * 32e-9, rel=1e-12)
    assert b.com == pytest.approx([0.004, 0, 1], rel=1e-12)
    assert np.diag(b.inertia) == pytest.approx(b.mass * np.array([1280, 1088, 320]) / 12e6, rel=1e-10)


def test_ascii_stl_and_paths_as_objects(there: Path) -> None:
    trimesh.creation.icosphere(subdivisions=1).export(there / "ball.STL", file_type="stl_ascii")
    mesh = fb.Mesh(path=there / "ball.STL")
    assert weight(mesh).volume == pytest.approx(trimesh.creation.icosphere(subdivisions=1).volume, rel=1e-6)
    v, f = mesh.mesh(resolve(mesh, {}))
    assert (len(v), len(f)) == (42, 80)


def test_a_file_that_changes_is_read_again(there: Path) -> None:
    trimesh.creation.box((1, 1, 1)).export("part.stl")
    m = body(fb.Mesh(path="part.stl"), density=1)
    assert m.mass_properties(drawn=True).total.mass == pytest.approx(1)
    trimesh.creation.box((2, 1, 1)).export("part.stl")
    stamp = os.stat("part.stl").st_mtime_ns + 10**9
    os.utime("part.stl", ns=(stamp, stamp))
    assert m.mass_properties(drawn=True).total.mass == pytest.approx(2)


def test_a_motion_begins_with_the_file_as_it_is(there: Path) -> None:
    """A box of 1 x 1 m, then of 2 x 1, turns from rest about an axis 2 m away: 2 g/(4 + (a^2 + b^2)/12)."""
    trimesh.creation.box((1, 1, 1)).export("part.stl")
    m = fb.Mechanism("pendulum", gravity=(0, -9.81, 0))
    m.add(fb.Body("b", shape=fb.Mesh(path="part.stl"), density=1.0))
    m.add(fb.Revolute("hinge", "ground", "b", at=(-2, 0, 0), axis=(0, 0, 1)))
    for a in (1, 2, 1):
        trimesh.creation.box((a, 1, 1)).export("part.stl")
        turned = m.simulate(1e-3, outputs=2)["b"].angular_acceleration[0]
        assert turned == pytest.approx([0, 0, -2 * 9.81 / (4 + (a * a + 1) / 12)], rel=1e-9)


def test_a_path_is_counted_from_the_model_file(there: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (there / "model" / "parts").mkdir(parents=True)
    trimesh.creation.box((1, 2, 3)).export("model/parts/part.stl")
    text = 'density = 2\nshape = { type = "Mesh", path = "parts/part.stl", scale = 0.5 }\n'
    (there / "model" / "m.toml").write_text(f'[[bodies]]\nname = "b"\n{text}', encoding="utf-8")
    m = fb.load("model/m.toml")
    assert m.mass_properties(drawn=True).total.mass == pytest.approx(1.5)
    assert m["b"].shape.path == "parts/part.stl"
    m.save("model/again.toml")
    assert 'path = "parts/part.stl"' in Path("model/again.toml").read_text(encoding="utf-8")
    m.save("other.toml")  # in another folder: the same file by another way
    assert 'path = "model/parts/part.stl"' in Path("other.toml").read_text(encoding="utf-8")
    back = fb.load("other.toml")
    assert back == m == pickle.loads(pickle.dumps(m)) == fb.load("model/again.toml")
    assert hash(back["b"].shape) == hash(m["b"].shape)
    monkeypatch.chdir(there / "model")  # the current folder has no part in it any more
    assert back.mass_properties(drawn=True).total.mass == pytest.approx(1.5)
    assert fb.Mesh(path="part.stl") != fb.Mesh(path="parts/part.stl")


def test_vertices_come_back_from_a_file_exactly(there: Path) -> None:
    v = np.array(TETRAHEDRON["vertices"]) * np.pi + 0.1
    m = body(fb.Mesh(vertices=v, faces=np.array(TETRAHEDRON["faces"]), scale="1 cm"), density=1)
    m.save("m.toml")
    back = fb.load("m.toml")
    assert back == m
    assert dumps(back) == dumps(m)
    assert np.array_equal(back["b"].shape.vertices, v)


def test_a_result_file_finds_the_mesh(there: Path) -> None:
    trimesh.creation.box((1, 2, 3)).export("part.stl")
    (there / "out").mkdir()
    m = body(fb.Mesh(path="part.stl"), density=1, velocity=(1, 0, 0))
    r = m.simulate(0.1, outputs=3)
    r.save("out/r.nc")
    back = fb.load_result("out/r.nc")
    assert back.model == m
    assert back["b"].position == pytest.approx(r["b"].position)


def test_any_surface_will_do_for_looks(there: Path) -> None:
    flat = {"vertices": [(0, 0, 0), (1, 0, 0), (0, 1, 0)], "faces": [(0, 1, 2)]}
    body(fb.Mesh(**flat), mass=1, inertia=(1, 1, 1))
    b = weight([fb.Mesh(**flat, looks=True), fb.Sphere(radius=1)], density=3)
    assert b.volume == pytest.approx(4 / 3 * np.pi)


def test_without_trimesh(there: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Files ask for it by name; vertices and faces do without."""
    trimesh.creation.box((1, 1, 1.5)).export("part.stl")
    monkeypatch.setitem(sys.modules, "trimesh", None)
    weight(fb.Mesh(**TETRAHEDRON))
    said = r"Body 'b': Mesh 'part\.stl': reading .stl files takes the package trimesh: pip install 'flyball\[meshes\]'"
    with pytest.raises(fb.ModelError, match=said):
        weight(fb.Mesh(path="part.stl"))
