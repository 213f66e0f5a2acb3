"""Rows of a place of contact: rates are derivatives of values, biases derivatives of rates, whatever both sides do."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from flyball.constraints import ball_on_box, corner_on_box

CORES = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.4), (0.3, 0.2, 0.1))
TANGENTS = [(which, up) for which in (1, 2) for up in (1, 2, 3, -1, -2, -3)]
H = 1e-4


class Path:
    """A frame that moves: positions of the second order in time, a turn about a vector that changes."""

    def __init__(self, rng, size):
        self.p, self.v, self.a = rng.normal(size=3) * size, rng.normal(size=3), rng.normal(size=3)
        self.R = Rotation.random(random_state=int(rng.integers(1 << 30))).as_matrix()
        self.w, self.alpha = rng.normal(size=3), rng.normal(size=3)

    def pose(self, t):
        turn = Rotation.from_rotvec(self.w * t + 0.5 * self.alpha * t * t).as_matrix()
        return self.p + self.v * t + 0.5 * self.a * t * t, turn @ self.R

    def record(self, t):
        """Its record at t; with its accelerations as what is left at vdot = 0, at t = 0."""
        p, R = self.pose(t)
        W = (self.pose(t + H)[1] - self.pose(t - H)[1]) / (2 * H) @ R.T
        w = self.w if t == 0.0 else np.array([W[2, 1], W[0, 2], W[1, 0]])
        a, alpha = (self.a, self.alpha) if t == 0.0 else (np.zeros(3), np.zeros(3))
        return tuple(tuple(map(float, np.ravel(x))) for x in (p, R, w, self.v + self.a * t, alpha, a))


def rate(row, par, hint, F, M):
    """Rate of the row by its wrench, its value, its bias."""
    value, force, on_M, on_F, bias = row(par, F, M, hint, None)
    u = np.subtract(M[3], F[3])
    return np.dot(force, u) + np.dot(on_M, M[2]) + np.dot(on_F, F[2]), value, bias


def errors(row, par, hint=0.0, seed=1):
    """Largest errors of rate and bias over ten motions."""
    rng, worst = np.random.default_rng(seed), [0.0, 0.0]
    for _ in range(10):
        F, M = Path(rng, 0.1), Path(rng, 1.0)
        now = rate(row, par, hint, F.record(0.0), M.record(0.0))
        before, after = (rate(row, par, hint, F.record(t), M.record(t)) for t in (-H, H))
        scale = 1.0 + abs(now[2])
        worst[0] = max(worst[0], abs((after[1] - before[1]) / (2 * H) - now[0]))
        worst[1] = max(worst[1], abs((after[0] - before[0]) / (2 * H) - now[2]) / scale)
    return worst


@pytest.mark.parametrize("core", CORES)
def test_gap_of_a_ball_on_a_rounded_box(core):
    assert max(errors(ball_on_box.gap_row, (*core, 0.1, 0.0, 3.0, 0.3, 1.0))) < 1e-5


@pytest.mark.parametrize(("core", "tangent"), list(itertools.product(CORES, TANGENTS)))
def test_slip_of_a_ball_on_a_rounded_box(core, tangent):
    which, up = tangent
    assert errors(ball_on_box.slip_row, (*core, 0.1, float(which), float(up), 0.3, 1.0))[1] < 1e-5


@pytest.mark.parametrize("face", range(6))
def test_height_and_slip_of_a_corner_above_a_face(face):
    par = (0.3, 0.2, 0.1, 0.0, 1.0, 3.0, 0.0, 1.0)
    assert max(errors(corner_on_box.height_row, par, float(face))) < 1e-5
    assert errors(corner_on_box.slide_row, par, float(face))[1] < 1e-5


def test_tangents_are_axes_across_the_normal():
    rng = np.random.default_rng(2)
    for _, (which, up) in itertools.product(range(5), TANGENTS):
        n = rng.normal(size=3)
        n = tuple(n / np.linalg.norm(n))
        t = [ball_on_box.tangent((0.0,) * 4 + (float(k), float(up)), n, (0.0,) * 3)[0] for k in (1, 2)]
        frame = np.array([*t, n])
        assert np.allclose(frame @ frame.T, np.eye(3), atol=1e-12)
        assert which in (1, 2)


@pytest.mark.parametrize("face", range(6))
def test_margin_of_a_corner_on_a_face(face):
    assert max(errors(corner_on_box.margin_row, (30.0, 20.0, 10.0, 0.0, 1.0, 0.5, 0.0, 1.0), float(face))) < 1e-5


def test_a_corner_over_an_edge_is_on_the_face_in_front_of_which_its_body_lies():
    axes = ((1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0), *((0.0,) * 3,) * 4)
    at_edge = ((0.3, 0.2, 0.0), *axes)
    for degrees, face in ((100.0, 2.0), (170.0, 2.0), (-60.0, 0.0), (-80.0, 0.0)):
        par = (0.3, 0.2, 1e30, 0.0, 0.0, np.deg2rad(degrees), 0.0, 1.0)
        assert corner_on_box.foot(par, ((0.0,) * 3, *axes), at_edge, 1.0, None) == face
        assert corner_on_box.foot(par, ((0.0,) * 3, *axes), ((0.31, 0.2, 0.0), *axes), 2.0, None) == 0.0
