"""What bounces to rest on two corners at once, at any size; what is beneath a floor, or slides backwards, is not silent.

Flights of a body dropped flat from h with restitution e last 2 e^n sqrt(2 h / g); the last is at rest after
sqrt(2 h / g) (1 + e) / (1 - e), at half an edge above the floor, however its inertia would let it tilt.
"""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb
from flyball.constraints.switches.contact_slip import SLIP
from flyball.simulation.events import event_loop, mode_selection

from .watched_ode import run as watched

EDGE, HEIGHT = 0.2, 0.5


def dropped(size, gravity, inertia, restitution):
    box = fb.Box(edges=(EDGE * size,) * 3, looks=True, contact=True)
    m = fb.Mechanism("dropped", planar=True, gravity=(0, -gravity))
    m.add(fb.Ground("floor", shape=fb.Plane(normal=(0, 1))), fb.Contact(friction=0.3, restitution=restitution))
    at = (0, (0.5 * EDGE + HEIGHT) * size)
    m.add(fb.Body("b", mass=1, inertia=inertia * size**2, position=at, shape=box))
    return m


@pytest.mark.parametrize("size", [1.0, 1e-2, 1e-4, 1e-6])
@pytest.mark.parametrize(("restitution", "inertia"), [(0.3, 1.0), (0.6, 0.02)])
@pytest.mark.parametrize("own", [True, False], ids=["same motion", "same gravity"])
def test_it_comes_to_rest_on_the_floor(size, restitution, inertia, own):
    g, e = 9.81 * (size if own else 1.0), restitution
    first = np.sqrt(2 * HEIGHT * size / g)
    over = first * (1 + e) / (1 - e)
    tops = first * (1 + 2 * np.cumsum(e ** np.arange(1, 5)) - e ** np.arange(1, 5))
    r = dropped(size, g, inertia, e).simulate(2 * over, outputs=[0.0, *tops, over, 2 * over])
    assert r["b.y"][1:5] / size == pytest.approx(0.5 * EDGE + HEIGHT * e ** (2 * np.arange(1, 5)), abs=1e-8)
    assert r["b.y"][-2:] / size == pytest.approx(0.5 * EDGE, abs=1e-11)
    assert np.abs(r["b.angle"]).max() < 1e-9
    assert [x.t for x in r.events if x.kind == "rest"] == pytest.approx([over], rel=1e-8)


def test_far_from_the_origin():
    """A block of 2 mm a hundred metres away, where places are known to 1e-14 m, comes to rest too."""
    at, e, over = 100.0, 0.6, 4 * np.sqrt(2 * HEIGHT * 1e-2 / 9.81)
    m = fb.Mechanism("far", planar=True, gravity=(0, -9.81))
    slab = fb.Box(edges=(0.2, 0.01, 0.01), looks=True, contact=True)
    m.add(fb.Ground("floor", position=(at, at - 0.005), shape=slab), fb.Contact(friction=0.3, restitution=e))
    box = fb.Box(edges=(EDGE * 1e-2,) * 3, looks=True, contact=True)
    m.add(fb.Body("b", mass=1, inertia=1e-5, position=(at, at + (0.5 * EDGE + HEIGHT) * 1e-2), shape=box))
    r = m.simulate(2 * over, outputs=2, method="dop853")
    assert r["b.y"][-1] - at == pytest.approx(0.5 * EDGE * 1e-2, abs=1e-11)
    assert len(r.events) < 50
    assert min(x.t for x in r.events if x.kind == "rest") == pytest.approx(over, rel=1e-4)


def test_what_begins_beneath_sinks_no_deeper():
    """A ball that begins at -1e-9 going up at 1e-5, and is thrown back where it is told of: never deeper than that."""

    def bounce(t, y, fired):
        y[1] = 1e-5
        return len(seen) > 5 or seen.append(y[0])

    seen = []
    watched(lambda t, q, v: [-1.0], lambda t, q, v: q, [-1e-9, 1e-5], 1.0, [-1], bounce, kept=[2])
    assert len(seen) > 5
    assert min(seen) > -1.001e-9


@pytest.mark.parametrize("size", [1.0, 1e-4])
def test_beneath_the_floor_is_refused(monkeypatch, size):
    happens, times = event_loop.EventDrivenMotion.resolve, []

    def sunk(self, fired):
        times.append(self.here.t)
        self.here.q[1] -= 1e-6 * size * (len(times) == 2)
        happens(self, fired)

    monkeypatch.setattr(event_loop.EventDrivenMotion, "resolve", sunk)
    with pytest.raises(fb.SimulationError, match=f"ground and 'b' are in each other by {1e-6 * size:.3g} m"):
        dropped(size, 9.81, 0.1, 0.5).simulate(3.0, method="dop853")
    assert len(times) == 2


def pushed():
    """A block on a floor, pushed with 2 + 2 t at its middle."""
    m = fb.Mechanism("pushed", planar=True, gravity=(0, -9.81))
    m.add(fb.Ground("floor", shape=fb.Plane(normal=(0, 1))), fb.Contact(friction=0.3))
    box = fb.Box(edges=(0.4, 0.2, 0.2), looks=True, contact=True)
    m.add(fb.Body("b", mass=1, inertia=0.1, position=(0, 0.1), shape=box))
    m.add(fb.PointForce("p", "b", at=(0, 0.1), force=("2 + 2*t", "0")))
    return m


@pytest.mark.parametrize("often", [1, 10**9])
def test_a_slip_that_begins_backwards_is_seen(monkeypatch, often):
    """From (mu g - 2) / 2 on it slides with x'' = 2 + 2 t - mu g, though it was told to slide the other way."""
    write, count = mode_selection.write_slips, []

    def backwards(n, parts, found):
        write(n, parts, found)
        ways, slips = n.ways(), n.of(lambda kind: kind is SLIP)
        if len(count) < often and ways[slips].any():
            count.append(n.here.t)
            ways[slips] *= -1.0

    monkeypatch.setattr(mode_selection, "write_slips", backwards)
    if often > 1:
        monkeypatch.setattr(event_loop, "ENDLESS", 50)
        with pytest.raises(fb.SimulationError, match="without end"):
            pushed().simulate(1.5, method="dop853")
        return
    start = (0.3 * 9.81 - 2) / 2
    r = pushed().simulate(1.5, method="dop853", rtol=1e-10)
    assert count == pytest.approx([start], abs=1e-9)
    assert r["b.x"][-1] == pytest.approx((1.5 - start) ** 3 / 3, abs=1e-9)


def test_a_mechanism_that_locks_beside_a_contact():
    """The error of a motion with places of contact that cannot go on names its reason."""
    m = pushed()
    m.add(
        fb.Body("crank", mass=1, inertia=0.1, position=(0.5, 3)), fb.Body("rod", mass=1, inertia=0.1, position=(2, 3.5))
    )
    m.add(fb.Body("slide", mass=1, inertia=0.1, position=(3, 3)))
    m.add(fb.Revolute("A", "ground", "crank", at=(0, 3)), fb.Revolute("B", "crank", "rod", at=(1, 4)))
    m.add(fb.Revolute("C", "rod", "slide", at=(3, 3)), fb.Prismatic("S", "ground", "slide", at=(3, 3), axis=(1, 0)))
    m.add(fb.Driver("D", "S.displacement", "t"))
    with pytest.raises(fb.SimulationError, match=r"t = 0\.6"):
        m.simulate(3.0, method="dop853")
