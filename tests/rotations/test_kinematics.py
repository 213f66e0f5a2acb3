"""Angular velocity and acceleration from the rates of every description, against derivatives and closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from scipy.spatial.transform import Rotation

import flyball as fb
from flyball import rotations
from tests.rotations.given import ALL, derivative, vectors

RNG = np.random.default_rng(5)
ANGLES, RATES, SECOND = (RNG.uniform(-3, 3, (40, 3)) for _ in range(3))
AXES = ["body", "base"]


def spin(function, axes, *pairs):
    """Angular velocity of rotation matrices over time: R^T Rdot is its cross-product matrix in the body, Rdot R^T not."""
    R = function(*(x for x, _ in pairs))
    Rdot = derivative(function, *pairs)
    Rt = np.swapaxes(R, -1, -2)
    W = Rt @ Rdot if axes == "body" else Rdot @ Rt
    return np.stack([W[..., 2, 1], W[..., 0, 2], W[..., 1, 0]], axis=-1)


@pytest.mark.parametrize("axes", AXES)
@pytest.mark.parametrize("sequence", ALL)
def test_euler_velocity(sequence, axes):
    """W = H etadot is the spin of the matrix, and H^-1 leads back."""

    def matrix(eta):
        return rotations.matrix(rotations.from_euler(eta, sequence))

    w = spin(matrix, axes, (ANGLES, RATES))
    H = rotations.euler_H(ANGLES, sequence, axes)
    assert np.einsum("nij,nj->ni", H, RATES) == pytest.approx(w, abs=1e-13)
    assert rotations.euler_angular_velocity(ANGLES, RATES, sequence, axes) == pytest.approx(w, abs=1e-13)
    assert rotations.euler_rates(ANGLES, w, sequence, axes) == pytest.approx(RATES, abs=1e-11)
    inverse = rotations.euler_H_inverse(ANGLES, sequence, axes)
    assert inverse @ H == pytest.approx(np.tile(np.eye(3), (40, 1, 1)), abs=1e-11)


@pytest.mark.parametrize("axes", AXES)
@pytest.mark.parametrize("sequence", ALL)
def test_euler_acceleration(sequence, axes):
    """Alpha = H etaddot + Hdot etadot is the derivative of w."""

    def w(eta, rates):
        return rotations.euler_angular_velocity(eta, rates, sequence, axes)

    alpha = derivative(w, (ANGLES, RATES), (RATES, SECOND))
    assert rotations.euler_angular_acceleration(ANGLES, RATES, SECOND, sequence, axes) == pytest.approx(
        alpha, abs=1e-12
    )
    assert rotations.euler_accelerations(ANGLES, RATES, alpha, sequence, axes) == pytest.approx(SECOND, abs=1e-10)
    Hdot = derivative(lambda eta: rotations.euler_H(eta, sequence, axes), (ANGLES, RATES))
    assert rotations.euler_H_rate(ANGLES, RATES, sequence, axes) == pytest.approx(Hdot, abs=1e-13)


@pytest.mark.parametrize("sequence", ALL)
def test_euler_velocity_by_differences_of_scipys_rotations(sequence):
    h = 1e-4
    after, before = (Rotation.from_euler(sequence, ANGLES + s * h * RATES) for s in (1, -1))
    w = (after * before.inv()).as_rotvec() / (2 * h)
    assert rotations.euler_angular_velocity(ANGLES, RATES, sequence, "base") == pytest.approx(w, abs=2e-6)
    body = (before.inv() * after).as_rotvec() / (2 * h)
    assert rotations.euler_angular_velocity(ANGLES, RATES, sequence) == pytest.approx(body, abs=2e-6)


def test_published_kinematic_matrices():
    """Bryant: Wittenburg (2008), section 2.1.2; Euler: Landau and Lifshitz, section 35; aircraft: Euler's in any text."""
    a, b, c = 0.4, -0.7, 1.9
    (ca, sa), (cb, sb), (cc, sc) = ((np.cos(x), np.sin(x)) for x in (a, b, c))
    H = [[cb * cc, sc, 0], [-cb * sc, cc, 0], [sb, 0, 1]]
    assert rotations.euler_H((a, b, c)) == pytest.approx(np.array(H), abs=1e-15)
    H = [[1, 0, sb], [0, ca, -sa * cb], [0, sa, ca * cb]]
    assert rotations.euler_H((a, b, c), axes="base") == pytest.approx(np.array(H), abs=1e-15)
    inverse = [[cc / cb, -sc / cb, 0], [sc, cc, 0], [-cc * sb / cb, sc * sb / cb, 1]]
    assert rotations.euler_H_inverse((a, b, c)) == pytest.approx(np.array(inverse), abs=1e-15)
    H = [[sb * sc, cc, 0], [sb * cc, -sc, 0], [cb, 0, 1]]
    assert rotations.euler_H((a, b, c), "ZXZ") == pytest.approx(np.array(H), abs=1e-15)
    H = [[-sb, 0, 1], [cb * sc, cc, 0], [cb * cc, -sc, 0]]  # yaw a, pitch b, roll c
    assert rotations.euler_H((a, b, c), "ZYX") == pytest.approx(np.array(H), abs=1e-15)
    assert rotations.euler_H((c, b, a), "xyz") == pytest.approx(np.array(H)[:, ::-1], abs=1e-15)


@pytest.mark.parametrize("sequence", ALL)
def test_the_determinant_of_h_is_the_distance_from_singular(sequence):
    H = rotations.euler_H(ANGLES, sequence)
    d = rotations.distance_to_singular(rotations.from_euler(ANGLES, sequence), sequence)
    assert np.abs(np.linalg.det(H)) == pytest.approx(np.sin(d), abs=1e-14)


@pytest.mark.parametrize(
    ("sequence", "middle"), [("XYZ", np.pi / 2), ("zyx", -5 * np.pi / 2), ("ZXZ", 0), ("yxy", np.pi)]
)
def test_no_rates_at_singular_angles(sequence, middle):
    """Refused within 1e-7 rad, by a message with sequence, angle, distance and remedy; beyond, rates grow as 1/distance."""
    angles = np.array([[0.1, 0.7, 0.2], [0.3, middle + 3e-8, -0.2]])
    for axes in AXES:
        with pytest.raises(fb.SingularOrientationError) as e:
            rotations.euler_H_inverse(angles, sequence, axes)
        assert (e.value.sequence, e.value.angle) == (sequence, pytest.approx(middle, abs=1e-7))
        assert e.value.distance == pytest.approx(3e-8, rel=1e-6)
    text = str(e.value)
    assert f"Euler angles '{sequence}' at index 1: the middle angle" in text
    assert "3e-08 rad from a singular one" in text
    assert "use another sequence" in text
    assert "quaternion_rates" in text
    with pytest.raises(fb.SingularOrientationError):
        rotations.euler_rates(angles, (1, 0, 0), sequence)
    with pytest.raises(fb.SingularOrientationError):
        rotations.euler_accelerations(angles, (1, 0, 0), (1, 0, 0), sequence)
    beyond = np.abs(rotations.euler_H_inverse((0.3, middle + 1e-6, -0.2), sequence)).max()
    assert 0.7e6 < beyond < 1.1e6
    assert np.isfinite(rotations.euler_H_inverse(angles, sequence, tolerance=1e-9)).all()
    assert np.isfinite(rotations.euler_H(angles, sequence)).all()


@pytest.mark.parametrize("axes", AXES)
def test_quaternion_velocity(axes):
    """Qdot = T w, w = 2 G qdot, along a motion q(t) of unit length; G G^T = 1, G q = 0."""

    def motion(eta):
        return rotations.from_bryant(eta)

    q, qdot = motion(ANGLES), derivative(motion, (ANGLES, RATES))
    w = spin(lambda eta: rotations.matrix(motion(eta)), axes, (ANGLES, RATES))
    assert rotations.quaternion_rates(q, w, axes) == pytest.approx(qdot, abs=1e-13)
    assert rotations.quaternion_angular_velocity(q, qdot, axes) == pytest.approx(w, abs=1e-13)
    G, T = rotations.quaternion_G(q, axes), rotations.quaternion_T(q, axes)
    assert pytest.approx(np.tile(np.eye(3), (40, 1, 1)), abs=1e-15) == G @ np.swapaxes(G, 1, 2)
    assert np.einsum("nij,nj->ni", G, q) == pytest.approx(np.zeros((40, 3)), abs=1e-15)
    assert np.einsum("nij,nj->ni", T, w) == pytest.approx(qdot, abs=1e-13)
    R = rotations.quaternion_G(q, "base") @ np.swapaxes(rotations.quaternion_G(q, "body"), 1, 2)
    assert pytest.approx(rotations.matrix(q), abs=1e-14) == R  # Nikravesh (1988): A = G L^T


@pytest.mark.parametrize("axes", AXES)
def test_quaternion_acceleration(axes):
    def rates(eta, speed):
        q = rotations.from_bryant(eta)
        return rotations.quaternion_rates(q, rotations.euler_angular_velocity(eta, speed, axes=axes), axes)

    qddot = derivative(rates, (ANGLES, RATES), (RATES, SECOND))
    q = rotations.from_bryant(ANGLES)
    w = rotations.euler_angular_velocity(ANGLES, RATES, axes=axes)
    alpha = rotations.euler_angular_acceleration(ANGLES, RATES, SECOND, axes=axes)
    assert rotations.quaternion_accelerations(q, w, alpha, axes) == pytest.approx(qddot, abs=1e-12)
    assert rotations.quaternion_angular_acceleration(q, qddot, axes) == pytest.approx(alpha, abs=1e-12)
    Gdot = derivative(lambda x: rotations.quaternion_G(x, axes), (q, qddot))
    assert rotations.quaternion_G(qddot, axes) == pytest.approx(Gdot, abs=1e-14)  # linear, so its own derivative


@pytest.mark.parametrize("axes", AXES)
@pytest.mark.parametrize("size", [0.0, 1e-12, 1e-5, 0.3, 1.0, 1.99999, 2.00001, 3.1, 6.0, 6.5, 20.0])
def test_rotation_vector(size, axes):
    """W = J phidot and alpha = J phiddot + Jdot phidot from nothing to several turns."""
    phi = size * ANGLES / np.linalg.norm(ANGLES, axis=1)[:, None]

    def matrix(phi):
        return rotations.matrix(rotations.from_rotation_vector(phi))

    def velocity(phi, rates):
        return rotations.rotation_vector_angular_velocity(phi, rates, axes)

    w = spin(matrix, axes, (phi, RATES))
    assert velocity(phi, RATES) == pytest.approx(w, abs=2e-13)
    assert rotations.rotation_vector_rates(phi, w, axes) == pytest.approx(RATES, abs=1e-11)
    alpha = derivative(velocity, (phi, RATES), (RATES, SECOND))
    assert rotations.rotation_vector_angular_acceleration(phi, RATES, SECOND, axes) == pytest.approx(alpha, abs=2e-12)
    assert rotations.rotation_vector_accelerations(phi, RATES, alpha, axes) == pytest.approx(SECOND, abs=1e-10)


@given(vectors, vectors)
def test_jacobians_of_so3(phi, rates):
    """J_left = R J_right = J_right^T; both leave phi where it is; the inverses are inverses (Chirikjian 2011)."""
    left, right = rotations.left_jacobian(phi), rotations.right_jacobian(phi)
    R = rotations.matrix(rotations.from_rotation_vector(phi))
    assert left == pytest.approx(R @ right, abs=1e-14)
    assert left == pytest.approx(right.T, abs=0)
    assert left @ phi == pytest.approx(phi, abs=2e-14)
    if abs(np.linalg.norm(phi) - 2 * np.pi) > 0.05:
        assert rotations.left_jacobian_inverse(phi) @ left == pytest.approx(np.eye(3), abs=1e-11)
        assert rotations.right_jacobian_inverse(phi) @ right == pytest.approx(np.eye(3), abs=1e-11)
    Jdot = derivative(rotations.left_jacobian, (phi, rates))
    assert rotations.left_jacobian_rate(phi, rates) == pytest.approx(Jdot, abs=2e-13)
    assert rotations.right_jacobian_rate(phi, rates) == pytest.approx(Jdot.T, abs=2e-13)


def test_jacobian_in_sines_and_cosines():
    """The closed form of Sola, Deray and Atchuthan (2018) and others."""
    n, theta = np.array([2, -1, 2]) / 3, 2.2
    S = theta * np.array([[0, -n[2], n[1]], [n[2], 0, -n[0]], [-n[1], n[0], 0]])
    c, s = np.cos(theta), np.sin(theta)
    J = np.eye(3) + (1 - c) / theta**2 * S + (theta - s) / theta**3 * S @ S
    assert rotations.left_jacobian(theta * n) == pytest.approx(J, abs=1e-15)
    inverse = np.eye(3) - S / 2 + (1 / theta**2 - (1 + c) / (2 * theta * s)) * S @ S
    assert rotations.left_jacobian_inverse(theta * n) == pytest.approx(inverse, abs=1e-15)


@pytest.mark.parametrize("turns", [1, 2])
def test_no_rates_of_rotation_vectors_at_whole_turns(turns):
    phi = np.array([[0, 0, 0.5], [0, 2 * np.pi * turns + 4e-8, 0]])
    with pytest.raises(
        fb.SingularOrientationError, match=r"at index 1: .*4e-08 rad from whole turns.*shorter vector"
    ) as e:
        rotations.rotation_vector_rates(phi, (1, 0, 0))
    assert e.value.distance == pytest.approx(4e-8, rel=1e-6)
    with pytest.raises(fb.SingularOrientationError):
        rotations.right_jacobian_inverse(phi)
    with pytest.raises(fb.SingularOrientationError):
        rotations.rotation_vector_accelerations(phi, (1, 0, 0), (1, 0, 0))
    assert rotations.left_jacobian_inverse((0, 0, 0)).tolist() == np.eye(3).tolist()


@pytest.mark.parametrize("shape", [(), (5,), (2, 3), (0,)])
def test_leading_axes(shape):
    eta, w = np.full((*shape, 3), 0.3), np.array([1.0, 2, 3])
    q = rotations.from_bryant(eta)
    for sequence in ("XYZ", "zxz"):
        for name in ("euler_H", "euler_H_inverse"):
            assert getattr(rotations, name)(eta, sequence).shape == (*shape, 3, 3)
        assert rotations.euler_H_rate(eta, w, sequence).shape == (*shape, 3, 3)
        assert rotations.euler_H_rate(eta, w, sequence, "base").shape == (*shape, 3, 3)
        assert rotations.euler_rates(eta, w, sequence).shape == (*shape, 3)
        assert rotations.euler_accelerations(eta, w, w, sequence).shape == (*shape, 3)
    assert rotations.quaternion_G(q).shape == (*shape, 3, 4)
    assert rotations.quaternion_T(q).shape == (*shape, 4, 3)
    assert rotations.quaternion_rates(q, w).shape == (*shape, 4)
    assert rotations.left_jacobian(eta).shape == (*shape, 3, 3)
    assert rotations.right_jacobian_inverse(eta).shape == (*shape, 3, 3)
    assert rotations.left_jacobian_rate(eta, w).shape == (*shape, 3, 3)
    assert rotations.rotation_vector_accelerations(eta, w, w, "base").shape == (*shape, 3)


@pytest.mark.parametrize("name", ["rotation_vector", "modified_rodrigues", "gibbs", "bryant"])
def test_a_complex_step_goes_through_every_conversion(name):
    """There and back, the rate of an orientation comes back too, from a matrix and from a quaternion."""
    to, back = getattr(rotations, name), getattr(rotations, f"from_{name}")
    x = 0.15 * ANGLES
    assert derivative(lambda x: to(back(x)), (x, RATES)) == pytest.approx(RATES, abs=1e-12)
    assert derivative(lambda x: to(rotations.matrix(back(x))), (x, RATES)) == pytest.approx(RATES, abs=1e-12)
    zero = np.zeros((40, 3))
    assert derivative(lambda x: to(back(x)), (zero, RATES)) == pytest.approx(RATES, abs=1e-14)  # smooth at no rotation


def test_a_complex_step_goes_through_distance_and_axis():
    n = np.array([2, -1, 2]) / 3
    angle = np.array([0.02, 0.3, 2.9])
    assert derivative(
        lambda t: rotations.axis_angle(rotations.from_axis_angle(n, t))[1], (angle, 1.0)
    ) == pytest.approx(np.ones(3), abs=1e-13)
    assert derivative(
        lambda t: rotations.angular_distance(rotations.from_axis_angle(n, t), np.eye(3)), (angle, 1.0)
    ) == (pytest.approx(np.ones(3), abs=1e-13))
