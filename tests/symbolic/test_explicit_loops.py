"""Loops in closed form: against the laws of cosines and sines over the whole range, in both modes of assembly."""

import numpy as np
import pytest

import flyball as fb
from flyball.expression_graph.graph import Graph, Symbol, evaluate
from flyball.symbolic.explicit.closed_form_loops import solve_single
from flyball.symbolic.explicit.definitions import Probe
from tests.analyses.linkages import whitworth
from tests.mechanisms import example, planar_rod
from tests.symbolic.explicit_made import differs, states_of


def crossing(p, r, q, s, side):
    """Intersection of two circles, on one side of the line from p to q."""
    d = q - p
    size = np.sqrt((d * d).sum(0))
    x = (size**2 + r * r - s * s) / (2 * size)
    e = d / size
    return p + x * e + side * np.sqrt(r * r - x * x) * np.array([-e[1], e[0]])


def four_bar(lengths, side, start=1.0) -> fb.Mechanism:
    """Ground, crank, coupler, rocker; the coupler's end left (1) or right (-1) of the line from crank to rocker."""
    d, a, b, c = lengths
    A, D = np.zeros(2), np.array([d, 0.0])
    B = a * np.array([np.cos(start), np.sin(start)])
    C = crossing(B, b, D, c, side)
    m = fb.Mechanism("four-bar", planar=True, gravity=(0, -9.81))
    m.add(planar_rod("crank", A, B), planar_rod("coupler", B, C, 1.5), planar_rod("rocker", D, C, 0.8))
    m.add(fb.Revolute("A", "ground", "crank", at=A, angle=start), fb.Revolute("B", "crank", "coupler", at=B))
    m.add(fb.Revolute("C", "coupler", "rocker", at=C), fb.Revolute("D", "ground", "rocker", at=D))
    return m


def coordinate(s, name, first):
    """A coordinate where the independent one is as given (an array)."""
    return s.explicit[name].at({s.states[0]: first})


FOUR_BARS = {
    "crank and rocker": (0.5, 0.2, 0.5, 0.4),
    "two cranks": (0.2, 0.5, 0.45, 0.4),
    "two rockers (Grashof)": (0.5, 0.4, 0.2, 0.45),
    "not Grashof": (0.5, 0.4, 0.45, 0.3),
}


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("lengths", FOUR_BARS.values(), ids=FOUR_BARS)
def test_four_bar(lengths, side):
    """The rocker's angle over all that the crank can do; it goes on without jumps."""
    d, a, b, c = lengths
    start = np.arccos(np.clip((a * a + d * d - (0.6 * (b + c) + 0.4 * abs(b - c)) ** 2) / (2 * a * d), -0.9, 0.9))
    m = four_bar(lengths, side, start)
    s = states_of(m, "joint", ["A.angle"])
    assert s.implicit == () and not s.explicit.notes
    phi = np.linspace(start - 2 * np.pi, start + 2 * np.pi, 401)
    B, D = a * np.array([np.cos(phi), np.sin(phi)]), np.array([[d], [0.0]])
    with np.errstate(all="ignore"):
        C = crossing(B, b, D, c, side)
        rocker = np.arctan2(C[1] - D[1], C[0] - D[0])
        w = coordinate(s, "D.angle", phi)
    there = np.isfinite(rocker)
    first = crossing(a * np.array([[np.cos(start)], [np.sin(start)]]), b, D, c, side)
    drawn = np.arctan2(first[1] - D[1], first[0] - D[0])
    assert there.all() == (min(lengths) in (a, d) and min(lengths) + max(lengths) < sum(lengths) / 2)
    assert np.isfinite(w[there]).all()
    np.testing.assert_allclose(np.exp(1j * (w + drawn))[there], np.exp(1j * rocker)[there], atol=2e-13)
    middle = len(phi) // 2
    reach = middle + np.argmin(np.r_[there[middle:], False])
    assert np.abs(np.diff(w[middle:reach])).max() < 1.0  # no jumps
    if min(lengths) == d:
        assert w[-1] - w[middle] == pytest.approx(2 * np.pi, abs=1e-12)


@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_accelerations_of_a_four_bar(side, coordinates):
    m = four_bar((0.5, 0.2, 0.5, 0.4), side)
    name = "A.angle" if coordinates == "joint" else "crank.angle"
    s = states_of(m, coordinates, [name])
    rng = np.random.default_rng(0)
    for x in rng.uniform(-3, 3, (100, 2)):
        assert differs(m, s, coordinates, x) < 1e-12


def slider_crank(offset=0.05) -> fb.Mechanism:
    """Crank r about the origin, rod l, slider on the line y = h; drawn with the crank upright; lengths are parameters."""
    m = fb.Mechanism("slider-crank", planar=True, gravity=(0, -9.81), parameters={"r": 0.2, "l": 0.5, "h": offset})
    x = "sqrt(l**2 - (r - h)**2)"
    m.add(fb.Body("crank", mass=1, inertia=0.01, position=(0, "r/2")))
    m.add(fb.Body("rod", mass=2, inertia=0.03, position=(f"{x}/2", "(r + h)/2")))
    m.add(fb.Body("slider", mass=3, inertia=0.01, position=(x, "h")))
    m.add(fb.Revolute("O", "ground", "crank", at=(0, 0)), fb.Revolute("A", "crank", "rod", at=(0, "r")))
    m.add(fb.Revolute("B", "rod", "slider", at=(x, "h")))
    m.add(fb.Prismatic("guide", "ground", "slider", at=(x, "h"), axis=(1, 0)))
    return m


@pytest.mark.parametrize("numbers", [{}, {"r": 0.15, "l": 0.4, "h": -0.07}])
def test_slider_crank_for_any_lengths(numbers):
    """x = r cos phi + sqrt(l^2 - (r sin phi - h)^2): one formula for other values of the lengths too."""
    m = slider_crank()
    s = states_of(m, "joint", ["O.angle"])
    assert s.implicit == ()
    r, l, e = ({"r": 0.2, "l": 0.5, "h": 0.05} | numbers).values()
    drawn = np.sqrt(l * l - (r - e) ** 2)
    for turn in np.linspace(0, 2 * np.pi, 30):
        phi = turn + np.pi / 2
        expected = r * np.cos(phi) + np.sqrt(l * l - (r * np.sin(phi) - e) ** 2)
        found = s.explicit["guide.displacement"].at(s.point([turn, 0.0], parameters=numbers))
        assert found + drawn == pytest.approx(expected, abs=1e-14)
    for x in np.random.default_rng(1).uniform(-3, 3, (30, 2)):
        assert differs(m, s, "joint", x) < 1e-12


def test_slider_drives_the_crank():
    """The slider is independent: the crank's angle is in the branch that is drawn, up to the dead centre."""
    m = slider_crank(0.0)
    s = states_of(m, "joint", ["guide.displacement"])
    assert s.implicit == ()
    drawn = np.sqrt(0.5**2 - 0.2**2)
    for move in (-0.1, 0.0, 0.2):
        x = drawn + move
        phi = np.arccos((0.2**2 + x * x - 0.5**2) / (2 * 0.2 * x))
        assert coordinate(s, "O.angle", move) + np.pi / 2 == pytest.approx(phi, abs=1e-13)
    assert np.isnan(coordinate(s, "O.angle", 0.7 - drawn + 1e-3))


def test_inverted_slider_crank():
    """Whitworth's quick return: the lever's angle is that of the crank pin."""
    r, d, start = 0.1, 0.3, 0.5
    m = whitworth()
    m.drivers.clear()
    s = states_of(m, "joint", ["C.angle"])
    assert s.implicit == ()
    first = np.arctan2(d + r * np.sin(start), r * np.cos(start))
    for turn in np.linspace(-6, 6, 41):
        phi = start + turn
        lever = np.arctan2(d + r * np.sin(phi), r * np.cos(phi))
        assert coordinate(s, "O.angle", phi) == pytest.approx(lever - first, abs=1e-13)
    for x in np.random.default_rng(1).uniform(-3, 3, (30, 2)):
        assert differs(m, s, "joint", x) < 1e-12


@pytest.mark.parametrize("name", ["andrews.toml", "peaucellier.toml", "quick_return.toml", "slider_crank.toml"])
def test_mechanisms_of_dyads(name):
    """Six-bars and more, dyad by dyad, at states about the drawn one."""
    m = example(name)
    m.drivers.clear()
    s = states_of(m, "joint")
    assert s.implicit == ()
    rng = np.random.default_rng(0)
    for move in rng.uniform(-0.05, 0.05, (10, 2)):
        assert differs(m, s, "joint", s.start + move) < 1e-11


@pytest.mark.parametrize("drawn", [1.2, -5.0])
@pytest.mark.parametrize("leading", ["a parameter", 2.0, 0.5])
def test_a_quadratic_with_any_leading_coefficient(leading, drawn):
    """p w^2 + 3 w = 5 + t: (-3 + sqrt(9 + 4 p (5 + t))) / (2 p), or with the other sign, whichever is drawn."""
    g = Graph()
    given = leading == "a parameter"
    p = g.symbol(Symbol("p", "parameter"), 2.0) if given else leading
    t, w = (g.symbol(Symbol(n, "coordinate")) for n in "tw")
    found = solve_single(p * w * w + 3.0 * w - (5.0 + t), w, Probe({"w": drawn, "t": 0.0})).value
    for a, more in ((2.0, 0.0), (0.5, 1.0), (7.0, -2.0)) if given else ((leading, 0.0), (leading, 4.0)):
        root = np.copysign(np.sqrt(9.0 + 4.0 * a * (5.0 + more)), drawn)
        assert evaluate([found], {"p": a, "t": more})[0] == pytest.approx((root - 3.0) / (2.0 * a), rel=1e-14)


@pytest.mark.parametrize("drawn", [1.0, -1.0])
def test_a_quadratic_under_a_root_with_a_factor(drawn):
    """3 sqrt(w^2 + 4) = 7 + t: w^2 = (7 + t)^2 / 9 - 4."""
    g = Graph()
    t, w = (g.symbol(Symbol(n, "coordinate")) for n in "tw")
    found = solve_single(3.0 * (w * w + 4.0).sqrt() - (7.0 + t), w, Probe({"w": drawn * 1.2, "t": 0.0})).value
    for more in (0.0, 2.0):
        wanted = np.copysign(np.sqrt((7.0 + more) ** 2 / 9.0 - 4.0), drawn)
        assert evaluate([found], {"t": more})[0] == pytest.approx(wanted, rel=1e-14)
