"""Sets of bodies: energies against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from flyball.results.part_views.bodies import BodySetMotion
from tests.results.made_up import slider_crank


def rods(n: int = 3) -> BodySetMotion:
    """Two slender rods turning about the vertical through their mass centres; the second lies along another axis."""
    t = np.linspace(0.0, 1.0, n)
    a = 3.0 * t
    q = np.zeros((n, 2, 4))
    q[:, :, 0], q[:, :, 3] = np.cos(a / 2)[:, None], np.sin(a / 2)[:, None]
    w = np.zeros((n, 2, 3))
    w[:, :, 2] = 3.0
    x = np.zeros((n, 2, 3))
    x[:, 1] = np.stack([2.0 * t, 0 * t, 1.0 - 0.5 * t], axis=1)
    v = np.zeros((n, 2, 3))
    v[:, 1] = (2.0, 0.0, -0.5)
    J = np.zeros((2, 3, 3))
    J[0] = np.diag([0.0, 0.12, 0.12])  # 1.44 kg m^2 / 12 along x
    J[1] = np.diag([0.12, 0.12, 0.0])  # along z: no energy of turning about it
    com = np.array([[0.3, 0.0, 0.0], [0.0, 0.0, 0.5]])
    return BodySetMotion("rods", np.array([1.0, 2.0]), J, com, x, q, v, w)


def test_kinetic_and_potential_energy():
    b = rods()
    np.testing.assert_allclose(b.kinetic, 0.5 * 0.12 * 9.0 + 0.5 * 2.0 * 4.25, rtol=1e-14)
    np.testing.assert_allclose(b.potential(np.array([0, 0, -10.0])), 20.0 - 10.0 * np.linspace(0, 1, 3))
    balls = BodySetMotion("b", b.mass, 0.4 * np.eye(3) * b.mass[:, None, None], 0 * b.com, b.position, b.quaternion,
                 b.velocity, b.angular_velocity)  # fmt: skip
    np.testing.assert_allclose(balls.kinetic, 0.5 * 0.4 * 3.0 * 9.0 + 4.25, rtol=1e-14)


def test_origins_of_reference_frames_circle_the_mass_centre():
    b = rods(4001)
    np.testing.assert_allclose(b.origin[0, 0], (-0.3, 0, 0), atol=1e-15)
    np.testing.assert_allclose(b.origin[:, 1], b.position[:, 1] - (0, 0, 0.5), atol=1e-15)
    found = np.gradient(b.origin, 1 / 4000, axis=0)[1:-1]
    np.testing.assert_allclose(found, b.origin_velocity[1:-1], atol=1e-6)


def test_arrays_that_do_not_fit_are_refused():
    b = rods()
    with pytest.raises(ValueError, match="quaternion must have shape"):
        BodySetMotion("b", b.mass, b.inertia, b.com, b.position, b.position, b.velocity, b.angular_velocity)


def test_energies_of_a_result_count_sets_and_what_contacts_exchange():
    r, alone = slider_crank(3), slider_crank(3)
    r.bulk = {"rods": rods()}
    np.testing.assert_allclose(r.energy.kinetic - alone.energy.kinetic, r.bulk["rods"].kinetic, rtol=1e-9)
    np.testing.assert_allclose(r.energy.gravity - alone.energy.gravity, 0.0, atol=1e-9)  # gravity is along -y there
    other = slider_crank(3)
    other.exchanged = {"friction_loss": np.array([0.0, 1, 3]), "surface_work": np.array([0.0, 0.5, 0.5])}
    np.testing.assert_allclose(other.energy.balance - alone.energy.balance, (0.0, 0.5, 2.5), atol=1e-9)
    np.testing.assert_array_equal(other.energy.exchanged("friction_loss"), (0, 1, 3))
    assert not alone.energy.exchanged("impact_loss").any()
