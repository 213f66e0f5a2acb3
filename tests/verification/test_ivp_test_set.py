"""Two mechanisms of the Test Set for IVP Solvers (Mazzia and Magherini, 2008), with their end states.

Andrews' squeezing mechanism (II-13) and the car axis (II-10), both from the examples folder.
"""

import numpy as np
import pytest

import flyball as fb
from tests.layers import both_layers, cached
from tests.mechanisms import EXAMPLES, example

pytestmark = both_layers

# -------------------------------------------------------------------------------- Andrews' squeezing mechanism, II-13

HINGES = ("crank", "K1-K2", "B", "K5-K4", "A5", "K7-K6", "A7")
"""The joints whose angles are beta, theta, gamma, phi, delta, omega and epsilon."""

# At 0.03 s. The Test Set's own end state (PSIDE at 1e-14) is good to 1e-9 in the angles; these are its equations
# integrated with 80-bit numbers by extrapolation (Gragg, Bulirsch, Stoer), 240 and 400 steps agreeing to 2e-14.
ANGLES = (
    15.81077119515369977,
    -15.75637105841183032,
    0.04082224011964573388,
    -0.5347301163420797179,
    0.5244099658799540657,
    0.534730116342079718,
    1.048080741041937871,
)
RATES = (
    1139.920302259105807,
    -1424.379295177539887,
    11.0329119106165075,
    19.29337410502839268,
    0.5735699148293946755,
    -19.29337410502839268,
    0.3231791492490676234,
)
ACCELERATIONS = (
    -24631.76312286736376,
    51850.3196364530008,
    324102.6007075787602,
    566749.4220009956035,
    16743.63541834551346,
    -566749.4220009956035,
    9826.507801543978537,
)
MULTIPLIERS = (
    199.1753481045386654,
    -29.75530997497116360,
    23.06654361162216733,
    31.45272527577125926,
    22.64249478639439053,
    11.61739235261105685,
)
PUBLISHED_ANGLES = (  # the Test Set's own
    0.1581077119629904e2,
    -0.1575637105984298e2,
    0.4082224013073101e-1,
    -0.5347301163226948,
    0.5244099658805304,
    0.5347301163226948,
    0.1048080741042263e1,
)
FIRST_ACCELERATIONS = (14222.4439199541138705911625887, -10666.8329399655854029433719415, 0, 0, 0, 0, 0)
FIRST_MULTIPLIERS = (98.5668703962410896057654982170, -6.12268834425566265503114393122, 0, 0, 0, 0)


@cached
def andrews(method="dop853"):
    return example("andrews.toml").simulate(0.03, rtol=1e-12, atol=1e-14, outputs=31, method=method)


def hinges(r, what, k):
    return [getattr(r[name], what)[k] for name in HINGES]


def loop_forces(r, k):
    """The six multipliers as forces.

    The Test Set writes M q'' = f - G^T lam, with g the way from the end of K3, of K4 and of K6 to the end of K2. So
    (lam1, lam2) is the force that K2 exerts on K3 where they meet, (lam3, lam4) on K4, (lam5, lam6) on K6: the
    reactions, on their ``body_j``, of the three hinges in P.
    """
    return np.concatenate([r[name].force[k] for name in ("P3", "P4", "P6")])


@pytest.mark.parametrize("method", ["dop853", "rk45"])
def test_andrews_end_state(method):
    """Test Set II-13 at 0.03 s: angles to 1e-9, velocities, accelerations and multipliers to 1e-8 of their sizes."""
    r = andrews(method)
    assert hinges(r, "angle", -1) == pytest.approx(ANGLES, abs=1e-9)
    assert hinges(r, "angle", -1) == pytest.approx(PUBLISHED_ANGLES, abs=1e-8)
    assert hinges(r, "rate", -1) == pytest.approx(RATES, abs=1e-6)
    assert hinges(r, "acceleration", -1) == pytest.approx(ACCELERATIONS, abs=2e-3)
    assert loop_forces(r, -1) == pytest.approx(MULTIPLIERS, rel=1e-8)


def test_andrews_start():
    """Test Set II-13 at 0: accelerations and multipliers to all digits given that a double holds."""
    r = andrews()
    assert hinges(r, "acceleration", 0) == pytest.approx(FIRST_ACCELERATIONS, rel=1e-12, abs=1e-8)
    assert loop_forces(r, 0) == pytest.approx(FIRST_MULTIPLIERS, rel=1e-11, abs=1e-10)


def test_andrews_is_sound():
    """One freedom, nothing redundant; the motor puts in torque times angle and nothing else does work."""
    r = andrews()
    assert (r.health.freedoms, r.health.redundant) == (1, ())
    assert r.health.violation < 1e-15  # of parts some centimetres long
    turned = r["crank"].angle - r["crank"].angle[0]
    assert r.energy.total - r.energy.total[0] == pytest.approx(0.033 * turned, abs=1e-9)
    assert r["motor"].work == pytest.approx(0.033 * turned, abs=1e-9)


# ------------------------------------------------------------------------------------------------------ car axis, II-10

# At 3 s, quadruple precision (GAMD, ex_reference.R): positions and velocities of the left
# and of the right end, and the two multipliers. The double-precision digits of the Test Set are 1e-10 from these.
CAR_AXIS = (
    0.493455784275402809122e-1,
    0.496989460230171153861,
    0.104174252488542151681e1,
    0.373911027265361256927,
    -0.770583684040972357970e-1,
    0.744686658723778553466e-2,
    0.175568157537232222276e-1,
    0.770341043779251976443,
    -0.473688659084893324729e-2,
    -0.110468033125734368808e-2,
)


def hinged_axle():
    return example("car_axis.toml")


def carried_axle():
    """The same with the road's own words: the right wheel at x_b = sqrt(L^2 - y_b^2), the left one kept on y = 0.

    As x_b^2 + y_b^2 = L^2 and the axle is L long, its other end on y = 0 is in the origin, where the hinge held it.
    """
    m = fb.Mechanism("carried axle", planar=True, gravity=(0, -1), parameters=hinged_axle().parameters)
    for e in hinged_axle().elements():
        if e.name != "left wheel":
            m.add(e)
    m.add(fb.Driver("across", "right wheel.x", "sqrt(track**2 - (height*sin(rate*t))**2)"))
    m.add(fb.Driver("flat", "axle.y", "0"))
    return m


def car_axis_state(r):
    """y1 to y10 of the Test Set over time.

    Its equations are eps^2 times those of two masses M/2 on springs of stiffness 1/eps^2. Its first constraint is
    b.x_l = 0 with b the axle's vector, so lam1 b is eps^2 times the force of the guide; its second |x_l - x_r|^2 = L^2,
    so 2 lam2 (x_l - x_r) is eps^2 times the force of the rod on the left mass, the reverse of that on its ``body_j``.
    The equations take the masses for points: here the right one has an inertia, but nothing acts on it off its
    centre, so it never turns; the left one has none and turns with the guide.
    """
    left, right, b = r["left"], r["right"], r["right wheel"].position
    d = left.position - right.position
    lam1 = 1e-4 * (r["guide"].force * b).sum(axis=1)
    lam2 = -1e-4 * (r["chassis rod"].force * d).sum(axis=1) / 2
    return np.column_stack([left.position, right.position, left.velocity, right.velocity, lam1, lam2])


@pytest.mark.parametrize("make", [hinged_axle, carried_axle])
def test_car_axis(make):
    """Test Set II-10 at 3 s: all ten components to 1e-9."""
    r = make().simulate(3.0, rtol=1e-11, atol=1e-13, outputs=31)
    y = car_axis_state(r)
    assert y[0, :8] == pytest.approx([0, 0.5, 1, 0.5, -0.5, 0, -0.5, 0], abs=1e-13)
    assert y[-1] == pytest.approx(CAR_AXIS, abs=1e-9)
    base = 0.1 * np.sin(10 * r.t)
    assert r["right wheel"].position == pytest.approx(np.column_stack([np.sqrt(1 - base**2), base]), abs=1e-13)
    assert r["axle"].position == pytest.approx(np.zeros((31, 2)), abs=1e-13)
    assert np.abs(r["right"].angular_velocity).max() < 1e-14
    assert r.energy.drift < 1e-8
    assert np.ptp(r.energy.total) > 1.0  # what the road does


def test_andrews_by_the_command(tmp_path):
    """``flyball run`` on the example's file, at the default tolerances: the end state to 1e-7."""
    from typer.testing import CliRunner

    from flyball.cli import app

    words = ["run", str(EXAMPLES / "andrews.toml"), "--t-end", "30 ms", "--out", str(tmp_path), "--no-animation"]
    ended = CliRunner().invoke(app, words)
    assert ended.exit_code == 0, ended.output
    r = fb.load_result(tmp_path / "result.nc")
    assert hinges(r, "angle", -1) == pytest.approx(ANGLES, abs=1e-7)
    pictures = {"energy.png", "coordinates.png", "paths.png", "reactions.png", "actuation.png"}
    assert pictures <= {p.name for p in (tmp_path / "plots").iterdir()}
