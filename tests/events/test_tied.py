"""What two hold at once, each one way only: a freewheel and the end of a gap, a taut rope, a stop, a brake."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq

import flyball as fb

LAYERS = ({}, {"rtol": 1e-10, "coordinates": "joint"}, {"method": "rk45", "rtol": 1e-6, "coordinates": "absolute"})


def pair(kind: str) -> fb.Mechanism:
    """1 kg and 2 kg on one line, the second driven by a freewheel from the first, and kept from going off."""
    m = fb.Mechanism("pair", planar=True, gravity=(0, 0))
    for i in range(2):
        m.add(fb.Body(f"b{i}", mass=1 + i, inertia=1, position=(2.0 * i, 0)))
        m.add(fb.Prismatic(f"s{i}", "ground", f"b{i}", at=(2.0 * i, 0), axis=(1, 0)))
    m.add(fb.Actuator("a1", "s1.displacement", force="cos(2*t) + 0.3"))
    m.add(fb.Actuator("a0", "s0.displacement", force="-0.2*cos(3*t)"))
    m.add(fb.OneWay("o", "s1.displacement", relative_to="s0.displacement"))
    if kind == "backlash":
        m.add(fb.Backlash("e", ("s0.displacement", "s1.displacement"), gap=0.2))
    else:
        m.add(fb.Rope("e", ["b0", "b1"], at=[(0, 0), (2, 0)], length=2.1 if kind == "rope" else 2.0))
    return m


def changes() -> list[float]:
    """When the force between the masses changes its sign: f1 / 2 = f0."""
    return [
        brentq(lambda t: (np.cos(2 * t) + 0.3) / 2 + 0.2 * np.cos(3 * t), *x)
        for x in ((0.6, 1), (1.8, 2.2), (4, 4.6), (5.2, 5.8))
    ]


@pytest.mark.parametrize("kind", ["backlash", "rope", "taut"])
@pytest.mark.parametrize("kw", LAYERS)
def test_a_freewheel_at_the_end_of_its_play_locks(kind: str, kw: dict) -> None:
    r = pair(kind).simulate(6, outputs=3, progress=False, **kw)
    gap = r["s1.displacement"] - r["s0.displacement"]
    assert gap[-1] == pytest.approx(0.0 if kind == "taut" else 0.1, abs=1e-12)
    # together from the impact on: momentum alone
    both = 2 * r["s1.rate"][-1] + r["s0.rate"][-1]
    assert both == pytest.approx(np.sin(12) / 2 + 1.8 - 0.2 * np.sin(18) / 3, abs=1e-5 if kw.get("method") else 1e-6)
    told = [e.t for e in r.events if e.kind in ("lock", "overrun")]
    assert told == pytest.approx(changes(), abs=1e-9)
    assert [e.t for e in r.events if e.kind in ("open", "slack", "close", "taut")] == told


@pytest.mark.parametrize("kw", LAYERS)
@pytest.mark.parametrize("static", [1.0, 1.5])
@pytest.mark.parametrize("other", ["oneway", "limit"])
def test_a_brake_lets_go_the_way_that_is_free(other: str, static: float, kw: dict) -> None:
    m = fb.Mechanism("braked", planar=True, gravity=(0, 0))
    m.add(fb.Body("b", mass=1, inertia=1), fb.Prismatic("s", "ground", "b", at=(0, 0), axis=(1, 0)))
    m.add(
        fb.Actuator("a", "s.displacement", force="-2*sin(t)"),
        fb.Brake("br", "s.displacement", capacity=1, static=static),
    )
    m.add(fb.OneWay("o", "s.displacement") if other == "oneway" else fb.Limit("o", "s.displacement", lower=0.0))
    r = m.simulate(4, outputs=3, progress=False, **kw)
    t0 = np.pi + np.arcsin(static / 2)
    s = 4 - t0
    assert r.events[0].t == pytest.approx(t0, abs=1e-9)
    assert r["s.displacement"][-1] == pytest.approx(
        2 * (np.sin(4) - np.sin(t0)) - 2 * np.cos(t0) * s - s * s / 2, abs=1e-9
    )


def test_what_begins_with_no_force_is_no_impact() -> None:
    m = fb.Mechanism("wheels", planar=True, gravity=(0, 0))
    for i in range(2):
        m.add(fb.Body(f"b{i}", mass=1, inertia=0.5), fb.Revolute(f"A{i}", "ground", f"b{i}", at=(0, 0)))
    m.add(fb.Motor("m", "A0", torque="3*sin(2*t)"), fb.OneWay("o", "A1.angle", relative_to="A0.angle"))
    r = m.simulate(2, outputs=3, progress=False)
    assert [(e.name, e.kind) for e in r.events] == [("o", "overrun")]
    assert r.events[0].t == pytest.approx(np.pi / 2, abs=1e-9)
    assert r["A1.rate"][-1] == pytest.approx(3.0, abs=1e-6)  # 3 N m (1 - cos pi) / 2 over 1 kg m^2
    cut = m.simulate(r.events[0].t, outputs=3, progress=False)
    on = m.simulate(2, start=cut, outputs=3, progress=False)
    assert on["A1.angle"][-1] == pytest.approx(r["A1.angle"][-1], abs=1e-9)


@pytest.mark.parametrize("load", [13.17, 1000.0])
@pytest.mark.parametrize("at", [0.333333, 0.81237])
def test_what_is_pressed_on_lets_go_later(at: float, load: float) -> None:
    """The load of two stops passes zero; an arm that swings up from one presses on the other, and then pulls."""
    m = fb.Mechanism("arms", planar=True, gravity=(0, 0))
    for i in range(2):
        m.add(fb.Body(f"b{i}", mass=1, inertia=0.1, position=(i + 0.5, 0)))
        m.add(fb.Revolute(f"A{i}", f"b{i - 1}" if i else "ground", f"b{i}", at=(i, 0)))
        m.add(fb.Limit(f"l{i}", f"A{i}.angle", lower=0))
    m.add(fb.PointForce("f", "b1", force=("0", f"{load}*sin(t - {at})*({at + 0.3} - t)"), at=(1.93, 0.37)))
    r = m.simulate(at + 0.45, outputs=41, progress=False)
    assert r["l0"].force.min() > -1e-9 * load
    assert r["l0"].force[(r.t > at + 0.02) & (r.t < at + 0.12)].min() > 0.0
    assert [(e.name, e.kind) for e in r.events] == [("l1", "open"), ("l0", "open")]
