"""Results of motions in joint coordinates: turned angles, drivers, files, going on, and what health says of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import flyball as fb
from flyball.check import mass_report
from tests.identities.test_results_in_both_layers import agree
from tests.mechanisms import G, four_bar
from tests.results.test_result_files import same

TURN = 2 * np.pi


def wheels(told: float | None = None) -> fb.Mechanism:
    """A shaft, a slide on it, a rotor in that (named from the rotor), and a flag welded to the rotor; drawn wound up."""
    m = fb.Mechanism("wheels", planar=True)
    m.add(fb.Body("shaft", mass=2, inertia=0.5, angle=0.3 + 2 * TURN, angular_velocity=25.0))
    m.add(fb.Body("slide", mass=0.2, inertia=0.01, position=(0.3, 0.1), angle=-0.2, angular_velocity=25.0))
    m.add(fb.Body("rotor", mass=1, inertia=0.2, position=(0.5, 0.1), angle=1.0 - TURN, angular_velocity=-40.0))
    m.add(fb.Body("flag", mass=0.1, inertia=0.01, position=(0.6, 0.1), angle=3.1, angular_velocity=-40.0))
    m.add(fb.Revolute("bearing", "ground", "shaft", at=(0, 0), angle=0.4))
    m.add(fb.Prismatic("groove", "shaft", "slide", at=(0.3, 0.1), axis=(1, 1)))
    m.add(fb.CoordinateSpring("hold", "groove.displacement", stiffness=900, damping=2))
    m.add(fb.Revolute("pin", "rotor", "slide", at=(0.5, 0.1)), fb.Fixed("seam", "rotor", "flag", at=(0.55, 0.1)))
    m.add(fb.TorsionalSpringDamper("coil", "pin", stiffness=0.01, angle=1.0))
    if told is not None:
        m.add(fb.Initial("bearing.angle", value=told))
    return m


def both(m: fb.Mechanism, t: float, **options) -> tuple[fb.Result, fb.Result]:
    """The motion in absolute and in joint coordinates."""
    one, two = (
        m.simulate(t, outputs=31, coordinates=c, rtol=1e-12, atol=1e-13, **options) for c in ("absolute", "joint")
    )
    assert not one.values.structure.tree
    assert two.values.structure.tree
    return one, two


def test_angles_count_turns_in_the_plane():
    """Of bodies from the turns that they are drawn with, of joints from zero; through hinges, slides and welds."""
    r, o = both(wheels(), 2.5)
    assert {j: t.reversed for j, t in o.values.structure.tree_joints.items()} == {
        "bearing": False,
        "groove": False,
        "pin": True,
        "seam": False,
    }
    for x in (r, o):
        start = [x[name].angle[0] for name in ("shaft", "slide", "rotor", "flag")]
        assert start == pytest.approx([0.3 + 2 * TURN, -0.2, 1.0 - TURN, 3.1])
        assert x["bearing"].angle[0] == pytest.approx(0.4)
        assert x["pin"].angle[0] == pytest.approx(0.0, abs=1e-12)
        assert np.ptp(x["shaft"].angle) > 4 * TURN
        assert np.ptp(x["flag"].angle) > 10 * TURN
        assert x["bearing"].angle - 0.4 == pytest.approx(x["shaft"].angle - (0.3 + 2 * TURN))
        assert x["pin"].angle == pytest.approx(x["slide"].angle + 0.2 - x["rotor"].angle + 1.0 - TURN)
        assert x["flag"].angle - x["rotor"].angle == pytest.approx(np.full(len(x.t), 2.1 + TURN))
    agree(r, o, 1e-8)


@pytest.mark.parametrize("told", [0.4 + 3 * TURN, 0.4 - TURN, 3.0])
def test_turns_that_a_joint_is_told_are_not_those_of_bodies(told):
    r, o = both(wheels(told), 0.3)
    for x in (r, o):
        assert x["bearing"].angle[0] == pytest.approx(told)
        assert abs(x["shaft"].angle[0] - (0.3 + 2 * TURN)) < np.pi
    agree(r, o, 1e-8)


@pytest.mark.parametrize("law", ["12*t", "12*t + 4", "12*t - 20"])
def test_a_driven_crank(law):
    """The driver prescribes a coordinate: its effort, and the reaction of the joint without it, are the same."""
    m = four_bar()
    m.add(fb.Driver("motor", "A.angle", law))
    m.add(fb.SpringDamper("spring", "crank", "rocker", at=((0.05, 0.1), (0.45, 0.1)), stiffness=300, damping=3))
    r, o = both(m, 1.0)
    assert o.values.structure.prescribed == {"motor": o.values.structure.place["crank"]}
    assert o.multipliers.shape[1] == len(o.values.structure.rows) + 1
    assert o["A"].torque == pytest.approx(np.zeros(31), abs=1e-9)
    assert o["motor"].work == pytest.approx(r["motor"].work, abs=1e-7)
    agree(r, o, 1e-7)


def spinning() -> fb.Mechanism:
    """A fork that turns about the vertical; a rotor turns and slides on a bar of it: turns in space."""
    m = fb.Mechanism("turntable", gravity=(0, 0, -G))
    m.add(fb.Body("fork", mass=1, inertia=(0.2, 0.2, 0.3), angular_velocity=(0, 0, 30)))
    m.add(fb.Body("rotor", mass=1, inertia=(0.02, 0.01, 0.015), position=(0, 0, 0.2), angular_velocity=(70, 0, 30)))
    m.add(fb.Revolute("foot", "ground", "fork", at=(0, 0, 0), axis=(0, 0, 1)))
    m.add(fb.Cylindrical("bar", "rotor", "fork", at=(0, 0, 0.2), axis=(1, 0, 0), angle=0.5))
    m.add(fb.CoordinateSpring("hold", "bar.displacement", stiffness=2000, damping=3, rest=0.02))
    return m


@pytest.mark.parametrize("make", [wheels, lambda: wheels(0.4 + 3 * TURN), spinning], ids=["plane", "told", "space"])
@pytest.mark.parametrize("way", [("joint", "absolute"), ("absolute", "joint"), ("joint", "joint")], ids="-".join)
def test_going_on_in_other_coordinates(make, way):
    """Whole turns go on, of bodies and joints, and works: the same as one motion."""
    m, exact = make(), {"rtol": 1e-11, "atol": 1e-12}
    whole = m.simulate(0.8, outputs=np.linspace(0.4, 0.8, 11), coordinates="absolute", **exact)
    first = m.simulate(0.4, outputs=3, coordinates=way[0], **exact)
    rest = m.simulate(0.8, start=first, outputs=11, coordinates=way[1], **exact)
    agree(whole, rest, 1e-7)
    for name, work in whole.energy.work.items():
        assert rest.energy.work[name] == pytest.approx(work, abs=1e-8)


def test_files_keep_joint_coordinates(tmp_path: Path):
    """Tree, prescribed coordinates and turns included; drivers' efforts are multipliers too."""
    m = four_bar()
    m.add(fb.Driver("motor", "A.angle", "3*t + 4"), fb.Frame("eye", "coupler", position=(0.1, 0.05)))
    for r in (
        m.simulate(0.5, outputs=6, coordinates="joint"),
        wheels(9.0).simulate(0.1, outputs=3, coordinates="joint"),
    ):
        r.save(tmp_path / "r.nc")
        back = fb.load_result(tmp_path / "r.nc")
        assert r.wound
        assert back.wound == r.wound
        assert back.values.structure.tree == r.values.structure.tree
        assert back.values.structure.tree
        assert back.health.coordinates == r.health.coordinates
        assert str(back.health) == str(r.health)
        same(r, back)


def test_health_says_which_coordinates():
    r = wheels().simulate(0.1, outputs=2, coordinates="joint")
    assert r.health.coordinates.startswith("joint: ")
    assert dict(r.health.lines())["coordinates"] == r.health.coordinates
    assert r.health.as_dict()["coordinates"] == r.health.coordinates
    r.health.coordinates = ""
    assert "coordinates" not in dict(r.health.lines())


def test_masses_and_energies_do_not_ask_for_coordinates():
    """Centres of mass and the inertia of all together where a motion ends, from either layer's coordinates."""
    r, o = (spinning().simulate(0.1, outputs=2, coordinates=c, rtol=1e-11, atol=1e-12) for c in ("absolute", "joint"))
    one, two = (mass_report(x.model, x.values, x.q[-1]) for x in (r, o))
    for name in ("fork", "rotor"):
        assert two[name].position == pytest.approx(one[name].position, abs=1e-8)
    assert two.total.inertia == pytest.approx(one.total.inertia, abs=1e-8)
    assert two.total.position == pytest.approx(one.total.position, abs=1e-8)
    assert one["rotor"].position[1] != pytest.approx(0.0, abs=1e-3)


def test_a_start_that_is_zero_but_for_rounding():
    """Joint coordinates are zero as drawn: tight tolerances must not take rounding for a size to go by."""
    m, before = fb.Mechanism("sliders in the oblique", planar=True, gravity=(0, -9.81)), "ground"
    along = np.array([np.cos(0.3), np.sin(0.3)])
    for i in range(10):
        m.add(fb.Body(f"b{i}", mass=1, inertia=0.1, position=tuple((i + 0.5) * 0.1 * along), angle=0.1 * i + 0.3))
        m.add(fb.Prismatic(f"j{i}", before, f"b{i}", at=tuple(i * 0.1 * along), axis=tuple(along)))
        before = f"b{i}"
    r = m.simulate(0.01, outputs=2, coordinates="joint", rtol=1e-11, atol=1e-13)
    assert r.health.success
    assert 0.0 < np.abs(r.q[0]).max() < 1e-14
