"""Contacts divided among threads: the same bits for any number of threads, and the weight of a pile on its floor."""

from __future__ import annotations

import os
import threading

import numpy as np
import pytest

import flyball as fb
from flyball.numerics.complementarity.contact_problem import empty_problem
from flyball.numerics.complementarity.packed_contacts import block_of_contact
from flyball.numerics.thread_team import default_threads
from flyball.simulation.impulse_stepping import impulse_stepper

RADIUS, DENSITY, FRICTION = 0.05, 1000.0, 0.3


def pile(count: int, **contact: float) -> fb.Mechanism:
    """Balls, and a crate among them, in a box without a lid."""
    side = 2.1 * RADIUS
    k = np.arange(count)
    at = side * np.stack([k % 5 - 2, k // 5 % 5 - 2, k // 25 + 0.5], axis=1)
    at[:, :2] += np.random.default_rng(0).uniform(-0.04, 0.04, (count, 2)) * RADIUS
    m = fb.Mechanism("pile", gravity=(0, 0, -9.81))
    m.add(fb.Ground("floor", shape=fb.Plane()))
    for name, normal in {"left": (1, 0, 0), "right": (-1, 0, 0), "front": (0, 1, 0), "back": (0, -1, 0)}.items():
        place = tuple(-2.7 * side * x for x in normal)
        m.add(fb.Ground(name, shape=fb.Plane(normal=normal, position=place)))
    m.add(fb.Bodies("balls", shape=fb.Sphere(radius=RADIUS), density=DENSITY, position=at))
    top = float(at[:, 2].max()) + 3 * RADIUS
    m.add(fb.Body("crate", mass=2, shape=fb.Box(edges=(4 * RADIUS, 4 * RADIUS, 2 * RADIUS)), position=(0, 0, top)))
    m.add(fb.Contact(friction=FRICTION, **contact))
    return m


def bits(m: fb.Mechanism, threads: int, **options: object) -> list[bytes]:
    """State and energies at the end of a motion."""
    run = m.simulate(0.2, outputs=3, method=fb.Stepping(step=5e-3, threads=threads, **options))
    energy = run.energy
    return [x[-1].tobytes() for x in (run["balls"].position, run["crate"].position, energy.total, energy.balance)]


@pytest.mark.parametrize("contact", [{}, {"rolling_friction": 1e-3}, {"restitution": 0.5}])
def test_bits_do_not_depend_on_the_number_of_threads(
    monkeypatch: pytest.MonkeyPatch, contact: dict[str, float]
) -> None:
    monkeypatch.setattr(impulse_stepper, "DIVIDED_BODIES", 100)
    monkeypatch.setattr(impulse_stepper, "LAYERS", 1.5)
    m = pile(250, **contact)
    assert impulse_stepper.slab_count(251) == 4
    one = bits(m, 1)
    assert one == bits(m, 2)
    assert one == bits(m, 3)


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="no choice of cores on this system")
def test_three_threads_on_one_core(monkeypatch: pytest.MonkeyPatch) -> None:
    """They end, with the same bits."""
    monkeypatch.setattr(impulse_stepper, "DIVIDED_BODIES", 100)
    m, cores = pile(250), os.sched_getaffinity(0)
    free = bits(m, 1)
    try:
        os.sched_setaffinity(0, {min(cores)})
        assert bits(m, 3) == free
    finally:
        os.sched_setaffinity(0, cores)


def test_a_divided_pile_has_its_weight(monkeypatch: pytest.MonkeyPatch) -> None:
    """Floor and walls carry the pile at rest."""
    monkeypatch.setattr(impulse_stepper, "DIVIDED_BODIES", 100)
    m = pile(150)
    run = m.simulate(1.5, outputs=2, method=fb.Stepping(step=5e-3, threads=2))
    lift = sum(run.contacts.between("ground", name).force[-1, 2] for name in ("balls", "crate"))
    weight = 9.81 * (2 + 150 * DENSITY * 4 / 3 * np.pi * RADIUS**3)
    assert lift == pytest.approx(weight, rel=0.02)


def test_blocks_that_threads_work_on_at_once_share_no_node() -> None:
    rng, nodes, slabs, count = np.random.default_rng(1), 60, 5, 2000
    P = empty_problem(count, nodes, 1)._replace(half_slab=rng.integers(0, 2 * slabs, nodes))
    P.at[:] = rng.integers(-2, nodes, (count, 2))
    near = rng.random(count) < 0.9
    P.at[near] = np.sort(P.at[near], axis=1)
    of = np.array([block_of_contact(P, c, slabs) for c in range(count)])
    rest = 2 * slabs - 1
    touched = [set(P.at[of == b][P.at[of == b] >= 0].tolist()) for b in range(rest)]
    assert all((of == b).any() for b in range(rest + 1))
    for blocks in (range(slabs), range(slabs, rest)):
        for a in blocks:
            assert not any(touched[a] & touched[b] for b in blocks if b != a)
    assert (P.at[of != rest] >= -1).all()


def test_default_number_of_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    """That of OMP_NUM_THREADS or of the cores; one in other threads than the main one."""
    found: list[int] = []
    for given, expected in (("3", 3), ("2,1", 2), ("", None), ("many", None)):
        monkeypatch.setenv("OMP_NUM_THREADS", given)
        assert default_threads() == (expected or len(os.sched_getaffinity(0)))
        other = threading.Thread(target=lambda: found.append(default_threads()))
        other.start()
        other.join()
    assert found == [1] * 4


def test_no_threads_are_refused() -> None:
    with pytest.raises(fb.ModelError, match="threads"):
        fb.Stepping(threads=0)
