"""Equilibria against closed forms."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import flyball as fb
from tests.analyses.made import G, chain, rod


@pytest.mark.parametrize(
    ("drawn", "angle", "stability"), [(0.4, 0, "stable"), (1.5, 0, "stable"), (2.9, np.pi, "unstable")]
)
def test_a_rod_hangs_or_stands(drawn, angle, stability):
    found = rod(drawn).equilibrium()
    assert found["A.angle"] == pytest.approx(angle, abs=1e-9)
    assert found.stability == stability
    assert found["A.fy"] == pytest.approx(G, rel=1e-9)
    assert found.unbalanced < 1e-9


def test_downhill_from_an_unstable_one():
    found = rod(np.pi).equilibrium(stable=True)
    assert found.stability == "stable"
    assert found.method == "descent"
    assert np.cos(found["A.angle"]) == pytest.approx(1.0, abs=1e-9)


def test_far_from_it():
    found = chain(6, 2.0).equilibrium(stable=True)
    assert found.stability == "stable"
    assert found["rod 5.y"] == pytest.approx(-5.5 / 6, abs=1e-8)


def test_a_spring_against_the_weight():
    """k (theta - 1) + (g / 2) sin theta = 0."""
    m = rod(0.3)
    m.add(fb.TorsionalSpringDamper("spring", joint="A", stiffness=20, angle=1.0))
    angle = m.equilibrium()["A.angle"]
    assert 20 * (angle - 1) + G / 2 * np.sin(angle) == pytest.approx(0, abs=1e-9)


def test_a_hanging_chain():
    """Links between two supports: with the horizontal pull H, tan of link k is (w (k + 1/2) - V) / H."""
    n, span = 12, 0.7
    m = fb.Mechanism("catenary", planar=True, gravity=(0, -G))
    at = np.zeros(2)
    for k in range(n):
        angle = -1.0 if k < n // 2 else 1.0
        way = np.array([np.cos(angle), np.sin(angle)]) / n
        m.add(fb.Body(f"link {k}", mass=1, inertia=0.01, position=tuple(at + way / 2), angle=angle))
        m.add(fb.Revolute(f"J{k}", "ground" if k == 0 else f"link {k - 1}", f"link {k}", at=tuple(at)))
        at = at + way
    m.add(fb.Frame("end", f"link {n - 1}", position=(0.5 / n, 0)))
    m.add(fb.Frame("hook", "ground", position=(span, 0)))
    m.add(fb.Revolute("last", "hook", "end"))
    found = m.equilibrium()
    assert found.stability == "stable"
    slopes = np.tan([found[f"link {k}.angle"] for k in range(n)])
    assert np.diff(slopes, 2) == pytest.approx(np.zeros(n - 2), abs=1e-8)
    pull = abs(found["J0.fx"])
    assert np.diff(slopes) == pytest.approx(np.full(n - 1, G / pull), rel=1e-8)
    assert sum(np.cos(np.arctan(slopes))) / n == pytest.approx(span, rel=1e-9)


def test_nothing_holds_it():
    m = fb.Mechanism("free", planar=True, gravity=(0, -G))
    m.add(fb.Body("stone", mass=2, inertia=1))
    with pytest.raises(fb.NotConverged, match=r"-19.6 N push along stone.y and nothing balances this") as found:
        m.equilibrium()
    assert found.value.residuals["stone.y"] == pytest.approx(-2 * G)


def test_more_torque_than_the_weight_can_hold():
    m = rod(0.5)
    m.add(fb.Motor("motor", joint="A", torque="6"))
    with pytest.raises(fb.NotConverged, match="no equilibrium of 'rod'"):
        m.equilibrium()
    held = m.equilibrium
    m.replace(fb.Motor("motor", joint="A", torque="3"))
    assert np.sin(held()["A.angle"]) == pytest.approx(3 / (G / 2), rel=1e-9)


def test_marginal_where_nothing_pushes_back():
    m = fb.Mechanism("wheel", planar=True, gravity=(0, -G))
    m.add(fb.Body("wheel", mass=1, inertia=1))
    m.add(fb.Revolute("axle", "ground", "wheel", at=(0, 0)))
    assert m.equilibrium().stability == "marginal"


def test_without_any_force_it_stays_where_it_is():
    m = fb.Mechanism("crank", planar=True)
    m.add(fb.Body("crank", mass=1, inertia=0.1, position=(0.3, 0.4)))
    m.add(fb.Revolute("A", "ground", "crank", at=(0, 0)), fb.Driver("motor", "A.angle", "1 + t"))
    found = m.equilibrium(t=2.0)
    assert found["A.angle"] == pytest.approx(3.0)
    assert found["motor.effort"] == pytest.approx(0.0, abs=1e-12)


def test_flutter_of_a_follower_force():
    """Ziegler's column: 2 m and m on two hinges with springs k, a follower force P: it flutters from 2.086 k / l on.

    Ziegler (1952); the closed form (7/2 - sqrt 2) k / l without damping.
    """

    def column(load: float) -> fb.Mechanism:
        m = fb.Mechanism("Ziegler", planar=True, parameters={"load": load})
        for k, mass in enumerate((2.0, 1.0)):
            m.add(fb.Body(f"rod {k}", mass=mass, inertia=1e-9, position=(0, k + 1.0)))
            m.add(fb.Revolute(f"J{k}", "ground" if k == 0 else "rod 0", f"rod {k}", at=(0, float(k))))
            m.add(fb.TorsionalSpringDamper(f"spring {k}", joint=f"J{k}", stiffness=1.0))
        m.add(fb.PointForce("push", "rod 1", at=(0, 2), force=("0", "-load"), axes="body"))
        return m

    limit = 3.5 - np.sqrt(2)
    assert column(0.999 * limit).equilibrium().stability != "unstable"
    assert column(1.001 * limit).equilibrium().stability == "unstable"


def test_preload():
    """The pull of a rope from (0, 1) that holds a level rod: its moment about the hinge is (g / 2) m."""
    m = rod(np.pi / 2)
    m.add(fb.SpringDamper("rope", "ground", "rod", at=((0, 1), (1, 0)), stiffness=100))
    found = m.equilibrium(preload=["rope"])
    assert found.preload["rope"] == pytest.approx(G / 2 * np.sqrt(2), rel=1e-9)
    assert found["rope.force"] == pytest.approx(G / 2 * np.sqrt(2), rel=1e-9)
    assert found["A.angle"] == pytest.approx(np.pi / 2)
    assert m.linearize(about=found).stiffness[0, 0] > 0
    m.add(fb.SpringDamper("useless", "ground", "rod", at=((-1, 0), (1, 0)), stiffness=1))
    with pytest.raises(fb.NotConverged, match="useless cannot balance 'rod'"):
        m.equilibrium(preload=["useless"])


def test_steady_motions_need_a_coordinate_that_turns():
    with pytest.raises(fb.ModelError, match="name a joint's coordinate"):
        rod().equilibrium(turning=["rod.x"])


def with_block(m: fb.Mechanism, stiffness: float, mass: float = 1.0) -> fb.Mechanism:
    """The same with a block beside it, on a spring so stiff that it hides everything else; nothing connects them."""
    m.add(fb.Body("block", mass=mass, inertia=1, position=(3, 0)))
    m.add(fb.Translational("slide", "ground", "block", at=(3, 0), axis=(1, 0)))
    m.add(fb.SpringDamper("bush", "ground", "block", at=((2, 0), (3, 0)), stiffness=stiffness))
    return m


@pytest.mark.parametrize(("stiffness", "mass"), [(1e3, 1.0), (1e9, 1.0), (1e3, 1e6)])
def test_nothing_stiff_or_heavy_beside_it_hides_what_is_wrong(stiffness, mass):
    with pytest.raises(fb.AnalysisError, match="not in equilibrium"):
        with_block(rod(0.3), stiffness, mass).linearize()
    up = with_block(rod(np.pi), stiffness, mass)
    assert up.equilibrium().stability == "unstable"
    assert not up.modes().stable
    assert not up.modes(count=1).stable
    m = with_block(rod(np.pi / 2), stiffness, mass)
    m.add(fb.PointForce("p", "rod", at=(0, 0), force=("0", "0")))
    with pytest.raises(fb.NotConverged, match="cannot balance"):
        m.equilibrium(preload=["p.x"])
    m = with_block(rod(0.3), stiffness, mass)
    m.add(fb.TorsionalSpringDamper("spring", joint="A", stiffness=20, angle=1.0))
    angle = m.equilibrium()["A.angle"]
    assert 20 * (angle - 1) + G / 2 * np.sin(angle) == pytest.approx(0, abs=1e-8)


def test_bricards_mechanism_rests_where_it_swings_about():
    """By symmetry at a right angle; the drawn position, a little off, is none."""
    m = fb.load(Path(__file__).parents[2] / "examples" / "bricard.toml")
    found = m.equilibrium()
    assert found.stability == "stable"
    assert found.unbalanced < 1e-9
    assert m.modes(about=found).stable


@pytest.mark.parametrize("size", [1e-3, 1e3])
def test_any_size_and_mass(size):
    mass = size**3
    m = fb.Mechanism("rod", planar=True, gravity=(0, -G))
    m.add(
        fb.Body("rod", mass=mass, inertia=mass * size**2 / 12, position=(0.2 * size, -0.4 * size), angle=np.arctan(0.5))
    )
    m.add(fb.Revolute("A", "ground", "rod", at=(0, 0)))
    with pytest.raises(fb.AnalysisError, match="not in equilibrium"):
        m.modes()
    found = m.equilibrium()
    assert found.stability == "stable"
    r = np.hypot(0.2, 0.4) * size
    w = np.sqrt(mass * G * r / (mass * size**2 / 12 + mass * r**2))
    assert m.modes(about=found).omega == pytest.approx([w], rel=1e-9)


def test_a_sled_rests_across_a_slope_on_its_edge():
    m = fb.Mechanism("sled", planar=True, gravity=(0, -G))
    m.add(fb.Body("sled", mass=2, inertia=1))
    m.add(fb.KnifeEdge("edge", "ground", "sled", at=(0, 0), axis=(1, 0)))
    found = m.equilibrium()
    assert found["sled.y"] == pytest.approx(0, abs=1e-12)
    assert found.unbalanced < 1e-9
