"""Differences of two motions: parameters, parts, curves by closed form, events, health; what cannot be compared."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb


def cart(planar: bool = True, body: str = "cart", wall: bool = False, **values: float) -> fb.Mechanism:
    """A cart on a slide, driven as sin(omega t); or free, at 1 m/s, with a wall."""
    m = fb.Mechanism("cart", planar=planar, gravity=(0, 0) if planar else (0, 0, 0), parameters={"omega": 2.0})
    at, axis = ((0, 0), (1, 0)) if planar else ((0, 0, 0), (1, 0, 0))
    m.add(fb.Body(body, mass=values.get("mass", 1.0), inertia=1.0 if planar else (1.0, 1.0, 1.0)))
    m.add(fb.Prismatic("slide", "ground", body, at=at, axis=axis))
    if wall:
        m.add(fb.Initial("slide.displacement", rate=1))
        m.add(fb.Limit("wall", "slide.displacement", upper=values["upper"], restitution=0.5))
    else:
        m.add(fb.Driver("drive", "slide.displacement", "sin(omega*t)"))
    return m


@pytest.fixture(scope="module")
def slow() -> fb.Result:
    return cart().simulate(1.5, outputs=151)


def test_a_curve_differs_as_its_closed_form_does(slow):
    fast = cart().simulate(2.0, outputs=301, parameters={"omega": 2.2})
    d = slow.differences(fast)
    assert d.parameters == {"omega": (2.0, 2.2)}
    assert d.parts == {}
    assert d.interpolated
    c = next(c for c in d.curves if c.name == "cart.x")
    t = np.union1d(slow.t, fast.t[fast.t <= 1.5])
    exact = np.sin(2.2 * t) - np.sin(2.0 * t)
    assert c.at == pytest.approx(t[np.abs(exact).argmax()])
    assert c.largest == pytest.approx(exact[np.abs(exact).argmax()], abs=1e-7)
    assert c.final == pytest.approx(np.sin(3.3) - np.sin(3.0), abs=1e-7)
    told = d.lines()
    assert ("parameter", "omega: 2 -> 2.2") in told
    assert ("differences", "other less first, interpolated at the output times of both") in told


def test_a_motion_does_not_differ_from_itself(slow):
    d = slow.differences(cart().simulate(1.5, outputs=151))
    assert (d.parameters, d.parts, d.events, d.health, d.interpolated) == ({}, {}, {}, {}, False)
    assert all(c.largest == 0.0 for c in d.curves)


def test_the_same_motion_at_other_times_differs_by_the_interpolation_only(slow):
    d = slow.differences(cart().simulate(1.5, outputs=116), "cart.x", "cart.vx")
    assert [c.name for c in d.curves] == ["cart.x", "cart.vx"]
    assert max(abs(c.largest) for c in d.curves) < 1e-5


def test_parts_and_events_that_differ_are_named():
    a = cart(wall=True, upper=0.5).simulate(1, outputs=51)
    b = cart(wall=True, upper=0.6, mass=2.0)
    b.add(fb.CoordinateSpring("spring", "slide.displacement", stiffness=1.0))
    d = a.differences(b.simulate(1, outputs=51, parameters={"omega": 2.0}))
    assert d.parts["cart"] == "mass 1.0 -> 2.0"
    assert d.parts["wall"] == "upper 0.5 -> 0.6"
    assert d.parts["spring"] == "CoordinateSpring, only in the other"
    first, other = d.events["wall", "impact"]
    assert (first.occurrences, other.occurrences) == (1, 1)
    assert first.first == pytest.approx(0.5, abs=1e-9)
    assert other.first > 0.6
    assert "spring.force" not in [c.name for c in d.curves]
    assert "(impact): once at 0.5 s -> once at 0.6" in dict(d.lines())["event"]


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: cart(body="wagon").simulate(1, outputs=5), "no body of the same name .* are cart and wagon"),
        (lambda: cart(planar=False).simulate(1, outputs=5), "'cart' is planar and 'cart' is spatial"),
        (lambda: cart().kinematics(np.linspace(2, 3, 5)), "no time in common: 0 to 1.5 s and 2 to 3 s"),
    ],
)
def test_what_cannot_be_compared_is_refused(slow, make, message):
    with pytest.raises(fb.ModelError, match=message):
        slow.differences(make())


def test_an_unknown_curve_is_refused(slow):
    with pytest.raises(fb.ModelError, match="no curve 'q'"):
        slow.differences(slow, "cart.q")
