"""Equations as expressions need no compiler: a process with an empty cache that only reads them starts none."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

import flyball as fb
from tests.mechanisms import EXAMPLES
from tests.symbolic.small import cart

READ = """
import sys
import flyball as fb
from tests.mechanisms import example
from tests.symbolic import small, test_uncompiled
from flyball.compiler.formulas import KERNELS

m = {made}
eq = m.symbolic()
str(eq), eq.M.latex(), str(eq.f), eq.G.simplified(), eq["energy.kinetic"].simplified()
{more}
assert [k.function.__name__ for k in KERNELS if k.used] == []
assert "numba" not in sys.modules
print(eq.coordinates)
"""


def point_mass() -> fb.Mechanism:
    """A cart with a bob that has no inertia about its own centre."""
    return cart(J=0.0)


def rubbing() -> fb.Mechanism:
    """The cart on a rail with dry friction."""
    m = cart()
    m.add(fb.JointFriction("rub", "rail", static=0.1, kinetic=0.1))
    return m


@pytest.mark.parametrize(
    ("made", "more", "which"),
    [
        ("small.cart()", "str(eq.lagrange().residual); eq.joint('pin').text()", "joint: "),
        ("small.cart()", "str(m.symbolic(inputs=['push.x']).linear(['pin.angle']).A)", "joint: "),
        ("test_uncompiled.point_mass()", "m.symbolic(coordinates='absolute')", "joint: "),
        ("test_uncompiled.rubbing()", "", "joint: "),
        ("example('slider_crank.toml')", "", "joint: "),
    ],
)
def test_nothing_compiles(made, more, which, tmp_path):
    where = os.environ | {"FLYBALL_CACHE": str(tmp_path)}
    code = READ.format(made=made, more=more)
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=EXAMPLES.parent, env=where, capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith(which)
    assert list(tmp_path.iterdir()) == []


def test_massless_coordinates_are_refused():
    m = fb.Mechanism("light", planar=True)
    m.add(fb.Body("a", mass=0.0, inertia=0.0))
    m.add(fb.Prismatic("rail", "ground", "a", at=(0, 0), axis=(1, 0)))
    for which in ("auto", "joint", "absolute"):
        with pytest.raises(fb.ModelError, match="can move without any mass"):
            m.symbolic(coordinates=which)


def test_friction_that_leaves_reactions_open_takes_absolute_coordinates():
    """Two parallel rails carry one cart: which of them presses how hard is a choice."""
    m = cart()
    m.add(fb.Prismatic("second rail", "ground", "cart", at=(0, 1), axis=(1, 0)))
    m.add(fb.JointFriction("rub", "rail", static=0.1, kinetic=0.1))
    assert m.symbolic().coordinates.startswith("absolute: ")
    with pytest.raises(fb.AnalysisError, match="rub"):
        m.symbolic(coordinates="joint")


def test_names_of_symbols_stand_once():
    eq = cart().symbolic()
    assert str(eq.q) == "rail.displacement\npin.angle"
    assert str(eq.v) == "rail.displacement'\npin.angle'"


def test_a_rate_has_two_names_where_a_point_is_given():
    m = cart()
    m.add(fb.Body("disc", mass=1.0, inertia=1.0), fb.Revolute("axle", "ground", "disc", at=(0, 0)))
    m.parameters["W"] = 3.0
    at = [m.symbolic().linear(["axle.angle"], at={f"axle.angle{rate}": "W"}) for rate in ("'", " rate")]
    assert str(at[0].A) == str(at[1].A)


def test_inputs_do_not_balance_but_parameters_do():
    with pytest.raises(fb.ModelError, match=r"'push.x', an input.*a parameter of its own"):
        cart().symbolic(inputs=["push.x"]).linear(balanced_by=["push.x"])


def test_a_joint_shows_parameters_as_symbols():
    m = fb.Mechanism("rod", planar=True, parameters={"l": 2.0})
    m.add(fb.Body("bob", mass=1, inertia=1, position=("l", 0)))
    m.add(fb.Distance("rod", "ground", "bob", at=((0, 0), ("l", 0)), length="l"))
    told = m.symbolic().joint("rod")
    at = {"F.x": 0.0, "F.y": 0.0, "F.z": 0.0, "M.x": 3.0, "M.y": 4.0, "M.z": 0.0}
    for frame in "FM":
        at |= {f"{frame}.e0": 1.0, f"{frame}.e1": 0.0, f"{frame}.e2": 0.0, f"{frame}.e3": 0.0}
    wanted = told.position.symbols
    assert "l" in wanted
    assert told.position.at({k: at[k] for k in at if k in wanted} | {"l": 5.0})[0] == pytest.approx(0.0)
