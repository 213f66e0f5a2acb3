"""What a body that cannot be, or is described in two ways, is answered: shapes, densities, inertias, colours."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import flyball as fb
from flyball.model.shapes import SHAPES

BOX = {"edges": (1, 1, 1)}
ONE = {"mass": 1, "inertia": (1, 1, 1)}
TETRAHEDRON = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
FACES = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]


def said(planar: bool = False, **fields: Any) -> str:
    m = fb.Mechanism("m", planar=planar)
    with pytest.raises(fb.ModelError) as caught:
        m.add(fb.Body("b", **fields))
    assert m.bodies == []
    return str(caught.value)


@pytest.mark.parametrize("cls", SHAPES, ids=lambda c: c.__name__)
def test_no_dimension_has_a_default(cls: type) -> None:
    """A shape of no size is never silently one of 1 m."""
    with pytest.raises(fb.ModelError, match=r"is missing|neither a path nor vertices"):
        fb.Mechanism("m").add(fb.Body("b", density=1, shape=cls()))


LENGTHS = [
    (fb.Box, {"edges": (1, 1, 0)}, "Box: edges must be three lengths greater than 0, got (1.0, 1.0, 0.0)"),
    (fb.Box, {"edges": (1, 1)}, "Box: edges must be three lengths greater than 0, got (1.0, 1.0)"),
    (fb.Ellipsoid, {"semi_axes": (1, -1, 1)}, "Ellipsoid: semi_axes must be three lengths greater than 0"),
    (fb.Sphere, {"radius": 0}, "Sphere: radius is 0 m; it must be greater than 0"),
    (fb.Sphere, {"radius": "1 kg"}, "radius of Sphere: '1 kg': expected a length [m]"),
    (fb.Sphere, {"radius": float("nan")}, "radius of Sphere: the value is nan"),
    (fb.Sphere, {"radius": "r"}, "radius of Sphere: unknown name 'r'"),
    (fb.Hemisphere, {"radius": -1}, "Hemisphere: radius is -1 m"),
    (fb.Cylinder, {"radius": 1, "length": 0}, "Cylinder: length is 0 m"),
    (fb.Capsule, {"radius": -1, "length": 1}, "Capsule: radius is -1 m"),
    (fb.Cone, {"radius": 1, "height": -2}, "Cone: height is -2 m"),
    (fb.Tube, {"radius": 1, "inner_radius": 0, "length": 1}, "inner_radius is 0 m; it must be greater than 0. Without"),
    (
        fb.Tube,
        {"radius": 1, "inner_radius": 1, "length": 1},
        "Tube: inner_radius is 1 m; it must be smaller than its radius, 1 m",
    ),
    (fb.Tube, {"radius": 1, "inner_radius": 0.5, "length": -1}, "Tube: length is -1 m"),
    (
        fb.Torus,
        {"radius": 1, "tube_radius": 2},
        "Torus: tube_radius is 2 m; it must be smaller than its radius, 1 m",
    ),
    (fb.Torus, {"radius": 1, "tube_radius": 0}, "Torus: tube_radius is 0 m"),
    (fb.Rod, {"start": (0, 0, 0), "end": (0, 0, 0), "radius": 1}, "Rod: start and end are the same point, (0.0, 0.0"),
    (fb.Rod, {"start": (0, 0, 0), "end": (0, 1), "radius": 1}, "end of Rod: expected 3 components, got 2: (0.0, 1.0)"),
    (fb.Rod, {"start": (0, 0, 0), "end": (0, 0, 1), "radius": 0}, "Rod: radius is 0 m"),
    (
        fb.Link,
        {"start": (0, 0, 0), "end": (0, 0, 1), "width": 1, "thickness": 1, "normal": (0, 0, 2)},
        "Link: its normal (0.0, 0.0, 2.0) points along the bar; it must point across",
    ),
    (
        fb.Link,
        {"start": (0, 0, 0), "end": (0, 0, 1), "width": 1, "thickness": 1, "normal": (0, 0, 0)},
        "normal of Link: (0.0, 0.0, 0.0) has no length",
    ),
    (fb.Link, {"start": (0, 0, 0), "end": (0, 0, 1), "width": 0, "thickness": 1}, "Link: width is 0 m"),
    (fb.Link, {"start": (0, 0, 0), "end": (0, 0, 1), "width": 1, "thickness": -1}, "Link: thickness is -1 m"),
    (fb.Prism, {"outline": [(0, 0), (1, 0), (0, 1)], "thickness": 0}, "Prism: thickness is 0 m"),
    (fb.Prism, {"outline": [(0, 0), (1, 0), (0, 0)], "thickness": 1}, "outline has 2 corners; it needs three at least"),
    (fb.Prism, {"outline": [(0, 0), (1, 1), (3, 3)], "thickness": 1}, "its outline has no area"),
    (fb.Prism, {"outline": [(0, 0), (1, 0, 0), (1, 1)], "thickness": 1}, "list of points (x, y), got (1.0, 0.0, 0.0)"),
    (
        fb.Prism,
        {"outline": [(0, 0), (3, 1), (3, 0), (0, 1.5)], "thickness": 1},
        "its outline crosses itself: the side from corner 1 meets the side from corner 3",
    ),
    (
        fb.Prism,  # a corner that touches another side
        {"outline": [(0, 0), (4, 0), (4, 3), (2, 0), (0, 3)], "thickness": 1},
        "its outline crosses itself: the side from corner 1 meets the side from corner 3",
    ),
    (
        fb.Prism,  # one corner twice in a row
        {"outline": [(0, 0), (1, 0), (1, 0), (0, 1)], "thickness": 1},
        "its outline crosses itself",
    ),
    (
        fb.Prism,  # there and back along one line
        {"outline": [(0, 0), (2, 0), (1, 0), (1, 1)], "thickness": 1},
        "its outline crosses itself",
    ),
    (fb.Box, BOX | {"position": (1, 2)}, "position of Box: expected 3 components, got 2"),
    (fb.Box, BOX | {"orientation": (0, 0, 0, 0)}, "a quaternion must not be zero"),
    (fb.Box, BOX | {"name": "lid", "orientation": (1, 0)}, "orientation of Box 'lid': give a quaternion"),
    (fb.Box, BOX | {"density": -1}, "Box: density is -1 kg/m^3; it must be greater than 0"),
    (fb.Box, BOX | {"mass": -1}, "Box: mass is -1 kg; it must be greater than 0"),
    (fb.Box, BOX | {"density": 0}, "Box: its density is 0; a shape that is only seen is given by looks=True"),
    (fb.Box, BOX | {"mass": 0}, "Box: its mass is 0; a shape that is only seen is given by looks=True"),
    (fb.Box, BOX | {"mass": 1, "density": 2}, "Box: mass 1 kg and density 2 kg/m^3 are both given; leave one out"),
    (fb.Box, BOX | {"looks": True, "mass": 1}, "Box: it is for looks only, so leave out looks or mass"),
    (fb.Box, BOX | {"looks": True, "density": 1}, "so leave out looks or density"),
    (fb.Box, BOX | {"looks": True, "hole": True}, "so leave out looks or hole"),
]


@pytest.mark.parametrize(("cls", "fields", "part"), LENGTHS)
def test_shapes_that_cannot_be(cls: type, fields: dict, part: str) -> None:
    """Alone on a body, as one of several, and where it is for looks only, since mass and inertia are given."""
    assert said(shape=cls(**fields), density=1).startswith("Body 'b': ")
    assert part in said(shape=cls(**fields), density=1)
    several = said(shape=[fb.Sphere(radius=1), cls(**fields)], density=1)
    assert several.startswith("Body 'b', shape 2: ")
    assert part in several
    assert part in said(shape=cls(**fields), **ONE)


MESHES = [
    ({}, "Mesh: it has neither a path nor vertices; give path='part.stl', or vertices=... and faces=..."),
    ({"vertices": TETRAHEDRON}, "Mesh: vertices and faces belong together"),
    ({"path": "a.stl", "faces": FACES}, "Mesh 'a.stl': vertices and faces belong together; a path has its own"),
    ({"path": "a.stl", "vertices": TETRAHEDRON, "faces": FACES}, "it has both a path and vertices"),
    ({"vertices": TETRAHEDRON, "faces": FACES, "scale": 0}, "Mesh: scale is 0 m; it must be greater than 0"),
    ({"vertices": TETRAHEDRON, "faces": FACES, "scale": "1 kg"}, "scale of Mesh: '1 kg': expected a length"),
    ({"vertices": [(0, 0), (1, 0), (0, 1)], "faces": FACES}, "three or more points of three finite numbers, got ((0"),
    ({"vertices": [(0, 0, 0), (1, 0), (0, 1)], "faces": FACES}, "three or more points of three finite numbers"),
    ({"vertices": [*TETRAHEDRON[:3], (0, 0, np.inf)], "faces": FACES}, "three or more points of three finite numbers"),
    ({"vertices": "cube", "faces": FACES}, "three or more points of three finite numbers, got 'cube'"),
    ({"vertices": TETRAHEDRON, "faces": [(0, 1, 2, 3)]}, "faces must be triangles, each given by three indices"),
    ({"vertices": TETRAHEDRON, "faces": [(0, 1, 0.5)]}, "faces must be triangles, each given by three indices"),
    ({"vertices": TETRAHEDRON, "faces": []}, "faces must be triangles"),
    ({"vertices": TETRAHEDRON, "faces": [(0, 0, 1)]}, "Mesh: it has no triangles"),
    ({"vertices": TETRAHEDRON, "faces": [(0, 1, 9)]}, "faces name the vertices 0 to 9; there are those from 0 to 3"),
    (
        {"vertices": TETRAHEDRON, "faces": np.array(FACES) + 1},
        "faces name the vertices 1 to 4; there are those from 0 to 3. They count from 0 here: subtract 1",
    ),
    ({"path": "prt.stl"}, "prt.stl' (did you mean 'part.stl'?)"),
    ({"path": "part.step"}, "Mesh 'part.step': .step is no kind of mesh; export it as .stl, .obj, .ply, .off"),
    ({"path": "part.stl"}, "Mesh 'part.stl': it has no triangles"),
    ({"path": "broken.ply"}, "cannot be read as PLY"),
    ({"path": "folder.stl"}, "Mesh 'folder.stl': "),
]


@pytest.mark.parametrize(("fields", "part"), MESHES)
def test_meshes_that_cannot_be(fields: dict, part: str, tmp_path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "part.stl").write_text("solid nothing\nendsolid nothing\n")
    (tmp_path / "part.step").write_text("ISO-10303-21;")
    (tmp_path / "broken.ply").write_bytes(b"ply\nformat")
    (tmp_path / "folder.stl").mkdir()
    assert part in said(shape=fb.Mesh(**fields), density=1)
    assert part in said(shape=fb.Mesh(**fields), **ONE)


BACKWARDS = [f[::-1] for f in FACES]
SURFACES = [
    (FACES[:3], "it is not closed: 3 of its edges have a triangle on one side only. Close its holes and merge"),
    ([FACES[0][::-1], *FACES[1:]], "its triangles do not all face outwards: at 3 edges two neighbours are oriented"),
    (BACKWARDS, "triangles of it face inwards (the volume of a part is -0.167). Flip the normals of these faces"),
    ([FACES[0], FACES[0][::-1]], "it encloses no volume. Give it a thickness"),
]


@pytest.mark.parametrize(("faces", "part"), SURFACES)
def test_surfaces_without_an_inside(faces: list, part: str) -> None:
    """They give no inertia, and the message says what to do; for looks only they are welcome."""
    mesh = fb.Mesh(vertices=TETRAHEDRON, faces=faces)
    text = said(shape=mesh, density=1)
    assert text.startswith("Body 'b': Mesh: it gives no mass and inertia, since ")
    assert part in text
    assert "give mass and inertia of the body, or looks=True here" in text
    fb.Mechanism("m").add(fb.Body("b", shape=mesh, **ONE))


def test_a_part_that_is_turned_inside_out() -> None:
    """A cavity lies inside; a part beside the others that faces inwards is a mistake."""
    v = np.array(TETRAHEDRON)
    both = {"vertices": np.vstack([10 * v, v + 20]), "faces": np.vstack([FACES, np.array(BACKWARDS) + 4])}
    assert "triangles of it face inwards (the volume of a part is -0.167)" in said(shape=fb.Mesh(**both), density=1)


SPHERE, PLATE = fb.Sphere(radius=1), fb.Box(edges=(1, 2, 3))
WEIGHTS = [
    ({"mass": 1, "shape": fb.Box(**BOX, looks=True)}, "its inertia is missing; its shapes are for looks only; give"),
    ({"mass": 1, "inertia": (1, 1, 1), "density": 1}, "density has no effect, since mass and inertia are given"),
    ({"mass": 1, "density": 7, "shape": SPHERE}, "mass 1 kg and density 7 kg/m^3 are both given; leave one out"),
    ({"shape": SPHERE}, "Body 'b': its mass is missing; give mass=... or density=... of the body or the shape"),
    ({"shape": [fb.Sphere(radius=1, mass=1), SPHERE]}, "Body 'b', shape 2: its mass is missing"),
    ({"density": -1, "shape": SPHERE}, "Body 'b': density is -1 kg/m^3; it must be greater than 0"),
    ({"density": 0, "shape": SPHERE}, "Body 'b': density is 0 kg/m^3; it must be greater than 0"),
    ({"density": 1, "shape": fb.Sphere(radius=1, mass=1)}, "density 1 kg/m^3 has no effect, since all its shapes have"),
    ({"density": 1}, "its inertia is missing; give inertia=(Ixx, Iyy, Izz), 0 for a point mass, or a shape"),
    (
        {"mass": 3, "shape": [PLATE, fb.Sphere(radius=1, mass=1)]},
        "Body 'b', shape 2: it has a mass of its own, 1 kg, and so has the body, 3 kg; leave one out",
    ),
    (
        {"mass": 3, "shape": [fb.Sphere(radius=1, density=1), PLATE]},
        "Body 'b', shape 2: it has no density, but others have",
    ),
    (
        {"density": 1, "inertia": (1, 1, 1), "shape": SPHERE},
        "its mass is missing; inertia is given, so the shapes are for looks only: give mass=...",
    ),
    ({**ONE, "shape": fb.Sphere(radius=1, density=1)}, "density of Sphere has no effect, since mass and inertia of"),
    ({**ONE, "shape": fb.Sphere(radius=1, mass=1)}, "mass of Sphere has no effect"),
    ({**ONE, "shape": fb.Sphere(radius=1, hole=True)}, "hole of Sphere has no effect"),
    ({"mass": 1, "shape": SPHERE, "inertia_about": (0, 0, 0)}, "inertia_about is the reference of inertia=, which is"),
    ({"mass": 1, "shape": SPHERE, "inertia_axes": (0, 0, 1)}, "inertia_axes is the reference of inertia=, which is"),
    (
        {"mass": 1, "shape": SPHERE, "com": (0, 0, 1)},
        "com is (0, 0, 1) m, but the centre of mass of its shapes is (0, 0, 0) m. Leave com out, or give mass and",
    ),
    (
        {"density": 1, "shape": [SPHERE, fb.Box(edges=(2, 2, 2), hole=True)]},
        "its holes take more than there is: -3.81121 m^3 are left. Holes must lie inside the other shapes",
    ),
    (
        {"density": 1, "shape": [fb.Box(edges=(9, 1, 1)), fb.Box(edges=(1, 1, 1), position=(40, 0, 0), hole=True)]},
        "its inertia has a negative principal moment",
    ),
    ({"mass": 1, "shape": "box"}, "field 'shape': give a shape such as Sphere(radius=0.1), or a list of shapes"),
    ({"mass": 1, "shape": fb.Sphere}, "field 'shape': give a shape such as Sphere(radius=0.1)"),
    ({"mass": 1, "shape": {"type": "Bal"}}, "unknown shape type 'Bal'; there are "),
    ({"mass": 1, "shape": {"radius": 1}}, "a shape has no type; there are "),
    ({"mass": 1, "shape": {"type": "Sphere"}}, "Sphere: field 'radius' is missing"),
    ({"mass": 1, "shape": {"type": "Sphere", "radus": 1}}, "unknown field 'radus' (did you mean 'radius'?)"),
]


@pytest.mark.parametrize(("fields", "part"), WEIGHTS)
def test_masses_given_in_two_ways_or_none(fields: dict, part: str) -> None:
    assert part in said(**fields)


def test_a_hole_outside_is_found_where_the_inertia_becomes_impossible() -> None:
    text = said(density=1, shape=[fb.Box(edges=(9, 1, 1)), fb.Box(edges=(1, 1, 1), position=(40, 0, 0), hole=True)])
    assert text.endswith("Its holes must lie inside the other shapes")


INERTIAS = [
    ({"inertia": (1, 1, 2.1)}, "principal moments 1, 1, 2.1 kg m^2 break the triangle inequality (1 + 1 < 2.1)"),
    ({"inertia": (-1, 1, 1)}, "its inertia has a negative principal moment: -1, 1, 1 kg m^2. Check its sign"),
    (
        {"inertia": ((1, 2, 0), (2, 1, 0), (0, 0, 1))},
        "Terms off the diagonal are minus the products of inertia, Ixy = -sum of m x y: check their signs",
    ),
    (
        {"inertia": (1, 1, 1), "inertia_about": (2, 0, 0)},
        "negative principal moment: -3, -3, 1 kg m^2. Check whether inertia_about is the point that it is about",
    ),
    ({"inertia": (1, 2, 3, 0, 0, 0)}, "six numbers are written ((Ixx, Ixy, Ixz), (Ixy, Iyy, Iyz), (Ixz, Iyz, Izz))"),
    ({"inertia": ((1, 0, 0), (0, 1, 0), (0.1, 0, 1))}, "its inertia matrix is not symmetric"),
    ({"inertia": ((1, 2), (3,))}, "three principal moments or a 3x3 matrix (0 for a point mass)"),
    ({"inertia": (1, 1, 1), "inertia_axes": ((2, 0, 0), (0, 1, 0), (0, 0, 1))}, "the matrix is not a rotation"),
    ({"inertia": (1, 1, 1), "inertia_about": (1, 0)}, "inertia_about of Body 'b': expected 3 components, got 2"),
]


@pytest.mark.parametrize(("fields", "part"), INERTIAS)
def test_inertias_that_cannot_be(fields: dict, part: str) -> None:
    assert part in said(mass=1, **fields)


@pytest.mark.parametrize("J", [(0, 0, 0), (1, 1, 0), (1, 1, 2), (1, 1, 2 * (1 + 1e-12)), 0])
def test_point_masses_thin_rods_and_flat_plates_can_be(J: Any) -> None:
    m = fb.Mechanism("m")
    m.add(fb.Body("b", mass=1, inertia=J))
    assert np.all(np.diag(m.mass_properties().bodies["b"].inertia) == J)


PLANAR = [
    ({"mass": 1, "inertia": 1, "inertia_axes": (0, 0, 1)}, "in a planar mechanism inertia is about z; leave inertia_a"),
    ({"mass": 1, "inertia": 1, "inertia_about": (2, 0)}, "inertia is -3 kg m^2; it must be zero or greater"),
    ({"density": 1, "shape": fb.Box(**BOX, position=(1,))}, "position of Box: expected 3 components, got 1"),
    ({"mass": 1, "shape": SPHERE, "com": (1, 0)}, "the centre of mass of its shapes is (0, 0, 0) m"),
]


@pytest.mark.parametrize(("fields", "part"), PLANAR)
def test_in_the_plane(fields: dict, part: str) -> None:
    assert part in said(planar=True, **fields)


@pytest.mark.parametrize(
    ("color", "part"),
    [
        ("steelbleu", "color 'steelbleu' is no colour (did you mean 'steelblue'?); write a name of CSS"),
        ("#12345", "color '#12345' is no colour; write a name of CSS such as 'steelblue', or #rgb or #rrggbb"),
        ("#ggg", "is no colour"),
        ("rgb(1, 2, 3)", "is no colour"),
        ("", "is no colour"),
    ],
)
def test_colours(color: str, part: str) -> None:
    assert part in said(**ONE, color=color)


@pytest.mark.parametrize("color", ["steelblue", "RebeccaPurple", "#abc", "#A63d2f"])
def test_colours_that_there_are(color: str) -> None:
    fb.Mechanism("m").add(fb.Body("b", **ONE, color=color))


def test_a_fixed_body_is_said_in_other_words() -> None:
    """The word sounds like welded to ground, which it was not."""
    assert "to weld it to ground add a Fixed joint; to keep assembly from moving it, as_drawn=True" in said(
        **ONE, fixed=True
    )


def test_an_initial_condition_says_something() -> None:
    m = fb.Mechanism("m")
    m.add(fb.Body("b", **ONE))
    with pytest.raises(
        fb.ModelError, match=r"Initial 'b\.x': it has no effect; give value=\.\.\., rate=\.\.\. or both"
    ):
        m.add(fb.Initial("b.x"))
    m.add(fb.Initial("b.x", rate=0.0))


def test_a_long_value_is_cut_short_in_a_message() -> None:
    many = {"type": "Mesh", "vertices": [(k, 0, 0) for k in range(10_000)], "facs": FACES}
    text = said(density=1, shape=many)
    assert "unknown field 'facs' (did you mean 'faces'?)" in text
    assert len(text) < 800
