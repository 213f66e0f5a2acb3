"""Efforts and reactions of given motions against closed forms; what redundancy leaves undetermined is told apart."""

from __future__ import annotations

import csv
import json

import numpy as np
import pytest
from typer.testing import CliRunner

import flyball as fb
from flyball.cli import app
from tests.analyses.linkages import four_bar_driven, slider_crank
from tests.assembly.test_mobility import parallelogram, windows
from tests.mechanisms import G, door, four_bar, planar_rod

BOTH = ("absolute", "joint")


def slider_crank_energies(a, r, l):
    """J(a) with T = J w^2 / 2, and the potential, of `slider_crank`; a may be complex."""
    c, s = np.cos(a), np.sin(a)
    q = np.sqrt(l * l - (r * s) ** 2)
    slider = -r * s - r * r * s * c / q
    middle = (-r * s + slider) / 2, r * c / 2
    rod = -r * c / q  # d(angle)/da
    J = r * r / 3 + 2 * (middle[0] ** 2 + middle[1] ** 2 + l * l / 12 * rod**2) + 3 * slider**2
    return J, G * (1 * r / 2 + 2 * r / 2) * s


@pytest.mark.parametrize("coordinates", BOTH)
def test_slider_crank_torque_by_virtual_work(coordinates):
    """M = J e + J' w^2 / 2 + V', derivatives by complex step, for a = 5 t + t^2."""
    r, l, h = 0.2, 0.5, 1e-30
    found = slider_crank("5*t + t**2", r, l, g=G).inverse_dynamics(101, t_end=2.0, coordinates=coordinates)
    a, w = 5 * found.t + found.t**2, 5 + 2 * found.t
    J, V = slider_crank_energies(a + 1j * h, r, l)
    torque = J.real * 2 + J.imag / h * w**2 / 2 + V.imag / h
    assert found.efforts["drive"] == pytest.approx(torque, abs=1e-9)
    assert found.drives["drive"].power == pytest.approx(torque * w, abs=1e-8)
    assert (found.drives["drive"].unit, found.drives["drive"].coordinate) == ("N*m", "O.angle")
    assert found.undetermined == {}


def arm() -> fb.Mechanism:
    """Two links in line along x, l = 1 and 0.8 m, slender, 2 and 1 kg."""
    m = fb.Mechanism("arm", planar=True, gravity=(0, -G))
    m.add(planar_rod("upper", (0, 0), (1, 0), 2.0), planar_rod("lower", (1, 0), (1.8, 0), 1.0))
    m.add(fb.Revolute("shoulder", "ground", "upper", at=(0, 0)), fb.Revolute("elbow", "upper", "lower", at=(1, 0)))
    m.add(fb.Sensor("bend", "elbow.angle"), fb.Sensor("speed", "elbow.rate"))
    return m


def arm_torques(q, w, e):
    """Closed form of the two-link arm (Craig, Introduction to Robotics, section 6.7, with the rods' inertias)."""
    m1, m2, l1, l2 = 2.0, 1.0, 1.0, 0.8
    k = m2 * l1 * l2 / 2
    M22 = m2 * l2**2 / 3
    M12 = M22 + k * np.cos(q[1])
    M11 = m1 * l1**2 / 3 + m2 * l1**2 + M22 + 2 * k * np.cos(q[1])
    h = k * np.sin(q[1])
    g2 = m2 * G * l2 / 2 * np.cos(q[0] + q[1])
    g1 = (m1 / 2 + m2) * G * l1 * np.cos(q[0]) + g2
    first = M11 * e[0] + M12 * e[1] - h * (2 * w[0] * w[1] + w[1] ** 2) + g1
    return first, M12 * e[0] + M22 * e[1] + h * w[0] ** 2 + g2


@pytest.mark.parametrize("coordinates", BOTH)
def test_two_link_arm(coordinates):
    motion = {"shoulder.angle": "0.3*sin(2*t)", "bend": "1 - cos(3*t)"}
    found = arm().inverse_dynamics(101, motion, t_end=2, coordinates=coordinates)
    t = found.t
    q = 0.3 * np.sin(2 * t), 1 - np.cos(3 * t)
    w = 0.6 * np.cos(2 * t), 3 * np.sin(3 * t)
    e = -1.2 * np.sin(2 * t), 9 * np.cos(3 * t)
    first, second = arm_torques(q, w, e)
    assert list(found.efforts) == ["shoulder.angle", "bend"]
    assert found.efforts["shoulder.angle"] == pytest.approx(first, abs=1e-9)
    assert found.efforts["bend"] == pytest.approx(second, abs=1e-9)
    assert found["elbow.angle"] == pytest.approx(q[1], abs=1e-12)


def test_sampled_motion():
    """A cubic spline through samples: the error of accelerations falls with the square of their distance."""
    errors = []
    for n in (51, 101, 201):
        t = np.linspace(0.5, 2.5, n)
        found = arm().inverse_dynamics(
            t, {"shoulder.angle": 0.3 * np.sin(2 * t), "elbow.angle": (t, 1 - np.cos(3 * t))}
        )
        q, w, e = (0.3 * np.sin(2 * t), 1 - np.cos(3 * t)), (0.6 * np.cos(2 * t), 3 * np.sin(3 * t)), (
            -1.2 * np.sin(2 * t), 9 * np.cos(3 * t))  # fmt: skip
        inside = slice(n // 10, -(n // 10))
        errors.append(np.abs(found.efforts["elbow.angle"] - arm_torques(q, w, e)[1])[inside].max())
        assert found.t[[0, -1]] == pytest.approx([0.5, 2.5])
    assert errors[0] < 5e-3
    assert errors[0] / errors[1] > 3.5
    assert errors[1] / errors[2] > 3.5


def test_four_bar_power_balance():
    """Driven over whole turns, the drive's power is the rate of the energy: by Fourier, since the motion is periodic."""
    n, period = 400, 2 * np.pi / 6
    found = four_bar_driven("1 + 6*t").inverse_dynamics(np.arange(n + 1) * period / n)
    E = found.result.energy.total[:-1]
    wave = 2j * np.pi * np.fft.fftfreq(n, period / n)
    rate = np.fft.ifft(wave * np.fft.fft(E)).real
    assert found.drives["motor"].power[:-1] == pytest.approx(rate, abs=1e-8 * np.ptp(rate))


def test_forces_stay_applied():
    """A motor that pushes along the driven coordinate takes its share off the drive."""
    m, other = four_bar(), four_bar()
    other.add(fb.Motor("motor", "A", torque=2.5))
    a, b = (x.inverse_dynamics(11, {"A.angle": "sin(t)"}, t_end=1).efforts["A.angle"] for x in (m, other))
    assert a - b == pytest.approx(2.5 + 0 * a, abs=1e-10)


@pytest.mark.parametrize("coordinates", BOTH)
def test_a_door_on_two_hinges(coordinates):
    """Five constraints too many: only the hinges' own axis is determined of each, but their sum in full."""
    found = door().inverse_dynamics(41, {"upper.angle": "0.5*sin(2*t)"}, t_end=2, coordinates=coordinates)
    t, m = found.t, 30.0
    a, w, e = 0.5 * np.sin(2 * t), np.cos(2 * t), -2 * np.sin(2 * t)
    torque = (1.6 + m * 0.4**2) * e
    assert found.efforts["upper.angle"] == pytest.approx(torque, abs=1e-9)
    assert (found.determinacy.count == 5).all()
    for hinge in ("upper", "lower"):
        x = found.reaction(hinge)
        assert x.undetermined.all(axis=0).tolist() == [True] * 5 + [False]
        assert np.isnan(x.force).all()
        assert x.torque[:, 2] == pytest.approx(0 * t, abs=1e-9)
    n, s = np.stack([np.cos(a), np.sin(a)]), np.stack([-np.sin(a), np.cos(a)])
    both = found.together("upper", "lower", on="leaf")
    assert not both.undetermined.any()
    acceleration = 0.4 * (e * s - w**2 * n)
    assert both.force == pytest.approx(np.column_stack([*(m * acceleration), m * G + 0 * t]), abs=1e-8)
    # about the mass centre the leaf turns about z only; of the torque about z the driver does its part
    arm = -0.4 * n
    about_z = arm[0] * both.force[:, 1] - arm[1] * both.force[:, 0]
    assert both.torque == pytest.approx(np.column_stack([0 * t, 0 * t, about_z]), abs=1e-8)
    assert about_z + torque == pytest.approx(1.6 * e, abs=1e-8)
    one = found.together("upper", on="leaf")
    assert one.undetermined[:, :5].all()


@pytest.mark.parametrize("coordinates", BOTH)
def test_a_door_on_two_balls(coordinates):
    """Only how the hinges share the weight is undetermined; the pull of the upper one is m g a / h."""
    m = door(fb.Spherical, fb.Spherical)
    found = m.inverse_dynamics(5, {"leaf.y": "0.4*sin(0.3*t)"}, t_end=1, coordinates=coordinates)
    x = found.reaction("upper")
    assert x.undetermined[0].tolist() == [False, False, True, False, False, False]
    # about the lower hinge: weight at 0.4 m pulls the upper hinge, 1.6 m above, back; the drive acts at the mass centre
    assert x.force[0, 0] == pytest.approx(-30 * G * 0.4 / 1.6 - 30 * 0.4 * 0.3**2 / 2, rel=1e-6)
    assert set(found.undetermined) == {"upper.fz", "lower.fz"}


def test_a_cured_door_is_determined():
    """Ball above, ball in a groove below: every component has one value, by the laws of statics."""
    m = door()
    (only,) = m.mobility().sets
    cured = only.cure.applied(m)
    found = cured.inverse_dynamics([0.0, 1.0], {"leaf.y": "0*t"})
    assert found.undetermined == {}
    upper, lower = found.reaction("upper"), found.reaction("lower")
    assert upper.force == pytest.approx(np.tile([-30 * G * 0.4 / 1.6, 0, 30 * G], (2, 1)), abs=1e-8)
    assert lower.force == pytest.approx(np.tile([30 * G * 0.4 / 1.6, 0, 0], (2, 1)), abs=1e-8)


@pytest.mark.parametrize("coordinates", BOTH)
def test_determinacy_goes_with_the_position(coordinates):
    """Three parallel cranks: stress along them cannot be told; when they stand upright that is all fy, no fx."""
    m = parallelogram()
    upright = np.arctan2(0.3, 1.0)  # how far they lean as drawn
    found = m.inverse_dynamics([0.0, 1.0], {"A0.angle": f"{upright}*t"}, coordinates=coordinates)
    for joint in ("A0", "B1", "A2"):
        x = found.reaction(joint)
        assert x.undetermined[:, [0, 1]].tolist() == [[True, True], [False, True]]
        assert x.force[1, 0] == pytest.approx(0.0, abs=1e-9)
        along = found.reaction(joint, axes=f"crank {joint[1]}")
        assert along.undetermined[:, [0, 1]].tolist() == [[True, False], [True, False]]
    assert "undetermined at some times: fx" in str(found)


def test_planar_loop_in_space_tells_the_plane_from_the_rest():
    """Four hinges in space: forces in the plane as in the planar model, the rest undetermined."""
    flat = four_bar_driven().inverse_dynamics(11, t_end=1)
    space = four_bar_driven(space=True).inverse_dynamics(11, t_end=1)
    assert space.efforts["motor"] == pytest.approx(flat.efforts["motor"], abs=1e-9)
    for joint in "ABCD":
        assert space.reaction(joint).force[:, :2] == pytest.approx(flat.reaction(joint).force[:, :2], abs=1e-8)
        assert np.isnan(space.reaction(joint).force[:, 2]).all()


def test_reports_never_show_what_is_undetermined(tmp_path):
    found = door().inverse_dynamics(3, {"upper.angle": "0.1*t"}, t_end=1)
    data = found.as_dict()
    assert data["reactions"]["upper.fz"]["values"] == [None] * 3
    assert data["reactions"]["upper.tz"]["values"] == pytest.approx([0, 0, 0], abs=1e-12)
    assert data["redundant"] == [5, 5, 5]
    assert json.dumps(data, allow_nan=False)
    found.to_csv(tmp_path / "r.csv")
    head, first, *_ = csv.reader((tmp_path / "r.csv").open())
    assert first[head.index("upper.fz [N]")] == ""
    assert float(first[head.index("upper.angle [N*m]")]) == pytest.approx(found.efforts["upper.angle"][0])
    assert "upper: tz 0 N m; undetermined: fx, fy, fz, tx, ty" in str(found)
    figure = found.plot()
    assert "not plotted: upper fx, fy, fz, tx, ty; lower fx" in figure.get_supxlabel()
    for ax in figure.axes:
        assert all("fz" not in line.get_label() for line in ax.lines)


def test_wrong_motions_are_refused_by_name():
    m = arm()
    good = {"elbow.angle": "0*t"}
    for motion, message in (
        ({"shoulder.angel": "t"}, "no coordinate 'angel'"),
        ({"bent": "t"}, "no sensor of that name; did you mean 'bend'|'bent'"),
        ({"speed": "t"}, "only positions and angles"),
        ({"shoulder.angle": [1.0, 2.0]}, "2 samples do not fit 11 times"),
        ({"shoulder.angle": ([0, 0.2, 0.1, 1], [0, 1, 2, 3])}, "ascend"),
        ({"shoulder.angle": ([0, 0.2, 0.3, 0.5], [0, 1, 2, 3])}, "extend from 0 s to 0.5 s"),
        ({"shoulder.angle": ([0, 0.5, 1], [0, 1, 2])}, "3 samples make no smooth motion"),
        ({"shoulder.angle": {"a": 1}}, "give an expression of t"),
        ({"shoulder.angle": "sin(x)"}, "x"),
    ):
        with pytest.raises(fb.ModelError, match=message):
            m.inverse_dynamics(11, good | motion, t_end=1)
    with pytest.raises(fb.MobilityError, match=r"shoulder\.angle: upper, lower move"):
        m.inverse_dynamics(11, good, t_end=1)
    with pytest.raises(fb.MobilityError, match="drivers motor, A angle drive prescribe the same motion"):
        four_bar_driven().inverse_dynamics(11, {"A.angle": "1 + 6*t"}, t_end=1)
    found = m.inverse_dynamics(3, good | {"shoulder.angle": "0*t"}, t_end=1)
    with pytest.raises(fb.ModelError, match="no joint 'knee'"):
        found.reaction("knee")
    with pytest.raises(fb.ModelError, match="it is not on 'lower'"):
        found.together("shoulder", on="lower")


def test_the_model_is_left_as_it_was():
    m = arm()
    m.inverse_dynamics(5, {"shoulder.angle": "t", "elbow.angle": (np.linspace(0, 1, 5), np.zeros(5))}, t_end=1)
    assert m == arm()


def test_the_command(tmp_path):
    path, out = tmp_path / "m.toml", tmp_path / "out"
    door().save(path)
    words = ["inverse-dynamics", str(path), "--motion", "upper.angle=0.5*sin(2*t)", "--outputs", "5", "-o", str(out)]
    said = CliRunner().invoke(app, words)
    assert said.exit_code == 0
    assert "undetermined: fx, fy, fz, tx, ty" in said.stdout
    assert {p.name for p in out.iterdir()} == {"inverse_dynamics.csv", "inverse_dynamics.png", "result.nc"}
    data = json.loads(CliRunner().invoke(app, [*words, "--json"]).stdout)
    assert data["reactions"]["lower.fx"]["values"] == [None] * 5
    assert CliRunner().invoke(app, ["inverse-dynamics", str(path), "--motion", "upper.angle"]).exit_code == 2
    assert CliRunner().invoke(app, ["inverse-dynamics", str(path), "-o", str(out)]).exit_code == 3


def test_a_singular_instant_is_told():
    """A slider that is pushed to the dead centre of its crank: the force that this takes has no bound."""
    m = fb.Mechanism("press", planar=True)
    m.add(fb.Body("crank", mass=1, inertia=0.01, position=(0, 0.05)))
    m.add(fb.Body("rod", mass=1, inertia=0.02, position=(0.14, 0.05)))
    x = 0.28284271247461906
    m.add(fb.Body("slider", mass=1, inertia=0.01, position=(x, 0)))
    m.add(fb.Revolute("A", "ground", "crank", at=(0, 0)), fb.Revolute("B", "crank", "rod", at=(0, 0.1)))
    m.add(fb.Revolute("C", "rod", "slider", at=(x, 0)))
    m.add(fb.Translational("D", "ground", "slider", at=(x, 0), axis=(1, 0)))
    m.add(fb.Driver("push", "slider.x", f"{x} + t"))
    end = 0.4 - x
    told = dict(m.inverse_dynamics([0.0, 0.5 * end], None).lines())
    assert "warning" not in told
    found = m.inverse_dynamics(np.linspace(0.0, end * (1 - 1e-13), 11))
    assert found.near_singular[-1]
    assert not found.near_singular[:-1].any()
    assert "singular position" in dict(found.lines())["warning"]


@pytest.mark.parametrize("coordinates", BOTH)
def test_joints_together_on_either_body(coordinates):
    """Two links held still: what both joints do to the upper one carries its weight, whichever side of it they have."""
    m = arm()
    m.add(fb.Driver("one", "shoulder.angle", "0*t"), fb.Driver("two", "elbow.angle", "0*t"))
    found = m.inverse_dynamics(3, t_end=1.0, coordinates=coordinates)
    upper = found.together("shoulder", "elbow", on="upper")
    assert upper.force == pytest.approx(np.tile([0, 2.0 * G, 0], (3, 1)), abs=1e-9)
    assert found.together("elbow", on="upper").force == pytest.approx(np.tile([0, -1.0 * G, 0], (3, 1)), abs=1e-9)
    assert found.together("elbow", on="lower").force == pytest.approx(np.tile([0, 1.0 * G, 0], (3, 1)), abs=1e-9)
    # about the middle of the upper link: 3 kg hang on its left end, 1 kg on its right
    arm_of_forces = -0.5 * 3.0 * G - 0.5 * 1.0 * G
    assert upper.torque[:, 2] == pytest.approx(arm_of_forces, abs=1e-9)


def test_many_dependencies_are_counted_by_pivots(monkeypatch):
    """22 driven windows: 462 rows of which 396 can be independent, taken for a large mechanism; 66 are too many."""
    from flyball.kinematics import inverse_dynamics
    from flyball.numerics import rank

    m = windows(22)
    m.add(*[fb.Driver(f"drive{k}", f"A{k}.angle", "0.1*t") for k in range(22)])
    for module in (inverse_dynamics, rank):
        monkeypatch.setattr(module, "MAX_DOUBTFUL_SVD_SIZE", 0)
    found = m.inverse_dynamics([0.1])
    assert found.determinacy.count.tolist() == [66]
    assert len(found.determinacy.wrenches) == 88
