"""Play in gears and couplings, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb
from tests.events.one_sided import LAYERS, run, times, wheels

layers = pytest.mark.parametrize("coordinates", LAYERS)
J1, J2, R1, R2, GAP = 0.2, 0.9, 0.05, 0.15, 0.04
RATIO = R2 / R1
MASS = 1 / (1 / J1 + RATIO**2 / J2)  # inertia against a blow between the flanks, as seen at the first wheel


@layers
def test_gears_with_play_rattle(coordinates):
    """From the middle of the play to a flank, then to and fro across the gap, each time by e slower: all in closed form."""
    e, w = 0.7, 3.0
    m = wheels(J1, J2, rates=(w, 0.0))
    m.add(fb.Backlash("play", ("A.angle", "B.angle"), weights=(R1, R2), gap=GAP, restitution=e))
    hits = GAP / 2 / w + np.r_[0.0, np.cumsum(GAP / (w * e ** np.arange(1, 5)))]
    r = run(m, float(hits[-1]) + 1e-3, coordinates, outputs=301)
    assert times(r, "play") == pytest.approx(hits, abs=1e-8)
    p = -(1 + e) * MASS * w
    assert r.events[0].impulses["play"] == pytest.approx(p, rel=1e-9)
    after = (r.t > hits[0]) & (r.t < hits[1])
    assert r["A"].rate[after] == pytest.approx(w + p / J1, abs=1e-9)
    assert r["B"].rate[after] == pytest.approx(RATIO * p / J2, abs=1e-9)
    assert np.abs(r["play"].value).max() <= GAP / 2 + 1e-10
    assert [x.lost for x in r.events] == pytest.approx(
        [0.5 * MASS * w**2 * e ** (2 * k) * (1 - e**2) for k in range(5)], rel=1e-8
    )


@layers
def test_a_reversal_crosses_the_whole_gap(coordinates):
    """T (1 - t) at the first gear, plastic flanks: they part at t = 1, the gap takes (6 J1 gap / T)^(1/3), then a blow."""
    T = 0.8
    m = wheels(J1, J2, torques=(f"{T}*(1 - t)", None))
    m.add(fb.Backlash("play", ("A.angle", "B.angle"), weights=(R1, R2), gap=GAP, middle=-GAP / 2))
    crossed = 1.0 + (6 * J1 * GAP / T) ** (1 / 3)
    r = run(m, crossed + 0.2, coordinates, outputs=401)
    t = r.t
    driven = t < 1
    whole = J1 + J2 / RATIO**2
    assert r["A"].rate[driven] == pytest.approx(T * (t - t**2 / 2)[driven] / whole, abs=1e-9)
    assert r["play"].value[driven] == pytest.approx(GAP / 2, abs=1e-11)
    assert r["play"].force[driven] == pytest.approx(-J2 / RATIO**2 * T * (1 - t[driven]) / whole, abs=1e-8)
    assert times(r, "play")[-2:] == pytest.approx([1.0, crossed], abs=1e-8)
    free = r["play"].value[(t > 1) & (t < crossed)]
    assert np.abs(free).max() < GAP / 2
    rest = t > crossed + 1e-9
    assert r["play"].value[rest] == pytest.approx(-GAP / 2, abs=1e-10), "the other flank"
    assert (r["play"].closed[rest] == 1.0).all()
    struck = MASS * T * (crossed - 1) ** 2 / 2 / J1
    assert r.events[-1].impulses["play"] == pytest.approx(struck, rel=1e-7)
    assert np.abs(r.energy.balance).max() < 1e-8


@layers
def test_elastic_flanks(coordinates):
    """Pressed for pi sqrt(m/k), away with the speed it came with; the whole gap free in between."""
    k, w = 500.0, 3.0
    m = wheels(J1, J2, rates=(w, 0.0))
    m.add(fb.Backlash("play", ("A.angle", "B.angle"), weights=(R1, R2), gap=GAP, stiffness=k))
    on, pressed = GAP / 2 / w, np.pi * np.sqrt(MASS / k)
    wanted = [on, on + pressed, on + pressed + GAP / w, on + 2 * pressed + GAP / w]
    r = run(m, wanted[-1] + 1e-3, coordinates, outputs=301)
    assert times(r, "play") == pytest.approx(wanted, abs=1e-9)
    assert r["play"].rate[-1] == pytest.approx(w, abs=1e-8)
    assert np.abs(r.energy.balance).max() < 1e-9


@layers
def test_play_of_one_coordinate_is_a_pair_of_stops(coordinates):
    m = wheels(0.5, rates=(2.0,))
    m.add(fb.Backlash("key", ("A.angle",), gap=0.2, restitution=1))
    r = run(m, 1.0, coordinates)
    assert times(r, "key") == pytest.approx([0.05 + 0.1 * k for k in range(10)], abs=1e-9)


@pytest.mark.parametrize("elastic", [{}, {"stiffness": 1e5}])
def test_play_and_a_stop_of_one_coordinate_count_it_each_their_own_way(elastic):
    """Play counts from where it is drawn, at 1 m; the stop at 1.005 m lies within it and is reached first."""
    m = fb.Mechanism("slide", planar=True, gravity=None)
    m.add(fb.Body("b", mass=1, inertia=1), fb.Prismatic("P", "ground", "b", at=(0, 0), axis=(1, 0), displacement=1.0))
    m.add(fb.Initial("P.displacement", rate=0.1), fb.Backlash("play", ["P.displacement"], gap=0.02, **elastic))
    m.add(fb.Limit("stop", "P.displacement", upper=1.005))
    r = m.simulate(0.3, outputs=4)
    assert [e.t for e in r.events] == pytest.approx([0.05], rel=1e-9)
    assert r["play"].value[-1] == pytest.approx(0.005, rel=1e-9)
    assert r["stop"].value[-1] == pytest.approx(1.005, rel=1e-9)


def test_a_gear_pair_says_where_its_play_is():
    with pytest.raises(fb.ModelError, match=r"unknown field 'backlash'.*gears with play are a Backlash in its place"):
        fb.GearPair("mesh", "A", "B", teeth=(20, 60), backlash="0.2 deg")
