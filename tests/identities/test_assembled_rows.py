"""The rows as a whole, in both coordinate layers: G v - nu is the rate of g, and G vdot - gamma the rate of that.

At a state and velocities that fulfil nothing: by differences along a motion, for every joint, coupling and driver.
"""

import numpy as np
import pytest

from flyball.assembly.assemble import assemble
from flyball.assembly.compiled_mechanism import compile_mechanism
from flyball.engine.kinematics import retract
from tests.contract.zoo import CASES, SPLINED
from tests.identities.test_joint_layer import HINGES, PARTS, coupled, with_joint

T, H = 0.4, 1e-5


def layers(model):
    """The assembled state, moved a little off the constraints, in absolute and in joint coordinates."""
    a = assemble(model)
    tree = compile_mechanism(model, tree=HINGES)
    for c, (q, v) in ((a.compiled, (a.q, a.v)), (tree, tree.take(a.compiled, 0.0, a.q, a.v))):
        rng = np.random.default_rng(5)
        q = q.copy()
        retract(c.values.system, q, 0.03 * rng.normal(size=len(v)))
        yield c, q, v + 0.3 * rng.normal(size=len(v)), rng.normal(size=len(v))


def moved(c, q, v, a, s):
    """Values and rates of the rows after a time s of the motion with velocities v and accelerations a."""
    there, u = q.copy(), v + s * a
    retract(c.values.system, there, s * v)
    c.at(T + s, there, u)
    return c.work.rows.value.copy(), c.jacobian() @ u - c.work.rows.nu


def examine(model, close=1e-6):
    for c, q, v, a in layers(model):
        (ahead, ahead_rate), (behind, behind_rate) = (moved(c, q, v, a, s) for s in (H, -H))
        c.at(T, q, v)
        G, nu, gamma = c.jacobian(), c.work.rows.nu.copy(), c.work.rows.gamma.copy()
        valued = np.array([r.holonomic for r in c.structure.rows], bool)
        assert (ahead - behind)[valued] / (2 * H) == pytest.approx((G @ v - nu)[valued], rel=1e-6, abs=1e-6)
        second = G @ a - gamma
        assert (ahead_rate - behind_rate) / (2 * H) == pytest.approx(
            second, rel=close, abs=close * np.abs(second).max(initial=0.0)
        )


@pytest.mark.parametrize(("where", "name"), CASES, ids=lambda x: x)
def test_every_joint(where, name):
    # a spline's curvature has kinks; off its curve the rows of a PointOnCurve leave a term out
    examine(with_joint(where, name), 1e-2 if name == "PointOnCurve" else 1e-4 if name in SPLINED else 1e-6)


@pytest.mark.parametrize("case", [k for k in PARTS if k in ("coupler", "gears", "rack", "driver by sensors")])
def test_couplings_and_drivers(case):
    examine(coupled(*PARTS[case]()))
