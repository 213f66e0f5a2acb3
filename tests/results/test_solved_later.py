"""Accelerations and reactions that are solved for when they are asked for are those of the motion."""

from __future__ import annotations

import copy
import pickle
import threading
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import flyball as fb
from tests import mechanisms

NAMES = ["andrews.toml", "bricard.toml", "governor.toml", "rolling_disk.toml", "spatial_four_bar.toml", "car_axis.toml"]


@pytest.mark.parametrize("coordinates", ["absolute", "joint"])
@pytest.mark.parametrize("name", NAMES)
def test_they_are_those_at_the_states(name, coordinates):
    m = mechanisms.example(name)
    r = m.simulate(0.02, outputs=5, coordinates=coordinates)
    assert r.deferred_accelerations is not None
    p = m.prepare(coordinates=coordinates)
    if not r.values.structure.terms or all(t.hint < 0 for t in r.values.structure.terms):
        found = np.array([p.acceleration(t, q, v) for t, q, v in zip(r.t, r.q, r.v, strict=True)])
        np.testing.assert_allclose(r.vdot, found, rtol=1e-9, atol=1e-9 * np.abs(found).max())
    G = [p.jacobian(t, q) for t, q in zip(r.t, r.q, strict=True)]
    M = [p.mass_matrix(q) for q in r.q]
    forces = np.array([p.forces(t, q, v) for t, q, v in zip(r.t, r.q, r.v, strict=True)])
    left = [A @ a - f - B.T @ x[: len(B)] for A, a, f, B, x in zip(M, r.vdot, forces, G, r.multipliers, strict=True)]
    assert np.abs(left).max() <= 1e-8 * np.abs(forces).max()


def test_order_of_asking_does_not_matter():
    one, two = (mechanisms.example("andrews.toml").simulate(0.02, outputs=7) for _ in range(2))
    force = one["O.force"] if "O" in one.parts() else one.multipliers
    _ = two.energy.total, two.states, two.final
    other = two["O.force"] if "O" in two.parts() else two.multipliers
    assert force.tobytes() == other.tobytes()
    three = pickle.loads(pickle.dumps(mechanisms.example("andrews.toml").simulate(0.02, outputs=7)))
    assert three.multipliers.tobytes() == one.multipliers.tobytes()


@pytest.mark.parametrize(("name", "what"), [("andrews.toml", "vdot"), ("slider_crank.toml", "states")])
def test_threads_that_ask_at_once_are_told_the_same(name, what):
    m = mechanisms.example(name)
    alone = getattr(m.simulate(0.03, outputs=400), what).tobytes()
    for _ in range(5):
        r = m.simulate(0.03, outputs=400)
        begin = threading.Barrier(4)

        def ask(_, r=r, begin=begin):
            begin.wait()
            return getattr(r, what).tobytes()

        with ThreadPoolExecutor(4) as pool:
            assert set(pool.map(ask, range(4))) == {alone}


@pytest.mark.parametrize("again", [copy.copy, copy.deepcopy, lambda r: pickle.loads(pickle.dumps(r))])
def test_a_copy_has_found_all_and_leaves_the_scratch_behind(again):
    m = mechanisms.example("andrews.toml")
    r = m.simulate(0.02, outputs=7)
    made = again(r)
    assert made.deferred_accelerations is None
    assert made.deferred_works is None
    assert made.vdot.tobytes() == m.simulate(0.02, outputs=7).vdot.tobytes()


def test_a_function_with_a_memory_is_asked_in_order():
    seen = []

    def pull(t):
        seen.append(t)
        return 1.0

    m = fb.Mechanism("block", planar=True)
    m.add(fb.Body("b", mass=1, inertia=1), fb.PointForce("F", "b", force=(pull, 0)))
    with pytest.warns(fb.PerformanceNotice):
        r = m.simulate(1.0, outputs=3)
    count = len(seen)
    assert r["b"].ax == pytest.approx([1.0, 1.0, 1.0])
    assert len(seen) == count


def by_all(read, n=4):
    """What threads get that ask at once."""
    ready = threading.Barrier(n)
    with ThreadPoolExecutor(n) as pool:
        return list(pool.map(lambda _: ready.wait() >= 0 and read().copy(), range(n)))


@pytest.mark.parametrize("coordinates", ["absolute", "joint"])
def test_threads_may_ask_one_result_at_once(coordinates):
    m = mechanisms.example("andrews.toml")
    wanted = m.simulate(0.01, outputs=2001, coordinates=coordinates).vdot
    r = m.simulate(0.01, outputs=2001, coordinates=coordinates)
    assert all(np.array_equal(x, wanted) for x in by_all(lambda: r.vdot))
    m = mechanisms.example("slider_crank.toml")  # driven: works are found when asked for
    wanted = m.simulate(1.0, outputs=501, coordinates=coordinates).states
    r = m.simulate(1.0, outputs=501, coordinates=coordinates)
    assert all(np.array_equal(x, wanted) for x in by_all(lambda: r.states))


def test_works_that_were_interrupted_are_found_the_next_time():
    m = mechanisms.example("slider_crank.toml")
    wanted = m.simulate(1.0, outputs=5).states
    r = m.simulate(1.0, outputs=5)
    find = r.deferred_works

    def interrupted():
        raise KeyboardInterrupt

    r.deferred_works = interrupted
    with pytest.raises(KeyboardInterrupt):
        _ = r.states
    r.deferred_works = find if r.deferred_works is interrupted else r.deferred_works
    assert np.array_equal(r.states, wanted)


@pytest.mark.parametrize("specialize", [True, False])
@pytest.mark.parametrize("coordinates", ["absolute", "joint"])
def test_output_times_without_accelerations_are_named_with_the_cause(coordinates, specialize):
    """The force has no value at one instant, which steps pass over: position and velocity there are right."""
    m = fb.Mechanism("block", planar=True)
    m.add(fb.Body("b", mass=2, inertia=1), fb.Prismatic("slide", "ground", "b", at=(0, 0), axis=(1, 0)))
    m.add(fb.Actuator("F", "slide.displacement", force="4 + 0/(t - 0.5)"))
    r = m.simulate(1.0, outputs=5, coordinates=coordinates, specialize=specialize)
    np.testing.assert_allclose(r["b"].x, r.t**2, rtol=1e-12)
    np.testing.assert_array_equal(np.isnan(r["b"].ax), r.t == 0.5)
    (text,) = r.health.warnings
    assert "at 1 of 5 output times, the first t = 0.5 s" in text
    assert "Actuator 'F'" in text
    assert "4 + 0/(t - 0.5)" in text
    assert text in pickle.loads(pickle.dumps(r)).health.warnings
