"""Motions that are not what their tolerance asks for say so, everywhere; sound ones do not."""

import json
import re

import numpy as np
import pytest
from typer.testing import CliRunner

import flyball as fb
from flyball.cli import app
from flyball.results.energy_balance import budgets_by_part
from tests.mechanisms import example


def coupled() -> fb.Mechanism:
    """A crank and a rocker whose coupler is a spring of 1e8 N/m: what swings at 25 000 rad/s never dies out."""
    m = fb.Mechanism("coupled", planar=True, gravity=(0, -9.81))
    m.add(fb.Body("crank", mass=1, inertia=1 / 12, position=(0, 0.5), angular_velocity=-1))
    m.add(fb.Body("rocker", mass=1, inertia=1.5**2 / 12, position=(2, 0.25), angular_velocity=-2 / 3))
    m.add(fb.Revolute("A", "ground", "crank", at=(0, 0)), fb.Revolute("B", "ground", "rocker", at=(2, -0.5)))
    m.add(fb.SpringDamper("coupler", "crank", "rocker", at=((0, 1), (2, 1)), stiffness=1e8))
    return m


@pytest.mark.parametrize("method", ["dop853", "rk45"])
def test_a_stiff_motion_at_a_rough_tolerance(method):
    """It comes out off by as much as it moves, and nothing is raised."""
    m = coupled()
    exact = m.simulate(2.0, outputs=11, method="radau", rtol=1e-8)
    assert not exact.health.doubtful
    rough = m.simulate(2.0, outputs=11, method=method, rtol=1e-2)
    assert np.abs(rough["crank"].angular_velocity - exact["crank"].angular_velocity).max() > 1.0
    (text,) = rough.health.doubtful
    assert text.startswith("the energy balance is off by ")
    assert rough.health.status == "done, but doubtful"
    assert ("doubtful", text) in rough.health.lines()
    assert rough.health.as_dict()["doubtful"] == (text,)
    assert text in rough.health.warnings


def test_it_is_kept_and_shown(tmp_path):
    m = coupled()
    r = m.simulate(0.1, outputs=5, method="rk45", rtol=1e-2)
    r.save(tmp_path / "r.nc")
    assert fb.load_result(tmp_path / "r.nc").health.doubtful == r.health.doubtful
    assert "The run reached its end, but is doubtful" in r.report()
    m.save(tmp_path / "m.toml")
    asked = ["run", str(tmp_path / "m.toml"), "--t-end", "0.1", "--method", "rk45", "--rtol", "1e-2", "--no-plots"]
    out = CliRunner().invoke(app, [*asked, "--out", str(tmp_path / "o"), "--json"])
    assert json.loads(out.stdout)["doubtful"]
    out = CliRunner().invoke(app, [*asked, "--out", str(tmp_path / "p")])
    assert "done, but doubtful" in out.stdout


@pytest.mark.parametrize("rtol", [1e-2, 1e-3, 1e-5, 1e-7, 1e-10])
@pytest.mark.parametrize("name", ["slider_crank.toml", "car_axis.toml", "heavy_top.toml", "governor.toml"])
def test_sound_motions_are_not_doubted(name, rtol):
    """At a rough tolerance a rough balance is what was asked for."""
    m = example(name)
    assert not m.simulate(0.5, outputs=11, rtol=rtol).health.doubtful


def struck(k: float) -> fb.Mechanism:
    """Of three bodies on slides one creeps to rest from 0.1 m, 5000 J, before another one is hit, 5e-3 J."""
    m = fb.Mechanism("struck", planar=True, gravity=(0, 0))
    for n in "abd":
        m.add(fb.Body(n, mass=1, inertia=1), fb.Prismatic(n.upper(), "ground", n, at=(0, 0), axis=(1, 0)))
    m.add(fb.CoordinateSpring("soft", "A.displacement", stiffness=10), fb.Initial("A.displacement", value=0.1))
    m.add(fb.CoordinateSpring("hard", "B.displacement", stiffness=k))
    m.add(fb.CoordinateSpring("oil", "D.displacement", stiffness=1e6, damping=1e5))
    m.add(fb.Initial("D.displacement", value=0.1), fb.Event("blow", "t > 1", do=[fb.Impulse("b", (0.1, 0))]))
    return m


def test_what_was_dissipated_before_excuses_nothing():
    """Steps of 0.2 ms damp a swing of 1e4 rad/s away; 5e-3 J are nothing beside 5000 J, and much of what moves then."""
    r = struck(1e8).simulate(2.0, outputs=101, method="radau", step=2e-4)
    assert np.abs(r["B.displacement"][-25:]).max() < 1e-9
    (text,) = r.health.doubtful
    assert "between t = " in text
    assert not struck(1e4).simulate(2.0, outputs=101, method="radau", step=2e-4).health.doubtful


def test_what_moves_between_two_rows_only_is_not_nothing():
    """From rest to rest by a relay: what was moved stands in no row."""
    m = fb.Mechanism("relay", planar=True)
    m.add(fb.Body("b", mass=1, inertia=1), fb.Prismatic("A", "ground", "b", at=(0, 0), axis=(1, 0)))
    m.add(fb.Actuator("f", "A.displacement", force="-2*value - 0.5*sign(rate)"), fb.Initial("A.displacement", value=1))
    r = m.simulate(20.0, outputs=3)
    assert np.abs(r["A.displacement_rate"]).max() < 1e-9
    assert not r.health.doubtful


def beside(k: float, *more) -> fb.Mechanism:
    """1 kg on a spring of k with 5e-3 J beside 1000 t that swing with 1e6 J."""
    m = fb.Mechanism("beside", planar=True, gravity=(0, 0))
    for n, mass in (("a", 1e6), ("b", 1.0)):
        m.add(fb.Body(n, mass=mass, inertia=1), fb.Prismatic(n.upper(), "ground", n, at=(0, 0), axis=(1, 0)))
    m.add(fb.CoordinateSpring("slow", "A.displacement", stiffness=2e6), fb.Initial("A.displacement", value=1))
    m.add(fb.CoordinateSpring("hard", "B.displacement", stiffness=k), fb.Initial("B.displacement", value=0.0, rate=0.1))
    m.add(*more)
    return m


def test_a_part_that_nothing_connects_is_judged_by_its_own_energy():
    """Steps of 1 ms damp 1e4 rad/s away. By what A moves, 5e-3 J are nothing."""
    r = beside(1e8).simulate(1.0, outputs=101, method="radau", step=1e-3)
    assert np.abs(r["B.displacement_rate"][-25:]).max() < 1e-3
    assert r.health.energy_drift < 1e-7 * 1e6
    (text,) = r.health.doubtful
    assert text.startswith("the energy balance of 'b' is off by 0.005 J of ")
    assert not beside(1e4).simulate(1.0, outputs=101, method="radau", step=1e-3).health.doubtful


@pytest.mark.parametrize("rtol", [1e-3, 1e-5, 1e-7, 1e-9])
@pytest.mark.parametrize("method", ["radau", "dop853"])
def test_parts_with_works_and_events_are_sound(method, rtol):
    """Damping, a blow and a spring that an event makes weaker, each in a part of its own."""
    m = beside(1e4, fb.Body("c", mass=1e-3, inertia=1e-3))
    m.add(fb.Prismatic("C", "ground", "c", at=(0, 0), axis=(1, 0)), fb.Initial("C.displacement", value=1e-3))
    m.add(fb.CoordinateSpring("oil", "C.displacement", stiffness=10.0, damping=0.1))
    m.add(fb.Event("blow", "t > 0.5", do=[fb.Impulse("c", (1e-4, 0))]))
    r = m.simulate(1.0, outputs=101, method=method, rtol=rtol)
    assert not r.health.doubtful


def pendulum() -> fb.Mechanism:
    m = fb.Mechanism("pendulum", planar=True, gravity=(0, -9.81))
    m.add(fb.Body("b", mass=1, inertia=1 / 12, position=(0.5, 0)), fb.Revolute("A", "ground", "b", at=(0, 0)))
    return m


@pytest.mark.parametrize("rtol", [0.11, 2, 50.0])
def test_no_motion_comes_of_a_tolerance_as_large_as_the_motion(rtol):
    with pytest.raises(fb.ModelError, match=r"rtol must not be larger than 0\.1, got "):
        pendulum().simulate(1.0, rtol=rtol)


def test_no_tolerance_excuses_a_loss_of_some_per_cent():
    rough = pendulum().simulate(10.0, rtol=0.1)
    assert np.abs(rough["b"].position - pendulum().simulate(10.0, rtol=1e-9)["b"].position).max() > 0.2
    (text,) = rough.health.doubtful
    assert text.startswith("the energy balance is off by ")


@pytest.mark.parametrize("method", ["dop853", "radau"])
def test_turning_back_makes_nothing_late(method):
    """At its turning points a pendulum has no kinetic energy, and yet is in time."""
    exact = pendulum().simulate(10.0, rtol=1e-10)
    r = pendulum().simulate(10.0, rtol=1e-3, method=method)
    assert np.abs(r["b"].position - exact["b"].position).max() < 1e-2
    assert not r.health.doubtful


def four_bar() -> fb.Mechanism:
    """A parallelogram that all but stops upright, 1 J of 80."""
    m = fb.Mechanism("four_bar", planar=True, gravity=(0, -9.81))
    for name, at in (("crank", (0, 0.5)), ("coupler", (0.5, 1)), ("rocker", (1, 0.5))):
        m.add(fb.Body(name, mass=1, inertia=1 / 12, position=at))
    m.add(fb.Revolute("A", "ground", "crank", at=(0, 0)), fb.Revolute("B", "crank", "coupler", at=(0, 1)))
    m.add(fb.Revolute("C", "coupler", "rocker", at=(1, 1)), fb.Revolute("D", "ground", "rocker", at=(1, 0)))
    m.add(fb.Initial("A.angle", rate=-1))
    return m


@pytest.mark.parametrize("rtol", [1e-2, 3e-3])
def test_how_late_a_motion_comes_is_known_from_its_energy(rtol):
    """A thousandth of the energy moved is a tenth of what goes over the top."""
    exact = four_bar().simulate(10.0, rtol=1e-10)
    r = four_bar().simulate(10.0, rtol=rtol, method="radau")
    (text,) = r.health.doubtful
    name, told = re.search(r"position of '(\w+)' wrong by about ([\d.]+) m", text).groups()
    off = np.linalg.norm(r[name].position - exact[name].position, axis=1).max()
    assert off > 0.1
    assert float(told) == pytest.approx(off, rel=0.3)


@pytest.mark.parametrize("method", ["dop853", "radau"])
def test_a_motion_in_time_is_not_called_late(method):
    assert not four_bar().simulate(10.0, rtol=1e-5, method=method).health.doubtful


@pytest.mark.parametrize("rtol", [1e-3, 1e-7])
def test_what_turns_about_its_centre_is_not_late(rtol):
    """Its centre goes no way but that of rounding."""
    m = fb.Mechanism("wheel", planar=True, gravity=(0, 0))
    m.add(fb.Body("b", mass=1, inertia=1, position=(0.1, 0.3)), fb.Revolute("A", "ground", "b", at=(0.1, 0.3)))
    m.add(fb.CoordinateSpring("k", "A.angle", stiffness=1), fb.Initial("A.angle", rate=1))
    assert not m.simulate(1.0, outputs=101, method="radau", rtol=rtol).health.doubtful


def bushed() -> fb.Mechanism:
    """Two bars on a bushing of 1e7 N/m: a hundredth of a millimetre are 100 N."""
    m = fb.Mechanism("bushed", planar=True, gravity=(0, -9.81))
    m.add(fb.Body("a", mass=1, inertia=1 / 12, position=(0.5, 0)))
    m.add(fb.Body("b", mass=1, inertia=1 / 12, position=(1.5, 0)), fb.Revolute("A", "ground", "a", at=(0, 0)))
    m.add(fb.Bushing("s", "a", "b", at=(1, 0), stiffness=1e7, damping=3))
    return m


def test_accelerations_that_are_not_the_rates_of_velocities():
    """Positions are right to 1e-4 and the balance to 1e-4, and the reaction is off by more than there is of it."""
    exact = bushed().simulate(2.0, method="radau", rtol=1e-8)
    rough = bushed().simulate(2.0, method="radau", rtol=1e-2)
    assert np.abs(rough["b"].position - exact["b"].position).max() < 1e-3
    assert rough.health.energy_drift < 1e-2
    assert np.abs(rough["A"].force - exact["A"].force).max() > np.abs(exact["A"].force).max()
    (text,) = rough.health.doubtful
    assert text.startswith("accelerations are inaccurate, and so are forces and reactions: that of 'A.angle' differs ")
    fine = bushed().simulate(2.0, method="radau", rtol=1e-5)
    assert np.abs(fine["A"].force - exact["A"].force).max() < 0.1 * np.abs(exact["A"].force).max()
    assert not fine.health.doubtful


@pytest.mark.parametrize("outputs", [21, 101, 1001])
@pytest.mark.parametrize("rtol", [1e-5, 1e-8])
def test_what_swings_between_output_times_is_not_rough(outputs, rtol):
    """Just once from one to the next of 101: velocities do not change then, and accelerations are large."""
    m = fb.Mechanism("swing", planar=True, gravity=(0, 0))
    m.add(fb.Body("b", mass=1, inertia=1), fb.Prismatic("A", "ground", "b", at=(0, 0), axis=(1, 0)))
    m.add(fb.CoordinateSpring("k", "A.displacement", stiffness=(2 * np.pi) ** 2), fb.Initial("A.displacement", value=1))
    assert not m.simulate(100.0, outputs=outputs, rtol=rtol).health.doubtful


def test_parts_of_massless_links_have_names():
    """A joint of two freedoms is two rows of the body table, the first of which is no body."""
    m = fb.Mechanism("links", gravity=(0, 0, -9.81))
    for n in "ab":
        m.add(
            fb.Body(n, mass=1, inertia=(1, 1, 1)), fb.Cylindrical(n.upper(), "ground", n, at=(0, 0, 0), axis=(0, 0, 1))
        )
    assert [x.of for x in budgets_by_part(m.simulate(0.1, outputs=3, coordinates="joint"))] == [" of 'a'", " of 'b'"]


@pytest.mark.parametrize("mass", [10.0, 1000.0])
@pytest.mark.parametrize("method", ["auto", "impulse"])
def test_a_self_locked_screw_at_rest_is_not_doubtful(mass, method):
    """All that is lost is rounding of its weight's energy, which is counted from where the nut is: 3e-13 J of 540 J."""
    for inertia, torque in ((1e-5 * mass, 0.0), (1.0, 0.0), (1.0, 0.3)):
        m = fb.Mechanism("jack", gravity=(0, 0, -9.81))
        m.add(fb.Body("nut", mass=mass, inertia=(inertia,) * 3))
        m.add(fb.Screw("thread", "ground", "nut", at=(0, 0, 0), axis=(0, 0, 1), lead=0.002))
        m.add(fb.JointFriction("rub", "thread", static=1.5, radius=0.01))
        m.add(fb.Motor("motor", "thread", torque=torque * mass * 9.81 * 0.002 / 6.28))
        run = m.simulate(5.0, outputs=3, method=method)
        assert not run.health.doubtful and not run.health.warnings
