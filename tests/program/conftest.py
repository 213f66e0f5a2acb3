"""Three processes on a copy of the package, shared by the tests of the cache and of the house.

The first compiles. For the second nothing has changed. Before the third a formula is edited, a joint is added (one
new file, one export) and a force (one new file).
"""

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

from ..compiler.jit import formula
from ..math.vec import scale
from ..model.element import Damping, element
from ..model.force import BodyForce
from .point_force import inputs

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
    inputs: ClassVar = staticmethod(inputs)
    wrench: ClassVar = staticmethod(wrench)

    def parameters(self, n: SimpleNamespace, separation: float) -> tuple[float, ...]:
        """Numbers that the formulas see."""
        return (n.coefficient,)
'''


@pytest.fixture(scope="session")
def runs(tmp_path_factory):
    """The copy, and what its three processes say."""
    copy = Copy(tmp_path_factory.mktemp("copied"))
    first = copy.run(FALL + PRINT)
    second = copy.run(FALL + PRINT)
    # a callee in another file than the kernel's: gravity pulls the other way
    copy.edit("equations/loads.py", "sub(gravity, load3", "sub(neg(gravity), load3")
    copy.add("joints/sheet.py", JOINT)
    copy.append("joints/__init__.py", "from .sheet import Sheet as Sheet\n")
    copy.add("forces/drag.py", FORCE.replace("{kind}", str(1 + max(force.kind for force in forces.ALL))))
    return copy, first, second, copy.run(FALL + SLIDE + PRINT)
