"""Every output time that was given is a row, whatever the span, the times, the method and the coordinates."""

import numpy as np
import pytest

import flyball as fb

METHODS = {
    "dop853": {},
    "rk45": {},
    "radau": {},
    "fixed": {"method": "rk45", "step": 0.013},
    "generalised-alpha": {"step": 0.011},
    "variational": {"step": 0.007},
}
SPANS = 80  # of each method and kind of coordinates


def pendulum(*more):
    m = fb.Mechanism("pendulum", planar=True, gravity=(0, -9.81), parameters={"k": 0.0})
    m.add(fb.Body("b", mass=1, inertia=1, position=(0.5, 0)), fb.Revolute("A", "ground", "b", at=(0, 0)))
    m.add(*more)
    return m


def driven():
    """A crank that a driver turns, and nothing else is free."""
    return pendulum(fb.Driver("D", "A.angle", "sin(3*t)"))


def watched():
    """The same pendulum with an event that is only noted."""
    return pendulum(fb.Event("passes", "A.angle < -0.02", do=[]))


def grid(rng, begin, end):
    """A number of times, or times of which the first and the last may be the ends."""
    if rng.random() < 0.3:
        return int(rng.integers(2, 9))
    inner = rng.uniform(begin, end, int(rng.integers(0, 5)))
    ends = [x for x, there in ((begin, rng.random() < 0.7), (end, rng.random() < 0.95)) if there]
    times = np.unique(np.concatenate([inner, ends]))
    return times.tolist() if len(times) else [end]


def spans(seed, longest=1.0):
    """Spans of time of all sizes, many of them not a sum of their steps to the last bit, and output times in them."""
    rng = np.random.default_rng(seed)
    for k in range(SPANS):
        begin = 0.0 if rng.random() < 0.8 else float(rng.uniform(-1.0, 3.0))
        end = begin + longest * float(rng.uniform(0.0, 0.1) if k % 4 else 10.0 ** rng.uniform(-7.0, 0.0))
        yield begin, end, grid(rng, begin, end)


def every_time(m, begin, end, outputs, **options):
    run = m.simulate(end, t_start=begin, outputs=outputs, **options)
    given = np.linspace(begin, end, outputs) if isinstance(outputs, int) else outputs
    assert run.health.success
    np.testing.assert_allclose(run.t, given, rtol=0, atol=1e-15 * max(1.0, abs(end)))


@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("make", [pendulum, watched])
def test_of_what_is_integrated(make, method, coordinates):
    if method == "variational" and (make is watched or coordinates == "joint"):
        pytest.skip("it knows no events, and absolute coordinates only")
    m, options = make(), {"method": method, "coordinates": coordinates} | METHODS[method]
    if "step" in METHODS[method]:
        options["max_steps"] = 10_000
    for span in spans(len(method) + 7 * (coordinates == "joint")):
        every_time(m, *span, **options)


@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
def test_of_what_drivers_prescribe(coordinates):
    m = driven()
    for span in spans(5):
        every_time(m, *span, coordinates=coordinates)


def test_of_steps_by_impulses():
    m = fb.Mechanism("ball", gravity=(0, 0, -9.81))
    m.add(fb.Ground("floor", shape=fb.Plane()), fb.Contact(friction=0.3))
    m.add(
        fb.Body(
            "b",
            mass=1,
            inertia=[0.001] * 3,
            position=(0, 0, 0.06),
            shape=fb.Sphere(radius=0.05, looks=True, contact=True),
        )
    )
    for span in spans(3, longest=0.1):
        every_time(m, *span, method="impulse")


@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
@pytest.mark.parametrize("method", ["dop853", "rk45"])
def test_the_end_of_a_span_that_its_steps_miss_by_rounding(method, coordinates):
    """0 to 0.0249 s in two steps of which the second ends before the end by one in the last place; -1/4 g t^2 ... ."""
    end = 0.024899097858680174
    m = pendulum(fb.Motor("u", "A", torque="k"))
    run = m.simulate(end, outputs=[0, end], method=method, coordinates=coordinates)
    assert run.t.tolist() == [0, end]
    # m g r / (I + m r^2) = 3.924 rad/s^2 all the way: the angle is small
    assert run["A.angle"][-1] == pytest.approx(-0.5 * 3.924 * end**2, rel=1e-4)
    study = m.study({"k": [0.0, 1e-9]}, ["end(A.angle)"], t_end=end, outputs=[0, end])
    np.testing.assert_allclose(study["end(A.angle)"], run["A.angle"][-1], rtol=1e-6)
