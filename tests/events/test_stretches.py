"""What held between events is kept over time: reactions, friction, energies and files are those of their time."""

from __future__ import annotations

from types import SimpleNamespace
from typing import ClassVar

import numpy as np
import pytest

import flyball as fb
from flyball.assembly.compiled_mechanism import CompiledMechanism
from flyball.constraints.switches.lock import LOCK
from flyball.constraints.switches.switch_kind import HELD
from flyball.engine.entry_point import MOTION
from flyball.model.element import Element, element
from flyball.model.force import Switch
from flyball.results.health import Health
from flyball.results.result import Result
from flyball.simulation.events.event_loop import PhaseRecorder
from flyball.simulation.initial_state import find_initial_state


@element
class Hold(Element):
    """A coordinate of the test's that is held."""

    of: str
    category: ClassVar[str] = "limits"

    def acts(self):
        return False

    def switches(self):
        return (Switch(LOCK, along=(self.of,)),)


@pytest.fixture(autouse=True)
def forgotten():
    yield
    Element.registry.pop("Hold", None)


def block(**parts):
    """2 kg on a slide between springs, k of them; a hold on its slide."""
    m = fb.Mechanism("block", planar=True, gravity=(0, -9.81), parameters={"k": 100.0})
    m.add(fb.Body("b", mass=2.0, inertia=0.1, position=(0, 0)))
    m.add(fb.Translational("slide", "ground", "b", at=(0, 0), axis=(1, 0)))
    m.add(fb.CoordinateSpring("spring", "slide.displacement", stiffness="k", damping=parts.get("damping", 0.0)))
    m.limits.append(Hold("hold", of="slide.displacement"))
    m.by_name["hold"] = m.limits[-1]
    return m


def row(c, t, x, v):
    """A row of output at that state, solved with the modes of now."""
    q, w = np.array([x]), np.array([v])
    c.at(t, q, w, MOTION)
    dy = c.at(t, q, w, MOTION)[1]
    n = c.structure.nq
    return np.r_[t, q, w, c.z, dy[n : n + 1], c.work.rows.multiplier]


def two_stretches(damping=0.0):
    """At rest held at x = 0.1, k = 100; from then on free at k = 400."""
    m = block(damping=damping).snapshot()
    a = find_initial_state(m, 0.0, None, None, "joint", switches=True).assembly
    seen, lost = PhaseRecorder(), 0.0
    rows = []
    here = SimpleNamespace(c=a.compiled, structure=a.compiled.structure, lost=lost, given=0.0, y=None)
    here.c.work.modes.mode[0], here.c.work.modes.hold[0] = HELD, 0.1
    for told, state in (({}, (0.1, 0.0)), ({"k": 400.0}, (0.1, 0.0)), ({"k": 400.0}, (0.0, 0.3))):
        if told:
            from flyball.tables.values import values

            here.c = (
                CompiledMechanism(values(a.compiled.structure, told), a.compiled.z.copy(), told)
                if not rows[1:]
                else here.c
            )
            here.lost = 0.25
        new = row(here.c, float(len(rows)), *state)
        rows.append(new)
        here.y = np.r_[state, here.c.z]
        seen.add(here, new[None, :])
    s, rows = a.compiled.structure, np.array(rows)
    parts = np.split(rows, np.cumsum([1, s.nq, s.nv, len(s.states), s.nv]), axis=1)
    health = Health(True, "", 0.0, 0.0, 0, 0, 0, 0, 0.0, {})
    result = Result(m, here.c.values, parts[0][:, 0], *parts[1:], health)
    result.final = (2.0, here.y)
    health.late = {
        "mobility": m.mobility(),
        "energy_drift": 0.0,
        "acceleration_violation": 0.0,
        "creep": {},
        "warnings": (),
    }
    seen.add_phases(result)
    return result


def test_multipliers_are_those_of_the_modes_of_their_time():
    """Held it carries the spring's pull 100 * 0.1 N; free nothing, and accelerates by -400 x / m."""
    r = two_stretches()
    assert np.allclose(r.multipliers[:, -1], [10.0, 0.0, 0.0], atol=1e-12)
    assert np.allclose(r["b.ax"], [0.0, -400 * 0.1 / 2, 0.0], atol=1e-12)
    assert r.record.violation < 1e-12


def test_parameters_are_those_of_their_time():
    r = two_stretches()
    assert np.allclose(r["spring.force"], [-10.0, -40.0, 0.0], atol=1e-12)
    assert np.allclose(r.energy.elastic, [0.5, 2.0, 0.0], atol=1e-12)
    assert np.allclose(r.energy.kinetic, [0, 0, 0.09])


@pytest.mark.parametrize("damping", [0.0, 3.0])
def test_what_a_change_of_a_parameter_gives_is_booked(damping):
    """The stiffer spring has 1.5 J more; with 0.25 J said to be lost the balance stands at what the states miss."""
    r = two_stretches(damping)
    assert np.allclose(r.exchanged["event_work"], [0.0, 1.5, 1.5], atol=1e-12)
    assert np.allclose(r.energy.work.get("spring", 0.0), [0, 0, -2.0] if damping else 0.0, atol=1e-12)
    assert np.allclose(r.exchanged["impact_loss"], [0.0, 0.25, 0.25])
    assert np.isclose(r.energy.balance[1], 0.25, atol=1e-12)
