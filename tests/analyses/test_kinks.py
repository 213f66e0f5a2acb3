"""Forces with another slope, or value, on the other side: judged from all sides at rest, refused by what is linear."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb
from tests.analyses.made import G

LAYERS = ("absolute", "joint")


def slider(force: str, *tables: fb.Table, **parameters: float) -> fb.Mechanism:
    """A block of 1 kg on a level slide, pushed along it by a law of its place."""
    m = fb.Mechanism("slider", planar=True, parameters=parameters)
    m.add(fb.Body("block", mass=1, inertia=1), fb.Translational("slide", "ground", "block", at=(0, 0), axis=(1, 0)))
    m.add(*tables, fb.Actuator("push", "slide.displacement", force=force))
    return m


CORNER = fb.Table("corner", x=(-1, 0, 1), y=(1, 0, -3), interpolation="linear")
ROUND = fb.Table("round", x=(-1, 0, 1), y=(1, 0, -3))

KINKS = {
    "-50*abs(value)": "unstable",  # pushed back on the right, away on the left
    "50*abs(value)": "unstable",
    "-50*abs(value) - 100*value": "stable",
    "where(value < 0, -100*value, -50*value)": "stable",
    "where(value < 0, 100*value, -50*value)": "unstable",
    "-min(100*value, 20*value)": "stable",
    "max(0, -100*value)": "marginal",
    "-100*sqrt(value**2)": "unstable",
    "corner(value)": "stable",
    "abs(value) - 2*max(0, value)": "stable",  # -value on both sides, but not to one who asks at zero
}


@pytest.mark.parametrize("law", KINKS)
def test_an_equilibrium_at_a_kink_is_judged_from_both_sides(law):
    found = slider(law, CORNER).equilibrium()
    assert found.stability == KINKS[law]
    assert found["block.x"] == 0.0
    (kink,) = found.kinks
    assert kink == f"Actuator 'push': its law '{law}' has a kink at push.value = 0 m"
    assert ("kink", kink) in found.lines()
    assert found.as_dict()["kinks"] == [kink]


@pytest.mark.parametrize("law", [*KINKS, "-50*sign(value)", "-5*abs(rate) - 9*value", "-5*sign(rate) - 9*value"])
@pytest.mark.parametrize("layer", LAYERS)
def test_linear_equations_at_a_kink_are_refused(law, layer):
    m = slider(law, CORNER)
    for ask in (m.modes, m.linearize):
        with pytest.raises(fb.SingularityError, match=r"Actuator 'push': its law .* (kink|jumps) at push\.") as said:
            ask(coordinates=layer)
        assert said.value.elements == ("push",)


@pytest.mark.parametrize(
    ("law", "stiffness"),
    [
        ("-50*value*abs(value)", 0.0),
        ("-9*value - 3*rate*abs(rate)", 9.0),  # as drag does
        ("-step(value, 0, 0, 1, 1) - value", 1.0),
        ("-9*value + 0*abs(value - 1e-3)", 9.0),
        ("-9*abs(value - 1) + 9", -9.0),
        ("-100*tanh(1e4*value)", 1e6),
        ("round(value)", 2.0),
    ],
)
@pytest.mark.parametrize("layer", LAYERS)
def test_what_is_smooth_there_is_not_refused(law, stiffness, layer):
    m = slider(law, ROUND)
    assert m.equilibrium().kinks == ()
    assert m.linearize(coordinates=layer).stiffness == pytest.approx(np.array([[stiffness]]), abs=1e-9)


def test_a_force_that_jumps_is_named():
    with pytest.raises(fb.SingularityError, match=r"'-50\*sign\(value\)' jumps at push.value = 0 m"):
        slider("-50*sign(value)").equilibrium()
    with pytest.raises(
        fb.NotConverged, match=r"the search ended where Actuator 'push': its law .* jumps at push.value"
    ):
        slider("where(value < 0, 10, -10)").equilibrium()
    found = slider("-5*sign(rate) - 9*value").equilibrium()  # rates play no part at rest
    assert (found.stability, found.kinks) == ("stable", ())


def test_a_force_without_a_value_is_named():
    m = slider("-10*value/abs(value)")
    for ask in (m.modes, m.equilibrium):
        with pytest.raises(fb.AnalysisError, match="law of Actuator 'push' gives"):
            ask()


def between_ropes(spring: float = 0.0) -> fb.Mechanism:
    """A block between two ropes at their free lengths, across which it may move too."""
    m = fb.Mechanism("between ropes", planar=True)
    m.add(fb.Body("block", mass=1, inertia=1))
    m.add(fb.Rope("left", ["ground", "block"], at=[(-1, 0), (-0.1, 0)], stiffness=100))
    m.add(fb.Rope("right", ["ground", "block"], at=[(1, 0), (0.1, 0)], stiffness=100))
    if spring:
        m.add(fb.Bushing("pad", "ground", "block", at=(0, 0), stiffness=(spring, spring), torsional_stiffness=spring))
    return m


def test_ropes_at_their_free_lengths():
    found = between_ropes(7.0).equilibrium()
    assert found.stability == "stable"
    assert len(found.kinks) == 2
    assert found.kinks[0] == "Rope 'left' has a kink at left.length = 0.9 m"
    with pytest.raises(fb.SingularityError, match=r"Rope 'left' has a kink at left\.length = 0\.9 m; Rope 'right'"):
        between_ropes(7.0).modes()


@pytest.mark.parametrize(("c", "stability"), [(0.37, "stable"), (0.38, "unstable")])
def test_of_two_freedoms_one_kinked(c, stability):
    """V = (3 x^2 + y^2)/2 - c max(0, x - y)^2 has a minimum on its soft side up to c = 3/8."""
    m = fb.Mechanism("two blocks", planar=True, parameters={"c": c})
    for name, stiffness, y in (("a", 3.0, 0.0), ("b", 1.0, 1.0)):
        m.add(fb.Body(name, mass=1, inertia=1, position=(0, y)))
        m.add(fb.Translational(f"slide {name}", "ground", name, at=(0, y), axis=(1, 0)))
        m.add(fb.CoordinateSpring(f"spring {name}", f"slide {name}.displacement", stiffness=stiffness))
    m.add(fb.Sensor("x", of="slide a.displacement"), fb.Sensor("y", of="slide b.displacement"))
    m.add(fb.Actuator("pull", "slide a.displacement", force="2*c*max(0, x - y)"))
    m.add(fb.Actuator("push", "slide b.displacement", force="-2*c*max(0, x - y)"))
    found = m.equilibrium()
    assert found.stability == stability
    assert len(found.kinks) == 2


def test_a_kink_that_nothing_free_crosses_is_no_matter():
    m = slider("-50*abs(value)")
    m.add(fb.Driver("hold", "slide.displacement", "0*t"))
    assert m.equilibrium().kinks == ()
    assert len(m.modes().eigenvalues) == 0


def test_drivers_that_follow_sensors_across_a_kink():
    m = slider("-9*value")
    m.add(fb.Sensor("x", of="slide.displacement"))
    m.add(fb.Body("arm", mass=1, inertia=1, position=(0, 2)), fb.Revolute("A", "ground", "arm", at=(0, 2)))
    m.add(fb.Driver("follow", "A.angle", "abs(x)"))
    with pytest.raises(fb.SingularityError, match=r"Driver 'follow': its law 'abs\(x\)' has a kink at x.value = 0 m"):
        m.modes()


def test_sensitivities_at_a_kink_are_refused():
    with pytest.raises(fb.SingularityError, match=r"has a kink at p = 0"):
        slider("max(0, p) - 9*value", p=0.0).sensitivity(["block.ax"], ["p"])
    with pytest.raises(fb.SingularityError, match=r"has a kink at p = 0"):
        slider("max(0, p) - 9*value", p=0.0).sensitivity(["block.x"], ["p"], analysis="equilibrium")
    with pytest.raises(fb.SingularityError, match=r"has a kink at push.value = 0 m"):
        slider("p - 9*value - abs(value)", p=0.0).sensitivity(["block.x"], ["p"], analysis="equilibrium")
    found = slider("max(0, 1e9*p - 0.5) - 9*value", p=1e-9).sensitivity(["block.x"], ["p"], analysis="equilibrium")
    assert found["block.x", "p"] == pytest.approx(1e9 / 9)  # twice as large as at its kink
    found = slider("p - 9*value - abs(value)", p=1.0).sensitivity(["block.x"], ["p"], analysis="equilibrium")
    assert found["block.x", "p"] == pytest.approx(1 / 10)


def test_an_unstable_side_is_left_downhill():
    """A column whose rope holds it on one side only: it falls to the other."""
    m = fb.Mechanism("column", planar=True, gravity=(0, -G))
    m.add(fb.Body("rod", mass=1, inertia=1 / 12, position=(0, 0.5)), fb.Revolute("A", "ground", "rod", at=(0, 0)))
    m.add(fb.Rope("stay", ["ground", "rod"], at=[(-1, 0), (0, 1)], stiffness=1000))
    found = m.equilibrium()
    assert found.stability == "unstable"
    assert found.kinks == (f"Rope 'stay' has a kink at stay.length = {np.sqrt(2):.6g} m",)
    down = m.equilibrium(stable=True)
    assert down.stability == "stable"


def pushed_together(law: str, names: str) -> fb.Mechanism:
    """Blocks of 1 kg, each on a spring of 10 N/m and pushed by the same law of all their places."""
    m = fb.Mechanism("blocks", planar=True, gravity=(0, 0))
    for k, name in enumerate(names):
        m.add(fb.Body(f"b{name}", mass=1, inertia=1, position=(0, k)))
        m.add(fb.Translational(f"s{name}", "ground", f"b{name}", at=(0, k), axis=(1, 0)))
        m.add(fb.Sensor(name, f"s{name}.displacement"))
    for name in names:
        m.add(fb.Actuator(f"f{name}", f"s{name}.displacement", force=f"-10*value + {law}"))
    return m


@pytest.mark.parametrize(
    ("law", "names"),
    [
        ("30*max(0, min(x, y))", "xy"),
        ("30*where(x > 0, where(y > 0, min(x, y), 0), 0)", "xy"),
        ("15*(abs(x + y) - abs(x - y))/2", "xy"),
        ("30*max(0, min(x, min(y, z)))", "xyz"),
        ("6*max(0, x + y)", "xy"),
    ],
)
def test_kinks_that_meet_are_followed_between_the_coordinates(law, names):
    """Along x = y = a > 0 the force on each block leads away: 20 a, 5 a, 2 a; along x or y alone, back."""
    m = pushed_together(law, names)
    assert m.equilibrium().stability == "unstable"
    for layer in LAYERS:
        with pytest.raises(fb.SingularityError, match="has a kink at"):
            m.modes(coordinates=layer)


def test_kinks_that_meet_may_be_stable_or_open():
    assert pushed_together("4*max(0, x + y)", "xy").equilibrium().stability == "stable"  # 10 > 2*4
    with pytest.raises(fb.SingularityError, match="its stability there is not determined"):
        pushed_together("8*max(0, min(x, y))", "xy").equilibrium()  # no potential, and no motion that grows


def test_what_is_smooth_all_around_has_no_kinks():
    m = pushed_together("x*y + tanh(100*(x - y)) - 3*x*abs(x)", "xy")
    assert m.equilibrium().kinks == ()


def test_a_force_without_a_slope_is_named_where_it_is_to_rest():
    with pytest.raises(
        fb.SingularityError, match=r"'-\(value\*\*2\)\*\*0.5' has no value or no slope at push.value = 0 m"
    ):
        slider("-(value**2)**0.5").equilibrium()


@pytest.mark.parametrize("points", [{"x": (0, 1, 2), "y": (0, -3, -9)}, {"x": (-2, -1, 0), "y": (9, 3, 0)}])
def test_beyond_the_end_of_a_table_nothing_is_known(points):
    m = slider("ended(value)", fb.Table("ended", **points, interpolation="linear"))
    for ask in (m.equilibrium, m.modes):
        with pytest.raises(fb.SingularityError, match=r"'ended\(value\)' has no value or no slope at push.value = 0 m"):
            ask()


@pytest.mark.parametrize(("law", "kind"), [("-sign(value)*sqrt(abs(value))", "stable"), ("sign(value)*sqrt(abs(value))", "unstable"),
                                           ("sqrt(max(-value, 0)) - sqrt(max(value, 0))", "stable")])  # fmt: skip
def test_an_equilibrium_where_a_slope_is_infinite(law, kind):
    """Every direction beside it has other slopes: the search for faces between pieces had no end."""
    m = slider(law)
    assert m.equilibrium().stability == kind
    for ask in (m.linearize, m.modes):
        with pytest.raises(fb.SingularityError, match=r"'push': its law .* has an infinite slope at push\.value = 0 m"):
            ask()


@pytest.mark.parametrize(("law", "at"), [("-value - sign(rate)*sqrt(abs(rate))", r"an infinite slope at push\.rate = 0 m/s"),
                                         ("-2*value - sqrt(value**2 + rate**2)", r"a kink at push\.value = 0 m")])  # fmt: skip
def test_no_linear_equations_at_an_infinite_slope_or_a_cone(law, at):
    with pytest.raises(fb.SingularityError, match=at):
        slider(law).linearize()


@pytest.mark.parametrize("coordinates", LAYERS)
def test_a_parameter_shifts_a_motion_from_rest_at_an_infinite_slope(coordinates):
    """p = s^2 (t - 1/2)^2 with 2 s^2 + s = a: s = 1/2 and ds/da = 1/(4 s + 1) = 1/3 at a = 1."""
    m = slider("0", a=1.0)
    m.add(fb.State("p", rate="a*max(t - 0.5, 0) - sqrt(max(p, 0))"))
    found = m.sensitivity(
        ["p.value"], ["a"], analysis="motion", t_end=1.5, outputs=[0.25, 1.0, 1.5], coordinates=coordinates
    )
    assert found["p.value", "a"] == pytest.approx([0.0, 0.25 / 3, 1.0 / 3], abs=1e-9)
