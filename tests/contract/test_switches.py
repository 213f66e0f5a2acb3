"""Every element that switches: it transitions both ways, its force is the one that the motion needs, energy balances.

A block on a slide, or two, pushed by a periodic force. The same in both coordinate layers, and in units that are other
powers of two. A new element with switches fails here by its name until it has a sample.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import flyball as fb
from flyball.forces import ALL, LIMITS
from flyball.testing import CHECKS, check_element

SECONDS = 8.0
PUSH, PHASE = 3.0, 0.9  # amplitude [N] and phase of the force on the first block
BLOCKS = {"b": 1.0, "c": 2.0}  # masses [kg]
Scales = tuple[float, float, float]  # units of length, mass and time in the model's


def _friction(force: float) -> Callable:
    return lambda L, M, T: fb.JointFriction(
        "part", "P", static=0.5, kinetic=0.4, preload=2.0 * force * M * L / T**2, coordinate="displacement"
    )


SAMPLES: dict[str, tuple[Callable, set[str]]] = {  # element by the units' scales; kinds of its events
    "Limit": (lambda L, M, T: fb.Limit("part", "P.displacement", lower=-0.5 * L, upper=L), {"impact", "open"}),
    "Backlash": (
        lambda L, M, T: fb.Backlash("part", ("P.displacement", "Q.displacement"), gap=0.4 * L), {"impact", "open"}
    ),
    "OneWay": (lambda L, M, T: fb.OneWay("part", "P.displacement"), {"lock", "overrun"}),
    "Ratchet": (lambda L, M, T: fb.Ratchet("part", "P.displacement", pitch=0.3 * L), {"impact", "unlatch"}),
    "Rope": (
        lambda L, M, T: fb.Rope("part", bodies=("ground", "b"), at=((-2 * L, 0.0), (0.0, 0.0)), length=2.5 * L),
        {"impact", "slack"},
    ),
    "JointFriction": (_friction(2.0), {"stick", "slip"}),
    "Brake": (lambda L, M, T: fb.Brake("part", "P.displacement", capacity=2.0 * M * L / T**2), {"stick", "slip"}),
    "Clutch": (
        lambda L, M, T: fb.Clutch("part", "P.displacement", "Q.displacement", capacity=1.5 * M * L / T**2),
        {"stick", "slip"},
    ),
    "ShearPin": (
        lambda L, M, T: fb.ShearPin(
            "part", "P.displacement", relative_to="Q.displacement", strength=1.9 * M * L / T**2
        ),
        {"break"},
    ),
}  # fmt: skip
ELASTIC: dict[str, Callable] = {
    "Limit": lambda L, M, T: fb.Limit("part", "P.displacement", lower=-0.5 * L, upper=L, stiffness=50.0 * M / T**2),
    "Backlash": lambda L, M, T: fb.Backlash(
        "part", ("P.displacement", "Q.displacement"), gap=0.4 * L, stiffness=50.0 * M / T**2
    ),
    "Rope": lambda L, M, T: fb.Rope(
        "part", bodies=("ground", "b"), at=((-2 * L, 0.0), (0.0, 0.0)), length=2.5 * L, stiffness=50.0 * M / T**2
    ),
}


def sample(name: str) -> Callable:
    return ELASTIC[name.partition(" ")[2]] if name.startswith("elastic") else SAMPLES[name][0]


SI: Scales = (1.0, 1.0, 1.0)
OTHER: Scales = (2.0**10, 2.0**-8, 2.0**-6)


def blocks(part: Callable, scales: Scales = SI) -> fb.Mechanism:
    """Two blocks on slides, the first with a periodic force and the element."""
    m = pushed_blocks(scales)
    m.add(part(*scales))
    return m


def pushed_blocks(scales: Scales = SI) -> fb.Mechanism:
    L, M, T = scales
    m = fb.Mechanism("blocks", planar=True)
    for body, joint in (("b", "P"), ("c", "Q")):
        m.add(fb.Body(body, mass=BLOCKS[body] * M, inertia=0.1 * M * L**2, position=(0.0, 0.0)))
        m.add(fb.Prismatic(joint, "ground", body, at=(0.0, 0.0), axis=(1.0, 0.0)))
    m.add(fb.Actuator("push", "P.displacement", force=f"{PUSH * M * L / T**2}*sin({1.0 / T}*t + {PHASE})"))
    return m


def run(part: Callable, coordinates: str, scales: Scales = SI) -> fb.Result:
    return blocks(part, scales).simulate(SECONDS * scales[2], coordinates=coordinates, outputs=201, rtol=1e-9)


def force_on(r: fb.Result) -> dict[str, np.ndarray]:
    """Force of the element on each block by Newton's second law."""
    push = PUSH * np.sin(r.t + PHASE)
    return {b: mass * r[b].acceleration[:, 0] - (push if b == "b" else 0.0) for b, mass in BLOCKS.items()}


def pull(r: fb.Result) -> np.ndarray:
    """Force of the rope on the first block."""
    return -r["part"].tension * np.sign(r["b"].position[:, 0] + 2.0)


def test_every_element_that_switches_has_a_sample():
    made = {c.__name__ for c in (*ALL, *LIMITS) if c.switches is not fb.SpringDamper.switches}
    assert made == set(SAMPLES)


@pytest.mark.parametrize("coordinates", ["absolute", "joint"])
@pytest.mark.parametrize("name", SAMPLES)
def test_transitions_force_and_energy(name, coordinates):
    make, kinds = SAMPLES[name]
    r = run(make, coordinates)
    assert kinds <= {x.kind for x in r.events if x.name == "part"}
    assert abs(r.energy.balance).max() < 1e-6
    part, on = r["part"], force_on(r)
    if name == "Rope":
        carried = pull(r)
    elif name in ("JointFriction", "Brake", "Clutch"):
        carried = part.friction
    else:
        carried = part.force
    first = -carried if name == "Clutch" else carried  # slip: second coordinate less the first
    assert on["b"] == pytest.approx(first, abs=1e-9)
    if name in ("Backlash", "Clutch", "ShearPin"):
        assert on["c"] == pytest.approx(-first, abs=1e-9)
    assert abs(carried).max() > 0.5


@pytest.mark.parametrize("coordinates", ["absolute", "joint"])
@pytest.mark.parametrize("name", ELASTIC)
def test_elastic_ones(name, coordinates):
    r = run(ELASTIC[name], coordinates)
    kinds = {"taut", "slack"} if name == "Rope" else {"close", "open"}
    assert kinds <= {x.kind for x in r.events if x.name == "part"}
    assert abs(r.energy.balance).max() < 1e-6
    carried = pull(r) if name == "Rope" else r["part"].force
    assert force_on(r)["b"] == pytest.approx(carried, abs=1e-9)


@pytest.mark.parametrize("name", [*SAMPLES, *(f"elastic {x}" for x in ELASTIC)])
def test_they_keep_the_contract(name):
    """In bodies that tumble; a pin starts at rest, the rope of the sample is planar."""
    e = sample(name)(*SI)
    own = pushed_blocks() if name.endswith(("ShearPin", "Rope")) else None
    assert check_element(e, mechanism=own) == list(CHECKS[e.category])


@pytest.mark.parametrize("coordinates", ["absolute", "joint"])
def test_pin_breaks_at_its_strength(coordinates):
    """It carries what accelerates the second block, 2/3 of the push; then each block moves by itself."""
    r = run(SAMPLES["ShearPin"][0], coordinates)
    (broken,) = r.events["part"]
    assert broken.t == pytest.approx(np.arcsin(1.9 / (PUSH * 2.0 / 3.0)) - PHASE, rel=1e-9)
    after = r.t > broken.t
    assert not r["part"].force[after].any()
    assert np.ptp(r["c"].velocity[after, 0]) < 1e-12


def test_pin_that_breaks_at_the_start():
    r = run(lambda L, M, T: fb.ShearPin("part", "P.displacement", strength=1.0), "joint")
    assert [(x.t, x.kind, x.name) for x in r.events] == [(0.0, "break", "part")]
    assert not r["part"].intact.any()


def test_impact_across_a_pin_breaks_it():
    """A pin of finite strength carries no impulse."""
    m = blocks(lambda L, M, T: fb.ShearPin("part", "P.displacement", relative_to="Q.displacement", strength=100.0))
    m.add(fb.Event("blow", "t - 1", do=fb.Impulse("Q.displacement", 4.0)))
    r = m.simulate(1.5)
    assert [(x.kind, x.t) for x in r.events if x.name == "part"] == [("break", 1.0)]
    before, after = (x["Q.displacement_rate"] for x in (r.events["blow"][0].before, r.events["blow"][0].after))
    assert after - before == pytest.approx(2.0)


def test_pin_refuses_a_start_with_a_velocity_across_it():
    m = blocks(lambda L, M, T: fb.ShearPin("part", "P.displacement", strength=100.0))
    m.add(fb.Initial("P.displacement", rate=1.0))
    with pytest.raises(
        fb.ModelError, match=r"ShearPin 'part': the motion starts beyond it: the rate of .* must be zero"
    ):
        m.simulate(1.0)


def test_new_pin():
    """An event puts a new pin in; it holds the blocks where they are."""
    m = blocks(lambda L, M, T: fb.ShearPin("part", "P.displacement", strength=2.9))
    m.add(fb.Event("repair", "P.displacement_rate", direction="falling", do=fb.Lock("part")))
    r = m.simulate(SECONDS, outputs=201)
    kinds = [(x.kind, x.name) for x in r.events]
    assert kinds[:2] == [("break", "part"), ("event", "repair")]
    t = r.events["repair"][0].t
    after = int(np.searchsorted(r.t, t)) + 1
    assert r["part"].intact[after] == 1.0
    assert r["b"].velocity[after, 0] == 0.0
    again = [x.t for x in r.events["part"] if x.t > t]
    assert PUSH * abs(np.sin(again[0] + PHASE)) == pytest.approx(2.9, rel=1e-9)


@pytest.mark.parametrize("name", [*SAMPLES, *(f"elastic {x}" for x in ELASTIC)])
def test_other_units(name):
    """The same events at the same instants, and the same motion, in units of which the first are powers of two."""
    make = sample(name)
    one, two = run(make, "joint"), run(make, "joint", OTHER)
    L, _, T = OTHER
    assert [(x.kind, x.name) for x in one.events] == [(x.kind, x.name) for x in two.events]
    assert two.events.t == pytest.approx(T * one.events.t, rel=1e-8)
    assert two["b"].position / L == pytest.approx(one["b"].position, abs=1e-8)
