"""Laws that clamp what they are a function of, to stay in its domain: a branch is not continued beyond that.

The positions expected are SciPy's, DOP853 at rtol = 1e-12, atol = 1e-14 and steps of at most 1 ms.
"""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb

FROM_A_TENTH = {
    "-100*abs(value)**1.5*sign(value)": 0.05892637804776968,
    "-3*rate*abs(rate)**0.75 - 100*value": -0.03622296649304908,
    "-rate*exp(-abs(rate)**0.5) - 100*value": -0.0690405633038552,
    "-100*sqrt(max(value, 0)) + 50*sqrt(max(-value, 0))": -0.08700245339890823,
    "where(value > 0, -100*sqrt(value), 50*sqrt(-value))": -0.08700245339890823,
    "-100*asin(min(max(30*value, -1), 1))": 0.09470607463496632,
    "-10*sign(value)*sqrt(abs(value)) - rate": 0.0566452516335034,
}


def end(law: str, gravity: float = 0.0, **options: object) -> float:
    """Where a mass of 1 kg is after 1 s, from rest at 0.1 m."""
    m = fb.Mechanism(planar=True, gravity=(-gravity, 0))
    m.add(fb.Body("b", mass=1, inertia=1, position=(0.1, 0)))
    m.add(fb.Prismatic("x", "ground", "b", at=(0, 0), axis=(1, 0), displacement=0.1))
    m.add(fb.Actuator("k", "x.displacement", force=law))
    return float(m.simulate(1, **options)["x.displacement"][-1])


@pytest.mark.parametrize("law", FROM_A_TENTH)
def test_motion_through_an_end_of_a_domain(law):
    for coordinates in ("joint", "absolute"):
        assert end(law, rtol=1e-9, coordinates=coordinates) == pytest.approx(FROM_A_TENTH[law], abs=1e-8)
    assert end(law, rtol=1e-9, method="rk45") == pytest.approx(FROM_A_TENTH[law], abs=1e-8)
    assert end(law, method="dop853", step=1e-3) == pytest.approx(FROM_A_TENTH[law], abs=2e-4)


@pytest.mark.parametrize("law", FROM_A_TENTH)
def test_implicit_step_from_an_infinite_slope(law):
    """With the slope at the corner Newton's corrections, and the estimated error, were nothing: no force acted."""
    assert end(law, rtol=1e-9, method="radau") == pytest.approx(FROM_A_TENTH[law], abs=1e-6)


def test_an_implicit_method_of_fixed_steps_begins_anew_beyond_the_corner():
    for law in ("-100*sqrt(max(value, 0)) + 50*sqrt(max(-value, 0))", "-10*sign(value)*sqrt(abs(value)) - rate"):
        assert end(law, method="generalised-alpha", step=1e-3) == pytest.approx(FROM_A_TENTH[law], abs=1e-3)


@pytest.mark.parametrize("method", ["auto", "rk45", "radau"])
def test_hertzian_contact_written_as_a_law(method):
    x = end("1e5*max(-value, 0)**1.5", gravity=9.81, rtol=1e-9, method=method)
    assert x == pytest.approx(0.0873828584, abs=1e-7)


def test_a_law_that_leaves_its_domain_as_written_is_refused():
    for law in ("sqrt(value) - 1", "where(value > -0.05, -10 - sqrt(value), 0)"):
        with pytest.raises(fb.SimulationError, match="Actuator 'k'"):
            end(law, gravity=9.81)


def test_a_branch_with_a_pole_at_its_corner():
    """sin(x)/x where a step ends right on x = 0: the value of the law as written."""
    law = "-100*value*where(value > 0, sin(value)/value, 1)"
    smooth = end("-100*where(value > 0, sin(value), value)", rtol=1e-10)
    assert end(law, rtol=1e-10) == pytest.approx(smooth, abs=1e-8)


@pytest.mark.parametrize(
    ("rate", "initial", "value"),
    [
        ("-sign(p)*sqrt(abs(p))", 0.04, 0.0),  # empties in 0.4 s, and stays
        ("t - sign(p)*sqrt(abs(p))", 0.0, 0.25),  # p = t^2/4
        ("-3*sign(p)*sqrt(abs(p)) + 4*sin(5*t)", 1.0, -0.4054908500460201),  # by SciPy, as above
    ],
)
def test_orifice_in_a_state(rate, initial, value):
    m = fb.Mechanism(planar=True)
    m.add(fb.Body("b", mass=1, inertia=1), fb.Prismatic("x", "ground", "b", at=(0, 0), axis=(1, 0)))
    m.add(fb.State("p", rate=rate, initial=initial), fb.Actuator("k", "x.displacement", force="p"))
    for options in ({}, {"method": "radau"}, {"method": "rk45"}, {"coordinates": "absolute"}):
        assert m.simulate(1, **options)["p"].output[-1] == pytest.approx(value, abs=2e-7)


@pytest.mark.parametrize("flow", ["sign(p)*sqrt(abs(p))", "p*abs(p)"])
def test_what_a_smooth_product_is_multiplied_by_keeps_its_corners(flow):
    """A brake by the pressure p: 1 m/s is gone at v^2 / 2a = 0.25 m, and the mass rests there."""
    m = fb.Mechanism(planar=True)
    m.add(fb.Body("b", mass=1, inertia=1, velocity=(1, 0)))
    m.add(fb.Prismatic("x", "ground", "b", at=(0, 0), axis=(1, 0)))
    m.add(fb.State("p", rate="1 - p", initial=1))
    m.add(fb.Actuator("k", "x.displacement", force=f"where(rate > 0, -2, 2)*{flow}"))
    run = m.simulate(1)
    assert run["x.displacement"][-1] == pytest.approx(0.25, abs=1e-9)
    assert run.health.steps < 100


@pytest.mark.parametrize(
    ("rate", "initial", "value"),
    [
        ("-sqrt(max(p, 0))", 0.04, 0.0),
        ("-where(p > 0, sqrt(p), 0)", 0.04, 0.0),
        ("t - sqrt(max(p, 0))", 0.0, 0.25),  # p = t^2/4
        ("max(t - 0.5, 0) - sqrt(max(p, 0))", 0.0, 0.0625),  # it rests until then
        ("where(t > 0.5, 1, 0) - 2*sqrt(max(p, 0))", 0.0, 0.17699087224126825),  # by SciPy, as above
    ],
)
def test_state_at_rest_where_a_slope_is_infinite(rate, initial, value):
    """The second derivative of the state was nan there; with radau nothing moved, or the root had no effect."""
    m = fb.Mechanism(planar=True)
    m.add(fb.Body("b", mass=1, inertia=1), fb.Prismatic("x", "ground", "b", at=(0, 0), axis=(1, 0)))
    m.add(fb.State("p", rate=rate, initial=initial), fb.Actuator("k", "x.displacement", force="p"))
    for options in ({}, {"method": "radau"}, {"method": "rk45"}, {"coordinates": "absolute"}):
        assert m.simulate(1, **options)["p"].output[-1] == pytest.approx(value, abs=2e-7)


@pytest.mark.parametrize(("law", "value"), [("t - sqrt(max(value, 0))", 0.8788363277328602),
                                            ("max(t - 0.5, 0) - sqrt(max(value, 0))", 0.3929833512064383)])  # fmt: skip
def test_implicit_steps_of_a_body_at_rest_where_a_slope_is_infinite(law, value):
    """By SciPy, as above."""
    m = fb.Mechanism(planar=True)
    m.add(fb.Body("b", mass=1, inertia=1), fb.Prismatic("x", "ground", "b", at=(0, 0), axis=(1, 0)))
    m.add(fb.Actuator("k", "x.displacement", force=law))
    for options in ({}, {"method": "radau"}, {"method": "radau", "step": 1e-3}):
        assert m.simulate(2, **options)["x.displacement"][-1] == pytest.approx(value, abs=1e-7)


FROM_REST = {  # where a mass of 1 kg is after 2 s, by SciPy, as above
    "max(t - 0.5, 0) - sqrt(max(value, 0))": 0.3929833512064383,
    "1e-3*t**8 - sqrt(max(value, 0))": 0.0060336720,
    "0.1*t**4 - 3*sign(rate)*sqrt(abs(rate))": 0.0356372396,
    "max(t - 0.5, 0) - 3*sign(rate)*abs(rate)**0.5": 0.0886898142,
}
IMPLICIT = [{"method": "radau"}, {"method": "radau", "step": 1e-3}, {"method": "generalised-alpha", "step": 1e-3}]


@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
@pytest.mark.parametrize("options", IMPLICIT, ids=lambda x: "-".join(map(str, x.values())))
def test_implicit_methods_from_rest_at_an_infinite_slope(options, coordinates):
    """Newton's corrections with the slope there are next to nothing, though the equations are not satisfied."""
    for law, value in FROM_REST.items():
        m = fb.Mechanism(planar=True)
        m.add(fb.Body("b", mass=1, inertia=1), fb.Prismatic("x", "ground", "b", at=(0, 0), axis=(1, 0)))
        m.add(fb.Actuator("k", "x.displacement", force=law))
        assert m.simulate(2, coordinates=coordinates, **options)["x.displacement"][-1] == pytest.approx(value, abs=2e-7)
    for rate, value in (("max(t - 0.5, 0) - sqrt(max(p, 0))", 0.0625), ("t - sqrt(max(p, 0))", 0.25)):
        m = fb.Mechanism(planar=True)
        m.add(fb.Body("b", mass=1, inertia=1), fb.Prismatic("x", "ground", "b", at=(0, 0), axis=(1, 0)))
        m.add(fb.State("p", rate=rate), fb.Actuator("k", "x.displacement", force="p"))
        assert m.simulate(1, coordinates=coordinates, **options)["p"].output[-1] == pytest.approx(value, abs=2e-7)


def test_a_fixed_step_without_a_solution_names_the_steep_law():
    """p is (t - 0.5)^2 / 1e6, to 1e-3 of it; the method gave 19."""
    m = fb.Mechanism(planar=True)
    m.add(fb.Body("b", mass=1, inertia=1), fb.Prismatic("x", "ground", "b", at=(0, 0), axis=(1, 0)))
    m.add(fb.State("p", rate="max(t - 0.5, 0) - 1000*sqrt(max(p, 0))"), fb.Actuator("k", "x.displacement", force="p"))
    with pytest.raises(
        fb.SimulationError, match=r"slope of value of State 'p' may be infinite there\); give a shorter"
    ):
        m.simulate(1, method="generalised-alpha", step=1e-3)
    for options in ({}, {"step": 1e-3}):
        assert m.simulate(1, method="radau", **options)["p"].output[-1] == pytest.approx(2.49999e-7, rel=1e-3)


@pytest.mark.parametrize("law", ["sqrt(max(t-1, 0))**5", "where(t > 1, (t-1)**2*sqrt(t-1), 0)", "sqrt(t)**5", "t**2*sqrt(t)",
                                 "sqrt(max(t-1, 0))**4", "atan2(max(t-1, 0)**3, max(t-1, 0)**3)*0"])  # fmt: skip
def test_driver_whose_law_is_smooth_though_a_part_of_it_is_not(law):
    """The derivatives of the product are finite where those of a factor are infinite."""
    m = fb.Mechanism(planar=True)
    m.add(fb.Body("b", mass=1, inertia=1), fb.Prismatic("x", "ground", "b", at=(0, 0), axis=(1, 0)))
    m.add(fb.Driver("d", "x.displacement", law=law))
    run = m.simulate(2, outputs=20)
    power = 2.5 if "5" in law or "sqrt(t" in law else 2.0
    expected = 0.0 if law.endswith("*0") else np.maximum(run.t - ("-1" in law), 0.0) ** power
    assert run["x.displacement"] == pytest.approx(expected, abs=1e-12)


def test_a_driver_still_leaves_the_domain_of_a_root_in_a_power():
    m = fb.Mechanism(planar=True)
    m.add(fb.Body("b", mass=1, inertia=1), fb.Prismatic("x", "ground", "b", at=(0, 0), axis=(1, 0)))
    m.add(fb.Driver("d", "x.displacement", law="sqrt(0.5 - t)**4"))
    with pytest.raises(fb.SimulationError, match=r"Driver .d. cannot be followed beyond t = 0\.5 s"):
        m.simulate(2)


@pytest.mark.parametrize(
    ("law", "value"),
    [
        ("-where(rate > 0, 1, where(rate < 0, -1, 0)) + 2*t", 1.5**3 / 3),  # rests until t = 0.5
        ("-where(rate > 0 and rate >= 0, 1, -1) + 2*t", 1.5**3 / 3),
        ("-sign(rate)*sign(rate)*sign(rate) + 2*t", 1.5**3 / 3),
        ("-sign(rate)*where(rate > 0, 2, 1) + 2*t", 1 / 3),  # until t = 1
    ],
)
def test_a_pull_grows_until_friction_lets_go(law, value):
    """Parts of the law that decide by the same rate are affine in its side together."""
    m = fb.Mechanism(planar=True)
    m.add(fb.Body("b", mass=1, inertia=1), fb.Prismatic("x", "ground", "b", at=(0, 0), axis=(1, 0)))
    m.add(fb.Actuator("k", "x.displacement", force=law))
    for options in ({}, {"method": "radau"}, {"coordinates": "absolute"}):
        assert m.simulate(2, **options)["x.displacement"][-1] == pytest.approx(value, abs=1e-8)


def test_size_of_an_angle_passes_half_a_turn():
    """|atan2(y, x)| has a corner there, though atan2(y, x) jumps; here even that has no effect."""

    def swing(torque: str) -> float:
        m = fb.Mechanism(planar=True, gravity=(0, -9.81))
        m.add(fb.Body("rod", mass=0.1, inertia=1e-3, position=(0, -0.15)))
        m.add(fb.Revolute("B", "ground", "rod", at=(0, 0)), fb.Initial("B.angle", value="2 deg"))
        m.add(fb.Sensor("th", "B.angle"), fb.Sensor("w", "B.rate"), fb.Motor("M", "B", torque=torque))
        return float(m.simulate(3, rtol=1e-9)["B.angle"][-1])

    wrapped = "atan2(sin(th-pi), cos(th-pi))"
    plain = swing("-0.001*w")
    for size, near, far in ((f"abs({wrapped})", 0.3, 0.5), (f"{wrapped}**2", 0.09, 0.25)):
        catch = f"0.01*step({size}, {near}, 1, {far}, 0) - 0.001*w"
        assert swing(catch) == pytest.approx(plain, abs=1e-8)


def test_the_text_of_a_law_without_a_value_is_told():
    with pytest.raises(fb.SimulationError, match=r"in force = -5 - sqrt\(value\)"):
        end("-5 - sqrt(value)")


def driven_along(law: str, swinging: bool = False) -> fb.Mechanism:
    """A block on a slide, driven by a law of time; ``swinging``: a second body, which is free, hangs on it."""
    m = fb.Mechanism("driven", planar=True)
    m.add(fb.Body("b", mass=2, inertia=1), fb.Prismatic("P", "ground", "b", at=(0, 0), axis=(1, 0)))
    m.add(fb.Driver("D", "P.displacement", law))
    if swinging:
        m.add(fb.Body("c", mass=1, inertia=1, position=(0, 1)), fb.Revolute("R", "b", "c", at=(0, 0)))
    return m


@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
@pytest.mark.parametrize(("exponent", "what"), [(1.5, "acceleration"), (1.2, "acceleration"), (0.5, "velocity")])
def test_a_driver_that_asks_for_what_is_infinite_is_named_with_the_time_and_a_remedy(exponent, what, coordinates):
    m = driven_along(f"max(t - 1, 0)**{exponent}")
    for run in (lambda o: m.simulate(2.0, outputs=9, **o), lambda o: m.kinematics(9, t_end=2.0, **o)):
        with pytest.raises(fb.SimulationError, match=f"infinite {what}") as e:
            run({"coordinates": coordinates})
        assert "Driver 'D' cannot be followed beyond t = 1 s" in str(e.value)
        assert "step5" in str(e.value)
        assert e.value.t == pytest.approx(1.0, rel=1e-9)


@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
@pytest.mark.parametrize("exponent", [2, 2.5])
@pytest.mark.parametrize("swinging", [False, True])
def test_a_driver_whose_acceleration_jumps_is_followed(exponent, coordinates, swinging):
    m = driven_along(f"max(t - 1, 0)**{exponent}", swinging)
    results = [m.simulate(2.0, outputs=9, coordinates=coordinates)]
    results += [] if swinging else [m.kinematics(9, t_end=2.0, coordinates=coordinates)]
    for r in results:
        since = np.maximum(r.t - 1.0, 0.0)
        np.testing.assert_allclose(r["b"].x, since**exponent, atol=1e-9)
        np.testing.assert_allclose(r["b"].vx, exponent * since ** (exponent - 1), atol=1e-8)
        later = r.t > 1.0
        expected = exponent * (exponent - 1) * since[later] ** (exponent - 2)
        np.testing.assert_allclose(r["b"].ax[later], expected, rtol=1e-6)


@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
def test_an_output_time_at_which_a_driver_asks_for_an_infinite_acceleration_names_it(coordinates):
    m = driven_along("max(t - 1, 0)**1.5", swinging=True)
    r = m.simulate(2.0, outputs=9, coordinates=coordinates, rtol=1e-6)
    np.testing.assert_array_equal(np.isnan(r["b"].ax), r.t == 1.0)
    (text,) = r.health.warnings
    assert "the first t = 1 s" in text
    assert "Driver 'D'" in text
