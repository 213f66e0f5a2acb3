"""Tyres against the published formulas, the bicycle model, statics, and what a stop and a slope must do."""

import math

import numpy as np
import pytest

import flyball as fb
from flyball.forces.tyres import FialaTyre, MagicFormula, magic_formula
from flyball.model.element import resolve
from tests.verification.published_tyres import MF61, mf61

G = 9.81
MODEL = {
    "radius": 0.3, "stiffness": 2e5, "damping": 500.0, "nominal_load": 4000.0, "slip_stiffness": 8e4,
    "cornering_stiffness": 6e4,
}  # fmt: skip


def magic(load, slip, alpha, camber, pressure=None):
    """Fx, Fy, Mx, My, Mz of the Magic Formula."""
    model = MagicFormula(coefficients=MF61, pressure=pressure)
    data = np.array(model.numbers(resolve(model, {})))
    tangent = math.tan(alpha)
    motion = (1.0 / math.hypot(1.0, tangent), 10.0, 33.0)
    return magic_formula.slip_forces(data, 0, 1.0, slip, tangent, math.sin(camber), load, motion)


@pytest.mark.parametrize("load", [1500.0, 4000.0, 6500.0])
@pytest.mark.parametrize(
    ("slip", "alpha"), [(0.0, 0.0), (0.03, 0.0), (0.0, 0.05), (-0.12, 0.08), (0.2, -0.15), (-0.9, 0.3)]
)
@pytest.mark.parametrize("camber", [0.0, 0.06, -0.1])
def test_magic_formula_is_that_of_the_book(load, slip, alpha, camber):
    for pressure in (None, 250000.0):
        fx, fy, mx, _, mz = magic(load, slip, alpha, camber, pressure)
        told = mf61(MF61, load, slip, math.tan(alpha), camber, pressure or 220000.0)
        assert (fx, fy, mx, mz) == pytest.approx(told, rel=1e-5, abs=2e-3 * 4.0)


def test_magic_formula_has_the_published_slopes_and_peaks():
    """Cornering stiffness PKY1 Fz0 sin(PKY4 atan(1 / PKY2)), slip stiffness PKX1 Fz, peak of friction PDX1."""
    h = 1e-6
    slope = (magic(4000.0, 0.0, h, 0.0)[1] - magic(4000.0, 0.0, -h, 0.0)[1]) / (2.0 * h)
    assert slope == pytest.approx(-15.324 * 4000.0 * math.sin(2.0005 * math.atan(1.0 / 1.715)), rel=2e-3)
    slope = (magic(4000.0, h, 0.0, 0.0)[0] - magic(4000.0, -h, 0.0, 0.0)[0]) / (2.0 * h)
    assert slope == pytest.approx(21.687 * 4000.0, rel=2e-3)
    peak = max(magic(4000.0, k, 0.0, 0.0)[0] for k in np.linspace(0.0, 0.4, 400))
    assert peak == pytest.approx(1.0422 * 4000.0, rel=2e-3)


def test_fiala_slides_where_the_book_says():
    """All of the patch slides at tan(alpha) = 3 mu Fz / C; the force is then mu Fz and the trail zero."""
    model = FialaTyre(**MODEL, friction=0.8, trail=0.04)
    data = np.array(model.numbers(resolve(model, {})))
    sliding = 3.0 * 0.8 * 4000.0 / 6e4
    for tangent in (1.001 * sliding, 2.0 * sliding):
        _, fy, _, _, mz = model.slip_forces(data, 0, 1.0, 0.0, tangent, 0.0, 4000.0, (1.0, 10.0, 30.0))
        assert (fy, mz) == pytest.approx((-3200.0, 0.0), abs=1e-3)
    # aligning moment of the brush model: largest at a quarter of that, 27/256 mu Fz 3 t0 (Pacejka 2012, section 3.2)
    most = max(
        model.slip_forces(data, 0, 1.0, 0.0, x * sliding, 0.0, 4000.0, (1.0, 10.0, 30.0))[4]
        for x in np.linspace(0, 1, 401)
    )
    assert most == pytest.approx(27.0 / 256.0 * 3.0 * 0.04 * 3200.0, rel=1e-5)


def car(model=None, road=None, v=20.0, steer="0", gravity=(0.0, 0.0, -G), front=1.2, rear=1.4, mass=1500.0):
    """A body on four wheels, of which the front ones are steered; wheels and knuckles have little mass."""
    m = fb.Mechanism("car", gravity=gravity, parameters={"v": v})
    m.add(road or fb.Road("road"))
    m.add(fb.Body("chassis", mass=mass, inertia=(500, 2000, 2200), position=(0, 0, 0.35), velocity=("v", 0, 0)))
    for x, axle in ((front, "front"), (-rear, "rear")):
        for y, side in ((0.75, "left"), (-0.75, "right")):
            name, at = f"{axle} {side}", (x, y, 0.281)
            spin = (0, "v/0.2937", 0)
            m.add(
                fb.Body(name, mass=1, inertia=(0.3, 0.5, 0.3), position=at, velocity=("v", 0, 0), angular_velocity=spin)
            )
            carrier = "chassis"
            if axle == "front":
                carrier = f"knuckle {side}"
                m.add(fb.Body(carrier, mass=1, inertia=(0.05,) * 3, position=at, velocity=("v", 0, 0)))
                m.add(fb.Revolute(f"steer {side}", "chassis", carrier, at=at, axis=(0, 0, 1)))
                m.add(fb.Driver(f"steering {side}", f"steer {side}.angle", steer))
            m.add(fb.Revolute(f"spin {name}", carrier, name, at=at, axis=(0, 1, 0)))
            m.add(fb.Tyre(f"tyre {name}", "road", name, model=model or fb.LinearTyre(**MODEL)))
    return m


WHEELS = ("front left", "front right", "rear left", "rear right")


def test_static_loads_are_those_of_the_levers():
    eq = car(v=0.0).equilibrium()
    loads = [eq[f"tyre {w}"].load for w in WHEELS]
    share = 0.5 * 1500.0 * G / 2.6
    assert loads[0] == pytest.approx(share * 1.4 + 2.0 * G, rel=1e-3)  # a wheel and a knuckle
    assert loads[2] == pytest.approx(share * 1.2 + G, rel=1e-3)
    assert sum(loads) == pytest.approx(1506.0 * G, rel=1e-9)


def test_steady_cornering_is_that_of_the_bicycle_model():
    """Yaw rate v delta / (L + K v^2); stiffness proportional to the load: both axles slip alike, so K = 0."""
    delta = 0.004
    run = car(steer=f"{delta}*step(t, 0.5, 0, 1.5, 1)").simulate(8.0)
    v = float(np.linalg.norm(run["chassis"].velocity[-1, :2]))
    assert run["chassis"].omega_z[-1] == pytest.approx(v * delta / 2.6, rel=3e-3)
    # slip angle of an axle: lateral acceleration over cornering stiffness per load
    slip = run["tyre rear left"].slip_angle[-1]
    assert slip == pytest.approx(-v * run["chassis"].omega_z[-1] / G * 4000.0 / 6e4, rel=1e-2)


def test_understeer_gradient_is_that_of_the_stiffnesses():
    """Tyres of another stiffness in front: K = (m / L) (b / Cf - a / Cr), the yaw rate falls accordingly."""
    m = car(steer="0.004*step(t, 0.5, 0, 1.5, 1)")
    soft = fb.LinearTyre(**(MODEL | {"cornering_stiffness": 4e4}))
    for side in ("left", "right"):
        m = m.changed({f"tyre front {side}": fb.Tyre(f"tyre front {side}", "road", f"front {side}", model=soft)})
    run = m.simulate(8.0)
    v = float(np.linalg.norm(run["chassis"].velocity[-1, :2]))
    K = (4000.0 / 4e4 - 4000.0 / 6e4) / G
    assert run["chassis"].omega_z[-1] == pytest.approx(v * 0.004 / (2.6 + K * v * v), rel=3e-3)


def braked(m, torque):
    for w in WHEELS:
        m.add(fb.Motor(f"brake {w}", f"spin {w}", torque=torque))
    return m


def test_a_car_brakes_to_rest_and_stays():
    """Deceleration 4 T / (R m) while it rolls; then standstill without chatter: few steps, no creeping."""
    run = braked(car(v=10.0), "-400*tanh(rate/0.1)").simulate(6.0)
    early = np.searchsorted(run.t, 0.6), np.searchsorted(run.t, 1.0)
    v = run["chassis"].vx
    slowed = (v[early[0]] - v[early[1]]) / (run.t[early[1]] - run.t[early[0]])
    assert slowed == pytest.approx(4 * 400.0 / 0.2815 / 1506.0, rel=2e-2)
    assert abs(v[-1]) < 1e-4
    assert np.ptp(run["chassis"].x[run.t > 5.0]) < 1e-4
    assert abs(run.health.energy_drift) < 1e-5


def test_a_parked_car_stands_on_a_slope():
    m = car(v=0.0, gravity=(-0.1 * G, 0.0, -math.sqrt(0.99) * G))
    for w in WHEELS:
        m.add(fb.CoordinateSpring(f"parking {w}", f"spin {w}.angle", stiffness=2e4, damping=200.0))
    run = m.simulate(20.0)
    push = sum(run[f"tyre {w}"].longitudinal_force[-1] for w in WHEELS)
    assert push == pytest.approx(1506.0 * 0.1 * G, rel=1e-6)
    assert np.ptp(run["chassis"].x[run.t > 15.0]) < 1e-8
    eq = m.equilibrium()
    assert sum(eq[f"tyre {w}"].longitudinal_force for w in WHEELS) == pytest.approx(1506.0 * 0.1 * G, rel=1e-6)


def test_a_wheel_falls_on_the_road_and_rests():
    """In the air there is no force; the natural frequency of the rest is sqrt(k / m), with the damping given."""
    m = fb.Mechanism("drop", gravity=(0, 0, -G))
    m.add(fb.Body("wheel", mass=400, inertia=(10, 20, 10), position=(0, 0, 0.35)))
    m.add(fb.Tyre("tyre", "ground", "wheel", model=fb.LinearTyre(**MODEL)))
    run = m.simulate(20.0)
    air = run.t < math.sqrt(2.0 * 0.05 / G)
    assert not run["tyre"].load[air].any() and (run["tyre"].deflection[air] < 0.0).all()
    assert (run["tyre"].load >= 0.0).all()
    assert run["tyre"].load[-1] == pytest.approx(400.0 * G, rel=1e-4)
    eq = m.equilibrium()
    eigenvalues = m.linearize(about=eq).eigenvalues
    bounce = math.sqrt(2e5 / 400.0 - (500.0 / 800.0) ** 2)
    assert min(abs(eigenvalues - complex(-500.0 / 800.0, bounce))) < 1e-3


def test_sensitivities_go_through_tyres():
    m = fb.Mechanism("wheel", gravity=(0, 0, -G), parameters={"k": 2e5, "C": 8e4})
    at, spin = (0, 0, 0.3 - 0.4 * G / 200.0), (0, 30, 0)
    m.add(fb.Body("wheel", mass=400, inertia=(10, 20, 10), position=at, velocity=(10, 1, 0), angular_velocity=spin))
    model = fb.FialaTyre(**(MODEL | {"stiffness": "k", "slip_stiffness": "C"}))
    m.add(fb.Tyre("tyre", "ground", "wheel", model=model))
    found = m.sensitivity(["wheel.x", "tyre.load"], ["k", "C"], t_end=0.5, analysis="motion")
    more, less = (m.simulate(0.5, parameters={"C": 8e4 * x}, rtol=1e-10)["wheel"].x[-1] for x in (1.001, 0.999))
    assert found["wheel.x", "C"][-1] == pytest.approx((more - less) / 160.0, rel=1e-3)
