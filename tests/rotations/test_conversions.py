"""Conversions against SciPy, closed forms and each other, and the algebra of rotations."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

import flyball as fb
from flyball import rotations
from flyball.model.geometry import orientation_matrix
from tests.rotations.given import ALL, SOME, quaternions, same_orientation, vectors

SCIPY = Rotation.from_quat(SOME, scalar_first=True)


def test_matrix_and_quaternion_are_scipys():
    assert rotations.matrix(SOME) == pytest.approx(SCIPY.as_matrix(), abs=2e-15)
    assert rotations.from_matrix(SCIPY.as_matrix()) == pytest.approx(
        SCIPY.as_quat(canonical=True, scalar_first=True), abs=2e-15
    )
    assert rotations.quaternion(SCIPY) == pytest.approx(SCIPY.as_quat(canonical=True, scalar_first=True), abs=2e-15)


def test_vectors_are_scipys():
    assert rotations.rotation_vector(SOME) == pytest.approx(SCIPY.as_rotvec(), abs=4e-15)
    assert rotations.modified_rodrigues(SOME) == pytest.approx(SCIPY.as_mrp(), abs=2e-15)
    axis, angle = rotations.axis_angle(SOME)
    assert axis * angle[:, None] == pytest.approx(SCIPY.as_rotvec(), abs=4e-15)
    assert angle == pytest.approx(SCIPY.magnitude(), abs=4e-15)
    v = np.random.default_rng(0).uniform(-9, 9, (400, 3))
    assert rotations.matrix(rotations.from_rotation_vector(v)) == pytest.approx(
        Rotation.from_rotvec(v).as_matrix(), abs=4e-15
    )
    assert rotations.matrix(rotations.from_modified_rodrigues(v)) == pytest.approx(
        Rotation.from_mrp(v).as_matrix(), abs=4e-15
    )


@pytest.mark.parametrize("sequence", ALL)
def test_euler_angles_are_scipys(sequence):
    """Upper case about the moving axes, lower case about the fixed ones, the same ranges of the angles."""
    assert rotations.euler(SOME, sequence) == pytest.approx(SCIPY.as_euler(sequence), abs=1e-12)
    angles = np.random.default_rng(1).uniform(-7, 7, (200, 3))
    assert rotations.matrix(rotations.from_euler(angles, sequence)) == pytest.approx(
        Rotation.from_euler(sequence, angles).as_matrix(), abs=4e-15
    )


@pytest.mark.parametrize("sequence", rotations.INTRINSIC)
def test_fixed_axes_are_moving_axes_backwards(sequence):
    angles = np.random.default_rng(2).uniform(-3, 3, (50, 3))
    assert same_orientation(
        rotations.from_euler(angles, sequence), rotations.from_euler(angles[:, ::-1], sequence[::-1].lower())
    )


def test_closed_forms():
    """A third of a turn about (1, 1, 1) permutes the axes; a right angle about z takes x to y."""
    e = rotations.from_axis_angle((1, 1, 1), 2 * np.pi / 3)
    assert e == pytest.approx([0.5, 0.5, 0.5, 0.5], abs=1e-15)
    assert rotations.matrix(e) == pytest.approx(np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0]]), abs=1e-15)
    assert rotations.gibbs(e) == pytest.approx([1, 1, 1], abs=1e-15)
    quarter = rotations.from_axis_angle((0, 0, 5), np.pi / 2)
    assert rotations.apply(quarter, (1, 0, 0)) == pytest.approx([0, 1, 0], abs=1e-15)
    assert rotations.gibbs(quarter) == pytest.approx([0, 0, 1], abs=1e-15)
    assert rotations.modified_rodrigues(quarter) == pytest.approx([0, 0, np.tan(np.pi / 8)], abs=1e-15)


def test_bryant_angles_are_about_x_then_the_new_y_then_the_newer_z():
    """The matrix in Wittenburg, Dynamics of Multibody Systems (2008), section 2.1.2, columns being the turned axes."""
    a, b, c = 0.4, -0.7, 1.9
    (ca, sa), (cb, sb), (cc, sc) = ((np.cos(x), np.sin(x)) for x in (a, b, c))
    R = [
        [cb * cc, -cb * sc, sb],
        [ca * sc + sa * sb * cc, ca * cc - sa * sb * sc, -sa * cb],
        [sa * sc - ca * sb * cc, sa * cc + ca * sb * sc, ca * cb],
    ]
    assert rotations.matrix(rotations.from_bryant((a, b, c))) == pytest.approx(np.array(R), abs=1e-15)
    assert rotations.bryant(R) == pytest.approx([a, b, c], abs=1e-15)
    assert orientation_matrix((a, b, c), "the model's") == pytest.approx(np.array(R), abs=1e-15)


def test_rodrigues_formula_and_exponential():
    """R = exp(S) = cos(theta) 1 + (1 - cos(theta)) n n^T + sin(theta) N."""
    n, theta = np.array([2, -1, 2]) / 3, 2.2
    N = np.array([[0, -n[2], n[1]], [n[2], 0, -n[0]], [-n[1], n[0], 0]])
    R = np.cos(theta) * np.eye(3) + (1 - np.cos(theta)) * np.outer(n, n) + np.sin(theta) * N
    assert rotations.matrix(rotations.from_axis_angle(n, theta)) == pytest.approx(R, abs=1e-15)
    assert rotations.matrix(rotations.from_rotation_vector(theta * n)) == pytest.approx(expm(theta * N), abs=1e-14)


def test_cayley_is_one_plus_s_by_one_less_s():
    S = rotations.cayley(SOME)
    assert pytest.approx(-S) == np.swapaxes(S, 1, 2)
    near = np.abs(S).max(axis=(1, 2)) < 30  # the inverse that this test takes loses digits beyond
    R = (np.eye(3) + S[near]) @ np.linalg.inv(np.eye(3) - S[near])
    assert rotations.matrix(SOME[near]) == pytest.approx(R, abs=1e-11)
    assert same_orientation(rotations.from_cayley(S), SOME, 1e-14)


@given(quaternions, st.sampled_from(ALL))
def test_there_and_back(q, sequence):
    """Every description gives the orientation back, from wherever it comes, and singular angles no worse than others."""
    R, back = rotations.matrix(q), rotations.from_euler(rotations.euler(q, sequence, singular="choose"), sequence)
    assert same_orientation(back, q, 3e-12)
    assert same_orientation(R, q)
    assert same_orientation(rotations.from_rotation_vector(rotations.rotation_vector(q)), q)
    assert same_orientation(rotations.from_axis_angle(*rotations.axis_angle(q)), q)
    assert same_orientation(rotations.from_modified_rodrigues(rotations.modified_rodrigues(q)), q)
    if np.pi - rotations.axis_angle(q)[1] > 1e-3:
        assert same_orientation(rotations.from_gibbs(rotations.gibbs(q)), q)


@given(vectors)
def test_rotation_vectors_of_less_than_half_a_turn_come_back(phi):
    phi = phi * 3.14 / max(3.14, np.linalg.norm(phi))
    assert rotations.rotation_vector(rotations.from_rotation_vector(phi)) == pytest.approx(phi, abs=1e-14)


@pytest.mark.parametrize("size", [1e-300, 1e-160, 1e-20, 1e-9, 1e-4, 0.02, 0.0633, 0.5])
def test_small_turns_keep_their_digits(size):
    n = np.array([0.6, 0.0, -0.8])
    e = rotations.from_rotation_vector(size * n)
    assert rotations.rotation_vector(e) == pytest.approx(size * n, rel=4e-16, abs=0)
    axis, angle = rotations.axis_angle(e)
    assert axis == pytest.approx(n, rel=4e-16)
    assert angle == pytest.approx(size, rel=4e-16, abs=0)
    assert e[1:] == pytest.approx(np.sin(size / 2) * n, rel=4e-16, abs=0)


def test_no_rotation_and_half_turns_are_ordinary():
    axis, angle = rotations.axis_angle(np.eye(3))
    assert axis.tolist() == [0, 0, 1]
    assert angle == 0
    assert rotations.rotation_vector((1, 0, 0, 0)).tolist() == [0, 0, 0]
    assert rotations.rotation_vector((-1, 0, 0, 0)).tolist() == [0, 0, 0]
    for k in range(3):
        half = np.eye(4)[1 + k]
        R = rotations.matrix(half)
        assert np.diag(R).tolist() == [1 if i == k else -1 for i in range(3)]
        assert rotations.quaternion(R).tolist() == half.tolist()
        assert rotations.rotation_vector(R) == pytest.approx(np.pi * np.eye(3)[k], rel=1e-15)
        assert rotations.rotation_vector(-half) == pytest.approx(-np.pi * np.eye(3)[k], rel=1e-15)
        assert rotations.modified_rodrigues(half) == pytest.approx(np.eye(3)[k], rel=1e-15)


@given(quaternions, quaternions, vectors)
def test_algebra(a, b, v):
    """R_AC = R_AB R_BC; the inverse is the transpose; A sees B as R_A^T R_B."""
    A, B = rotations.matrix(a), rotations.matrix(b)
    assert rotations.matrix(rotations.compose(a, b)) == pytest.approx(A @ B, abs=4e-15)
    assert rotations.matrix(rotations.compose(a, B, rotations.inverse(b))) == pytest.approx(A, abs=4e-15)
    assert rotations.matrix(rotations.inverse(a)) == pytest.approx(A.T, abs=4e-15)
    assert rotations.matrix(rotations.relative(a, b)) == pytest.approx(A.T @ B, abs=4e-15)
    assert rotations.apply(a, v) == pytest.approx(A @ v, abs=2e-14)
    assert rotations.angular_distance(a, b) == pytest.approx(
        np.linalg.norm(rotations.rotation_vector(A.T @ B)), abs=1e-14
    )
    assert rotations.compose().tolist() == [1, 0, 0, 0]


@pytest.mark.parametrize("sign", [1, -1])
def test_slerp_turns_evenly(sign):
    a = rotations.from_bryant((0.3, -0.2, 0.9))
    b = rotations.compose(a, rotations.from_axis_angle((1, 2, -1), 1.5))
    part = np.linspace(-0.5, 1.5, 21)
    e = rotations.slerp(a, sign * b, part)
    assert same_orientation(e, rotations.compose(a, rotations.from_axis_angle((1, 2, -1), 1.5 * part)), 1e-15)
    assert rotations.angular_distance(e[1:], e[:-1]) == pytest.approx(np.full(20, 0.15), abs=1e-14)
    assert same_orientation(rotations.slerp(a, a, part), a, 1e-15)


def test_random_orientations_are_even():
    """The mean of R vanishes, each entry has variance 1/3, and the angle has the density (1 - cos)/pi (Miles 1965)."""
    n = 40_000
    e = rotations.random(n, seed=3)
    R = rotations.matrix(e)
    assert np.abs(R.mean(axis=0)).max() < 5 / np.sqrt(3 * n)
    assert (R**2).mean(axis=0) == pytest.approx(np.full((3, 3), 1 / 3), abs=0.01)
    angle = np.sort(rotations.axis_angle(e)[1])
    assert np.abs((angle - np.sin(angle)) / np.pi - (np.arange(n) + 0.5) / n).max() < 2 / np.sqrt(n)
    assert rotations.random((2, 3), seed=5).shape == (2, 3, 4)
    assert rotations.random(seed=5).shape == (4,)
    assert np.array_equal(rotations.random(4, seed=9), rotations.random(4, np.random.default_rng(9)))


def test_nearest_rotation():
    """The rotation part of R U with U symmetric and positive is R; rounded matrices come back to a rotation."""
    R = rotations.matrix(SOME)
    A = np.random.default_rng(4).uniform(-1, 1, (400, 3, 3))
    U = A @ np.swapaxes(A, 1, 2) + 0.1 * np.eye(3)
    assert same_orientation(rotations.nearest(R @ U), R, 1e-13)
    rounded = R.astype(np.float32)
    with pytest.raises(fb.ModelError, match=r"rotations\.nearest gives the closest"):
        rotations.quaternion(rounded)
    assert same_orientation(rotations.nearest(rounded), R, 1e-6)


def test_signs_of_a_series_of_quaternions_can_be_made_continuous():
    t = np.linspace(0, 4 * np.pi, 200)
    smooth = rotations.from_axis_angle((1, 2, 3), t)
    broken = smooth * np.where(np.arange(200) % 7 < 3, 1, -1)[:, None]
    assert rotations.quaternion(broken, continuous=True) == pytest.approx(smooth, abs=1e-15)
    assert np.abs(np.diff(rotations.quaternion(rotations.matrix(smooth)), axis=0)).max() > 1
    assert rotations.quaternion(rotations.matrix(smooth), continuous=True) == pytest.approx(smooth, abs=1e-15)
    two = np.stack([broken, smooth], axis=1)
    assert rotations.quaternion(two, continuous=True) == pytest.approx(np.stack([smooth, smooth], axis=1), abs=1e-15)


@pytest.mark.parametrize("shape", [(), (5,), (2, 3), (0,)])
def test_leading_axes(shape):
    q = rotations.random(shape, seed=1)
    R = rotations.matrix(q)
    assert R.shape == (*shape, 3, 3)
    assert rotations.quaternion(R).shape == (*shape, 4)
    for name in ("rotation_vector", "gibbs", "modified_rodrigues", "bryant", "euler"):
        vector = getattr(rotations, name)(q)
        assert vector.shape == (*shape, 3)
        assert getattr(rotations, f"from_{name}")(vector).shape == (*shape, 4)
    assert rotations.from_cayley(rotations.cayley(R)).shape == (*shape, 4)
    axis, angle = rotations.axis_angle(q)
    assert axis.shape == (*shape, 3)
    assert angle.shape == shape
    assert rotations.from_axis_angle((0, 0, 1), angle).shape == (*shape, 4)
    assert rotations.from_axis_angle(axis, 0.3).shape == (*shape, 4)
    assert rotations.apply(q, np.ones(3)).shape == (*shape, 3)
    assert rotations.apply((1, 0, 0, 0), np.ones((*shape, 3))).shape == (*shape, 3)
    assert rotations.relative(q, R).shape == (*shape, 4)
    assert rotations.angular_distance(q, (1, 0, 0, 0)).shape == shape
    assert rotations.distance_to_singular(q, "ZXZ").shape == shape
    assert rotations.nearest(R).shape == (*shape, 4)
    for i in np.ndindex(shape):  # together as one by one
        assert rotations.euler(q, "yzy")[i] == pytest.approx(rotations.euler(q[i], "yzy"), abs=1e-14)
        assert rotations.quaternion(R)[i] == pytest.approx(rotations.quaternion(R[i]), abs=1e-15)
