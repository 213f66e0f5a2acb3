"""Laws of time that jump, bend or act briefly: steps end where that happens, however brief it is."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb


def cart(law, mass=2.0) -> fb.Mechanism:
    m = fb.Mechanism("cart", planar=True)
    m.gravity = (0, 0)
    m.add(fb.Body("cart", mass=mass, inertia=1, position=(0, 0)))
    m.add(fb.Prismatic("track", "ground", "cart", at=(0, 0), axis=(1, 0)))
    m.add(fb.PointForce("blow", "cart", force=(law, 0)))
    return m


@pytest.mark.parametrize("method", ["dop853", "rk45"])
@pytest.mark.parametrize("width", [1e-3, 1e-6])
@pytest.mark.parametrize("centre", [0.01, 1.23456, 5.0, 9.97])
def test_a_pulse_gives_its_whole_impulse(method, width, centre):
    """1000 N for a millisecond, or a microsecond, within 10 s, and nothing else: to 1e-8."""
    r = cart(f"1000*exp(-((t-{centre})/{width})**2)").simulate(10.0, outputs=2, rtol=1e-10, method=method)
    assert r["cart"].velocity[-1, 0] == pytest.approx(1000 * width * np.sqrt(np.pi) / 2, rel=1e-8)


def test_a_pulse_to_the_usual_tolerance():
    r = cart("1000*exp(-((t-7.7)/0.001)**2)").simulate(10.0, outputs=2)
    assert r["cart"].velocity[-1, 0] == pytest.approx(1000 * 1e-3 * np.sqrt(np.pi) / 2, rel=1e-7)
    assert r.health.steps < 100


@pytest.mark.parametrize(("law", "impulse"), [
    ("where(t > 3.3 and t < 3.3000001, 1e6, 0)", 0.1),
    ("3 + sign(sin(2*pi*200*t))", 30.0),
    ("asin(sin(2*pi*20*t)) + 1", 10.0),
    ("max(0, 2000 - 2e9*abs(t - 3.3))", 2e-3),
    ("step(t, 2, 0, 2.001, 5)", 5 * (10 - 2.0005)),
])  # fmt: skip
def test_edges(law, impulse):
    r = cart(law).simulate(10.0, outputs=2, rtol=1e-10)
    assert r["cart"].velocity[-1, 0] == pytest.approx(impulse / 2, rel=1e-8)


def test_a_law_of_time_and_state():
    """A spring that is there for a microsecond: the time in it is known beforehand, whatever the state does."""
    m = cart("0")
    m.add(fb.Actuator("spring", "track.displacement", force="-1e6*(value - 0.5)*exp(-((t - 4.321)/1e-6)**2)"))
    r = m.simulate(10.0, outputs=2, rtol=1e-10)
    assert r["cart"].velocity[-1, 0] == pytest.approx(0.5e6 * 1e-6 * np.sqrt(np.pi) / 2, rel=1e-6)
    assert "sampled" not in r.health.event_detection


def test_what_follows_the_state_is_told():
    m = cart("1")
    m.add(fb.Actuator("wall", "track.displacement", force="-exp(-(value/0.01)**2)"))
    assert "force of Actuator 'wall'" in m.simulate(1.0, outputs=2).health.event_detection


@pytest.mark.parametrize("specialize", [True, False])
def test_made_code_ends_its_steps_there_too(specialize):
    m = cart("where(t < 1.23, 0, where(t < 1.230001, 1e6, 0))")
    r = m.simulate(10.0, outputs=2, specialize=specialize)
    assert r["cart"].velocity[-1, 0] == pytest.approx(0.5, rel=1e-8)
