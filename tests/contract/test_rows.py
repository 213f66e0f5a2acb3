"""Every constraint row, found by registry: Jacobian, acceleration term, action and reaction, plain = complex."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from flyball.constraints import alignment
from flyball.constraints.blocks import FORMULAS

MOTION = [k for k in FORMULAS if k not in (alignment.KIND_AXIS, alignment.KIND_FULL)]
PAR = {  # axes of unit length; parameter 6 a constant, 7 the coefficient (not seen by the formula)
    kind: (0.36, 0.48, 0.8, 0.6, 0.0, -0.8, 0.3, 1.0) for kind in FORMULAS
}


def cross_matrix(w):
    return np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])


def random_motion(seed):
    """Two frames with random poses, velocities and accelerations: dicts of arrays."""
    rng = np.random.default_rng(seed)
    keys = ("p", "w", "v", "alpha", "a")
    return [{"R": Rotation.random(random_state=rng).as_matrix()} | {k: rng.normal(size=3) for k in keys} for _ in "FM"]


def record(m, dtype=float):
    return tuple(tuple(np.asarray(m[k], dtype).ravel().tolist()) for k in ("p", "R", "w", "v", "alpha", "a"))


def moved(m, t):
    """The frame after a time t of its motion, exact to second order."""
    turn = m["w"] * t + 0.5 * m["alpha"] * t * t
    return m | {
        "p": m["p"] + m["v"] * t + 0.5 * m["a"] * t * t,
        "R": Rotation.from_rotvec(turn).as_matrix() @ m["R"],
        "w": m["w"] + m["alpha"] * t,
        "v": m["v"] + m["a"] * t,
    }


def rate(out, F, M):
    """G v of a row's record."""
    _, f, tM, tF, _ = (np.array(x) for x in out)
    return f @ (M["v"] - F["v"]) + tM @ M["w"] + tF @ F["w"]


@pytest.mark.parametrize("kind", MOTION)
@pytest.mark.parametrize("seed", range(3))
def test_wrench_is_the_gradient_of_the_value(kind, seed):
    """G v = dg/dt, off the constraint too: complex step along a first-order motion, and central differences."""
    F, M = random_motion(seed)
    out = FORMULAS[kind](PAR[kind], record(F), record(M))
    e = 1e-30
    stepped = [
        m | {"p": m["p"] + 1j * e * m["v"], "R": (np.eye(3) + 1j * e * cross_matrix(m["w"])) @ m["R"]} for m in (F, M)
    ]
    value = FORMULAS[kind](PAR[kind], *(record(m, complex) for m in stepped))[0]
    assert np.imag(value) / e == pytest.approx(rate(out, F, M), rel=1e-12, abs=1e-13)
    h = 1e-5
    ahead, behind = (FORMULAS[kind](PAR[kind], record(moved(F, s)), record(moved(M, s)))[0] for s in (h, -h))
    assert (ahead - behind) / (2 * h) == pytest.approx(rate(out, F, M), rel=1e-7, abs=1e-8)


@pytest.mark.parametrize("kind", MOTION)
@pytest.mark.parametrize("seed", range(3))
def test_bias_is_the_second_derivative(kind, seed):
    """With true accelerations in the records, the bias is d2g/dt2, off the constraint and moving."""
    F, M = random_motion(seed)
    bias = FORMULAS[kind](PAR[kind], record(F), record(M))[4]
    h = 1e-4
    rates = []
    for s in (h, -h):
        f, m = moved(F, s), moved(M, s)
        rates.append(rate(FORMULAS[kind](PAR[kind], record(f), record(m)), f, m))
    assert (rates[0] - rates[1]) / (2 * h) == pytest.approx(bias, rel=1e-6, abs=1e-6)


@pytest.mark.parametrize("kind", MOTION)
def test_action_equals_reaction(kind):
    """A rigid motion of both frames together needs no power: the two wrenches balance, moments included."""
    F, M = random_motion(7)
    _, f, tM, tF, _ = (np.array(x) for x in FORMULAS[kind](PAR[kind], record(F), record(M)))
    about_origin = np.cross(M["p"], f) + tM - np.cross(F["p"], f) + tF
    if kind == 0:  # along a world axis: the axis does not turn with the frames, only forces balance off the constraint
        F["p"] = M["p"]
        about_origin = tM + tF
    assert about_origin == pytest.approx(np.zeros(3), abs=1e-12)


@pytest.mark.parametrize("kind", [k for k in MOTION if k != 0])
def test_value_does_not_depend_on_the_world(kind):
    """Turning and moving the world, 10 km away, changes no value of a row that knows only its two frames."""
    F, M = random_motion(11)
    Q, d = Rotation.random(random_state=3).as_matrix(), np.array([1e4, -2e3, 5e2])
    turned = [m | {"p": Q @ m["p"] + d, "R": Q @ m["R"]} for m in (F, M)]
    one, two = (FORMULAS[kind](PAR[kind], *(record(m) for m in pair))[0] for pair in ((F, M), turned))
    assert one == pytest.approx(two, rel=1e-11, abs=1e-11)


@pytest.mark.parametrize("kind", MOTION)
def test_complex_numbers_without_imaginary_part_change_nothing(kind):
    F, M = random_motion(5)
    real = FORMULAS[kind](PAR[kind], record(F), record(M))
    complex_ = FORMULAS[kind](PAR[kind], record(F, complex), record(M, complex))
    for a, b in zip(real, complex_, strict=True):
        assert np.asarray(b) == pytest.approx(np.asarray(a, complex), rel=1e-14, abs=1e-14)


@pytest.mark.parametrize("angle", [1e-12, 0.4, 2.0, 3.0, np.pi])
def test_alignment_measures_the_true_angle(angle):
    """The stand-ins of assembly give the rotation vector, up to half a turn, where perpendicular rows give its sine."""
    F, M = random_motion(2)
    axis = np.array([0.6, 0.8, 0.0])
    M["R"] = F["R"] @ Rotation.from_rotvec(angle * axis).as_matrix()
    unit = np.eye(3)
    full = [alignment.full_row((*unit[i], 0, 0, 0, 0, 1), record(F), record(M))[0] for i in range(3)]
    tilt = [alignment.axis_row((*unit[i], 0, 0, 0, 0, 1), record(F), record(M))[0] for i in range(2)]
    assert np.linalg.norm(full) == pytest.approx(angle, abs=1e-7)
    assert np.linalg.norm(tilt) == pytest.approx(angle, abs=1e-7) or angle == np.pi
    if 0.1 < angle < 3.1:
        assert np.array(full) == pytest.approx(angle * axis, abs=1e-7)
        assert np.array(tilt) == pytest.approx(angle * axis[:2], abs=1e-7)
    if angle == np.pi:
        assert np.linalg.norm(tilt) > 3.0
