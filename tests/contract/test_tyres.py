"""Every tyre model, found by registry: plain numbers, complex steps and compiled code agree; axes and mirrors."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import flyball as fb
from flyball.engine.element_dispatch import wrench_and_rates
from flyball.forces.tyre import FRICTION, patch_state
from flyball.forces.tyres import MODELS
from flyball.model.element import resolve
from flyball.testing.formula_checks import frame_record, turned_frame
from tests.verification.published_tyres import MF61

SCALED = {
    "radius": 0.3, "stiffness": 2e5, "damping": 500.0, "nominal_load": 4000.0, "slip_stiffness": 8e4,
    "cornering_stiffness": 6e4, "camber_stiffness": 4e3, "trail": 0.03, "rolling_resistance": 0.01,
    "relaxation_length": 0.2, "lateral_relaxation_length": 0.4,
}  # fmt: skip
SAMPLES = {
    "LinearTyre": fb.LinearTyre(**SCALED),
    "FialaTyre": fb.FialaTyre(**SCALED, friction=0.9),
    "MagicFormula": fb.MagicFormula(coefficients=MF61),
}
models = pytest.mark.parametrize("model", SAMPLES.values(), ids=SAMPLES)


def told(model, **more):
    tyre = fb.Tyre("t", "ground", "wheel", model=model, **more)
    n = resolve(tyre, {})
    n.of = None
    par = tyre.parameters(n, 0.0)
    return (*par, *(0.0,) * (14 - len(par)), -1.0, 0.0), np.array(tyre.data(n))


def frames(lean=0.05, steer=0.1, speed=(9.0, 0.4, -0.02), spin=31.0, height=0.29):
    R = Rotation.from_euler("ZX", [steer, lean]).as_matrix() @ Rotation.from_euler("y", 0.7).as_matrix()
    o = np.zeros(3)
    ground = {"p": o, "R": np.eye(3), "w": o, "v": o, "alpha": o, "a": o}
    moving = {"p": np.array([3.0, 1.0, height]), "R": R, "w": R[:, 1] * spin + [0.1, 0.02, 0.3], "v": np.array(speed)}
    return ground, ground | moving


def state(model, deflections=(0.004, -0.006), more=None, dtype=float, **motion):
    par, data = told(model, **(more or {}))
    F, M = frames(**motion)
    return patch_state(par, frame_record(F, dtype), frame_record(M, dtype), deflections, data, np.zeros(1))


def test_every_model_has_a_sample():
    assert set(SAMPLES) == {m.__name__ for m in MODELS}
    assert [m.kind for m in MODELS] == list(range(len(MODELS)))


@models
def test_nothing_depends_on_the_world(model):
    par, data = told(model)
    F, M = frames()
    Q, d = Rotation.random(random_state=3).as_matrix(), np.array([1e3, -2e2, 5e1])
    here = wrench_and_rates(11, par, frame_record(F), frame_record(M), (0.004, -0.006), data, np.zeros(1))
    f, m = (frame_record(turned_frame(x, Q, d)) for x in (F, M))
    there = wrench_and_rates(11, par, f, m, (0.004, -0.006), data, np.zeros(1))
    for a, b in zip(here[:2], there[:2], strict=True):
        assert np.array(b) == pytest.approx(Q @ np.array(a), rel=1e-8, abs=1e-7)
    assert there[2] == pytest.approx(here[2], rel=1e-9)


@models
def test_complex_steps_are_derivatives(model):
    def forces(height, dtype=float):
        place, _, (load, *_), _, f, rates = state(model, height=height, dtype=dtype)
        return np.array([load, *f, *rates])

    exact = np.imag(forces(0.285 + 1e-30j, complex)) / 1e-30
    differences = (forces(0.285 + 1e-6) - forces(0.285 - 1e-6)) / 2e-6
    assert exact == pytest.approx(differences, rel=1e-5, abs=1e-3)


@models
def test_a_wheel_in_the_air_is_free(model):
    place, _, (load, deflection, _), _, forces, _ = state(model, height=0.5)
    assert load == 0.0 and deflection < 0.0
    assert forces == pytest.approx((0.0,) * 5, abs=1e-3)


@models
def test_signs_of_iso(model):
    """Driving slip pushes forward; a patch that moves to the left is pushed to the right, and turned to its motion."""
    still = {"lean": 0.0, "steer": 0.0}
    _, _, _, _, (fx, fy, _, my, mz), rates = state(model, (0.01, 0.02), **still, speed=(10.0, 0.5, 0.0))
    assert fx > 0.0 and fy < 0.0 and mz > 0.0 and my <= 0.0
    assert rates[1] > 0.0 or abs(0.5 - 10.0 * 0.02 / 0.4) < 0.3


def test_the_other_side_is_the_mirror_image():
    model = SAMPLES["MagicFormula"]
    left = state(model, more={"side": "left"})
    right = state(model, (0.004, 0.006), more={"side": "right"}, lean=-0.05, steer=-0.1, speed=(9.0, -0.4, -0.02))
    a, b = np.array(left[4]), np.array(right[4])
    assert a[[0, 3]] == pytest.approx(b[[0, 3]], rel=2e-2)  # the angular velocity given is not mirrored wholly
    assert abs(a[1] + b[1]) < 0.02 * abs(a[1]) + 5.0


def test_friction_of_the_road_scales_the_limit():
    par, data = told(SAMPLES["FialaTyre"])
    F, M = (frame_record(x) for x in frames())
    half = [0.5 if k == FRICTION else x for k, x in enumerate(par)]
    whole = patch_state(par, F, M, (0.2, 0.0), data, np.zeros(1))
    slippery = patch_state(tuple(half), F, M, (0.2, 0.0), data, np.zeros(1))
    assert slippery[4][0] == pytest.approx(0.5 * whole[4][0], rel=2e-3)


def test_a_wheel_below_its_road_stops_the_motion():
    m = fb.Mechanism("sunk wheel", gravity=(0, 0, -9.81))
    m.add(fb.Body("wheel", mass=20, inertia=(1, 1, 1), position=(0, 0, -5)))
    model = fb.LinearTyre(radius=0.3, stiffness=2e5, nominal_load=4e3, slip_stiffness=8e4, cornering_stiffness=6e4)
    m.add(fb.Tyre("tyre", "ground", "wheel", model=model))
    with pytest.raises(fb.FlyballError, match=r"The centre of the wheel is 5 m beneath 'ground'"):
        m.simulate(0.1)


def test_a_flat_wheel_stops_the_motion_by_its_axis():
    m = fb.Mechanism("flat wheel", gravity=(0, 0, -9.81))
    m.add(fb.Body("wheel", mass=20, inertia=(1, 1, 1), position=(0, 0, 0.2), orientation=("90 deg", 0, 0)))
    m.add(fb.Tyre("tyre", "ground", "wheel", model=SAMPLES["LinearTyre"]))
    with pytest.raises(fb.FlyballError, match=r"lies flat on 'ground'.*axis is y of 'wheel'"):
        m.simulate(0.1)


@models
def test_rolling_resistance_is_against_the_spin(model):
    """A locked wheel that slides has none, a wheel that spins backwards while it slides forwards the reverse one."""
    moments = [state(model, (0.0, 0.0), lean=0.0, steer=0.0, spin=w)[4][3] for w in (30.0, 0.0, -30.0)]
    assert moments[0] < 0.0
    assert moments[1:] == pytest.approx([0.0, -moments[0]], abs=0.1 * abs(moments[0]))  # of a spin of 0.02 rad/s
