"""Kinematics of driven mechanisms against closed forms; what is under-driven, over-driven or locks is told by name."""

from __future__ import annotations

import json

import numpy as np
import pytest
from typer.testing import CliRunner

import flyball as fb
from flyball.cli import app
from tests.analyses.linkages import four_bar_driven, slider_crank, whitworth
from tests.assembly.test_mobility import rssr
from tests.mechanisms import circles, door, example, four_bar

BOTH = ("absolute", "joint")


@pytest.mark.parametrize("coordinates", BOTH)
def test_slider_crank_is_exact(coordinates):
    """x = r cos a + sqrt(l^2 - r^2 sin^2 a), its two derivatives, and the angle of the rod, for a = 5 t + t^2."""
    r, l = 0.2, 0.5
    run = slider_crank("5*t + t**2", r, l).kinematics(301, t_end=3.0, coordinates=coordinates)
    t = run.t
    a, w, e = 5 * t + t**2, 5 + 2 * t, 2.0
    c, s = np.cos(a), np.sin(a)
    q = np.sqrt(l**2 - (r * s) ** 2)
    x1 = -r * s - r**2 * s * c / q  # dx/da
    x2 = -r * c - r**2 * (c**2 - s**2) / q - r**4 * s**2 * c**2 / q**3
    slider = run["slider"]
    assert slider.position[:, 0] == pytest.approx(r * c + q, abs=1e-12)
    assert slider.velocity[:, 0] == pytest.approx(x1 * w, abs=1e-10)
    assert slider.acceleration[:, 0] == pytest.approx(x2 * w**2 + x1 * e, abs=1e-9)
    assert slider.position[:, 1] == pytest.approx(0 * t, abs=1e-13)
    assert run["rod"].angle == pytest.approx(-np.arcsin(r * s / l), abs=1e-12)
    assert run["O"].angle == pytest.approx(a, abs=1e-11)


@pytest.mark.parametrize("coordinates", BOTH)
def test_quick_return_velocities(coordinates):
    """Whitworth: the lever's rate is w r (r + d sin a) / (r^2 + d^2 + 2 r d sin a); the block slides with w r d cos a / rho."""
    r, d, w = 0.1, 0.3, 4.0
    run = whitworth("0.5 + 4*t", r, d).kinematics(401, t_end=3.2, coordinates=coordinates)
    a = 0.5 + w * run.t
    D = r**2 + d**2 + 2 * r * d * np.sin(a)
    lever = run["lever"]
    assert lever.angular_velocity == pytest.approx(w * r * (r + d * np.sin(a)) / D, abs=1e-11)
    assert lever.angular_acceleration == pytest.approx(w**2 * r * d * np.cos(a) * (d**2 - r**2) / D**2, abs=1e-10)
    assert run["slot"].displacement_rate == pytest.approx(w * r * d * np.cos(a) / np.sqrt(D), abs=1e-11)
    limits = np.pi - 2 * np.arcsin(r / d)  # of a, while the lever goes back
    assert (lever.angular_velocity < 0).mean() == pytest.approx(limits / (2 * np.pi), abs=0.02)


@pytest.mark.parametrize("coordinates", BOTH)
def test_the_branch_is_kept_and_nothing_drifts(coordinates):
    """Five times in two hundred turns: whole turns are counted and the four-bar stays closed above."""
    times = [1.0, 7.3, 50.0, 123.4, 209.0]
    run = four_bar_driven("1 + 6*t").kinematics(times, coordinates=coordinates)
    assert run["A"].angle == pytest.approx(1 + 6 * np.array(times), abs=1e-9)
    for k, t in enumerate(times):
        b = 0.2 * np.array([np.cos(1 + 6 * t), np.sin(1 + 6 * t)])
        c, d = circles(b, 0.5, (0.5, 0), 0.4), np.array([0.5, 0])
        assert run["rocker"].position[k] == pytest.approx((c + d) / 2, abs=1e-11)
    assert run.health.violation < 1e-12


def andrews() -> fb.Mechanism:
    """Andrews' mechanism with its crank driven at 100 rad/s in place of the motor."""
    full = example("andrews.toml")
    m = fb.Mechanism(full.name, planar=True, parameters=full.parameters)
    for e in full.elements():
        if e.name != "motor":
            m.add(e)
    m.add(fb.Driver("motor", "crank.angle", "100*t"))
    return m


@pytest.mark.parametrize("coordinates", BOTH)
def test_andrews_mechanism_over_a_turn(coordinates):
    """The motion is periodic: velocities and accelerations are the derivatives of its Fourier series."""
    n, period = 1000, 2 * np.pi / 100
    run = andrews().kinematics(np.arange(n + 1) * period / n, coordinates=coordinates)
    wave = 2j * np.pi * np.fft.fftfreq(n, period / n)
    for body in ("K2", "K3", "K4", "K5", "K6", "K7"):
        angle, rate, more = (getattr(run[body], k) for k in ("angle", "angular_velocity", "angular_acceleration"))
        assert angle[-1] == pytest.approx(angle[0], abs=1e-12)
        x = np.fft.fft(angle[:-1])
        assert np.ptp(rate) > 1.0
        assert np.fft.ifft(wave * x).real == pytest.approx(rate[:-1], abs=1e-8 * np.ptp(rate))
        assert np.fft.ifft(wave**2 * x).real == pytest.approx(more[:-1], abs=1e-6 * np.ptp(more))


def test_masses_have_no_say():
    """Masses of a millionth and a million times as much, bodies without inertia, heavy loads: the same motion."""
    runs = []
    for k, scale in enumerate((1.0, 1e-6, 1e6)):
        m = four_bar_driven()
        m.bodies = [
            fb.Body(b.name, mass=b.mass * scale, inertia=0.0 if k else b.inertia, position=b.position, angle=b.angle)
            for b in m.bodies
        ]
        m.by_name |= {b.name: b for b in m.bodies}
        if k:
            m.add(fb.PointForce("load", "rocker", at=(0.4, 0.2), force=(1e5, 0)))
        runs.append(m.kinematics(51, t_end=1.0))
    for other in runs[1:]:
        assert other["rocker"].angle == pytest.approx(runs[0]["rocker"].angle, abs=1e-12)
        assert other["coupler"].acceleration == pytest.approx(runs[0]["coupler"].acceleration, abs=1e-8)


def test_times_parameters_and_a_single_time():
    m = fb.Mechanism("turn", planar=True, parameters={"speed": 2.0})
    m.add(fb.Body("arm", mass=1, inertia=1), fb.Revolute("A", "ground", "arm", at=(0, 0)))
    m.add(fb.Driver("d", "A.angle", "speed*t"))
    assert m.kinematics([3.0])["A"].angle == pytest.approx([6.0])
    assert m.kinematics([0.0])["A"].rate == pytest.approx([2.0])
    assert m.kinematics(3, t_end="500 ms").t == pytest.approx([0, 0.25, 0.5])
    assert m.kinematics([0.5], parameters={"speed": 8.0})["A"].angle == pytest.approx([4.0])
    assert m.kinematics([-1.0, 1.0])["A"].angle == pytest.approx([-2.0, 2.0])
    assert m.kinematics(3, t_start=5, t_end=6).t == pytest.approx([5, 5.5, 6])
    for wrong, options, message in (
        (10, {}, "until when"),
        ([1.0, 0.5], {}, "ascending"),
        ([1.0], {"t_end": 2}, "already contains the end"),
        ([1.0], {"t_start": 2}, "before the start"),
        ("soon", {}, "times must be"),
        (10, {"t_end": 1, "coordinates": "polar"}, "unknown coordinates"),
    ):
        with pytest.raises(fb.ModelError, match=message):
            m.kinematics(wrong, **options)


def test_a_driven_rolling_disk_is_followed_too():
    """Non-holonomic: a wheel that rolls round an arm, path and turning by the arm's rate."""
    m = fb.Mechanism("mill")
    R, r, w = 1.0, 0.4, 1.5
    m.add(fb.Body("arm", mass=1, inertia=(1, 1, 1), position=(0, 0, r)))
    m.add(fb.Body("wheel", mass=1, inertia=(0.04, 0.08, 0.04), position=(0, R, r)))
    m.add(fb.Revolute("post", "ground", "arm", at=(0, 0, r), axis=(0, 0, 1)))
    m.add(fb.Revolute("axle", "arm", "wheel", at=(0, R, r), axis=(0, 1, 0)))
    m.add(fb.RollingDisk("roll", "ground", "wheel", at=(0, R, r), axis=(0, 1, 0), radius=r))
    m.add(fb.Driver("drive", "post.angle", f"{w}*t"))
    run = m.kinematics(11, t_end=2.0)
    assert run["wheel"].position[:, 0] == pytest.approx(-R * np.sin(w * run.t), abs=1e-8)
    assert np.abs(run["axle"].rate) == pytest.approx(w * R / r + 0 * run.t, abs=1e-8)


def test_under_driven_mechanisms_are_told_what_is_free():
    with pytest.raises(fb.MobilityError, match=r"0 drivers leave 1 freedom: A\.angle: crank, coupler, rocker") as e:
        four_bar().kinematics(10, t_end=1)
    assert e.value.free == ("A.angle",)
    m = rssr()
    m.add(fb.Driver("motor", "A.angle", "t"))
    with pytest.raises(fb.MobilityError, match="one driver leaves 1 freedom: coupler spins about its own axis"):
        m.kinematics(10, t_end=1)
    m = example("governor.toml")
    with pytest.raises(fb.MobilityError, match="under-driven") as e:
        m.kinematics(10, t_end=1)
    assert set(e.value.free) == {"left hinge.angle", "right hinge.angle", "guide.displacement", "bearing.angle"}


@pytest.mark.parametrize(
    ("coordinate", "law", "says"),
    [
        ("A.angle", "1 + 6*t", "prescribe the same motion"),
        ("A.angle", "1 + 5*t", "contradict one another.*velocities"),
        ("D.angle", "0.3", "contradict one another.*positions"),
    ],
)
def test_over_driven_mechanisms_name_the_drivers(coordinate, law, says):
    m = four_bar_driven()
    m.add(fb.Driver("second", coordinate, law))
    with pytest.raises(fb.MobilityError, match=says) as e:
        m.kinematics(10, t_end=1)
    assert e.value.redundant == ("motor", "second")


def test_a_driver_of_what_joints_hold_already_is_named():
    m = slider_crank()
    m.add(fb.Driver("idle", "slider.y", "0"))
    with pytest.raises(fb.MobilityError, match=r"driver idle repeats the motion of .*guide") as e:
        m.kinematics(10, t_end=1)
    assert e.value.redundant == ("idle",)


@pytest.mark.parametrize("coordinates", BOTH)
def test_a_lock_is_told_with_time_and_joints(coordinates):
    """The slider is pulled at 0.2 m/s from 0.6 m and the links are stretched at r + l = 0.7 m, after half a second."""
    m = slider_crank("0.6 + 0.2*t", start=np.arccos((0.36 + 0.04 - 0.25) / 0.24), on="slider")
    with pytest.raises(fb.SingularityError, match=r"locks at t = 0\.5 s: driver drive .* O, A, B") as e:
        m.kinematics(101, t_end=1.0, coordinates=coordinates)
    assert e.value.where == pytest.approx(0.5, abs=1e-6)
    assert set(e.value.elements) == {"O", "A", "B", "drive"}
    assert e.value.result.t[-1] == pytest.approx(0.5, abs=0.0101)
    assert e.value.result["slider"].position[-1, 0] == pytest.approx(0.6 + 0.2 * e.value.result.t[-1])


def test_a_crank_that_cannot_turn_locks_where_coupler_and_rocker_are_in_line():
    """Crank 0.35, coupler 0.3, rocker 0.25, ground 0.5: cos a = (a^2 + d^2 - (b + c)^2) / (2 a d)."""
    m = four_bar_driven("1 + 6*t", crank=0.35, rocker=0.25, coupler=0.3)
    limit = np.arccos((0.35**2 + 0.5**2 - 0.55**2) / (2 * 0.35 * 0.5))
    with pytest.raises(fb.SingularityError, match="locks") as e:
        m.kinematics(101, t_end=1.0)
    assert 1 + 6 * e.value.where == pytest.approx(limit, abs=1e-6)


def test_a_start_that_drivers_do_not_decide_is_told():
    m = slider_crank("0.7 - 0.1*t", on="slider")
    with pytest.raises(fb.SingularityError, match=r"starts in a singular position at t = 0 s.*O\.angle"):
        m.kinematics(10, t_end=1)


def test_what_is_out_of_reach_is_no_position():
    with pytest.raises(fb.AssemblyError, match=r"cannot be assembled.* drive is 0.025 m"):
        slider_crank("0.8", on="slider").kinematics(10, t_end=1)


def test_a_law_that_jumps_is_told():
    with pytest.raises(fb.SimulationError, match=r"'motor' .* t = 0.5 s: its law jumps in its value") as e:
        four_bar_driven("1 + 6*t + where(t > 0.5, 1, 0)").kinematics(11, t_end=1)
    assert e.value.result.t[-1] == pytest.approx(0.5)


def test_redundancy_of_joints_is_no_obstacle():
    """A door on two hinges, driven: five constraints too many."""
    m = door()
    m.add(fb.Driver("butler", "upper.angle", "0.5*t"))
    run = m.kinematics(11, t_end=1)
    assert run["leaf"].position[:, 0] == pytest.approx(0.4 * np.cos(0.5 * run.t), abs=1e-12)


def test_pictures_of_paths(tmp_path):
    """A figure for the plane and for space; points of bodies; wrong points are refused by name."""
    run = four_bar_driven().kinematics(41, t_end=1)
    figure = run.plot_path(("coupler", (0.05, 0.15)), "rocker")
    (ax,) = figure.axes
    track = ax.lines[-4].get_xydata()
    R = run["coupler"].rotation[:, :2, :2]
    assert track == pytest.approx(run["coupler"].position + R @ [0.05, 0.15], abs=1e-12)
    arrows = [c for c in ax.collections if hasattr(c, "U")]
    shown = run["rocker"].velocity[np.unique(np.linspace(0, 40, 24).astype(int)), 0]
    assert np.asarray(arrows[1].U) == pytest.approx(shown)
    run.plot_path("rocker", arrows="acceleration", positions=0, path=tmp_path / "a.png")
    assert (tmp_path / "a.png").stat().st_size > 5000
    space = four_bar_driven(space=True).kinematics(5, t_end=1)
    assert len(space.plot_path().axes) == 4
    for wrong, message in (("motor", "has no path"), (("coupler", (1,)), "needs 2 components"), ("nobody", "no part")):
        with pytest.raises(fb.ModelError, match=message):
            run.plot_path(wrong)
    with pytest.raises(fb.ModelError, match="arrows must be"):
        run.plot_path(arrows="force")


def test_the_command(tmp_path):
    path, out = tmp_path / "m.toml", tmp_path / "out"
    four_bar_driven().save(path)
    said = CliRunner().invoke(app, ["kinematics", str(path), "--t-end", "1", "--outputs", "11", "-o", str(out),
                                    "--point", "coupler:0.1,0.1", "--json"])  # fmt: skip
    assert said.exit_code == 0
    assert json.loads(said.stdout)["times"] == 11
    assert {p.name for p in out.iterdir()} == {"result.csv", "result.nc", "paths.png"}
    assert fb.load_result(out / "result.nc")["A"].angle[-1] == pytest.approx(7.0)
    said = CliRunner().invoke(app, ["kinematics", str(path), "--times", "0,0.1,200 ms", "-o", str(out), "--json"])
    assert json.loads(said.stdout)["t"] == [0.0, 0.2]
    slider_crank("0.6 + 0.2*t", start=np.arccos(0.625), on="slider").save(path)
    said = CliRunner().invoke(app, ["kinematics", str(path), "-o", str(out), "--json"])
    assert said.exit_code == 3
    assert json.loads(said.stdout)["t"] == pytest.approx(0.5, abs=1e-6)
