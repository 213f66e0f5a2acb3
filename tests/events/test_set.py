"""Parameters that an event sets: what would put a part instantaneously is refused, all else has its forces."""

from __future__ import annotations

import math

import numpy as np
import pytest

import flyball as fb

LAYERS = ("joint", "absolute")
G = 10.0


@pytest.fixture(params=LAYERS)
def layer(request):
    return request.param


def mechanism(**parameters: float) -> fb.Mechanism:
    return fb.Mechanism("set", planar=True, gravity=(0, -G), parameters=parameters)


def swing(stiffness: float | None = None) -> fb.Mechanism:
    """A bob of 1 kg that swings on a line of 1 m."""
    m = mechanism(L=1.0)
    m.add(fb.Body("bob", mass=1, inertia=0.01, position=(0, -1), velocity=(2, 0)))
    m.add(fb.Rope("line", ["ground", "bob"], at=[(0, 0), (0, -1)], length="L", stiffness=stiffness))
    return m


def drop(start: float = 1.0, **fields: float) -> fb.Mechanism:
    """A body that falls on a stop at lo."""
    m = mechanism(lo=0.0)
    m.add(fb.Body("p", mass=1, inertia=0.01, position=(0, start)))
    m.add(fb.Limit("floor", "p.y", lower="lo", **fields))
    return m


def refused(m: fb.Mechanism, said: str, layer: str, t: float = 0.3) -> fb.Result:
    """The motion up to the event, at which the set is refused."""
    with pytest.raises(fb.SimulationError, match=said) as caught:
        m.simulate(1, outputs=11, coordinates=layer)
    assert caught.value.t == pytest.approx(t, abs=1e-9)
    r = caught.value.result
    assert r.final[0] == caught.value.t
    assert r.t[-1] > t - 0.1001
    assert r.energy.drift < 1e-6
    return r


def test_a_taut_rope_gets_no_shorter(layer):
    m = swing()
    m.add(fb.Event("pull", "t - 0.3", do=fb.Set("L", 0.8)))
    said = (
        r"at t = 0\.3 s Set of 'L' in Event 'pull' would put Rope 'line' instantaneously, by 0\.2 m: its length is "
        r"1 m and must be at most 0\.8 m\."
    )
    r = refused(m, said, layer)
    assert np.hypot(r["bob.x"], r["bob.y"]) == pytest.approx(1.0, abs=1e-8)


def test_a_taut_rope_that_gets_longer_goes_slack(layer):
    """The bob flies on, with what speed it had: x = x0 + v t, until the line of 1.2 m is taut."""
    m = swing()
    m.add(fb.Event("slack", "t - 0.3", do=fb.Set("L", 1.2)), fb.Event("taut", "line.length > 1.2", do=fb.Stop()))
    r = m.simulate(1, outputs=1001, coordinates=layer, rtol=1e-10)
    cut = r.events["slack"][0].after
    x, y, vx, vy = (float(cut[f"bob.{k}"]) for k in ("x", "y", "vx", "vy"))
    late = (r.t > 0.3) & (r.t < r.t[-1])
    dt = r.t[late] - 0.3
    assert r["bob.x"][late] == pytest.approx(x + vx * dt, abs=1e-7)
    assert r["bob.y"][late] == pytest.approx(y + vy * dt - G / 2 * dt**2, abs=1e-7)
    assert np.abs(r["line.tension"][late]).max() == 0.0
    assert r.energy.drift < 1e-8


def test_an_elastic_rope_gets_its_energy(layer):
    """Its free length is a number of a force: 0.2 m shorter, it stores k d^2 / 2 more."""
    m = swing(stiffness=1000.0)
    m.add(fb.Event("pull", "t - 0.3", do=fb.Set("L", 0.8)))
    r = m.simulate(0.6, outputs=61, coordinates=layer, rtol=1e-10)
    now = r.events["pull"][0]
    d = float(now.before["line.length"]) - 1.0
    assert r["energy.event_work"][-1] == pytest.approx(500 * ((d + 0.2) ** 2 - d**2), rel=1e-9)
    assert float(now.after["line.tension"]) == pytest.approx(1000 * (d + 0.2), rel=1e-9)
    assert r.energy.drift < 1e-5


def test_a_stop_does_not_lift_what_is_below_it(layer):
    m = drop()
    m.add(fb.Event("up", "t - 0.3", do=fb.Set("lo", 0.9)))
    r = refused(m, r"Limit 'floor' instantaneously, by 0\.35 m: 'p\.y' is 0\.55 m and must be at least 0\.9", layer)
    assert r["p.y"] == pytest.approx(1 - G / 2 * r.t**2, abs=1e-9)


def test_a_stop_that_is_left_where_nothing_is_beyond_it(layer):
    m = drop()
    m.add(fb.Event("up", "t - 0.3", do=fb.Set("lo", 0.2)))
    r = m.simulate(0.6, outputs=61, coordinates=layer, rtol=1e-10)
    hit = math.sqrt(2 * 0.8 / G)
    assert r.events["floor"].t == pytest.approx([hit], abs=1e-9)
    assert r["p.y"][-1] == pytest.approx(0.2, abs=1e-9)


@pytest.mark.parametrize(("to", "fine"), [(-0.5, True), (0.1, False)])
def test_a_stop_that_something_rests_on(layer, to, fine):
    """Lowered by 0.5 m, what rested on it falls on it again; raised, it would be lifted in no time."""
    m = drop(start=0.0)
    m.add(fb.Event("move", "t - 0.3", do=fb.Set("lo", to)))
    if not fine:
        r = refused(m, r"by 0\.1 m: 'p\.y' is 0 m and must be at least 0\.1 m", layer)
        assert r["p.y"] == pytest.approx(0.0, abs=1e-12)
        return
    r = m.simulate(1, outputs=101, coordinates=layer)
    y = np.where(r.t < 0.3, 0.0, np.maximum(-0.5, -G / 2 * (r.t - 0.3) ** 2))
    assert r["p.y"] == pytest.approx(y, abs=1e-8)
    assert r.events["floor"].t[-1] == pytest.approx(0.3 + math.sqrt(0.1), abs=1e-9)
    assert r.energy.drift < 1e-9


def test_angles_are_told_in_degrees_too(layer):
    m = mechanism(hi=1.0)
    m.add(fb.Body("b", mass=1, inertia=1), fb.Revolute("A", "ground", "b", at=(0, 0)))
    m.add(fb.Limit("end", "A.angle", upper="hi"), fb.Initial("A.angle", value="pi/3 - 0.3", rate=1.0))
    m.add(fb.Event("in", "t - 0.3", do=fb.Set("hi", "30 deg")))
    m.parameters["hi"] = 2.0
    refused(m, r"'A\.angle' is 1\.0472 rad \(60 deg\) and must be at most 0\.523599 rad \(30 deg\)", layer)


def test_a_play_and_a_tooth(layer):
    """A play that closes on what is in it; a pawl whose tooth is not there any more, or is one of twice as many."""
    m = mechanism(gap=0.4)
    m.add(fb.Body("b", mass=1, inertia=1), fb.Prismatic("A", "ground", "b", at=(0, 0), axis=(1, 0)))
    m.add(fb.Body("c", mass=1, inertia=1), fb.Prismatic("B", "ground", "c", at=(0, 1), axis=(1, 0)))
    m.add(fb.Backlash("play", ["A.displacement", "B.displacement"], gap="gap"), fb.Initial("A.displacement", rate=0.5))
    m.add(fb.Event("close", "t - 0.3", do=fb.Set("gap", 0.1)))
    refused(m, r"Backlash 'play' instantaneously, by 0\.1 m: the play of A\.displacement, B\.displacement", layer)


@pytest.mark.parametrize(("teeth", "fine"), [(24, True), (10, False)])
def test_a_tooth_that_holds(layer, teeth, fine):
    """A weight hangs on a tooth at 0; it stays there if that is a tooth of the new wheel."""
    m = mechanism(n=12.0, first=0.0)
    m.add(fb.Body("b", mass=1, inertia=1, position=(1, 0)), fb.Revolute("A", "ground", "b", at=(0, 0)))
    m.add(fb.Ratchet("pawl", "A.angle", teeth="n", tooth="first"))
    m.add(fb.Event("other", "t - 0.3", do=[fb.Set("n", teeth), fb.Set("first", 0 if fine else 0.05)]))
    if not fine:
        refused(m, r"Ratchet 'pawl' instantaneously, by 0\.05 rad: it is locked between teeth", layer)
        return
    r = m.simulate(0.6, coordinates=layer)
    assert r["A.angle"] == pytest.approx(0.0, abs=1e-9)


def test_a_pin_and_a_driver(layer):
    """Where a joint is, and how far a driver goes."""
    m = mechanism(x=0.0)
    m.add(fb.Body("b", mass=1, inertia=1, position=(1, 0)))
    m.add(fb.Frame("P", "ground", position=("x", 0)), fb.Frame("Q", "b", position=(-1, 0)), fb.Revolute("A", "P", "Q"))
    m.add(fb.Event("move", "t - 0.3", do=fb.Set("x", 0.25)))
    refused(m, r"Set of 'x' in Event 'move' would put .* instantaneously, by 0\.2[45]", layer)
    m = mechanism(a=0.1)
    m.add(fb.Body("b", mass=1, inertia=1), fb.Prismatic("A", "ground", "b", at=(0, 0), axis=(1, 0)))
    m.add(fb.Driver("d", "A.displacement", "a*sin(5*t)"), fb.Event("more", "t - 0.3", do=fb.Set("a", 0.2)))
    refused(m, rf"Set of 'a' in Event 'more' would put .* instantaneously, by {0.1 * math.sin(1.5):.3g}", layer)


def test_in_a_mechanism_of_a_millimetre_a_tenth_of_a_nanometre_is_elsewhere(layer):
    """What is rounding is told from the size of the mechanism: a pin, and a stop, that go 1e-7 of it."""
    m = mechanism(x=0.0)
    m.add(fb.Body("b", mass=1e-6, inertia=1e-13, position=(1e-3, 0)))
    m.add(fb.Frame("P", "ground", position=("x", 0)), fb.Frame("Q", "b", position=(-1e-3, 0)))
    m.add(fb.Revolute("A", "P", "Q"), fb.Event("move", "t - 0.003", do=fb.Set("x", 1e-10)))
    with pytest.raises(fb.SimulationError, match=r"Set of 'x' in Event 'move' would put .* instantaneously, by"):
        m.simulate(0.01, coordinates=layer)
    m = mechanism(lo=0.0)
    m.add(fb.Body("p", mass=1e-6, inertia=1e-13), fb.Body("q", mass=1e-6, inertia=1e-13, position=(1e-3, 0)))
    m.add(fb.Revolute("A", "ground", "q", at=(0, 0)), fb.Limit("floor", "p.y", lower="lo"))
    m.add(fb.Event("up", "t - 0.003", do=fb.Set("lo", 1e-10)))
    with pytest.raises(fb.SimulationError, match=r"would put Limit 'floor' instantaneously, by 1e-10 m"):
        m.simulate(0.01, coordinates=layer)
    for law, what in (("a", "instantaneously, by 1e-10"), ("a*(t - 0.003)", "velocity of .* by 1e-14")):
        m = mechanism(a=0.0)
        m.add(fb.Body("p", mass=1e-6, inertia=1e-13), fb.Body("q", mass=1e-6, inertia=1e-13, position=(1e-3, 0)))
        m.add(fb.Fixed("A", "ground", "q", at=(0, 0)), fb.Prismatic("P", "ground", "p", at=(0, 0), axis=(1, 0)))
        new = 1e-10 if law == "a" else 1e-14
        m.add(fb.Driver("D", "P.displacement", law), fb.Event("more", "t - 0.003", do=fb.Set("a", new)))
        with pytest.raises(fb.SimulationError, match=what):
            m.simulate(0.01, coordinates=layer)


def test_what_touches_keeps_its_size(layer):
    m = mechanism(r=0.1, back=0.5)
    m.add(fb.Ground("floor", shape=fb.Plane(normal=(0, 1))), fb.Contact(friction=0, restitution="back"))
    m.add(fb.Body("ball", mass=1, shape=fb.Sphere(radius="r"), position=(0, 1)))
    m.add(fb.Event("swell", "t - 0.3", do=fb.Set("r", 0.2)))
    with pytest.raises(fb.SimulationError, match=r"would move the contact of .* instantaneously, by 0\.1 m") as e:
        m.simulate(1, method="dop853", coordinates=layer)
    r = e.value.result
    assert r["ball.y"] == pytest.approx(1 - G / 2 * r.t**2, abs=1e-8)


def test_mass_comes_with_the_speed_of_its_body(layer):
    """Speed is kept, so momentum m v grows and m v^2 / 2 is given; with a blow of -dm v momentum is kept instead."""
    for blow, speed in ((0.0, 3.0), (-1.0, 1.0)):
        m = mechanism(m=1.0)
        m.add(fb.Body("b", mass="m", inertia="m/4"), fb.Prismatic("A", "ground", "b", at=(0, 0), axis=(1, 0)))
        do = [fb.Set("m", 3), *([fb.Impulse("A", "(m - 3)*b.vx")] if blow else [])]
        m.add(fb.Initial("A.displacement", rate=3.0), fb.Event("load", "t - 0.5", do=do))
        r = m.simulate(1, outputs=11, coordinates=layer)
        assert r["b.vx"][-1] == pytest.approx(speed, abs=1e-10)
        assert r.energy.kinetic[-1] == pytest.approx(1.5 * speed**2, abs=1e-9)
        assert r["energy.event_work"][-1] == pytest.approx(1.5 * speed**2 - 4.5, abs=1e-9)
        assert r.energy.drift < 1e-9
