"""Tables beyond their points: refused, held, straight on, or repeated; in forces and drivers, in both layers."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb

LAYERS = ["absolute", "joint"]


def cart(force: str = "", driver: str = "", **table) -> fb.Mechanism:
    """A cart of 2 kg on a rail, with a table "curve" of y = x^2 + x from 0 to 1, or as given."""
    given = {"x": np.linspace(0, 1, 6), "y": np.linspace(0, 1, 6) ** 2 + np.linspace(0, 1, 6)} | table
    m = fb.Mechanism("cart", planar=True, parameters={"late": 0.0})
    m.add(fb.Body("b", mass=2, inertia=1), fb.Prismatic("P", "ground", "b", at=(0, 0), axis=(1, 0)))
    m.add(fb.Table("curve", **given))
    if force:
        m.add(fb.Actuator("A", "P.displacement", force=force))
    if driver:
        m.add(fb.Driver("D", "P.displacement", driver))
    return m


@pytest.mark.parametrize("coordinates", LAYERS)
@pytest.mark.parametrize("beyond", ["hold", "line", "repeat"])
def test_a_driver_has_the_derivatives_of_what_is_beyond(beyond, coordinates):
    """Position, velocity and acceleration: of y = x^2 + x, then constant, then 2 + 3 (x - 1), or all over again."""
    t = np.array([0.25, 0.75, 1.25, 1.75, 2.5])
    u = t - 1.0
    inside = np.array([t**2 + t, 2 * t + 1, 0 * t + 2])
    outside = {"hold": [0 * t + 2, 0 * t, 0 * t], "line": [2 + 3 * u, 0 * t + 3, 0 * t]}
    table = {"beyond": beyond}
    if beyond == "repeat":  # a sine instead, which repeats smoothly
        x = np.linspace(0, 1, 401)
        table |= {"x": x, "y": np.sin(2 * np.pi * x)}
        w = 2 * np.pi
        inside = np.array([np.sin(w * t), w * np.cos(w * t), -w * w * np.sin(w * t)])
        outside["repeat"] = list(inside)
    expected = np.where(t < 1.0, inside, outside[beyond])
    for k, at in enumerate(t):  # each motion starts there: hold and line jump at the end of the table
        late = cart(driver="curve(t + late)", **table)
        r = late.simulate(1e-3, outputs=2, coordinates=coordinates, parameters={"late": at})
        j = r["P"]
        found = [j.displacement[0], j.displacement_rate[0], j.displacement_acceleration[0]]
        np.testing.assert_allclose(found, expected[:, k], rtol=1e-4, atol=1e-3 if beyond == "repeat" else 1e-9)
        assert r["D"].effort[0] == pytest.approx(2 * found[2], abs=1e-6)


@pytest.mark.parametrize("coordinates", LAYERS)
def test_a_spring_curve_repeats(coordinates):
    """A force sin(2 pi x) from a table of one period, far beyond it: 2 v^2/2 = (1 - cos(2 pi x)) / (2 pi) + v0^2."""
    x = np.linspace(0, 1, 201)
    m = cart("curve(value)", x=x, y=np.sin(2 * np.pi * x), beyond="repeat")
    m.add(fb.Initial("P.displacement", value=-3.2, rate=2.0))
    r = m.simulate(5.0, outputs=41, coordinates=coordinates)
    s, v = r["P"].displacement, r["P"].displacement_rate
    assert s[-1] > 5.0
    potential = np.cos(2 * np.pi * s) / (2 * np.pi)
    np.testing.assert_allclose(v**2 + potential, v[0] ** 2 + potential[0], rtol=1e-6)


@pytest.mark.parametrize("coordinates", LAYERS)
@pytest.mark.parametrize("law", ["force", "driver"])
def test_a_table_of_time_that_ends_too_early_is_told_before_the_run(law, coordinates):
    m = cart(**{law: "0.5*curve(2*t)"})
    who = {"force": "Actuator 'A'", "driver": "Driver 'D'"}[law]
    says = rf"{who}: at t = 0.5 s Table 'curve' is evaluated at a point just beyond x = 1, and its points extend from 0 to 1; .*"
    with pytest.raises(fb.ModelError, match=says + r"beyond='hold', 'line' or 'repeat'. .*from 0 s to 2 s"):
        m.simulate(2.0, coordinates=coordinates)
    assert m.simulate(0.5, coordinates=coordinates).t[-1] == 0.5
    if law == "driver":
        with pytest.raises(fb.ModelError, match=says):
            m.kinematics(11, t_end=2.0, coordinates=coordinates)
        with pytest.raises(fb.ModelError, match=says):
            m.inverse_dynamics(11, t_end=2.0)


def test_compare_tells_it_before_the_runs():
    with pytest.raises(
        fb.ModelError, match=r"Actuator 'A': at t = 1 s Table 'curve' is evaluated at a point just beyond"
    ):
        cart("curve(t)").compare(2)


@pytest.mark.parametrize("coordinates", LAYERS)
def test_a_table_asked_where_a_choice_leaves_it_out_is_none_of_its_business(coordinates):
    """F = t^2 + t up to 1 s, then nothing: x = t^4/24 + t^3/12 and straight on."""
    r = cart("where(t <= 1, curve(t), 0)").simulate(3.0, outputs=4, coordinates=coordinates, max_step=0.1)
    expected = [0, 1 / 24 + 1 / 12, 1 / 8 + 1 / 6 + 1 / 4, 1 / 8 + 1 / 3 + 1 / 2]
    assert r["P"].displacement == pytest.approx(expected, abs=1e-5)
    assert r.health.warnings == ()


@pytest.mark.parametrize("coordinates", LAYERS)
def test_a_motion_that_gets_there_stops_with_element_table_value_and_time(coordinates):
    """Under a force of 1 + x(x + 1) the cart comes to x = 1, where its curve ends."""
    m = cart("4 + 0*curve(value)")
    says = (
        r"just after t = 1 s, force of Actuator 'A': at t = 1 s Table 'curve' is evaluated at a point just beyond x = 1"
    )
    with pytest.raises(fb.SimulationError, match=says) as stopped:
        m.simulate(3.0, coordinates=coordinates, outputs=[0.5, 1.0, 2.0])
    assert stopped.value.t == pytest.approx(1.0, abs=1e-6)
    assert stopped.value.result["P"].displacement == pytest.approx([0.25], abs=1e-9) or stopped.value.t >= 1.0
    r = m.simulate(0.999, coordinates=coordinates)
    assert r.health.warnings == ()


def test_a_start_beyond_the_ends_is_told_at_once():
    m = cart("curve(value - 0.5)")
    says = (
        r"force of Actuator 'A': at t = 0 s Table 'curve' is evaluated at x = -0.5, and its points extend from 0 to 1"
    )
    for ask in (lambda: m.simulate(1.0), m.equilibrium, m.modes, m.linearize):
        with pytest.raises(fb.FlyballError, match=says):
            ask()
    assert any("Table 'curve' is evaluated at x = -0.5" in w for w in m.check().warnings)
    with pytest.raises(fb.AssemblyError, match=r"law of Driver 'D' has no finite value there: .*evaluated at x = 3,"):
        cart(driver="curve(t + 3)").assemble()


def test_units_of_the_table_are_spoken():
    m = cart("curve(value)", x=(10, 50, 90), y=(0, 1, 2), x_unit="mm")
    with pytest.raises(fb.ModelError, match=r"evaluated at x = 0 mm, and its points extend from 10 to 90 mm"):
        m.simulate(1.0)


def test_what_a_file_says(tmp_path):
    m = cart("curve(t)", beyond="repeat", x=(0, 1, 2), y=(1, 2, 1))
    m.save(tmp_path / "m.toml")
    assert 'beyond = "repeat"' in (tmp_path / "m.toml").read_text()
    assert fb.load(tmp_path / "m.toml") == m
    (tmp_path / "m.toml").write_text((tmp_path / "m.toml").read_text().replace('beyond = "repeat"', 'outside = "hold"'))
    with pytest.raises(fb.ModelError, match=r"Table 'curve': unknown field 'outside'.*this field is now beyond"):
        fb.load(tmp_path / "m.toml")
