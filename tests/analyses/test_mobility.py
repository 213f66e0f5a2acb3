"""Free motions by name, redundant sets and cures that really work, special dimensions, singular and shaky positions."""

from __future__ import annotations

import json
from typing import ClassVar

import numpy as np
import pytest
from typer.testing import CliRunner

import flyball as fb
from flyball.cli import app
from flyball.model.element import Element, element
from flyball.model.messages import kind_in_words
from flyball.results.mobility import JointChange
from tests.analyses.linkages import bennett, four_bar_driven
from tests.assembly.test_mobility import in_space, parallelogram, rssr
from tests.mechanisms import bricard, door, example, four_bar, free_body, planar_rod

ALL = tuple(f"R{i}" for i in range(1, 7))


def shaky() -> fb.Mechanism:
    """Two bars in line between fixed hinges: the middle can shake, yet nothing can move."""
    m = fb.Mechanism("shaky", planar=True)
    m.add(planar_rod("left", (0, 0), (1, 0)), planar_rod("right", (1, 0), (2, 0)))
    m.add(fb.Revolute("A", "ground", "left", at=(0, 0)), fb.Revolute("B", "left", "right", at=(1, 0)))
    m.add(fb.Revolute("C", "right", "ground", at=(2, 0)))
    return m


def flat() -> fb.Mechanism:
    """A parallelogram with all its bars in line: the change point of two motions."""
    m = fb.Mechanism("flat", planar=True)
    m.add(planar_rod("left", (0, 0), (1, 0)), planar_rod("right", (1, 0), (2, 0)), planar_rod("bar", (1, 0), (2, 0)))
    m.add(fb.Revolute("A", "ground", "left", at=(0, 0)), fb.Revolute("B", "left", "bar", at=(1, 0)))
    m.add(fb.Revolute("C", "bar", "right", at=(2, 0)), fb.Revolute("D", "ground", "right", at=(1, 0)))
    return m


def two_bars(gap: float) -> fb.Mechanism:
    """One bar of 1 m between hinges 1 + gap apart."""
    m = fb.Mechanism("too short", planar=True)
    m.add(fb.Body("bar", mass=1, inertia=1), fb.Frame("end", "bar", position=(1, 0)), fb.Frame("begin", "bar"))
    m.add(fb.Frame("P", "ground", position=(0, 0)), fb.Frame("Q", "ground", position=(1 + gap, 0)))
    m.add(fb.Revolute("A", "P", "begin"), fb.Revolute("B", "Q", "end"))
    return m


SPECIAL = {  # mechanism, Gruebler, rank, true freedom, freedoms with general dimensions
    "Bricard": (bricard, 0, 29, 1, 0),
    "Bennett": (bennett, -2, 17, 1, 0),
    "four hinges in space": (lambda: in_space(four_bar()), -2, 17, 1, 0),
    "three cranks": (parallelogram, 0, 11, 1, 0),
    "door": (door, -4, 5, 1, 0),
    "RSSR": (rssr, 2, 16, 2, 2),
    "four-bar": (four_bar, 1, 8, 1, 1),
}


@pytest.mark.parametrize("name", SPECIAL)
def test_what_the_freedom_rests_on(name):
    make, gruebler, rank, freedoms, generic = SPECIAL[name]
    found = make().mobility()
    g = found.geometry
    assert (found.gruebler, found.rank, found.freedoms) == (gruebler, rank, freedoms)
    assert (g.nearby, g.generic, g.singular, g.special) == (freedoms, generic, False, generic < freedoms)
    assert ("Gruebler's count is" in g.text) == (generic < freedoms)


def test_singular_and_shaky_positions_are_told_from_overconstrained_mechanisms():
    g = flat().mobility().geometry
    assert (g.here, g.nearby, g.generic, g.singular, g.special) == (2, 1, 1, True, False)
    assert "singular position: 2 freedoms here, 1 next to it" in g.text
    g = shaky().mobility().geometry
    assert (g.here, g.nearby, g.singular) == (1, 0, True)
    assert "can shake, but not move" in g.text
    for m in (flat(), shaky()):
        (only,) = m.mobility().sets
        assert only.here_only
        assert only.cure is None
        assert "in this singular position only" in only.text


SETS = {  # mechanism, sets with their counts
    "Bricard": (bricard, [(ALL, 1)]),
    "Bennett": (bennett, [(("R1", "R2", "R3", "R4"), 3)]),
    "door": (door, [(("upper", "lower"), 5)]),
    "door on two balls": (lambda: door(fb.Spherical, fb.Spherical), [(("upper", "lower"), 1)]),
    "four hinges in space": (lambda: in_space(four_bar()), [(("A", "B", "C", "D"), 3)]),
    "three cranks": (parallelogram, [(("A0", "A1", "A2", "B0", "B1", "B2"), 1)]),
    "four-bar": (four_bar, []),
}


@pytest.mark.parametrize("name", SETS)
def test_sets_name_all_that_take_part(name):
    make, sets = SETS[name]
    found = make().mobility()
    assert [(tuple(sorted(s.elements)), s.count) for s in found.sets] == [(tuple(sorted(e)), n) for e, n in sets]
    assert all(s.contradiction == "" and not s.here_only for s in found.sets)


def test_independent_sets_are_told_apart():
    """A door, a bar welded twice and a four-bar of hinges in space in one model: three sets, nothing mixed."""
    m = in_space(four_bar())
    for e in door().elements():
        m.add(e)
    m.add(fb.Body("plate", mass=1, inertia=(1, 1, 1), position=(5, 0, 0)))
    m.add(fb.Fixed("w1", "ground", "plate", at=(5, 0, 0)), fb.Fixed("w2", "ground", "plate", at=(6, 0, 0)))
    sets = {tuple(sorted(s.elements)): s.count for s in m.mobility().sets}
    assert sets == {("lower", "upper"): 5, ("w1", "w2"): 6, ("A", "B", "C", "D"): 3}


def test_three_cranks_in_space_have_a_set_for_each_loop():
    """Two loops of four parallel hinges, three constraints too many each, and one more that all six share."""
    sets = in_space(parallelogram()).mobility().sets
    assert [(len(s.elements), s.count) for s in sets] == [(4, 3), (4, 3), (6, 1)]


@pytest.mark.parametrize(
    "make",
    [
        bricard,
        bennett,
        door,
        lambda: door(fb.Spherical, fb.Spherical),
        lambda: door(fb.Revolute, fb.Spherical),
        lambda: in_space(four_bar()),
        parallelogram,
        lambda: in_space(parallelogram()),
        lambda: example("bricard.toml"),
    ],
)
def test_cures_work(make):
    """Rebuilt as proposed nothing is redundant, the freedoms are the same, and it moves through the same positions."""
    m = make()
    found = m.mobility()
    cured = m
    for s in found.sets:
        cured = s.cure.applied(cured)
    after = cured.mobility()
    assert (after.freedoms, after.redundancy, after.undetermined) == (found.freedoms, 0, {})
    assert m.mobility().redundancy > 0  # the mechanism itself is as it was
    assert cured.simulate(0.3, outputs=3).health.success


def test_the_cure_of_a_door_is_a_ball_and_a_ball_in_a_groove():
    (only,) = door().mobility().sets
    assert {type(c.by).__name__ for c in only.cure.changes} == {"Spherical", "PointOnLine"}
    assert "replace revolute 'upper' by a spherical joint" in only.advice
    assert only.undetermined["upper"] == ("force x", "force y", "force z", "torque x", "torque y")


def test_a_joint_whose_coordinate_is_driven_keeps_it():
    m = in_space(four_bar())
    m.add(fb.Driver("motor", "A.angle", "2*t"))
    (only,) = m.mobility().sets
    assert only.elements == ("A", "B", "C", "D")
    assert all(c.name != "A" or type(c.by).__name__ == "Cylindrical" for c in only.cure.changes)


def lift(stages: int, sides=("left", "right")) -> fb.Mechanism:
    """A scissor lift: two sides of crossed bars, all hinges parallel, feet on rails, and a platform on top of both."""
    m, y = fb.Mechanism("scissor lift"), (0, 1, 0)
    w, h = 2 * np.cos(0.5), 2 * np.sin(0.5)
    top = stages * h
    m.add(fb.Body("platform", mass=5, inertia=(1, 1, 1), position=(w / 2, 0.5, top)))
    for at, side in enumerate(sides):
        for k in range(stages):
            a, b = f"{side} a{k}", f"{side} b{k}"
            for name in (a, b):
                m.add(fb.Body(name, mass=1, inertia=(0.1, 0.3, 0.3), position=(w / 2, at, (k + 0.5) * h)))
            m.add(fb.Revolute(f"{side} middle {k}", a, b, at=(w / 2, at, (k + 0.5) * h), axis=y))
            if k:
                m.add(fb.Revolute(f"{side} near {k}", f"{side} b{k - 1}", a, at=(0, at, k * h), axis=y))
                m.add(fb.Revolute(f"{side} far {k}", f"{side} a{k - 1}", b, at=(w, at, k * h), axis=y))
        m.add(fb.Revolute(f"{side} foot", "ground", f"{side} a0", at=(0, at, 0), axis=y))
        m.add(fb.PointOnLine(f"{side} rail", "ground", f"{side} b0", at=(w, at, 0), axis=(1, 0, 0)))
        m.add(fb.Revolute(f"{side} head", b, "platform", at=(0, at, top), axis=y))
        m.add(fb.PointOnLine(f"{side} upper rail", "platform", a, at=(w, at, top), axis=(1, 0, 0)))
    return m


def test_cures_of_a_scissor_lift_work():
    """17 bodies, 24 hinges, 4 rails: 27 constraints too many. Cured it rises as the closed form says."""
    m = lift(4)
    found = m.mobility()
    assert (len(m.bodies), found.freedoms, found.redundancy) == (17, 1, 27)
    assert sum(s.count for s in found.sets) == 27
    cured = m
    for s in found.sets:
        cured = s.cure.applied(cured)
    after = cured.mobility()
    assert (after.freedoms, after.redundancy, after.undetermined) == (1, 0, {})
    cured.add(fb.Driver("motor", "left foot.angle", "-0.2*t"))  # about y: the bar rises
    r = cured.kinematics([0.0, 1.0])
    assert r["platform.z"][-1] == pytest.approx(4 * 2 * np.sin(0.5 + 0.2), rel=1e-9)


def test_a_cure_keeps_the_motion_and_not_only_its_number():
    """Two parallel rails: a plane across them would leave one freedom too, but it stops the slide and lets it turn."""
    m = fb.Mechanism("rails")
    m.add(fb.Body("carriage", mass=1, inertia=(1, 1, 1), position=(0, 0.5, 0)))
    m.add(fb.Prismatic("p", "ground", "carriage", at=(0, 0, 0), axis=(1, 0, 0)))
    m.add(fb.Prismatic("q", "ground", "carriage", at=(0, 1, 0), axis=(1, 0, 0)))
    found = m.mobility()
    (before,) = found.motions
    (after,) = found.sets[0].cure.applied(m).mobility().motions
    assert np.allclose(before.velocity, (1, 0, 0, 0, 0, 0))
    assert np.allclose(after.velocity / after.velocity[0], before.velocity)


def test_sets_that_share_joints_need_their_own_changes():
    """A lift of three crosses: what a hinge between two loops lets go counts for one of them only."""
    m = lift(3, sides=("left",))
    found = m.mobility()
    left = found.redundancy
    for s in found.sets:
        m, left = s.cure.applied(m), left - s.count
        assert (m.mobility().redundancy, m.mobility().freedoms) == (left, 1)
    assert left == 0


def test_a_line_of_shafts_has_a_remedy_for_every_set():
    """Each shaft on a bearing, springs about the hinges between them: bearings can be left out, the hinges cannot.

    If the first set leaves out the bearing in the middle, only the hinges are left to the other set.
    """
    m = fb.Mechanism("shaft line")
    for k in range(3):
        m.add(fb.Body(f"s{k}", mass=1, inertia=(0.1, 0.1, 0.1), position=(k, 0, 0)))
    m.add(fb.Revolute("B0", "ground", "s0", at=(0, 0, 0), axis=(1, 0, 0)), fb.Driver("motor", "B0.angle", "t"))
    for k in (1, 2):
        m.add(fb.Cylindrical(f"B{k}", "ground", f"s{k}", at=(k, 0, 0), axis=(1, 0, 0)))
        m.add(fb.Revolute(f"C{k}", f"s{k - 1}", f"s{k}", at=(k - 0.5, 0, 0), axis=(1, 0, 0)))
        m.add(fb.TorsionalSpringDamper(f"w{k}", joint=f"C{k}", stiffness=3))
    found = m.mobility()
    assert (found.freedoms, found.redundancy) == (2, 8)
    for s in found.sets:
        m = s.cure.applied(m)
    assert (m.mobility().freedoms, m.mobility().redundancy) == (2, 0)


def test_a_kind_of_joint_is_named_in_words():
    assert JointChange("J", kind_in_words(fb.PointInPlane), None).text == "leave out point in plane 'J'"


def test_where_the_search_for_cures_is_cut_it_says_so(monkeypatch):
    from flyball.mobility import remedies

    assert "search_cut" not in door().mobility().sets[0].as_dict()
    monkeypatch.setattr(remedies, "MAX_TESTS_PER_SET", 0)
    (only,) = door().mobility().sets
    assert only.cure is None
    assert only.advice == "no remedy by another joint was found; the search was cut after 0 choices"
    assert only.as_dict()["search_cut"] == only.cut


def test_a_new_kind_of_joint_takes_part_in_cures_by_what_its_class_says():
    """A cheap kind that holds a point is proposed for a door; no list anywhere names it."""

    @element
    class Ball(fb.Spherical):
        stand_in: ClassVar[float] = 0.1
        called: ClassVar[str] = "a ball of our own"

    try:
        (only,) = door().mobility().sets
    finally:
        del Element.registry["Ball"]
    assert "by a ball of our own" in only.advice


def test_what_is_welded_twice_is_welded_once():
    m = fb.Mechanism("welds")
    m.add(fb.Body("b", mass=1, inertia=(1, 1, 1)))
    m.add(fb.Fixed("w1", "ground", "b", at=(0, 0, 0)), fb.Fixed("w2", "ground", "b", at=(1, 0, 0)))
    (only,) = m.mobility().sets
    assert (only.count, only.cure.text) == (6, "leave out fixed 'w1'")


def test_contradictions_are_told_from_redundancy():
    """A bar 1 m too short; drivers that ask for different angles, for different rates."""
    found = two_bars(1.0).mobility()
    (only,) = found.sets
    assert (set(only.elements), only.contradiction) == ({"A", "B"}, "position")
    assert only.gap == pytest.approx(1.0, rel=1e-6)
    assert not found.as_dict()["closed"]
    assert "cannot agree on positions" in str(found)
    m = four_bar_driven()
    m.add(fb.Driver("second", "D.angle", "0.2 + 0*t"))
    (only,) = m.mobility().sets
    assert (set(only.elements), only.contradiction) == ({"A", "B", "C", "D", "motor", "second"}, "position")
    assert "leave out one of motor, second" in only.advice
    m = four_bar_driven("1 + 6*t")
    m.add(fb.Driver("second", "A.angle", "1 + 5*t"))
    (only,) = m.mobility().sets
    assert (set(only.elements), only.contradiction) == ({"motor", "second"}, "velocity")
    m = four_bar_driven("1 + 6*t")
    m.add(fb.Driver("second", "A.angle", "1 + 6*t"))
    (only,) = m.mobility().sets
    assert (only.contradiction, only.cure.text) == ("", "leave out driver 'motor'")


def test_freedoms_are_named():
    assert [x.name for x in free_body().mobility().motions[3:]] == ["b.x", "b.y", "b.z"]
    assert "turns about (1, 0, 0) through (0, 0, 0) m" in free_body().mobility().motions[0].text
    (spin, turn) = rssr().mobility().motions
    assert (turn.name, turn.bodies) == ("A.angle", ("crank", "coupler", "rocker"))
    assert spin.bodies == ("coupler",)
    assert "coupler spins about its own axis" in spin.name
    names = {x.name for x in example("governor.toml").mobility().motions}
    assert names == {"left hinge.angle", "right hinge.angle", "guide.displacement", "bearing.angle"}


@pytest.mark.parametrize("make", [rssr, bricard, four_bar, lambda: example("governor.toml"), free_body])
def test_free_motions_are_motions_and_span_all_of_them(make):
    """G v = 0 for each, they are independent, and as many as there are freedoms."""
    found = make().mobility()
    a = found.there.assembly
    a.compiled.at(a.t, a.q, 0.0 * a.v)
    V = np.column_stack([x.velocity for x in found.motions])
    assert np.linalg.matrix_rank(V / np.abs(V).max(axis=0)) == found.freedoms == len(found.motions)
    assert np.abs(a.compiled.jacobian() @ V).max(initial=0.0) < 1e-9 * np.abs(V).max()


def test_a_large_mechanism_is_named_too():
    """520 links: the sparse way, up to 64 freedoms by name, each moving its neighbours only."""
    from tests.assembly.test_mobility import links

    found = links(0.5).mobility()
    assert found.freedoms == 520
    assert len(found.motions) == 64
    assert all(len(x.bodies) <= 2 and x.coordinate.startswith("J") for x in found.motions)
    assert "and 508 more" in str(found)


def test_sets_of_a_large_mechanism():
    """Ninety four-bars of hinges in space: 270 constraints too many, in sets of one loop each."""
    m, flat = fb.Mechanism("many"), four_bar()
    for i in range(90):
        for b in flat.bodies:
            m.add(fb.Body(f"{b.name} {i}", mass=1, inertia=(1, 1, 1), position=(b.position[0] + i, b.position[1], 0)))
        for j in flat.joints:
            first = "ground" if j.body_i == "ground" else f"{j.body_i} {i}"
            at = (j.at[0] + i, j.at[1], 0)
            m.add(fb.Revolute(f"{j.name} {i}", first, f"{j.body_j} {i}", at=at, axis=(0, 0, 1)))
    found = m.mobility()
    assert (found.freedoms, found.redundancy) == (90, 270)
    assert {(len(s.elements), s.count) for s in found.sets} == {(4, 3)}
    assert all(len({name[2:] for name in s.elements}) == 1 for s in found.sets)


def test_a_motion_in_which_very_many_bodies_move_is_found():
    """600 windows: one freedom, in which all 1801 bodies move."""
    (only,) = example("n_four_bar.py", windows=600).mobility().motions
    assert (only.name, len(only.bodies)) == ("A0.angle", 1201)


def test_the_command(tmp_path):
    path = tmp_path / "m.toml"
    bricard().save(path)
    said = CliRunner().invoke(app, ["mobility", str(path)])
    assert said.exit_code == 0
    assert "rests on special dimensions: Gruebler's count is 0, the true freedom 1" in said.stdout
    data = json.loads(CliRunner().invoke(app, ["mobility", str(path), "--json"]).stdout)
    assert (data["rank"], data["rows"], data["geometry"]["generic"]) == (29, 30, 0)
    assert data["sets"][0]["elements"] == list(ALL)
    said = CliRunner().invoke(app, ["mobility", str(path), "--set", "x=1"])
    assert said.exit_code == 2


def test_gaps_of_drivers_are_in_their_own_units():
    """Two drivers of one crank, 1 rad/s apart, in a mechanism of any size; of a slide, 0.5 m/s."""
    for size in (0.01, 100.0):
        m = fb.Mechanism("crank", planar=True)
        m.add(fb.Body("a", mass=1, inertia=1, position=(size, 0)), fb.Revolute("A", "ground", "a", at=(0, 0)))
        m.add(fb.Driver("one", "A.angle", "2*t"), fb.Driver("two", "A.angle", "3*t"))
        (only,) = m.mobility().sets
        assert (only.gap, only.unit) == (pytest.approx(1.0, rel=1e-9), "rad/s")
        assert "1 rad/s apart" in only.text
    m = fb.Mechanism("slide", planar=True)
    m.add(fb.Body("a", mass=1, inertia=1), fb.Translational("P", "ground", "a", at=(0, 0), axis=(1, 0)))
    m.add(fb.Driver("one", "P.displacement", "2*t"), fb.Driver("two", "P.displacement", "1.5*t"))
    (only,) = m.mobility().sets
    assert (only.gap, only.unit) == (pytest.approx(0.5, rel=1e-9), "m/s")
