"""Systems of the examples against closed forms and matrices of their own: bogie, press, platforms, shafts, differential."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq

from tests.mechanisms import example

BOGIE = {"m": 1500.0, "Iz": 900.0, "M": 3000.0, "I": 3500.0, "r": 0.46, "b": 0.75, "a": 1.25, "conicity": 0.1}
CREEP, PRIMARY_X, PRIMARY_Y, SECONDARY, DAMPING = 6e6, 4e6, 5e6, 3e5, 2e4  # the springs' half distance across is 1 m


def bogie_matrix(speed: float) -> np.ndarray:
    """A (12 x 12) of lateral displacement and yaw of both wheelsets and the frame, each with its rate."""
    q = BOGIE
    K, C = np.diag([0, 0, 0, 0, 2 * SECONDARY, 2 * SECONDARY]), np.diag([0, 0, 0, 0, 2 * DAMPING, 2 * DAMPING])
    for y, side in ((0, 1), (2, -1)):
        K[y, y + 1] -= 2 * CREEP
        K[y + 1, y] += 2 * CREEP * q["b"] * q["conicity"] / q["r"]
        C[y, y] += 2 * CREEP / speed
        C[y + 1, y + 1] += 2 * CREEP * q["b"] ** 2 / speed
        lateral, yaw = np.zeros(6), np.zeros(6)  # what the axle boxes of the wheelset are strained by
        lateral[[y, 4, 5]] = 1, -1, -side * q["a"]
        yaw[[y + 1, 5]] = 1, -1
        K = K + 2 * PRIMARY_Y * np.outer(lateral, lateral) + 2 * PRIMARY_X * np.outer(yaw, yaw)
    M = np.diag([q["m"], q["Iz"], q["m"], q["Iz"], q["M"], q["I"]])
    return np.block([[np.zeros((6, 6)), np.eye(6)], [-np.linalg.solve(M, K), -np.linalg.solve(M, C)]])


def test_bogies_eigenvalues_and_critical_speed():
    m = example("bogie.py")
    for speed in (20.0, 60.0, 100.0):
        found = m.linearize(parameters={"speed": speed}).eigenvalues
        expected = np.linalg.eigvals(bogie_matrix(speed))
        apart = np.abs(np.subtract.outer(found, expected)).min(axis=0)
        assert apart.max() < 1e-9 * np.abs(expected).max()
    locus = m.root_locus("speed", np.linspace(60, 100, 5))
    critical = brentq(lambda v: np.linalg.eigvals(bogie_matrix(v)).real.max(), 60, 100, xtol=1e-10)
    assert [(c.kind, c.value) for c in locus.crossings] == [("flutter", pytest.approx(critical, rel=1e-8))]


@pytest.mark.parametrize("stiff", [False, True])
def test_klingels_wavelength(stiff):
    """At low speed of a free wheelset, and of a rigid bogie: 2 pi sqrt(r (b^2 + a^2) / (conicity b))."""
    soft = {"secondary": 0.0, "secondary_damping": 0.0}
    primary = 1e11 if stiff else 1.0
    m = example("bogie.py", speed=1.0, primary_x=primary, primary_y=primary, **soft)
    eigenvalues = m.linearize().eigenvalues
    wavelengths = 2 * np.pi / eigenvalues.imag[(eigenvalues.imag > 0.1) & (eigenvalues.imag < 1)]
    q = BOGIE
    klingel = 2 * np.pi * np.sqrt(q["r"] * (q["b"] ** 2 + stiff * q["a"] ** 2) / (q["conicity"] * q["b"]))
    assert wavelengths == pytest.approx(klingel * np.ones(1 if stiff else 2), rel=1e-5)
