"""What implicit steps work with is laid out once for a structure: each run is still as if it were the only one."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import flyball as fb

METHODS = [("radau", {}), ("generalised-alpha", {"step": 5e-3}), ("variational", {"step": 5e-3})]


def swing():
    """Two pendulums, the upper hinge damped; a spring between ground and the lower one."""
    m = fb.Mechanism("swing", planar=True, gravity=(0, -9.81), parameters={"c": 0.5, "k": 40.0, "m": 1.0})
    m.add(
        fb.Body("a", mass="m", inertia=0.1, position=(0.5, 0)), fb.Body("b", mass=2.0, inertia=0.2, position=(1.5, 0))
    )
    m.add(fb.Revolute("h", "ground", "a", at=(0, 0)), fb.Revolute("i", "a", "b", at=(1, 0)))
    m.add(fb.CoordinateSpring("d", "h.angle", stiffness=0.0, damping="c"))
    m.add(fb.SpringDamper("s", "ground", "b", at=((2, 1), (1.5, 0)), stiffness="k", length=0.5))
    return m


def numbers(run):
    return np.concatenate([x.ravel() for x in (run.q, run.v, run.vdot, run.multipliers, run.energy.total)])


@pytest.mark.parametrize("coordinates", ["absolute", "joint"])
@pytest.mark.parametrize(("method", "more"), METHODS)
def test_each_run_is_that_of_a_new_mechanism(method, more, coordinates):
    """To the last bit: other parameters, tolerances and masses in between leave nothing behind."""
    o = {"method": method, "coordinates": "absolute" if method == "variational" else coordinates, **more}
    points = [{"c": 0.5}, {"c": 30.0, "k": 900.0}, {"m": 5.0}, {"c": 0.5}]
    m = swing()
    runs = [m.simulate(0.3, parameters=p, outputs=5, rtol=r, **o) for p in points for r in (1e-4, 1e-7)]
    alone = [swing().simulate(0.3, parameters=p, outputs=5, rtol=r, **o) for p in points for r in (1e-4, 1e-7)]
    for one, other in zip(runs, alone, strict=True):
        assert np.array_equal(numbers(one), numbers(other))
        assert (one.health.steps, one.health.evaluations) == (other.health.steps, other.health.evaluations)


def test_threads_have_their_own():
    m, o = swing(), {"method": "radau", "outputs": 5}
    points = [{"c": c, "m": mass} for c in (0.1, 1.0, 50.0) for mass in (0.5, 3.0)] * 3
    with ThreadPoolExecutor(3) as threads:
        found = list(threads.map(lambda p: numbers(m.simulate(0.3, parameters=p, **o)), points))
    for p, x in zip(points, found, strict=True):
        assert np.array_equal(x, numbers(m.simulate(0.3, parameters=p, **o)))


@pytest.mark.parametrize("method", ["radau", "dop853"])
def test_what_is_asked_late_is_of_the_mechanism_as_it_was(method):
    """Accelerations, multipliers, energies that nobody had asked for when the mechanism was changed and run again."""
    m = swing()
    late, at_once = (m.simulate(0.3, method=method, outputs=5) for _ in range(2))
    known = numbers(at_once)
    m.parameters["c"], m.parameters["k"] = 9.0, 4000.0
    m.add(fb.Body("more", mass=1.0, inertia=0.1, position=(3, 0)))
    other = m.simulate(0.3, method=method, outputs=5)
    assert not np.array_equal(other["b"].position, at_once["b"].position)
    assert np.array_equal(numbers(late), known)
    assert late.health.energy_drift == at_once.health.energy_drift
