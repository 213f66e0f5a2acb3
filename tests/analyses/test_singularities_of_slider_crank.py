"""Every singular position of the slider-crank, driven at the crank (cases 1) or at the slider (cases 2).

Closed forms: li sin(psi_i) + lj sin(psi_j) = 0, x = li cos(psi_i) + lj cos(psi_j), derived twice and solved at each
position (cases after H. Hahn, Rigid Body Dynamics of Mechanisms 1, 2002, section 3.1.3, with the signs that the
derivation gives).
"""

import math
import runpy

import numpy as np
import pytest

from tests.mechanisms import EXAMPLES

E = runpy.run_path(str(EXAMPLES / "slider_crank_singularities.py"), run_name="example")
LOCK, BOTH = "lock-up", (1.0, -1.0)


@pytest.fixture(scope="module")
def found():
    return {name: p for name, (_, p) in E["cases"]().items()}


def motions(p, rate=0.0, acceleration=0.0):
    return [m for m in p.motions if (m.rate, m.acceleration) == (rate, acceleration)]


def pair(m, what="velocities"):
    return getattr(m, what)["crank.angle"], getattr(m, what)["rod.angle"]


def given(name):
    li, lj, i, j = {**E["CRANK"], **E["SLIDER"]}[name]
    return li, lj, i, j


def closes(name, m, x_driven):
    """The loop and its driver hold in velocities and accelerations, by their derivatives written out."""
    li, lj, i, j = given(name)
    (wi, wj), (ai, aj) = pair(m), pair(m, "accelerations")
    loop = li * (ai * math.cos(i) - wi**2 * math.sin(i)) + lj * (aj * math.cos(j) - wj**2 * math.sin(j))
    x = -li * (ai * math.sin(i) + wi**2 * math.cos(i)) - lj * (aj * math.sin(j) + wj**2 * math.cos(j))
    assert li * wi * math.cos(i) + lj * wj * math.cos(j) == pytest.approx(0.0, abs=1e-9)
    assert loop == pytest.approx(0.0, abs=1e-8)
    rate, acceleration = (-li * wi * math.sin(i) - lj * wj * math.sin(j), x) if x_driven else (wi, ai)
    assert rate == pytest.approx(m.rate, abs=1e-9)
    assert acceleration == pytest.approx(m.acceleration if m.rate == 0.0 else 0.0, abs=1e-8)


def test_all_motions_fulfil_the_loop(found):
    for name, p in found.items():
        for m in p.motions:
            closes(name, m, x_driven=name.startswith("2"))


def test_no_singular_position_of_a_short_crank():
    """1.1: li < lj."""
    m = E["mechanism"](0.3, 0.5, 0.4)
    assert len(m.singularities("drive", (0.0, 2 * math.pi))) == 0


@pytest.mark.parametrize("name", ["1.2a", "1.2b", "1.2c", "1.2d"])
def test_rod_upright_on_a_long_crank(found, name):
    """psi_i' = 0 and psi_j'^2 = s sgn(c) a'' sqrt(li^2 - lj^2) / lj: two where positive, else lock-up."""
    li, lj, i, j = given(name)
    p = found[name]
    sign = math.copysign(1.0, math.sin(j) * math.cos(i))
    assert p.kind == LOCK
    assert not p.branch_point
    assert p.count(rate=1.0) == 0
    assert p.count(acceleration=-sign) == 0
    rates = in_order(pair(m) for m in motions(p, acceleration=sign))
    w = math.sqrt(math.sqrt(li**2 - lj**2) / lj)
    assert np.array(rates) == pytest.approx(np.array([(0, -w), (0, w)]), abs=1e-9)


def test_all_four_are_on_two_curves():
    """The rod stands up or hangs; from either side the crank swings between two of the four positions."""
    li, lj = 0.5, 0.3
    limit = math.asin(lj / li)
    for psi, near in ((0.1, 0.0), (math.pi - 0.1, math.pi)):
        m = E["mechanism"](li, lj, psi, -math.asin(li / lj * math.sin(psi)))
        r = m.singularities("drive", (-1.0, 5.0))
        assert sorted(p.a for p in r) == pytest.approx([near - limit, near + limit], abs=1e-12)


def in_order(pairs):
    """By value, rounding aside: equal first numbers differ in their last digits."""
    return sorted(pairs, key=lambda pair: tuple(round(x, 6) for x in pair))


@pytest.mark.parametrize("name", ["1.3a", "1.3b"])
def test_folded_upright(found, name):
    """Two: psi_j' = +-a'; from rest psi_j'' = +-a''."""
    p = found[name]
    assert p.kind == "bifurcation"
    assert p.branch_point
    assert in_order(pair(m) for m in motions(p, rate=1.0)) == [pytest.approx(x) for x in ((1, -1), (1, 1))]
    for s in BOTH:
        ms = motions(p, acceleration=s)
        assert np.abs([pair(m) for m in ms]).max() < 1e-12
        both = [pytest.approx(x) for x in sorted(((s, s), (s, -s)))]
        assert in_order(pair(m, "accelerations") for m in ms) == both


@pytest.mark.parametrize("name", ["2.1a", "2.1b", "2.2a", "2.2b", "2.3a", "2.3d"])
def test_stretched_and_folded_on_the_line(found, name):
    """psi_i'^2 = -a'' / [li (ci + cj li / lj)], lj cj psi_j' = -li ci psi_i': two for the one sign of a''."""
    li, lj, i, j = given(name)
    ci, cj = math.cos(i), math.cos(j)
    square = -1.0 / (li * (ci + cj * li / lj))
    p = found[name]
    sign = math.copysign(1.0, square)
    assert sign == {"2.1a": -1, "2.2a": -1, "2.3a": -1, "2.1b": 1, "2.2b": 1, "2.3d": 1}[name]
    assert p.kind == LOCK
    assert p.branches[0].side == sign
    assert p.count(rate=1.0) == p.count(acceleration=-sign) == 0
    w = math.sqrt(abs(square))
    expected = sorted((s * w, -s * w * li * ci / (lj * cj)) for s in BOTH)
    assert in_order(pair(m) for m in motions(p, acceleration=sign)) == [pytest.approx(x, rel=1e-9) for x in expected]
    same = expected[0][0] * expected[0][1] > 0.0
    assert same == (name in ("2.1b", "2.2b"))


@pytest.mark.parametrize("name", ["2.3b", "2.3c"])
def test_folded_upright_slider_driven(found, name):
    """One: psi_i' = -psi_j' = -a' / (2 l sin psi_i), from rest the same with a''; and a self-motion."""
    l, _, i, _ = given(name)
    p = found[name]
    w = -1.0 / (2 * l * math.sin(i))
    assert p.kind == "regular passage"
    assert p.self_motion
    assert [pair(m) for m in motions(p, rate=1.0)] == [pytest.approx((w, -w))]
    for s in BOTH:
        (m,) = motions(p, acceleration=s)
        assert np.abs(pair(m)).max() < 1e-12
        assert pair(m, "accelerations") == pytest.approx((s * w, -s * w))
    (still,) = [b for b in p.branches if b.what == "self-motion"]
    assert still.tangent["crank.angle"] == pytest.approx(still.tangent["rod.angle"])


@pytest.mark.parametrize("name", ["2.3e", "2.3f", "2.3g", "2.3h", "2.3i", "2.3j"])
def test_folded_elsewhere(found, name):
    """Lock-up for every motion of the driver; with the driver held crank and rod turn together."""
    p = found[name]
    assert p.kind == "self-motion"
    assert not p.motions
    assert not p.branch_point
    (n,) = p.null_vectors
    assert n["crank.angle"] == pytest.approx(n["rod.angle"])
    assert n["slider.x"] == pytest.approx(0.0, abs=1e-12)


def test_self_motion_leads_to_where_it_branches():
    """Followed all the way round from 2.3e, the folded linkage passes 2.3b and 2.3c; from there the slider moves."""
    m = E["mechanism"](*E["SLIDER"]["2.3e"], "slider.x")
    r = m.singularities("drive", (-1.0, 1.0))
    assert "closed" in r.ends
    assert [p.kind for p in r] == ["self-motion", "regular passage", "regular passage"]
    assert np.abs(r.a).max() < 1e-12
    up = next(p for p in r if p.kind == "regular passage" and p.coordinates["crank.y"] > 0.0)
    on = m.singularities("drive", (-1.0, 1.0), branch=up.branches[0])
    assert on.reached == pytest.approx((-0.6, 0.6), abs=1e-9)
    assert sorted(p.kind for p in on) == ["lock-up", "lock-up", "regular passage", "regular passage"]


def test_the_table_names_every_case(found):
    text = E["table"]({name: ("", p) for name, p in found.items()})
    lines = {line.split()[0]: line for line in text.splitlines()}
    assert {"1.1", *found} <= set(lines)
    assert len(found) == 20
    assert lines["2.3e"].count("lock-up") == 3
    assert "self-motion" in lines["2.3b"]
