"""Describing contact: what touches what, with which friction, and the tables that follow."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

import flyball as fb
from flyball.collision import shape_kinds
from flyball.model.model_files import dumps, loads
from flyball.tables.contact_tables import ContactTables, contact_tables
from flyball.tables.element_numbers import element_numbers
from flyball.tables.table_definitions import ACROSS, KINETIC, RESTITUTION, ROLLING, STATIC

BOX = fb.Box(edges=(0.2, 0.2, 0.2))


def tables(m: fb.Mechanism, *names: str) -> ContactTables:
    s = m.snapshot()
    return contact_tables(s, element_numbers(s), names or [*(b.name for b in s.bodies), *(b.name for b in s.bulk)])


def meet(t: ContactTables, a: int, b: int) -> bool:
    """Whether two shapes may touch, as the search decides it."""
    i, j = t.geometry.shape[a], t.geometry.shape[b]
    if i.mover == j.mover or not (i.member & j.mask and j.member & i.mask):
        return False
    return sorted((i.mover, j.mover)) not in t.geometry.excluded_pairs.tolist()


def pairs(t: ContactTables) -> set[tuple[str, str]]:
    n = len(t.geometry.shape)
    return {(t.name(a), t.name(b)) for a in range(n) for b in range(a + 1, n) if meet(t, a, b)}


def row(t: ContactTables, a: str, b: str) -> np.ndarray:
    """What the surfaces of two parts are to each other."""
    names = [t.name(k) for k in range(len(t.part))]
    i, j = (t.geometry.shape.material[names.index(x)] for x in (a, b))
    assert t.surfaces.pair[i, j].tolist() == t.surfaces.pair[j, i].tolist()
    return t.surfaces.pair[i, j]


def three(**contact: object) -> fb.Mechanism:
    """A floor, and boxes a, b and c, the first two on a hinge."""
    m = fb.Mechanism("three", gravity=(0, 0, -9.81))
    m.add(fb.Ground("floor", shape=fb.Plane()))
    for k, name in enumerate("abc"):
        m.add(fb.Body(name, shape=BOX, density=1000, position=(k, 0, 0.1)))
    m.add(fb.Revolute("hinge", "a", "b", at=(0.5, 0, 0.1), axis=(0, 1, 0)))
    if contact:
        m.add(fb.Contact(**contact))
    return m


def test_one_line_lets_everything_touch_but_what_a_joint_connects() -> None:
    floor = {("floor", x) for x in "abc"}
    assert pairs(tables(three(friction=0.3))) == floor | {("a", "c"), ("b", "c")}
    assert pairs(tables(three(friction=0.3, joined=True))) == floor | {("a", "b"), ("a", "c"), ("b", "c")}


def test_exclusions_and_lists() -> None:
    t = tables(three(friction=0.3, exclude=[("a", "c"), ("b", "ground")]))
    assert pairs(t) == {("floor", "a"), ("floor", "c"), ("b", "c")}
    assert pairs(tables(three(friction=0.3, between="c", others=["a", "floor"]))) == {("floor", "c"), ("a", "c")}
    assert pairs(tables(three(friction=0.3, between=["a", "c", "ground"]))) == {
        ("floor", "a"), ("floor", "c"), ("a", "c")}  # fmt: skip


def test_a_joint_to_ground_leaves_out_nothing() -> None:
    """A door closes against its frame, though it hangs on ground."""
    m = three(friction=0.3)
    m.add(fb.Revolute("door", "ground", "c", at=(2, 0, 0.1), axis=(0, 0, 1)))
    assert ("floor", "c") in pairs(tables(m))


def test_a_contact_that_names_bodies_goes_before_materials_and_these_before_the_contact_for_all() -> None:
    m = three(friction=0.3, restitution=0.09)
    m.add(
        fb.Material("ice", friction=0.03),
        fb.Material("rubber", friction="0.8", restitution=0.81, rolling_friction="1 mm"),
    )
    m.replace(fb.Body("a", shape=BOX, density=1000, material="rubber"))
    m.replace(fb.Body("c", shape=fb.Box(edges=(1, 1, 1), material="ice"), density=1000))
    t = tables(m)
    assert row(t, "floor", "b")[[STATIC, KINETIC, RESTITUTION, ACROSS]] == pytest.approx([0.3, 0.3, 0.09, 1])
    assert row(t, "floor", "a")[[KINETIC, RESTITUTION]] == pytest.approx([(0.3 * 0.8) ** 0.5, 0.27])
    assert row(t, "a", "c")[KINETIC] == pytest.approx((0.03 * 0.8) ** 0.5)
    assert row(t, "a", "c")[ROLLING] == pytest.approx(1e-3)
    m.add(fb.MaterialPair("ice", "rubber", friction=0.2, static_friction=0.25))
    assert row(tables(m), "a", "c")[[STATIC, KINETIC, RESTITUTION]] == pytest.approx([0.25, 0.2, 0.27])
    m.add(fb.Contact("special", between=["a", "c"], friction=0.7))
    assert row(tables(m), "a", "c")[[STATIC, KINETIC, RESTITUTION]] == pytest.approx([0.7, 0.7, 0.27])


def test_what_only_one_side_says_holds_for_both() -> None:
    m = three(friction=0.3)
    m.add(fb.Material("rubber", restitution=0.8))
    m.replace(fb.Body("a", shape=BOX, density=1000, material="rubber"))
    assert row(tables(m), "floor", "a")[[KINETIC, RESTITUTION]] == pytest.approx([0.3, 0.8])


def test_nobody_says_the_friction() -> None:
    with pytest.raises(fb.ModelError, match=r"Contact 'contact': the friction of 'a' on 'c' is not given"):
        tables(three(between=["a", "c"]))


def test_grain_and_belt_lie_in_the_axes_of_the_body() -> None:
    m = three(friction=0.4)
    m.add(fb.Material("wood", friction=(0.1, 0.4), grain=(3, 0, 4), surface_velocity=(0, "100 mm/s", 0)))
    turn = (0.5**0.5, 0, 0, 0.5**0.5)  # x to y
    m.replace(fb.Ground("floor", shape=fb.Plane(), orientation=turn, material="wood"))
    t = tables(m)
    assert t.surfaces.grain[0] == pytest.approx([0, 0.6, 0.8])
    assert t.surfaces.belt[0] == pytest.approx([-0.1, 0, 0])
    assert row(t, "floor", "a")[[KINETIC, ACROSS]] == pytest.approx([0.2, 2.0])


def test_shapes_lie_from_the_centre_of_mass() -> None:
    m = fb.Mechanism("two")
    m.add(fb.Body("a", shape=[fb.Sphere(radius=0.1), fb.Box(edges=(0.2, 0.4, 0.6), position=(1, 0, 0))], density=1000))
    m.add(fb.Contact(friction=0.3))
    g = tables(m).geometry
    com = element_numbers(m).bodies["a"].com
    assert g.shape.kind[:].tolist() == [shape_kinds.SPHERE, shape_kinds.BOX]
    assert g.dimensions.place[0] == pytest.approx(-com)
    assert g.dimensions.place[1] == pytest.approx(np.array([1, 0, 0]) - com)
    assert g.dimensions.par[1, :3] == pytest.approx([0.1, 0.2, 0.3])
    assert g.dimensions.radius[1] == pytest.approx(0.14**0.5)


def test_looks_and_holes_touch_nothing_unless_told() -> None:
    m = fb.Mechanism("two")
    shapes = [
        fb.Sphere(radius=0.1),
        fb.Sphere(radius=0.2, looks=True),
        fb.Sphere(radius=0.3, looks=True, contact=True),
        fb.Sphere(radius=0.05, hole=True),
        fb.Sphere(radius=0.4, contact=False),
    ]
    m.add(fb.Body("a", shape=shapes, density=1000), fb.Contact(friction=0.3))
    assert tables(m).geometry.dimensions.par[:, 0].tolist() == [0.1, 0.3]


def test_many_bodies_are_as_single_ones() -> None:
    """Poses, velocities, masses and shapes of a `Bodies` are those of the same bodies described one by one."""
    rng = np.random.default_rng(3)
    n = 5
    p, v, w, e = rng.normal(size=(n, 3)), rng.normal(size=(n, 3)), rng.normal(size=(n, 3)), rng.normal(size=(n, 4))
    shape = [fb.Box(edges=(0.1, 0.2, 0.3), position=(0.2, 0, 0)), fb.Sphere(radius=0.1)]
    s = rng.uniform(0.5, 2.0, n)
    m, single = fb.Mechanism("many"), fb.Mechanism("single")
    m.add(
        fb.Bodies(
            "bricks", shape=shape, density=700, position=p, orientation=e, velocity=v, angular_velocity=w, scale=s
        )
    )
    for k in range(n):
        own = [
            fb.Box(edges=np.array([0.1, 0.2, 0.3]) * s[k], position=(0.2 * s[k], 0, 0)),
            fb.Sphere(radius=0.1 * s[k]),
        ]
        single.add(
            fb.Body(
                f"b{k}",
                shape=own,
                density=700,
                position=p[k],
                orientation=tuple(e[k]),
                velocity=v[k],
                angular_velocity=w[k],
            )
        )
    for x in (m, single):
        x.add(fb.Contact(friction=0.3))
    a, b = tables(m), tables(single)
    for x, y in zip((*a.geometry, *a.carriers.movers, a.carriers.mass, a.carriers.inertia),
                    (*b.geometry, *b.carriers.movers, b.carriers.mass, b.carriers.inertia), strict=True):  # fmt: skip
        assert x == pytest.approx(y, abs=1e-13)
    assert a.name(9) == "bricks[4]"


def test_many_bodies_in_the_plane() -> None:
    m = fb.Mechanism("discs", planar=True)
    m.add(fb.Bodies("discs", shape=fb.Cylinder(radius=0.1, length=0.02), density=1000, position=[(0, 0), (1, 0)],
                    angle=[0, 0.5], angular_velocity=2, velocity=(1, 0)))  # fmt: skip
    m.add(fb.Ground("floor", shape=fb.Plane(normal=(0, 1)), position=(0, -0.1)), fb.Contact(friction=0.1))
    t = tables(m)
    assert t.geometry.shape.kind[:].tolist() == [shape_kinds.PLANE, shape_kinds.SPHERE, shape_kinds.SPHERE]
    assert t.geometry.dimensions.axes[0].reshape(3, 3)[:, 2] == pytest.approx([0, 1, 0])
    assert np.linalg.det(t.geometry.dimensions.axes[0].reshape(3, 3)) == pytest.approx(1)
    pose = t.carriers.movers.pose[1]
    assert pose[3:].reshape(3, 3) == pytest.approx(
        np.array([[np.cos(0.5), -np.sin(0.5), 0], [np.sin(0.5), np.cos(0.5), 0], [0, 0, 1]])
    )
    assert t.carriers.movers.twist.tolist() == [[1, 0, 0, 0, 0, 2]] * 2


def test_model_files_hold_all_of_it() -> None:
    m = three()
    m.parameters["mu"] = 0.3
    m.add(fb.Contact(friction="mu", exclude=[("a", "floor")]))
    m.add(fb.Material("wood", friction=(0.1, 0.4), grain=(1, 0, 0)), fb.Material("belt", surface_velocity=(1, 0, 0)))
    m.add(fb.MaterialPair("wood", "belt", friction=0.2), fb.Contact("special", between=["a", "c"], friction=0.7))
    rng = np.random.default_rng(1)
    m.add(fb.Bodies("balls", shape=fb.Sphere(radius=0.1), density=1000, position=rng.normal(size=(50, 3)),
                    scale=rng.uniform(1, 2, 50), material="wood"))  # fmt: skip
    again = loads(dumps(m), fb.Mechanism)
    assert again == m
    assert dumps(again) == dumps(m)
    assert again["balls"].position.tobytes() == m["balls"].position.tobytes()
    copy = pickle.loads(pickle.dumps(m))
    assert copy == m
    assert not copy["balls"].position.flags.writeable
    assert m.copy() == m
    assert m != again.changed({"balls": None})


def test_a_model_file_needs_two_lines() -> None:
    m = loads("""
        gravity = [0, 0, -9.81]
        [[ground]]
        name = "floor"
        shape = { type = "Plane" }
        [[bulk]]
        name = "balls"
        shape = { type = "Sphere", radius = 0.1 }
        density = 1000
        position = [[0, 0, 1], [0, 0, 2]]
        [[contacts]]
        friction = 0.3
        """, fb.Mechanism)  # fmt: skip
    assert pairs(tables(m)) == {("floor", "balls[0]"), ("floor", "balls[1]"), ("balls[0]", "balls[1]")}


def test_arrays_from_files(tmp_path) -> None:
    rng = np.random.default_rng(2)
    p, s = rng.normal(size=(20, 3)), rng.uniform(1, 2, 20)
    np.save(tmp_path / "where.npy", p)
    np.savetxt(tmp_path / "size.csv", s, delimiter=",")
    lines = ["[[bulk]]", 'name = "balls"', 'shape = { type = "Sphere", radius = 0.1 }', "density = 1000"]
    (tmp_path / "pile.toml").write_text("\n".join([*lines, 'position = "where.npy"', 'scale = "size.csv"']))
    m = fb.load(tmp_path / "pile.toml")
    assert m["balls"].position.tobytes() == p.tobytes()
    assert m["balls"].scale == pytest.approx(s, rel=1e-15)
    assert loads(dumps(m), fb.Mechanism) == m


def test_a_hundred_thousand_spheres() -> None:
    m = fb.Mechanism("pile", gravity=(0, 0, -9.81))
    m.add(
        fb.Bodies(
            "balls", shape=fb.Sphere(radius=0.1), density=1000, position=np.random.default_rng(0).random((100_000, 3))
        )
    )
    m.add(fb.Contact(friction=0.3))
    t = tables(m)
    assert len(t.geometry.shape) == 100_000
    assert t.carriers.mass == pytest.approx(np.full(100_000, 4000 / 3 * np.pi * 0.1**3))
