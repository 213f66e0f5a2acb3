"""What is judged at an equilibrium is judged by the size of what is balanced there: closed forms and plain cases."""

from __future__ import annotations

import base64
import gzip
import re

import numpy as np
import pytest
from scipy.special import jn_zeros

import flyball as fb
from tests.analyses.made import G, chain, conical_pendulum


def test_a_box_on_a_rope_may_turn_about_it():
    m = fb.Mechanism("box on a rope", gravity=(0, 0, -G))
    m.add(fb.Body("box", mass=2, inertia=(0.1,) * 3, position=(0, 0, -1)))
    m.add(fb.Rope("rope", ["ground", "box"], at=[(0, 0, 0), (0, 0, -0.8)], stiffness=1e4))
    found = m.equilibrium()
    assert found.stability == "marginal"
    assert found.least == 0.0
    assert found.weakest == {"box.turn z": pytest.approx(1.0)}
    assert found["box.z"] == pytest.approx(-1 - 2 * G / 1e4, rel=1e-12)


def tub(planar: bool, motor: bool = False, laundry: bool = False) -> fb.Mechanism:
    """A tub between springs that pull against each other, with a drum in it."""

    def at(x, y, z=0.0):
        return (x, y) if planar else (x, y, z)

    def inertia(size):
        return size if planar else (size,) * 3

    m = fb.Mechanism("tub", planar=planar, gravity=at(0, -G), parameters={"speed": 0.0})
    m.add(fb.Body("tub", mass=20, inertia=inertia(1.0), position=at(0, 0)))
    m.add(fb.Body("drum", mass=5, inertia=inertia(0.3), position=at(0, 0)))
    m.add(fb.Revolute("axle", "tub", "drum", at=at(0, 0), **({} if planar else {"axis": (0, 0, 1)})))
    for k, (x, y) in enumerate(((-0.3, 0.3), (0.3, 0.3), (-0.3, -0.3), (0.3, -0.3))):
        for side in (0.0,) if planar else (-0.2, 0.2):
            hooks = at(2 * x, 1.7 * y, 1.9 * side), at(x, y, side)
            free = 0.8 * np.linalg.norm(np.subtract(*hooks))
            m.add(fb.SpringDamper(f"spring {k} {side > 0}", "ground", "tub", at=hooks, stiffness=5000, length=free))
    if motor:
        m.add(fb.Driver("motor", "axle.angle", "speed*t"))
    if laundry:
        m.add(fb.Body("laundry", mass=1, inertia=inertia(0.0), position=at(0.2, 0)))
        m.add(fb.Fixed("glue", "drum", "laundry", at=at(0.2, 0)))
    return m


@pytest.mark.parametrize("planar", [True, False])
def test_a_free_drum_in_a_sprung_tub_is_marginal(planar):
    found = tub(planar).equilibrium()
    assert found.stability == "marginal"
    assert found.least == 0.0
    assert found.unbalanced == 0.0


@pytest.mark.parametrize("planar", [True, False])
@pytest.mark.parametrize("laundry", [True, False])
def test_a_held_drum_in_a_sprung_tub_is_stable(planar, laundry):
    m = tub(planar, True, laundry)
    found = m.equilibrium()
    assert found.stability == "stable"
    assert found.unbalanced == 0.0
    layers = [m.modes(about=found, coordinates=layer) for layer in ("absolute", "joint")]
    assert layers[0].stable
    assert layers[0].omega == pytest.approx(layers[1].omega, rel=1e-9)


def test_a_straight_chain_hangs_as_it_is_drawn():
    """J0(2 w sqrt(l / g)) = 0 (D. Bernoulli 1732), to the order of a link's length."""
    found = chain(60).equilibrium()
    assert found.stability == "stable"
    assert found["J0.fy"] == pytest.approx(G, rel=1e-12)
    assert chain(3000).modes(count=2).omega == pytest.approx(jn_zeros(0, 2) / 2 * np.sqrt(G), rel=1e-4)


@pytest.mark.parametrize(("part", "stability"), [(0.99, "stable"), (1.01, "unstable")])
def test_a_column_of_many_links_buckles_at_henckys_load(part, stability):
    """P l = 2 k (1 - cos(pi / (2 n + 1))), clamped below, free above (Hencky 1920); more unknowns than dense ones."""
    n, k = 150, 3.0
    m = fb.Mechanism("column", planar=True)
    for i in range(n):
        m.add(fb.Body(f"b{i}", mass=1, inertia=0.1, position=(0, i + 0.5)))
        m.add(fb.Revolute(f"J{i}", f"b{i - 1}" if i else "ground", f"b{i}", at=(0, i)))
        m.add(fb.TorsionalSpringDamper(f"s{i}", joint=f"J{i}", stiffness=k, damping=1.0))
    load = part * 2.0 * k * (1.0 - np.cos(np.pi / (2 * n + 1)))
    m.add(fb.PointForce("load", f"b{n - 1}", at=(0, n), force=("0", f"-{float(load)!r}")))
    found = m.equilibrium()
    assert found.stability == stability
    assert len(found.freedoms) == len(found.stiffness) == n
    assert (found.least > 0.0) == (stability == "stable")


def test_forces_that_cancel_but_for_rounding():
    """0.1 + 0.2 - 0.3 is 5.6e-17."""
    m = fb.Mechanism("block", planar=True)
    m.add(fb.Body("block", mass=1, inertia=1), fb.Translational("slide", "ground", "block", at=(0, 0), axis=(1, 0)))
    for k, force in enumerate(("0.1", "0.2", "-0.3")):
        m.add(fb.Actuator(f"push {k}", "slide.displacement", force=force))
    assert m.equilibrium().stability == "marginal"
    for layer in ("absolute", "joint"):
        assert set(m.modes(coordinates=layer).kinds) == {"rigid"}


def ziegler(load: float) -> fb.Mechanism:
    """Ziegler's column (1952) with a wheel and a block on the stiffest of springs beside it, which touch nothing."""
    m = fb.Mechanism("Ziegler", planar=True)
    for k, mass in enumerate((2.0, 1.0)):
        m.add(fb.Body(f"rod {k}", mass=mass, inertia=1e-9, position=(0, k + 1.0)))
        m.add(fb.Revolute(f"J{k}", "ground" if k == 0 else "rod 0", f"rod {k}", at=(0, float(k))))
        m.add(fb.TorsionalSpringDamper(f"spring {k}", joint=f"J{k}", stiffness=1.0))
    m.add(fb.PointForce("push", "rod 1", at=(0, 2), force=("0", f"-{load}"), axes="body"))
    m.add(fb.Body("wheel", mass=1, inertia=1), fb.Revolute("axle", "ground", "wheel", at=(0, 0)))
    m.add(fb.Body("block", mass=1, inertia=1, position=(3, 0)))
    m.add(fb.Translational("slide", "ground", "block", at=(3, 0), axis=(1, 0)))
    m.add(fb.SpringDamper("bush", "ground", "block", at=((2, 0), (3, 0)), stiffness=1e14))
    return m


def test_nothing_stiff_or_free_beside_it_hides_flutter_or_makes_it_up():
    limit = 3.5 - np.sqrt(2)
    assert ziegler(0.99 * limit).equilibrium().stability == "marginal"
    assert ziegler(1.01 * limit).equilibrium().stability == "unstable"


@pytest.mark.parametrize(
    ("options", "why"),
    [
        ({"turning": ["vertical.angle"], "stable": True}, "which a steady motion does not have"),
        ({"turning": ["vertical.angle"], "preload": ["push.x"]}, "is for a mechanism at rest"),
        ({"stable": True, "preload": ["push.x"]}, "give one of the two"),
    ],
)
def test_options_that_say_nothing_beside_each_other_are_refused(options, why):
    m = conical_pendulum()
    m.add(fb.PointForce("push", "bob", force=("0", "0", "0")))
    with pytest.raises(fb.ModelError, match=why):
        m.equilibrium(**options)


def test_a_steady_motion_found_from_another_keeps_the_described_speed():
    """cos(tilt) = g / (l w^2)."""
    near = conical_pendulum(0.9).equilibrium(turning=["vertical.angle"])
    m = conical_pendulum(1.0)
    found = m.equilibrium(turning=["vertical.angle"], start=near)
    assert found.speeds["vertical.angle"] == pytest.approx(np.sqrt(G / np.cos(1.0)), rel=1e-9)
    assert found["bob.z"] == pytest.approx(-np.cos(1.0), rel=1e-7)


def test_the_page_of_an_equilibrium_tells_the_verdict():
    m = fb.Mechanism("rod", planar=True, gravity=(0, -G))
    m.add(fb.Body("rod", mass=1, inertia=1 / 12, position=(0, 0.5)), fb.Revolute("A", "ground", "rod", at=(0, 0)))
    (data,) = re.findall(r'id="recording"[^>]*>([^<]+)<', m.equilibrium().html())
    assert "unstable, found by Newton's method" in gzip.decompress(base64.b64decode(data)).decode("utf-8", "replace")


@pytest.mark.parametrize(("law", "stability"), [("1 - 0.1*rate", "stable"), ("0.1*rate - 1", "unstable")])
@pytest.mark.parametrize("turns", [True, False])
def test_where_nothing_is_left_but_what_turns(law, stability, turns):
    """A lone wheel, a lone block: the speed at which the force is none."""
    m = fb.Mechanism("lone", planar=True, gravity=(0, 0))
    start = {"angular_velocity": 3} if turns else {"velocity": (3, 0)}
    m.add(fb.Body("body", mass=1, inertia=1, **start))
    if turns:
        m.add(fb.Revolute("j", "ground", "body", at=(0, 0)), fb.Motor("push", "j", torque=law))
    else:
        m.add(fb.Translational("j", "ground", "body", at=(0, 0), axis=(1, 0)))
        m.add(fb.Actuator("push", "j.displacement", force=law))
    name = "j.angle" if turns else "j.displacement"
    found = m.equilibrium(turning=[name])
    assert found.speeds == {name: pytest.approx(10.0, rel=1e-12)}
    assert found.stability == stability


def straight(size: float, gravity: tuple[float, float], lift: float = 0.0) -> fb.Mechanism:
    """Two bars between two pivots, their hinge raised by a part of their length: none of them can move."""
    m = fb.Mechanism("straight", planar=True, gravity=gravity)
    for name, x in (("a", 0.5), ("b", 1.5)):
        m.add(fb.Body(name, mass=1, inertia=size**2, position=(x * size, 0)))
    m.add(fb.Revolute("A", "ground", "a", at=(0, 0)), fb.Revolute("B", "a", "b", at=(size, lift * size)))
    m.add(fb.Revolute("C", "ground", "b", at=(2 * size, 0)))
    return m


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e3])
def test_a_load_across_a_singular_position_is_carried_by_no_finite_reaction(size):
    with pytest.raises(fb.SingularityError, match=r"'straight' has no equilibrium .* no finite reaction") as said:
        straight(size, (0, -9.81)).equilibrium()
    assert said.value.elements == ("A", "B", "C")
    assert straight(size, (9.81, 0)).equilibrium().unbalanced < 1e-9  # along the bars: nothing shakes it


@pytest.mark.parametrize("lift", [1e-2, 1e-4])
def test_two_flat_bars_carry_a_load_as_a_three_hinged_arch(lift):
    found = straight(1.0, (0, -9.81), lift).equilibrium()
    assert found.stability == "stable"
    assert found["A.fx"] == pytest.approx(9.81 / (2.0 * lift), rel=1e-6)  # half a weight at the hinge, twice


@pytest.mark.parametrize("links", [*range(1, 14), 150])
def test_a_trolley_that_is_free_to_roll_is_marginal(links):
    """Whatever hangs on it: one translation has no stiffness, and rounding is none."""
    m = fb.Mechanism("trolley", planar=True, gravity=(0, -G))
    m.add(fb.Body("base", mass=5, inertia=1), fb.Prismatic("rail", "ground", "base", at=(0, 0), axis=(1, 0)))
    for i in range(links):
        m.add(fb.Body(f"b{i}", mass=1, inertia=0.01, position=(0, -(i + 0.5) * 0.1)))
        m.add(fb.Revolute(f"r{i}", f"b{i - 1}" if i else "base", f"b{i}", at=(0, -i * 0.1)))
        m.add(fb.CoordinateSpring(f"s{i}", f"r{i}.angle", stiffness=5.0, damping=0.05))
    assert m.equilibrium().stability == "marginal"


@pytest.mark.parametrize("more", [0, 150])
def test_a_strong_damper_hides_no_negative_damping(more):
    m = fb.Mechanism("two", planar=True, gravity=(0, -G))
    m.add(fb.Body("block", mass=1000, inertia=10), fb.Prismatic("g", "ground", "block", at=(0, 0), axis=(1, 0)))
    m.add(fb.CoordinateSpring("s", "g.displacement", stiffness=1e10, damping=1e7))
    for i in range(more + 1):
        m.add(fb.Body(f"p{i}", mass=0.01, inertia=1e-6, position=(3, -0.05)))
        m.add(fb.Revolute(f"P{i}", "ground", f"p{i}", at=(3, 0)))
    m.add(fb.Motor("negative", "P0", torque="5e-6*rate"))
    assert m.equilibrium().stability == "unstable"
