"""Tolerances near rounding: at singular positions, and far from the origin. What cannot be had is said."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import flyball as fb
from tests.layers import LAYERS
from tests.mechanisms import G, example, planar_rod


def turned(windows: int, t: float) -> float:
    """Angle of the first post of the N-four-bar, whose posts stay parallel: all of it is one pendulum."""
    k = G * ((windows + 1) / 2 + windows) / ((windows + 1) / 3 + windows)
    motion = solve_ivp(
        lambda _, y: [y[1], -k * np.cos(y[0])], (0, t), [np.pi / 2, -1], method="DOP853", rtol=1e-13, atol=1e-14
    )
    return motion.y[0, -1] - np.pi / 2


@pytest.mark.parametrize("coordinates", LAYERS)
@pytest.mark.parametrize(
    ("windows", "rtol", "error"),
    [(1, 1e-11, 3e-9), (1, 5e-12, 3e-9), (2, 1e-11, 3e-9), (2, 5e-12, 3e-9), (40, 4e-10, 1e-7)],
)
def test_singular_positions_at_tight_tolerances(windows, rtol, error, coordinates):
    """Four passages through the flat position, where a rounding error is amplified by the cube of the distance.

    At rtol = 1e-12 rounding decides whether a step ends too near to the position for the next one.
    """
    r = example("n_four_bar.py", windows=windows).simulate(
        3.5, outputs=8, rtol=rtol, atol=1e-2 * rtol, coordinates=coordinates, max_steps=20_000
    )
    assert r["A0"].angle[-1] == pytest.approx(turned(windows, 3.5), abs=error)
    assert r.health.steps < 1500


def hung(x: float, y: float, z: float) -> fb.Mechanism:
    m = fb.Mechanism("pendulum", gravity=(0, 0, -G))
    m.add(fb.Body("rod", mass=1, inertia=(1 / 12, 1 / 12, 1 / 12), position=(x + 0.5, y, z)))
    m.add(fb.Revolute("A", "ground", "rod", at=(x, y, z), axis=(0, 1, 0)))
    return m


@pytest.mark.parametrize("coordinates", LAYERS)
def test_a_pendulum_far_from_the_origin(coordinates):
    """100 000 km away it swings as at home, as far as its coordinates can tell; that they cannot tell more is said."""
    home, away = (hung(x, x, x).simulate(2.0, outputs=5, rtol=1e-8, coordinates=coordinates) for x in (0.0, 1e8))
    assert away["A"].angle == pytest.approx(home["A"].angle, abs=1e-5)
    assert any("1e+08 m from the origin" in text for text in away.health.warnings)
    assert home.health.warnings == ()


@pytest.mark.parametrize("coordinates", LAYERS)
def test_a_four_bar_far_from_the_origin(coordinates):
    x = 1e8
    m = fb.Mechanism("four-bar", planar=True, gravity=(0, -G))
    m.add(planar_rod("crank", (x, 0), (x, 0.25)), planar_rod("coupler", (x, 0.25), (x + 0.5, 0.5)))
    m.add(planar_rod("rocker", (x + 0.625, 0), (x + 0.5, 0.5)))
    m.add(fb.Revolute("A", "ground", "crank", at=(x, 0)), fb.Revolute("B", "crank", "coupler", at=(x, 0.25)))
    m.add(
        fb.Revolute("C", "coupler", "rocker", at=(x + 0.5, 0.5)),
        fb.Revolute("D", "ground", "rocker", at=(x + 0.625, 0)),
    )
    r = m.simulate(1.0, outputs=5, rtol=1e-8, coordinates=coordinates)
    assert np.ptp(r.energy.balance) < 1e-4
    assert any("describe it near the origin" in text for text in r.health.warnings)


def test_rounding_is_named_where_it_stops_a_run():
    """A tolerance that rounding forbids: the run goes on and says so, or the error does."""
    try:
        texts = (
            example("n_four_bar.py", windows=20)
            .simulate(2, outputs=3, rtol=1e-13, atol=1e-15, max_steps=3000)
            .health.warnings
        )
    except fb.SimulationError as error:
        texts = (str(error),)
    assert any("ounding is the limit" in text for text in texts)
