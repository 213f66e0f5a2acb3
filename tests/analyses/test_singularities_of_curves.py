"""Points of plane algebraic curves, whose kind every textbook knows, as positions of a driven mechanism.

Body P moves in the plane; body Q's place on the x axis is told twice, as two functions of where P is. They agree on the
curve f(x, y) = g(x, y), and the driver is x or y.
"""

import pytest

import flyball as fb


def curve(f: str, g: str, at=(0.0, 0.0), driven: str = "x") -> fb.Mechanism:
    m = fb.Mechanism(f"{f} = {g}", planar=True)
    start = float(eval(f, {"x": at[0], "y": at[1]}))
    m.add(fb.Body("P", mass=1, inertia=1, position=at), fb.Body("Q", mass=1, inertia=1, position=(start, 0)))
    m.add(fb.Sensor("x", "P.x"), fb.Sensor("y", "P.y"))
    m.add(fb.Driver("one", "Q.x", f), fb.Driver("two", "Q.x", g), fb.Driver("level", "Q.y", 0.0))
    m.add(fb.Driver("Q upright", "Q.angle", 0.0), fb.Driver("P upright", "P.angle", 0.0))
    m.add(fb.Driver("motor", f"P.{driven}", at["xy".index(driven)]))
    return m


def slopes(p):
    return sorted(round(b.tangent["P.y"], 5) + 0.0 for b in p.branches)


def test_crunode():
    """y^2 = x^2 (1 + x): two branches of slopes +-1 and second derivatives +-1; an end at x = -1."""
    r = curve("y**2", "x**2*(1 + x)", at=(0.44, 0.528)).singularities("motor", (-2, 1))
    node, end = sorted(r, key=lambda p: -p.a)
    assert (node.a, end.a) == pytest.approx((0.0, -1.0), abs=1e-10)
    assert (node.kind, end.kind) == ("bifurcation", "lock-up")
    assert slopes(node) == [-1.0, 1.0]
    bends = sorted(m.accelerations["P.y"] for m in node.motions if m.rate)
    assert bends == pytest.approx([-1.0, 1.0], abs=1e-9)
    assert end.branches[0].side == 1
    assert sorted(m.velocities["P.y"] for m in end.motions) == pytest.approx([-(0.5**0.5), 0.5**0.5], abs=1e-9)


def test_acnode():
    """y^2 = -x^2: a single point."""
    (p,) = curve("y**2", "-x**2").singularities("motor", (-1, 1))
    assert p.isolated
    assert p.kind == "lock-up"


@pytest.mark.parametrize("at", [(0.0, 0.0), (-0.5, 0.25)])
def test_tacnode(at):
    """y^2 = x^4: two branches touch; the velocity level does not tell them apart, accelerations +-2 do."""
    (p,) = curve("y**2", "x**4", at).singularities("motor", (-1, 1))
    assert p.a == pytest.approx(0.0, abs=1e-5)
    assert p.kind == "bifurcation"
    assert not p.decided
    assert p.count(rate=1.0) == 2
    assert slopes(p) == pytest.approx([0.0, 0.0], abs=3e-5)
    assert sorted(m.accelerations["P.y"] for m in p.motions if m.rate) == pytest.approx([-2.0, 2.0], abs=1e-4)


def test_cusp():
    """y^2 = x^3: it goes one way only; from rest there are two motions, out on the one half or on the other."""
    r = curve("y**2", "x**3").singularities("motor", (-1, 1))
    (p,) = r
    assert p.kind == "lock-up"
    assert [(b.what, b.side) for b in p.branches] == [("cusp", 1)]
    assert (p.count(rate=1.0), p.count(acceleration=1.0), p.count(acceleration=-1.0)) == (0, 2, 0)
    assert (r.values["P.y"].min(), r.values["P.y"].max()) == pytest.approx((-1.0, 1.0), abs=1e-6)  # both halves


def test_triple_point():
    """y (y^2 - x^2) = 0: derivatives of second order vanish; three lines."""
    (p,) = curve("y*(y**2 - x**2)", "0*y").singularities("motor", (-1, 1))
    assert p.kind == "bifurcation"
    assert slopes(p) == pytest.approx([-1.0, 0.0, 1.0], abs=1e-5)


@pytest.mark.parametrize("start", [(0.0, 0.0), (0.5, 0.125)])
def test_inflection(start):
    """y = x^3 driven at y: its Jacobian loses rank without a change of sign; y passes, at velocities without bound."""
    (p,) = curve("y", "x**3", start, "y").singularities("motor", (-1, 1))
    assert p.a == pytest.approx(0.0, abs=1e-12)
    assert [(b.what, b.order) for b in p.branches] == [("passes, unbounded", 3)]
    assert not p.branch_point
    assert not p.motions


def test_two_folds_in_one_step():
    """y = x^3 - e x: two lock-ups a hundredth apart."""
    e = 3e-4
    x = (e / 3) ** 0.5
    r = curve("y", f"x**3 - {e}*x", (0.5, 0.125 - 0.5 * e), "y").singularities("motor", (-1, 1))
    assert sorted(p.a for p in r) == pytest.approx([x**3 - e * x, -(x**3) + e * x], abs=1e-12)
    assert [p.kind for p in r] == ["lock-up", "lock-up"]


def test_flat_end():
    """y = x^4: the driver turns back at fourth order, with no finite velocity."""
    (p,) = curve("y", "x**4", driven="y").singularities("motor", (-1, 1))
    assert [(b.what, b.order, b.side) for b in p.branches] == [("turns back", 4, 1)]
    assert p.count(acceleration=1.0) == 0
