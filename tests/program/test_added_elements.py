"""Two processes on a copy of the package to which a joint is added (one new file, one export) and a force (one new file).

The first compiles all of it, the second finds it. After an edit of a formula nothing of that is served.
"""

import json
import subprocess
import sys

import numpy as np
import pytest

from flyball import forces
from tests.program.copied import Copy

FALL = """
import flyball as fb
m = fb.Mechanism("fall", planar=True, gravity=(0, -10))
m.add(fb.Body("stone", mass=1, inertia=1), fb.Body("rod", mass=1, inertia=1, position=(1, 0)))
m.add(fb.Revolute("A", "ground", "rod", at=(0, 0)))
r = m.simulate(1.0, outputs=3)
top = fb.Mechanism("in space", gravity=(0, 0, -10))
top.add(fb.Body("top", mass=1, inertia=(1, 1, 1)), fb.Spherical("S", "ground", "top", at=(0, 0, 1)))
top.simulate(0.1)
found = {"y": float(r["stone.y"][-1]), "where": fb.__file__}
"""

SLIDE = """
m = fb.Mechanism("slope")
m.add(fb.Body("puck", mass=2, inertia=(1, 1, 1), position=(1, 0, 0), velocity=(3, 0, 0)))
m.add(fb.Sheet("table", "ground", "puck", at=(1, 0, 0), axis=(0, 3, 4)))
m.add(fb.Drag("air", "puck", coefficient="0.8 N*s/m"), fb.PointForce("pull", "puck", force=(0, 0, -20)))
found |= {"freedoms": m.check().freedoms}
m.save("slope.toml")
found |= {"same file": fb.load("slope.toml") == m}
r = m.simulate(1.0, rtol=1e-11, atol=1e-12, outputs=11)
found |= {"t": r.t.tolist(), "position": r["puck"].position.tolist(), "force": r["table"].force.tolist()}
found |= {"drift": r.energy.drift, "work": r.energy.work["air"].tolist(), "kinds": sorted(set(r.energy.work))}
found |= {"page": len(r.html()), "names": [n in dir(fb) for n in ("Sheet", "Drag")]}
"""

FALLEN = "found |= {'fallen': cache_counts()['kernels']}\n"
PRINT = "print(json.dumps(cache_counts() | found))\n"

JOINT = '''"""A point that stays in a plane."""

from __future__ import annotations

from typing import ClassVar

from ..constraints.blocks import SLIDE
from ..model.element import element
from ..model.joint import Joint


@element
class Sheet(Joint):
    """A point of ``body_j`` stays in the plane of ``body_i`` through ``at`` whose normal is ``axis``."""

    blocks: ClassVar = (SLIDE,)
    needs_axis: ClassVar[bool] = True
    planar_normal: ClassVar[str] = ""
'''

FORCE = '''"""Resistance of the air, linear."""

from __future__ import annotations

from types import SimpleNamespace
from typing import ClassVar

from ..compiler.formulas import formula
from ..math.vec import scale
from ..model.element import Damping, element
from ..model.force import BodyForce

KIND = {kind}


@formula
def wrench(par, F, M, laws, values):
    """Against the velocity of M's origin."""
    o = 0.0 * par[0]
    return scale(-par[0], M[3]), (o, o, o)


@element
class Drag(BodyForce):
    """A force against the velocity of the mass centre."""

    coefficient: Damping = 0.0

    kind: ClassVar[int] = KIND
    wrench: ClassVar = staticmethod(wrench)

    def parameters(self, n: SimpleNamespace, separation: float) -> tuple[float, ...]:
        """Numbers that the formulas see."""
        return (n.coefficient,)
'''


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """The copy, and what its two processes say: compiling takes twenty seconds."""
    copy = Copy(tmp_path_factory.mktemp("copied"))
    copy.add("joints/sheet.py", JOINT)
    copy.append("joints/__init__.py", "from .sheet import Sheet as Sheet\n")
    copy.add("forces/drag.py", FORCE.replace("{kind}", str(1 + max(force.kind for force in forces.ALL))))
    return copy, copy.run(FALL + FALLEN + SLIDE + PRINT), copy.run(FALL + FALLEN + SLIDE + PRINT)


def test_the_copy_is_what_ran(runs):
    copy, *each = runs
    assert {r["where"] for r in each} == {str(copy.package / "__init__.py")}


def test_a_second_process_compiles_nothing(runs):
    _, first, second = runs
    assert first["misses"] == len(first["kernels"]) > 0
    assert (second["misses"], second["hits"]) == (0, len(second["kernels"]))
    assert second["kernels"] == first["kernels"]
    assert first["y"] == second["y"] == pytest.approx(-5.0, abs=1e-9)
    assert first["position"] == second["position"]


def test_the_right_hand_side_is_compiled_once(runs):
    """One engine holds it, whatever is simulated: planar, spatial, with and without constraints."""
    _, first, _ = runs
    assert set(first["fallen"]) == {"engine", "kinematics_over_time", "record_motion_kernel"}


def test_adding_a_joint_and_a_force_touches_nothing_else(runs):
    """One new file and one export; one new file."""
    copy, *_ = runs
    assert copy.changed() == {
        "joints/sheet.py",
        "joints/__init__.py",
        "forces/drag.py",
    }


def test_the_added_joint_and_force_work(runs):
    """A puck on a slope against the air: m dv/dt = m g - c v within the plane, the table carries the rest."""
    *_, r = runs
    assert r["names"] == [True, True]
    assert r["same file"]
    assert r["freedoms"] == 5
    assert "Drag" not in r["kinds"]
    assert r["kinds"] == ["air", "pull"]
    assert r["drift"] < 1e-8
    assert r["page"] > 10_000
    t, m, c = np.array(r["t"]), 2.0, 0.8
    n = np.array([0, 0.6, 0.8])
    pull = np.array([0, 0, -20.0])
    down = pull - n * (pull @ n)
    decay = 1 - np.exp(-c / m * t)
    steady = down / c
    exact = [1, 0, 0] + np.outer(t, steady) + np.outer(decay * m / c, np.array([3, 0, 0]) - steady)
    assert np.array(r["position"]) == pytest.approx(exact, abs=1e-8)
    assert np.array(r["force"]) == pytest.approx(np.tile(-n * (pull @ n), (11, 1)), abs=1e-8)
    assert np.all(np.diff(r["work"]) < 0)


def test_the_engine_of_edited_sources_is_not_in_the_cache(runs):
    """A callee in another file than the kernel's: gravity pulls the other way. `test_cache` runs a small kernel so."""
    copy, *_ = runs
    ask = "from flyball.compiler.object_files import is_stored\nfrom flyball.engine.entry_point import engine\n"
    ask += "print(json.dumps({'cold': not is_stored(engine)}))\n"
    assert not copy.run(ask)["cold"]
    copy.edit("engine/loads.py", "sub(gravity, a)", "sub(neg(gravity), a)")
    assert copy.run(ask)["cold"]
    copy.edit("engine/loads.py", "sub(neg(gravity), a)", "sub(gravity, a)")
    assert not copy.run(ask)["cold"]


OWN = """
import json, sys
import flyball as fb
from flyball.elements import BodyForce, Damping, Joint, blocks, element
from flyball.math.vec import scale
from flyball.compiler import object_files

compiled, compile_kernel = [], object_files.compile_kernel
object_files.compile_kernel = lambda kernel, cpus: compiled.append(kernel.name) or compile_kernel(kernel, cpus)

SHARE = 1.0

@element
class Wind(BodyForce):
    coefficient: Damping = 0.0

    @staticmethod
    def wrench(par, F, M, laws, values):
        o = 0.0 * par[0]
        return scale(-SHARE * par[0], M[3]), (o, o, o)

    def parameters(self, n, separation):
        return (n.coefficient,)

@element
class Plate(Joint):
    blocks = (blocks.SLIDE,)
    needs_axis = True
    planar_normal = ""

m = fb.Mechanism("thrown", gravity=(0, 0, -10))
m.add(fb.Body("puck", mass=1, inertia=(1, 1, 1), velocity=(1, 0, 0)), Wind("wind", "puck", coefficient=1))
m.add(Plate("plate", "ground", "puck", at=(0, 0, 0), axis=(0, 0, 1)))
r = m.simulate(1.0, outputs=2, specialize=False)
print(json.dumps({"v": r["puck.vx"][-1], "compiled": compiled, "numba": "numba" in sys.modules}))
"""


def test_an_edited_file_of_a_users_own_compiles_its_formula_alone(tmp_path):
    """Nothing where nothing was edited; the formula where a number that it takes from outside was. A joint needs none."""
    script = tmp_path / "wind.py"

    def run(share):
        script.write_text(OWN.replace("SHARE = 1.0", f"SHARE = {share}"))
        out = subprocess.run([sys.executable, "-W", "ignore", script], capture_output=True, text=True, check=True)
        found = json.loads(out.stdout)
        assert found["v"] == pytest.approx(np.exp(-share), rel=1e-5)
        return found

    run(1.0)
    again = run(1.0)
    assert (again["compiled"], again["numba"]) == ([], False)
    assert run(0.1 + 0.2 * np.random.default_rng().random())["compiled"] == ["__main__.Wind.wrench"]
