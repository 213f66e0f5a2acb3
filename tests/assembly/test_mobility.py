"""Freedoms by Gruebler and by rank, redundant joints by name, and motions without inertia refused by name."""

import numpy as np
import pytest

import flyball as fb
from flyball.assembly.assemble import assemble
from flyball.mobility.mobility import mobility
from tests.mechanisms import bricard, door, example, four_bar, free_body, planar_rod, spatial_four_bar


def rssr():
    """Revolute, spherical, spherical, revolute: the coupler may also spin about itself."""
    m = fb.Mechanism("RSSR")
    for e in spatial_four_bar().elements():
        if e.name not in ("C", "A.angle"):
            m.add(e)
    m.add(fb.Spherical("C", "coupler", "rocker", at=(0.2, 0.5, 0.35)))
    return m


def parallelogram(bars=3):
    """Equal cranks side by side: every crank beyond the second is redundant."""
    m = fb.Mechanism("parallelogram", planar=True)
    m.add(planar_rod("coupler", (0.3, 1), (0.3 + bars - 1, 1)))
    for i in range(bars):
        m.add(planar_rod(f"crank {i}", (i, 0), (i + 0.3, 1)))
        m.add(fb.Revolute(f"A{i}", "ground", f"crank {i}", at=(i, 0)))
        m.add(fb.Revolute(f"B{i}", f"crank {i}", "coupler", at=(i + 0.3, 1)))
    return m


def in_space(flat):
    """A planar mechanism of revolutes, drawn in space."""
    m = fb.Mechanism(flat.name)
    for b in flat.bodies:
        m.add(fb.Body(b.name, mass=b.mass, inertia=(1, 1, 1), position=(*b.position, 0), orientation=(0, 0, b.angle)))
    for j in flat.joints:
        m.add(fb.Revolute(j.name, j.body_i, j.body_j, at=(*j.at, 0), axis=(0, 0, 1)))
    return m


def linked(kind, **more):
    m = fb.Mechanism(kind.__name__)
    m.add(fb.Body("b", mass=1, inertia=(1, 1, 1), position=(1, 0, 0)))
    m.add(kind("J", "ground", "b", **more))
    return m


ALL = [f"R{i}" for i in range(1, 7)]
TABLE = {  # mechanism, freedoms, Gruebler's count, redundant joints
    "free body": (free_body, 6, 6, []),
    "planar four-bar": (four_bar, 1, 1, []),
    "planar four-bar in space": (lambda: in_space(four_bar()), 1, -2, ["A", "B", "C", "D"]),
    "RSSR": (rssr, 2, 2, []),
    "RSUR": (spatial_four_bar, 1, 1, []),
    "parallelogram": (parallelogram, 1, 0, ["A0", "B0", "A1", "B1", "A2", "B2"]),
    "two cranks": (lambda: parallelogram(2), 1, 1, []),
    "door on two hinges": (door, 1, -4, ["upper", "lower"]),
    "door on two balls": (lambda: door(fb.Spherical, fb.Spherical), 1, 0, ["upper", "lower"]),
    "door on hinge and ball": (lambda: door(fb.Revolute, fb.Spherical), 1, -2, ["upper", "lower"]),
    "Bricard": (bricard, 1, 0, ALL),
    "governor": (lambda: example("governor.toml"), 4, 4, []),
    "slider-crank, driven": (lambda: example("slider_crank.toml"), 0, 0, []),
    "heavy top": (lambda: example("heavy_top.toml"), 3, 3, []),
    "thin rod": (lambda: example("thin_rod.toml"), 2, 2, []),
    "forty windows upright": (lambda: example("n_four_bar.py", windows=40), 1, 1, []),
    "revolute": (lambda: linked(fb.Revolute, at=(0, 0, 0), axis=(1, 2, 3)), 1, 1, []),
    "prismatic": (lambda: linked(fb.Prismatic, at=(0, 0, 0), axis=(1, 2, 3)), 1, 1, []),
    "cylindrical": (lambda: linked(fb.Cylindrical, at=(0, 0, 0), axis=(1, 2, 3)), 2, 2, []),
    "universal": (lambda: linked(fb.Universal, at=(0, 0, 0), axes=((1, 0, 0), (0, 0, 1))), 2, 2, []),
    "spherical": (lambda: linked(fb.Spherical, at=(0, 0, 0)), 3, 3, []),
    "distance": (lambda: linked(fb.Distance, at=((0, 0, 0), (1, 0, 0))), 5, 5, []),
    "fixed": (lambda: linked(fb.Fixed, at=(0, 0, 0)), 0, 0, []),
}


@pytest.mark.parametrize("name", TABLE)
def test_freedoms(name):
    make, freedoms, gruebler, redundant = TABLE[name]
    model = make()
    found = mobility(model, assemble(model))
    assert (found.freedoms, found.gruebler) == (freedoms, gruebler)
    assert found.redundancy == freedoms - gruebler
    assert sorted(found.redundant) == sorted(redundant)
    report = model.check()
    assert (report.freedoms, report.gruebler, sorted(report.redundant)) == (freedoms, gruebler, sorted(redundant))


def test_flat_four_bar_counts_its_singular_position():
    """At the flat position the window of A02 has a second, instantaneous freedom: mobility jumps from 1 to N + 1."""
    m = fb.Mechanism("flat", planar=True)
    m.add(planar_rod("left", (0, 0), (1, 0)), planar_rod("right", (1, 0), (2, 0)), planar_rod("bar", (1, 0), (2, 0)))
    m.add(fb.Revolute("A", "ground", "left", at=(0, 0)), fb.Revolute("B", "left", "bar", at=(1, 0)))
    m.add(fb.Revolute("C", "bar", "right", at=(2, 0)), fb.Revolute("D", "ground", "right", at=(1, 0)))
    found = mobility(m, assemble(m))
    assert (found.freedoms, found.gruebler) == (2, 1)
    assert sorted(found.redundant) == ["A", "B", "C", "D"]


def test_an_independent_constraint_is_not_called_redundant():
    """Beside a redundant door, a pendulum of its own is not named."""
    m = door()
    m.add(fb.Body("bob", mass=1, inertia=(1, 1, 1), position=(3, 0, 0)))
    m.add(fb.Spherical("pivot", "ground", "bob", at=(3, 0, 1)))
    found = mobility(m, assemble(m))
    assert set(found.redundant) == {"upper", "lower"}
    assert "pivot" not in found.undetermined


def test_size_and_units_do_not_change_the_count():
    """The same mechanism a thousand times larger or smaller."""
    for scale in (1e-3, 1.0, 1e3):
        m = fb.Mechanism("scaled")
        P = scale * np.array([(0, 0, 0), (1, 0, 0), (1, -1, 0), (1, -1, 1), (0, -1, 1), (0, 0, 1)])
        names = ["ground", *(f"rod {i}" for i in range(1, 6)), "ground"]
        for i in range(5):
            m.add(fb.Body(names[i + 1], mass=1, inertia=(scale**2,) * 3, position=(P[i] + P[i + 1]) / 2))
        for j, at in zip(bricard().joints, P, strict=True):
            m.add(fb.Revolute(j.name, j.body_i, j.body_j, at=at, axis=j.axis))
        found = mobility(m, assemble(m))
        assert (found.freedoms, found.rank) == (1, 29)


def test_motion_without_inertia_is_refused_by_name():
    """A thin rod on two balls may spin about itself, a bob that is pushed off its centre may turn: which body, about what."""
    m = fb.Mechanism("spins")
    m.add(fb.Body("rod", mass=1, inertia=(1 / 12, 1 / 12, 0), position=(0, 0, 0.5)))
    m.add(fb.Spherical("ball", "ground", "rod", at=(0, 0, 0)))
    with pytest.raises(fb.ModelError, match=r"body 'rod' can turn about \(-?0, -?0, -?1\).* without any inertia"):
        m.simulate(1.0)
    m = fb.Mechanism("point", planar=True)
    m.add(fb.Body("bob", mass=1, inertia=0, position=(1, 0)), fb.Distance("wire", "ground", "bob", at=((0, 0), (1, 0))))
    m.add(fb.PointForce("push", "bob", force=(1, 0), at=(1, 0.1)))
    with pytest.raises(fb.ModelError, match=r"body 'bob' can turn .* without any inertia"):
        m.simulate(1.0)


def test_missing_inertia_that_nothing_needs_is_fine():
    """A point mass on a revolute: its rotation moves its mass."""
    r = example("point_mass_pendulum.toml").simulate(0.5)
    assert r.health.success
    assert r.energy.drift < 1e-7 * r.energy.kinetic.max()


def test_a_long_chain_is_counted_by_the_sparse_rank():
    """Beyond 1500 velocities the rank comes from a sparse factorisation: the count is the same."""
    links = 520
    m = fb.Mechanism("long", planar=True)
    before = "ground"
    for i in range(links):
        m.add(planar_rod(f"rod {i}", (i, 0), (i + 1, 0.1 * (i % 2))))
        m.add(fb.Revolute(f"J{i}", before, f"rod {i}", at=(i, 0.0 if i == 0 else 0.1 * ((i - 1) % 2))))
        before = f"rod {i}"
    m.add(fb.Fixed("wall", "ground", "rod 0", at=(0, 0)))
    found = mobility(m, assemble(m))
    assert found.velocities == 1560
    assert (found.freedoms, found.redundancy) == (links - 1, 2)
    assert set(found.redundant) & {"J0", "wall"}


@pytest.mark.parametrize("make", [bricard, door, spatial_four_bar, four_bar, lambda: parallelogram(3)])
def test_large_mechanisms_are_told_the_same(make, monkeypatch):
    """The sparse way, which large mechanisms take, names the same joints and reactions as the dense one."""
    from flyball.mobility import null_spaces
    from flyball.numerics import rank

    m = make()
    a = assemble(m)
    dense = mobility(m, a)
    for module in (null_spaces, rank):
        monkeypatch.setattr(module, "MAX_SVD_SIZE", 0)
    assert mobility(m, a) == dense
    for module in (null_spaces, rank):
        monkeypatch.setattr(module, "MAX_DOUBTFUL_SVD_SIZE", 0)
    assert mobility(m, a) == dense


def links(end: float) -> fb.Mechanism:
    """520 links; the last is a point mass, this far from its hinge."""
    m = fb.Mechanism("long", planar=True)
    for i in range(520):
        last = i == 519
        m.add(fb.Body(f"b{i}", mass=1, inertia=0.0 if last else 0.1, position=(i + (end if last else 0.5), 0)))
        m.add(fb.Revolute(f"J{i}", f"b{i - 1}" if i else "ground", f"b{i}", at=(i, 0)))
    return m


def test_a_large_mechanism_may_not_move_without_inertia_either():
    """A bob in its own hinge that is turned has no inertia: refused by name; off the hinge, turning moves it; left
    alone it is a point mass, which does not turn.
    """
    turned = links(0.0)
    turned.add(fb.PointTorque("torque", "b519", torque=1))
    with pytest.raises(fb.ModelError, match=r"body 'b519' can turn .* without any inertia.*PointTorque 'torque'"):
        turned.simulate(0.01)
    assert links(0.5).check().freedoms == 520
    assert links(0.0).check().freedoms == 519


def windows(count: int) -> fb.Mechanism:
    """Square four-bars in space beside one another: three constraints too many each."""
    m = fb.Mechanism("windows")
    for k in range(count):
        x = 3.0 * k
        for name, at in (("a", (x, 0.5, 0)), ("b", (x + 0.5, 1, 0)), ("c", (x + 1, 0.5, 0))):
            m.add(fb.Body(f"{name}{k}", mass=1, inertia=(1, 1, 1), position=at))
        for name, i, j, at in (
            ("A", "ground", f"a{k}", (x, 0, 0)),
            ("B", f"a{k}", f"b{k}", (x, 1, 0)),
            ("C", f"b{k}", f"c{k}", (x + 1, 1, 0)),
            ("D", "ground", f"c{k}", (x + 1, 0, 0)),
        ):
            m.add(fb.Revolute(f"{name}{k}", i, j, at=at, axis=(0, 0, 1)))
    return m


def test_all_that_depends_on_something_is_named_in_a_large_mechanism_too():
    """76 windows: 1520 rows, 228 too many, and all 304 joints take part."""
    m = windows(76)
    found = mobility(m, assemble(m))
    assert (found.rows, found.redundancy, found.freedoms) == (1520, 228, 76)
    assert set(found.redundant) == set(found.undetermined) == {f"{c}{k}" for c in "ABCD" for k in range(76)}
    assert found.cut == "" and found.as_dict()["cut"] == ""


def test_sets_of_a_large_mechanism_are_counted_where_they_are_not_all_sought(monkeypatch):
    """Three constraints too many in each of two windows; of each window's one is looked into."""
    from flyball.mobility import mobility as redundancy

    monkeypatch.setattr(redundancy, "MAX_DOUBTFUL_SVD_SIZE", 0)
    monkeypatch.setattr(redundancy, "MAX_DEPENDENCIES", 1)
    m = windows(2)
    assert [s.count for s in mobility(m, assemble(m)).sets] == [3, 3]


def test_a_list_that_is_cut_says_so(monkeypatch):
    """Where there is no room for all dependencies the true count stands beside what is named."""
    from flyball.numerics import rank

    m = windows(5)
    a = assemble(m)
    for name in ("MAX_SVD_SIZE", "MAX_DOUBTFUL_SVD_SIZE"):
        monkeypatch.setattr(rank, name, 0)
    monkeypatch.setattr(rank, "ROOM", 700)  # 7 vectors of 100 rows
    found = mobility(m, a)
    assert found.redundancy == 15
    words = "named are those that 7 of 15 constraints too many touch: there may be more"
    assert found.cut == found.as_dict()["cut"] == words
    assert words in str(found) and words in str(m.check()) and words in str(m.simulate(1e-3).health)
