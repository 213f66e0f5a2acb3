"""Rows with modes: off they are as if they were not there, held they hold; the same in both coordinate layers."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
import pytest

import flyball as fb
from flyball.assembly.assemble import assemble
from flyball.assembly.compiled_mechanism import compile_mechanism
from flyball.constraints.switches.lock import LOCK
from flyball.constraints.switches.stop import STOP
from flyball.constraints.switches.switch_kind import HELD, OFF, STEADY, SwitchKind
from flyball.engine.entry_point import MOTION
from flyball.model.element import Element, element
from flyball.model.force import Switch
from flyball.simulation.initial_state import find_initial_state
from tests.mechanisms import four_bar


@element
class Hold(Element):
    """A coordinate of the test's that is held."""

    of: tuple[str, ...]
    kind: SwitchKind = LOCK
    category: ClassVar[str] = "limits"

    def switches(self):
        return (Switch(self.kind, along=self.of),)

    def switch_weights(self, n, label):
        return (1.0, -0.5)[: len(self.of)]


@pytest.fixture(autouse=True)
def forgotten():
    yield
    Element.registry.pop("Hold", None)


def double(of, coordinates):
    """A double pendulum with a hold on it, in tables of motion."""
    m = fb.Mechanism("double", planar=True, gravity=(0, -9.81))
    m.add(fb.Body("a", mass=2.0, inertia=0.3, position=(0.5, 0), angular_velocity=1.0, velocity=(0, 0.5)))
    m.add(fb.Body("b", mass=1.0, inertia=0.2, position=(1.5, 0), angular_velocity=-0.5, velocity=(0, 0.75)))
    m.add(fb.Revolute("A", "ground", "a", at=(0, 0)), fb.Revolute("B", "a", "b", at=(1, 0)))
    m.limits.append(Hold("hold", of=of))
    m.by_name["hold"] = m.limits[-1]
    return find_initial_state(m.snapshot(), 0.0, None, None, coordinates, switches=True).assembly


@pytest.mark.parametrize("coordinates", ["absolute", "joint"])
def test_off_it_is_as_if_it_were_not_there(coordinates):
    a = double(("A.angle",), coordinates)
    c = a.compiled
    assert len(c.structure.switches) == 1
    status, dy = c.at(a.t, a.q, a.v, MOTION)
    plain = compile_mechanism(c.structure.model, tree=c.structure.tree)
    plain.follow(c.hints)
    wanted = plain.at(a.t, a.q, a.v, MOTION)[1]
    assert status == 0
    assert np.allclose(dy[: len(wanted)], wanted, rtol=1e-11, atol=1e-11)
    assert c.work.rows.multiplier[c.structure.switches[0].row] == 0.0


@pytest.mark.parametrize("coordinates", ["absolute", "joint"])
def test_held_it_is_a_pendulum_of_one_piece(coordinates):
    """Both bodies turn as one: (I_a + I_b + m_a 0.5^2 + m_b 1.5^2) alpha = -g (m_a 0.5 + m_b 1.5)."""
    a = double(("B.angle",), coordinates)
    c, k = a.compiled, a.compiled.structure.switches[0]
    c.work.modes.mode[0], c.work.modes.hold[0] = HELD, 0.0
    v = np.zeros_like(a.v)
    status, dy = c.at(a.t, a.q, v, MOTION)
    assert status == 0
    alpha = -9.81 * (2 * 0.5 + 1.5) / (0.3 + 0.2 + 2 * 0.25 + 2.25)
    moving = c.work.bodies.bias_angular_acceleration[
        :, 2
    ]  # bias accelerations are none at rest: look at the derivative
    assert np.allclose(moving, 0.0)
    nq = c.structure.nq
    turning = dy[nq + 2 :: 3] if coordinates == "absolute" else np.cumsum(dy[nq : nq + 2])
    assert np.allclose(turning, alpha, rtol=1e-12)
    held = 0.2 * alpha + 1.5 * (alpha * 1.5 + 9.81) - 1.0 * (alpha * 1.5 + 9.81)  # moments about B on body b
    assert np.isclose(c.work.rows.multiplier[k.row], held, rtol=1e-11)
    assert c.work.rows.value[k.row] == pytest.approx(0.0, abs=1e-15)


@pytest.mark.parametrize("coordinates", ["absolute", "joint"])
def test_weights_of_a_sum(coordinates):
    """A.angle - B.angle / 2 at rest in speed: accelerations keep the relation, the value counts for nothing."""
    a = double(("A.angle", "B.angle"), coordinates)
    c = a.compiled
    c.work.modes.mode[0] = STEADY
    status, dy = c.at(a.t, a.q, np.zeros_like(a.v), MOTION)
    assert status == 0
    nq = c.structure.nq
    angles = dy[nq : nq + 2] if coordinates == "joint" else np.diff(np.r_[0.0, dy[nq + 2 :: 3]])
    assert np.isclose(angles[0], 0.5 * angles[1], rtol=1e-12)
    assert abs(angles[0]) > 0.1


def test_analyses_of_positions_know_nothing_of_it():
    m = four_bar()
    m.limits.append(Hold("hold", of=("A.angle",), kind=STOP))
    m.by_name["hold"] = m.limits[-1]
    assert m.mobility().rank == four_bar().mobility().rank
    assert not assemble(m.snapshot()).compiled.structure.switches


def test_modes_begin_off():
    a = double(("A.angle",), "joint")
    assert (a.compiled.work.modes.mode == OFF).all()
    assert a.compiled.work.sensed.value[-1] == 0.0
