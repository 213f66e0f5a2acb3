"""Wheel on a rail: the same formula for every kind of number, anywhere, reflected, and in the air."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import flyball as fb
from flyball.engine import element_dispatch
from flyball.forces.rolling_contact import hertz
from flyball.model.element import resolve
from flyball.testing.formula_checks import frame_record, turned_frame

STILL = dict.fromkeys(("w", "v", "alpha", "a"), np.zeros(3))
NO_LAWS = (0.0, 0.0, 0.0)
SPEED, RADIUS = 20.0, 0.46
FIELDS = {"radius": RADIUS, "conicity": 0.05, "inclination": 0.05, "dissipation": 0.2, "wheel_load": 7e4}
CASES = {
    "track": {},
    "roller": {"roller_radius": 0.5},
    "curve": {"curve_radius": 300.0},
    "canted": {"curve_radius": -300.0, "axis": (0.0, np.cos(0.1), np.sin(0.1))},
}
cases = pytest.mark.parametrize("name", CASES)


def contact(side=1.0, **more):
    """An element at half the gauge on one side: formulas' numbers, splines and frame F."""
    axis = np.array(more.pop("axis", (0.0, 1.0, 0.0))) * (1.0, side, side)
    e = fb.WheelOnRail("w", "ground", "b", at=(0.0, 0.75 * side, 0.0), axis=axis, **{**FIELDS, **more})
    n = resolve(e, {})
    e.check(n)
    par = (*e.parameters(n, 0.0), *(0.0,) * 16)[:16]
    p, R = e.placed(n, False)["F"]
    return SimpleNamespace(e=e, par=par, data=np.concatenate(e.curves(n)), F={"p": p, "R": R, **STILL})


def rolling(y=0.0, z=-1e-4, yaw=0.0, roll=0.0, side=1.0, slip=0.0):
    """Frame M of a wheel that rolls with a yaw angle [rad], shifted by y and z [m]."""
    R = Rotation.from_euler("zx", [yaw, roll]).as_matrix()
    p, w = np.array([0.002, 0.75 * side + y, RADIUS + z]), R @ (0.0, SPEED / RADIUS * (1.0 + slip), 0.0)
    return {"p": p, "R": R, "w": w, "v": np.array([SPEED, 0.0, 0.0]), "alpha": np.zeros(3), "a": np.zeros(3)}


STATES = [
    rolling(0.002, -1e-4, 0.004, 0.01),
    rolling(-0.004, -4e-4, -0.01, 0.0, slip=0.001),
    rolling(0.006, -2e-4, 0.001),
]


def wrench(c, M, dtype=float):
    return np.ravel(c.e.wrench(c.par, frame_record(c.F, dtype), frame_record(M, dtype), NO_LAWS, (0.0, 0.0), c.data))


def figures(c, M):
    return dict(zip(c.e.outputs, c.e.figures(c.par, frame_record(c.F), frame_record(M), NO_LAWS, c.data), strict=True))


@cases
def test_complex_numbers_arrays_and_the_list_of_kinds_change_nothing(name):
    c = contact(**CASES[name])
    many = [
        tuple(np.array(x) for x in zip(*parts, strict=True)) for parts in zip(*map(frame_record, STATES), strict=True)
    ]
    still = tuple(tuple(np.full(len(STATES), x) for x in part) for part in frame_record(c.F))
    arrays = np.array(
        [
            np.broadcast_to(x, len(STATES))
            for part in c.e.wrench(c.par, still, many, NO_LAWS, (0, 0), c.data)
            for x in part
        ]
    )
    for k, M in enumerate(STATES):
        one = wrench(c, M)
        told = c.par, frame_record(c.F), frame_record(M), NO_LAWS, (0.0, 0.0), c.data
        assert np.ravel(element_dispatch.wrench(c.e.kind, *told)) == pytest.approx(one, rel=1e-15)
        assert wrench(c, M, complex).real == pytest.approx(one, rel=1e-12, abs=1e-9)
        assert arrays[:, k] == pytest.approx(one, rel=1e-12, abs=1e-9)
        assert one[2] > 1e4


@cases
def test_a_complex_step_is_the_derivative(name):
    c, h, e = contact(**CASES[name]), 1e-30, 1e-6
    for M in STATES:
        for k in range(3):
            d = np.eye(3)[k]
            exact = wrench(c, M | {"p": M["p"] + 1j * h * d}, complex).imag / h
            near = (wrench(c, M | {"p": M["p"] + e * d}) - wrench(c, M | {"p": M["p"] - e * d})) / (2.0 * e)
            assert exact == pytest.approx(near, rel=2e-5, abs=1.0 + 1e-6 * np.abs(near).max())


@cases
def test_nothing_depends_on_the_world(name):
    Q, d = Rotation.random(random_state=3).as_matrix(), np.array([1e3, -2e2, 50.0])
    here = contact(**CASES[name])
    for M in STATES:
        there = SimpleNamespace(**{**vars(here), "F": turned_frame(here.F, Q, d)})
        found = wrench(there, turned_frame(M, Q, d)).reshape(2, 3)
        assert found == pytest.approx(wrench(here, M).reshape(2, 3) @ Q.T, rel=1e-6, abs=0.5)


@pytest.mark.parametrize("name", ["track", "roller"])
def test_the_right_wheel_is_the_left_one_reflected(name):
    left, right = contact(**CASES[name]), contact(-1.0, **CASES[name])
    for y, z, yaw, roll in ((0.002, -1e-4, 0.004, 0.01), (-0.004, 0.0, -0.01, 0.0)):
        one, other = rolling(y, z, yaw, roll), rolling(-y, z, -yaw, -roll, side=-1.0)
        assert wrench(right, other) == pytest.approx(wrench(left, one) * (1, -1, 1, -1, 1, -1), rel=1e-9, abs=1e-6)
        shown = figures(left, one)
        assert figures(right, other) == pytest.approx(shown, rel=1e-9, abs=1e-9)


def test_a_wheel_in_the_air_and_one_beside_the_rail_have_no_force():
    c = contact()
    assert np.abs(wrench(c, rolling(z=0.01))).max() == 0.0
    assert np.abs(wrench(c, rolling(y=0.2, z=0.03))).max() == 0.0
    assert figures(c, rolling(z=0.01))["derailment_ratio"] == 0.0


def test_the_load_in_the_drawn_configuration():
    for more in CASES.values():
        M = rolling(z=0.0)
        M["p"][0], M["w"], M["v"] = 0.0, np.zeros(3), np.zeros(3)
        if "axis" in more:
            continue
        assert figures(contact(**more), M)["normal_force"] == pytest.approx(7e4, rel=1e-4)


def test_hertz_and_friction_bound_the_force():
    c = contact(friction=0.3)
    shown = figures(c, rolling(0.0, -1e-4, slip=0.1))
    assert shown["longitudinal_force"] == pytest.approx(0.3 * shown["normal_force"], rel=0.03)
    E = 0.5 * 210e9 / (1.0 - 0.28**2)
    a, b, N = hertz(0.5 / RADIUS, 0.5 / 0.3, E, shown["depth"])
    found = [shown[k] for k in ("semi_axis_along", "semi_axis_across")]
    assert found == pytest.approx([a, b], rel=2e-3)
    assert pytest.approx(figures(contact(dissipation=0.0), rolling(0.0, -1e-4))["normal_force"], rel=2e-3) == N


def test_a_curve_is_a_straight_track_that_turns():
    """A quarter of a circle further the force is that on straight track, turned by a right angle."""
    R, straight = 300.0, contact()
    c = contact(curve_radius=R)
    M = STATES[0] | {"p": STATES[0]["p"] * (0, 1, 1)}
    Q = Rotation.from_euler("z", 90, degrees=True).as_matrix()
    middle = np.array([0.0, 0.75 + R, 0.0])
    turned = turned_frame(M, Q, middle - Q @ middle)
    force = wrench(c, turned).reshape(2, 3)
    assert force == pytest.approx(wrench(straight, M).reshape(2, 3) @ Q.T, rel=1e-7, abs=1e-3)
    assert figures(c, turned)["distance"] == pytest.approx(R * np.pi / 2, rel=1e-12)
