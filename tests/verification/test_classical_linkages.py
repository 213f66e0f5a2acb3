"""Linkages of the examples in closed form: legs, six-bars, Hoeken's line, pantograph, couplings, Bennett's linkage."""

from __future__ import annotations

import runpy

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from tests.mechanisms import EXAMPLES, example

LINKAGES = runpy.run_path(str(EXAMPLES / "linkages.py"))
EXCAVATOR = runpy.run_path(str(EXAMPLES / "excavator.py"))
SCHATZ = runpy.run_path(str(EXAMPLES / "schatz.py"))
BENNETT = runpy.run_path(str(EXAMPLES / "bennett.py"))


def third(a: np.ndarray, b: np.ndarray, r: float, s: float, side: int) -> np.ndarray:
    """Complex point at r from a and s from b, by the law of cosines in the triangle."""
    d = b - a
    turn = np.arccos((abs(d) ** 2 + r**2 - s**2) / (2 * r * abs(d)))
    return a + r * d / abs(d) * np.exp(1j * side * turn)


@pytest.mark.parametrize("name", ["jansen", "klann", "watt", "stephenson"])
def test_points_of_a_linkage_of_dyads(name):
    """Every point, over a whole turn, one dyad after the other."""
    linkage, m = LINKAGES["LINKAGES"][name], LINKAGES["mechanism"](name)
    assert m.mobility().freedoms == 0
    t = np.linspace(0, 2, 73)
    run = m.kinematics(t)
    crank = next(iter(linkage.bars.values()))
    at = {p: complex(*xy) for p, xy in linkage.given.items()}
    at[crank[1]] = at[crank[0]] + (at[crank[1]] - at[crank[0]]) * np.exp(1j * np.pi * t)
    for p, a, r, b, s, side in linkage.dyads:
        at[p] = third(at[a], at[b], r, s, side)
    for bar, points in linkage.bars.items():
        for p in points:
            found = run[f"{bar} {p}"].position @ [1, 1j]
            np.testing.assert_allclose(found, linkage.unit * at[p] + 0 * t, atol=1e-12)


def test_the_foot_of_jansens_leg_stays_on_the_ground_for_more_than_a_third_of_a_turn():
    run = LINKAGES["mechanism"]("jansen").kinematics(np.linspace(0, 2, 721))
    x, y = run["foot S"].position.T
    stands = y < y.min() + 0.01 * np.ptp(x)
    assert 0.35 < stands.mean() < 0.45
    assert np.ptp(x[stands]) > 0.65 * np.ptp(x)


def test_the_foot_of_klanns_leg_stays_near_the_ground_for_half_a_turn():
    """Half a turn in contact, the other half lifted: two legs at opposite cranks walk (US patent 6260862)."""
    run = LINKAGES["mechanism"]("klann").kinematics(np.linspace(0, 2, 721))
    x, y = run["leg S"].position.T
    stands = y < y.min() + 0.15 * np.ptp(y)
    assert 0.45 < stands.mean() < 0.65
    assert np.ptp(x[stands]) > 0.95 * np.ptp(x)


def test_the_pantograph_enlarges_three_times():
    run = LINKAGES["mechanism"]("pantograph").kinematics(np.linspace(0, 2, 73))
    p, q = run["crank P"].position, run["forearm Q"].position
    np.testing.assert_allclose(p @ [1, 1j], 0.15 + 0.2j + 0.04 * np.exp(1j * np.pi * run.t), atol=1e-12)
    np.testing.assert_allclose(q, 3 * p, atol=1e-12)


def test_schmidts_coupling_keeps_the_speed_and_its_middle_disk_turns_about_a_fixed_point():
    """Two rows of each three links are redundant; the middle disk's centre is at a link's length from both shafts."""
    m = LINKAGES["mechanism"]("schmidt")
    report = m.mobility()
    assert (report.freedoms, report.redundancy) == (0, 2)
    run = m.kinematics(np.linspace(0, 2, 73))
    np.testing.assert_allclose(run["C.angle"], run["A.angle"], atol=1e-12)
    np.testing.assert_allclose(run["middle disk"].position, np.tile([0.15, 0.2], (73, 1)), atol=1e-12)
    np.testing.assert_allclose(
        run["link 0"].position @ [1, 1j], 0.075 + 0.1j + 0.24 * np.exp(1j * np.pi * run.t), atol=1e-12
    )


def test_hoekens_line_is_straight_to_a_quarter_percent_over_half_a_turn():
    """Its point is P = B + 2 (C - B), and the coupler is as long as the rocker."""
    t = np.linspace(0, 2, 721)
    run = LINKAGES["mechanism"]("hoeken").kinematics(t)
    b = -0.1 * np.exp(1j * np.pi * t)
    c = third(b, 0.2 + 0 * t, 0.25, 0.25, 1)
    x, y = run["coupler P"].position.T
    np.testing.assert_allclose(x + 1j * y, b + 2 * (c - b), atol=1e-12)
    straight = np.cos(np.pi * t) > 0
    assert np.ptp(y[straight]) / np.ptp(x[straight]) < 0.0025


def test_oldhams_coupling_keeps_the_speed_and_its_disk_circles_twice_as_fast():
    run = example("oldham.toml").simulate(1.5, outputs=151)
    np.testing.assert_allclose(run["driven shaft.angle"], run["driving shaft.angle"], atol=1e-12)
    np.testing.assert_allclose(run["disk.angle"], 2 * np.pi * run.t, atol=1e-12)
    centre = run["disk"].position @ [1, 1j] - 0.01  # on the circle over the two shafts
    np.testing.assert_allclose(centre, -0.01 * np.exp(4j * np.pi * run.t), atol=1e-12)
    np.testing.assert_allclose(run["motor.effort"], 0.5 * 2 * np.pi, rtol=1e-9)


def test_bennetts_linkage_moves_against_the_count():
    """tan(a/2) tan(b/2) = sin((beta + alpha)/2) / sin((beta - alpha)/2); opposite angles are opposite."""
    m, ratio = BENNETT["mechanism"](), BENNETT["RATIO"]
    free = m.changed({"motor": None}).mobility()
    assert (free.freedoms, free.geometry.gruebler, free.geometry.generic) == (1, -2, 0)
    assert free.redundancy == 3
    run = m.kinematics(np.linspace(0, 2, 181))
    first = np.radians(100) + run["A.angle"]
    second = 2 * np.arctan(ratio / np.tan(np.radians(50))) + run["B.angle"]
    sines, cosines = (f(first / 2) * f(second / 2) for f in (np.sin, np.cos))
    np.testing.assert_allclose(sines, ratio * cosines, atol=1e-12)
    np.testing.assert_allclose(run["C.angle"], -run["A.angle"], atol=1e-12)
    np.testing.assert_allclose(run["D.angle"], -run["B.angle"], atol=1e-12)


def test_an_excavators_arm_follows_its_cylinders():
    """One triangle after the other: boom, arm, rocker, bucket; the cylinders do the work of the motion."""
    m = EXCAVATOR["mechanism"]()
    assert m.mobility().freedoms == 0
    run = m.kinematics(np.linspace(0, EXCAVATOR["PERIOD"], 81))
    P = {name: complex(*xy) for name, xy in EXCAVATOR["POINTS"].items()}
    length = {name: run[f"{name} cylinder.length"] for name in EXCAVATOR["CYLINDERS"]}

    p1 = third(P["A"], P["c1"], abs(P["p1"] - P["A"]), length["boom"], 1)
    boom = (p1 - P["A"]) / (P["p1"] - P["A"])
    B, c2 = (P["A"] + boom * (P[x] - P["A"]) for x in ("B", "c2"))
    p2 = third(B, c2, abs(P["p2"] - P["B"]), length["arm"], -1)
    arm = (p2 - B) / (P["p2"] - P["B"])
    c3, D, E = (B + arm * (P[x] - P["B"]) for x in ("c3", "D", "E"))
    F = third(E, c3, abs(P["F"] - P["E"]), length["bucket"], -1)
    G = third(F, D, abs(P["G"] - P["F"]), abs(P["G"] - P["D"]), 1)
    T = D + (G - D) / (P["G"] - P["D"]) * (P["T"] - P["D"])
    for name, point in (("boom p1", p1), ("arm p2", p2), ("rocker F", F), ("link G", G), ("bucket T", T)):
        np.testing.assert_allclose(run[name].position @ [1, 1j], point, atol=1e-11)
    power = sum(run[f"{name} cylinder_drive.effort"] * run[f"{name} cylinder.length_rate"] for name in length)
    work = CubicSpline(run.t, power).antiderivative()(run.t)
    energy = run.energy.kinetic + run.energy.potential
    np.testing.assert_allclose(work, energy - energy[0], atol=1e-4 * np.ptp(energy))


def test_schatzs_linkage_moves_against_the_count_and_turns_round():
    """cos(b) = sqrt(3)/2 cos(a) of the first two hinge angles, which are measured as in its figure."""
    m, drawn = SCHATZ["mechanism"](), SCHATZ["drawn"]()
    free = m.changed({"motor": None}).mobility()
    assert (free.freedoms, free.geometry.gruebler, free.redundancy) == (1, 0, 1)
    run = m.kinematics(np.linspace(0, 4, 181))
    first, second = drawn[0] + run["A.angle"], drawn[1] + run["B.angle"]
    np.testing.assert_allclose(np.cos(second), np.sqrt(3) / 2 * np.cos(first), atol=1e-12)
    assert abs(run["F.angle"][-1]) == pytest.approx(4 * np.pi, abs=1e-10)  # the other shaft turns as often
