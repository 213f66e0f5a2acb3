"""What has no derivative, or one that is not found, is refused with names."""

from __future__ import annotations

import pytest

import flyball as fb


def cart(law: str) -> fb.Mechanism:
    """A cart that a force pushes by a law."""
    m = fb.Mechanism("cart", planar=True, parameters={"v0": 1.0, "F": 2.0, "t1": 0.4})
    m.add(fb.Body("cart", mass=1, inertia=1, position=(0, 0), velocity=("v0", 0)))
    m.add(fb.Translational("rail", "ground", "cart", at=(0, 0), axis=(1, 0)))
    m.add(fb.Sensor("x", "cart.x"))
    m.add(fb.PointForce("push", "cart", force=(law, "0")))
    return m


@pytest.mark.parametrize("law", ["where(x > 0.5, -F, 0)", "-F*sign(x - 0.5)", "where(t > 0.1 and x >= 0.5, F, 0)"])
def test_a_law_that_jumps_at_a_place_is_refused(law):
    with pytest.raises(fb.ModelError, match=r"'push'.* decides by 'x'.* Write a smooth law.*step\("):
        cart(law).sensitivity(["cart.vx"], ["v0"], analysis="motion", t_end=0.8)


def test_a_law_that_jumps_at_a_time_is_followed_unless_the_time_is_asked_for():
    """dv/dF = -(t - t1), dv/dv0 = 1."""
    m = cart("where(t > t1, -F, 0)")
    found = m.sensitivity(["cart.vx"], ["F", "v0"], analysis="motion", t_end=0.8, outputs=3)
    assert found.derivatives[-1, 0] == pytest.approx([-0.4, 1], abs=1e-6)
    with pytest.raises(fb.ModelError, match="decides by 't1'"):
        m.sensitivity(["cart.vx"], ["t1"], analysis="motion", t_end=0.8)
    assert m.sensitivity(["cart.ax"], ["t1", "F"], t=0.6).derivatives[0, 0] == pytest.approx([0, -1])


def test_a_law_that_sets_in_without_a_jump_is_followed():
    """A buffer of 100 N/m at 0.5 m: the cart comes back as fast as it came, so dv/dv0 = -1."""
    found = cart("-100*max(0, x - 0.5)").sensitivity(["cart.vx"], ["v0"], analysis="motion", t_end=1.2, outputs=3)
    assert found.values[-1, 0] == pytest.approx(-1, abs=1e-6)
    assert found.derivatives[-1, 0, 0] == pytest.approx(-1, abs=1e-5)


def two_bearings() -> fb.Mechanism:
    """A plate on a hinge at each end of one axis, off which its weight hangs: five rows too many."""
    m = fb.Mechanism("plate", gravity=(0, 0, -9.81), parameters={"mass": 2.0, "x": 0.5})
    m.add(fb.Body("plate", mass="mass", inertia=(0.1, 0.1, 0.1), position=("x", 0, -0.2)))
    for name, x in (("left", 0.0), ("right", 1.0)):
        m.add(fb.Revolute(name, "ground", "plate", at=(x, 0, 0), axis=(1, 0, 0)))
    m.add(fb.PointForce("push", "plate", force=("0", "0", "0")))
    return m


@pytest.mark.parametrize("coordinates", ["absolute", "joint"])
def test_reactions_that_redundancy_leaves_open_are_refused(coordinates):
    m = two_bearings()
    for name in ("left.fz", "right.ty"):
        with pytest.raises(fb.ModelError, match=rf"'{name}' is not determined: redundant .*right\)"):
            m.linearize(["push.z"], [name], coordinates=coordinates)
    assert m.linearize(["push.y"], ["left.angle"], coordinates=coordinates).D.shape == (1, 1)
    with pytest.raises(fb.ModelError, match=r"'right.fx' is not determined"):
        m.sensitivity(["plate.z", "right.fx"], ["mass"])
    with pytest.raises(fb.ModelError, match=r"'left.fz' is not determined"):
        m.sensitivity(["left.fz"], ["mass"], analysis="equilibrium")
    with pytest.raises(fb.ModelError, match=r"'left.fz' is not determined"):
        m.sensitivity(["left.fz"], ["mass"], analysis="motion", t_end=0.1, outputs=2)


def test_those_that_it_determines_are_told():
    """A three-hinged arch of spatial hinges: the forces in its plane are determined, half of the beam's weight at A."""
    m = fb.Mechanism("arch", gravity=(0, 0, -9.81), parameters={"mass": 2.0})
    m.add(fb.Body("beam", mass="mass", inertia=(0.1, 0.1, 0.1), position=(0.5, 0, 0)))
    m.add(fb.Revolute("A", "ground", "beam", at=(0, 0, 0), axis=(0, 1, 0)))
    m.add(fb.Body("foot", mass=1, inertia=(0.1, 0.1, 0.1), position=(1, 0, -0.5)))
    m.add(fb.Revolute("B", "beam", "foot", at=(1, 0, 0), axis=(0, 1, 0)))
    m.add(fb.Revolute("C", "ground", "foot", at=(1, 0, -1), axis=(0, 1, 0)))
    with pytest.raises(fb.ModelError, match=r"'B.fy' is not determined: redundant constraints \(A, B, C\)"):
        m.sensitivity(["B.fy"], ["mass"])
    found = m.sensitivity(["B.fx", "A.fz"], ["mass"], verify=True)
    assert found["A.fz", "mass"] == pytest.approx(9.81 / 2, rel=1e-9)
    assert found.difference < 1e-5


def three_cranks() -> fb.Mechanism:
    """Three cranks and a bar, one more than it takes: it moves because they are alike."""
    m = fb.Mechanism("three cranks", planar=True, gravity=(0, -9.81), parameters={"off": 0.0, "load": 1.0})
    m.add(fb.Body("bar", mass="load", inertia=0.5, position=(1.6, 0.8)))
    for k, x in enumerate((0, 2)):
        m.add(fb.Body(f"c{k}", mass=1, inertia=0.1, position=(x + 0.3, 0.4)))
        m.add(fb.Revolute(f"A{k}", "ground", f"c{k}", at=(x, 0)))
        m.add(fb.Revolute(f"B{k}", f"c{k}", "bar", at=(x + 0.6, 0.8)))
    m.add(fb.Distance("rod", "ground", "bar", at=((1, 0), (1.6, 0.8)), length="1 + off"))
    return m


@pytest.mark.parametrize("coordinates", ["absolute", "joint"])
def test_a_length_that_redundant_joints_do_not_allow_to_change_is_refused(coordinates):
    m = three_cranks()
    motion = {"analysis": "motion", "t_end": 0.3, "outputs": 3, "coordinates": coordinates}
    with pytest.raises(fb.ModelError, match=r"'three cranks' cannot be assembled with another 'off': .*rod"):
        m.sensitivity(["bar.x"], ["off"], **motion)
    with pytest.raises(fb.ModelError, match="cannot be assembled with another 'off'"):
        m.sensitivity(["bar.x"], ["off"])
    assert m.sensitivity(["bar.x"], ["load"], **motion, verify=True).difference < 1e-5
