"""Rows without a value say what they restrain by their rate: it is what geometry and differences say it is."""

import numpy as np
import pytest
from scipy.optimize import minimize_scalar
from scipy.spatial.transform import Rotation

from flyball.constraints import angle, knife_edge, relative_spin, rolling
from flyball.constraints.registry import KINDS
from flyball.testing.formula_checks import frame_record, moved_frame, random_motion
from tests.contract.frames import AXES, DATA, PARAMETERS, evaluated, frames, rate

H = 1e-5


def lowest(par, F, M):
    """The lowest point of a torus about M's z axis over F's plane, by search."""
    n, axis = F["R"][:, 2], M["R"][:, 2]

    def tread(phi):
        e = M["R"] @ (np.cos(phi), np.sin(phi), 0.0)
        return M["p"] + par[3] * e - par[4] * n

    phi = np.linspace(0.0, 2.0 * np.pi, 200)
    first = phi[np.argmin([n @ tread(x) for x in phi])]
    best = minimize_scalar(lambda x: n @ tread(x), bounds=(first - 0.1, first + 0.1), options={"xatol": 1e-12})
    assert abs(n @ axis) < 0.99
    return tread(best.x)


@pytest.mark.parametrize("name", PARAMETERS[rolling.KIND])
@pytest.mark.parametrize("seed", range(3))
def test_rolling_speaks_of_the_lowest_point(name, seed):
    """Its height over the plane, or how fast the wheel's material slides over the plane's there."""
    par = PARAMETERS[rolling.KIND][name]
    F, M, _ = frames((rolling.KIND, name), seed)
    out = evaluated((rolling.KIND, name), F, M, 0.0)
    c = lowest(par, F, M)
    t = F["R"] @ par[:3]
    if par[5]:
        assert out[0] == pytest.approx(t @ (c - F["p"]) - par[6], abs=1e-12)
    slide = M["v"] + np.cross(M["w"], c - M["p"]) - F["v"] - np.cross(F["w"], c - F["p"])
    assert rate(out, F, M) == pytest.approx(t @ slide, abs=1e-6)


def test_slip_of_an_upright_disk_adds_up():
    """Driven along the plane at a speed of its own while it spins: the integral of the slip is way less radius angle."""
    par = (1.0, 0.0, 0.0, 0.5, 0.0, 0.0, 0.0, 1.0)
    node, weight = np.polynomial.legendre.leggauss(12)
    times = 0.5 * (node + 1.0)
    slip = []
    for t in times:
        way, turn = np.sin(2.0 * t), t**3
        axle = Rotation.from_euler("x", -90, degrees=True) * Rotation.from_euler("z", turn)
        F = {"p": np.zeros(3), "R": np.eye(3)} | {k: np.zeros(3) for k in ("w", "v", "alpha", "a")}
        M = F | {
            "p": np.array([way, 0, 0.5]),
            "R": axle.as_matrix(),
            "v": np.array([2.0 * np.cos(2.0 * t), 0, 0]),
            "w": np.array([0, 3.0 * t * t, 0]),
        }
        slip.append(rate(KINDS[rolling.KIND].row(par, frame_record(F), frame_record(M), 0.0, DATA), F, M))
    assert 0.5 * np.dot(weight, slip) == pytest.approx(np.sin(2.0) - 0.5 * 1.0, abs=1e-12)


@pytest.mark.parametrize("seed", range(3))
def test_blade_is_the_velocity_seen_from_F_along_an_axis_of_M(seed):
    F, M = random_motion(seed)
    seen = [f["R"].T @ (m["p"] - f["p"]) for f, m in ((moved_frame(F, s), moved_frame(M, s)) for s in (H, -H))]
    velocity = F["R"] @ ((seen[0] - seen[1]) / (2 * H))
    out = evaluated((knife_edge.KIND, ""), F, M, 0.0)
    assert rate(out, F, M) == pytest.approx(M["R"] @ AXES[:3] @ velocity, rel=1e-7, abs=1e-8)
    assert out[0] == 0.0


@pytest.mark.parametrize("seed", range(3))
def test_spin_is_the_rotation_seen_from_F_about_an_axis_of_M(seed):
    F, M = random_motion(seed)
    ahead, behind = (moved_frame(F, s)["R"].T @ moved_frame(M, s)["R"] for s in (H, -H))
    turn = Rotation.from_matrix(behind.T @ ahead).as_rotvec() / (2 * H)
    out = evaluated((relative_spin.KIND, ""), F, M, 0.0)
    assert rate(out, F, M) == pytest.approx(turn @ AXES[:3], rel=1e-7, abs=1e-8)
    assert out[0] == 0.0


@pytest.mark.parametrize("turns", [-3, 0, 41])
def test_an_angle_is_the_one_next_to_its_hint(turns):
    """Whole turns come from the hint, the rest from the frames, also where the two disagree by nearly half a turn."""
    F, M = random_motion(4)
    plain = KINDS[angle.KIND].row((0.0,) * 8, frame_record(F), frame_record(M), 0.0, DATA)[0]
    assert -np.pi < plain <= np.pi
    for off in (-3.1, 0.0, 3.1):
        hint = plain + 2.0 * np.pi * turns + off
        value = KINDS[angle.KIND].row((1.0, *(0.0,) * 7), frame_record(F), frame_record(M), hint, DATA)[0]
        assert value == pytest.approx(plain + 2.0 * np.pi * turns, abs=1e-12)
