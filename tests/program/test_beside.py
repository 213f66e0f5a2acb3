"""What a first motion with contact compiles, and who compiles it."""

import json
import os
import subprocess
import sys
import time

import numpy as np
import pytest
from numba import typeof

import flyball as fb
from flyball.analysis.motion.impulse import drawn
from flyball.compiler import beside
from flyball.compiler.beside import Beside
from flyball.compiler.door import Door
from flyball.compiler.held import held_type
from flyball.compiler.jit import KERNELS
from flyball.contact.tables import Geometry
from flyball.stepping.needed import needed

DOORS = """
import flyball.contact.between  # the stamp of what is not the package's is of all texts that were put together so far
import flyball.equations.residual
import flyball.stepping.needed
from flyball.compiler.door import door, enter
from flyball.compiler.held import held
from flyball.compiler.jit import formula, kernel


@door
def first(A, B, C, D, E, task):
    return A.x[0] + task


@door
def second(A, B, C, D, E, task):
    return B.y.shape[0] + 2 * task


@formula
def both(one, two, A, B):
    return enter(one, A, B, A, B, A, 1) + enter(two, A, B, A, B, A, 1)


@kernel
def third(one, two, A, B):
    return both(one, two, held(A), held(B))
"""
TABLES = """
from typing import NamedTuple
import numpy as np


class X(NamedTuple):
    x: np.ndarray


class Y(NamedTuple):
    y: np.ndarray
"""


@pytest.fixture
def wanted(tmp_path, monkeypatch):
    """Two doors and a kernel that nobody has compiled, and two tuples for them."""
    name = f"doors_{os.getpid()}_{abs(hash(str(tmp_path)))}"
    (tmp_path / f"{name}.py").write_text(DOORS)
    (tmp_path / f"{name}_tables.py").write_text(TABLES)
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(beside, "cores", lambda: 2)
    code, tables = __import__(name), __import__(f"{name}_tables")
    A, B = tables.X(np.array([40], np.int64)), tables.Y(np.zeros(7))
    yield [(code.first, (A, B, A, B, A)), (code.second, (A, B, A, B, A)), (code.third, (0, 0, A, B))]
    for made in (code.first, code.second, code.third):
        KERNELS.remove(made)


def answer(wanted) -> int:
    """What the kernel says: 40 + 1 + 7 + 2."""
    (first, tuples), (second, _), (third, args) = wanted
    return third(first.address(*tuples), second.address(*tuples), *args[2:])


def test_two_processes_share_what_is_to_be_compiled(wanted):
    with Beside(wanted) as both:
        assert len(both.processes) == 1
        until = time.perf_counter() + 60.0
        while len(both.left) == 3 and time.perf_counter() < until:
            time.sleep(0.01)
        both.finish()
        left = both.processes[0]
    assert left.returncode is not None
    assert not any(code.cold for code, _ in wanted)
    assert answer(wanted) == 50
    assert wanted[2][0].from_cache == (1, 0)
    with Beside(wanted) as again:
        assert not again.processes


@pytest.mark.parametrize("code", ["pass", "import sys; sys.stdin.read(1)", "print(flush=True); print(flush=True)"])
def test_a_process_that_ends_leaves_the_work_to_this_one(wanted, monkeypatch, code):
    def poor(module, out, **more):
        return subprocess.Popen([sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=out, **more)

    monkeypatch.setattr(beside, "started", poor)
    with Beside(wanted) as both:
        both.finish()
    assert all(p.returncode is not None for p in both.processes)
    assert answer(wanted) == 50


def test_what_fails_in_between_ends_the_process(wanted):
    with pytest.raises(KeyboardInterrupt), Beside(wanted) as both:
        raise KeyboardInterrupt
    assert both.processes[0].returncode is not None
    assert answer(wanted) == 50


@pytest.mark.parametrize("why", ["one core", "not kept", "frozen"])
def test_alone(wanted, monkeypatch, why):
    if why == "one core":
        monkeypatch.setattr(beside, "cores", lambda: 1)
    elif why == "not kept":
        monkeypatch.setattr(beside, "_kept", lambda code: False)
    else:
        monkeypatch.setattr(sys, "frozen", True, raising=False)
    with Beside(wanted) as both:
        assert not both.processes
        both.finish()
    assert answer(wanted) == 50


def scene() -> fb.Mechanism:
    m = fb.Mechanism("scene", gravity=(0, 0, -9.81))
    m.add(fb.Ground("floor", shape=fb.Plane()))
    m.add(fb.Bodies("balls", shape=fb.Sphere(radius=0.1), density=1000, position=np.array([[0, 0, 0.1]])))
    box = fb.Box(edges=(0.2, 0.3, 0.4))
    m.add(fb.Body("box", shape=box, density=1000, position=(1, 0, 0.3), velocity=(1, 2, 0), angular_velocity=(1, 0, 2)))
    m.add(fb.Contact(friction=0.3))
    return m


def test_a_motion_asks_for_what_was_foreseen():
    scene().simulate(0.01)
    geometry = Geometry(
        *(np.zeros(s, t) for s, t in (((2, 9), int), ((2, 24), float), ((0, 3), float), (0, int))), None
    )
    geometry = geometry._replace(apart=np.zeros((0, 2), np.int64))
    for code, tuples in needed(geometry, "auto", True, False).wanted:
        if isinstance(code, Door):
            assert code.fits(tuple(held_type(typeof(x)) for x in tuples)), code.__qualname__
        else:
            assert tuple(typeof(x) for x in tuples) in code.dispatcher.signatures


USED = """
import json
import numpy as np
import flyball as fb
from flyball.compiler.jit import KERNELS
from tests.program.test_beside import scene
{}
print(json.dumps([k.__qualname__ for k in KERNELS if k.used]))
"""
SMOOTH = """
m = fb.Mechanism("pendulum")
m.add(fb.Body("bob", mass=1, inertia=(1, 1, 1), position=(1, 0, 0)))
m.add(fb.Revolute("pin", "ground", "bob", at=(0, 0, 0), axis=(0, 1, 0)))
m.simulate(0.01)
"""
CONTACT = {"search", "march_kernel", "gauss_seidel", "newton", "auto", "joined", "between_convex"}


def used(script: str) -> set[str]:
    """Kernels and doors that a fresh process asked for."""
    ended = subprocess.run([sys.executable, "-c", USED.format(script)], capture_output=True, text=True, check=True)
    return set(json.loads(ended.stdout.splitlines()[-1]))


def test_free_bodies_compile_no_engine():
    asked = used("r = scene().simulate(0.01); r.health.lines(); r.energy.total; r['box'].x")
    assert "march_kernel" in asked
    assert not {"engine", "motion_kernel", "through"} & asked


def test_a_mechanism_without_contact_compiles_none():
    assert not CONTACT & used(SMOOTH)


@pytest.mark.parametrize("planar", [False, True])
def test_a_start_as_drawn_is_the_assembled_one(planar):
    m = fb.Mechanism("drawn", planar=planar)
    m.add(
        fb.Body(
            "a", mass=2, inertia=3 if planar else (1, 2, 2.5), com=(0.1, 0.2) if planar else (0.1, 0.2, 0.3),
            position=(1, 2) if planar else (1, 2, 3), velocity=(3, 4) if planar else (3, 4, 5),
            angular_velocity=2 if planar else (0.3, -0.2, 0.5),
        )
    )  # fmt: skip
    from flyball.analysis.assemble import assemble
    from flyball.analysis.compiled import compiled

    model = m.snapshot()
    start, other = drawn.as_drawn(compiled(model), 0.0), assemble(model)
    assert start.q == pytest.approx(other.q, abs=1e-15)
    assert start.v == pytest.approx(other.v, abs=1e-14)
    there = other.compiled.moving(0.0, other.q, other.v)
    for name, b in drawn.moving(start).items():
        for k in "pRvw":
            assert getattr(b, k) == pytest.approx(getattr(there[name], k), abs=1e-14), k
