"""Events in the tables of a motion: rows of what is locked or let go, guards, names of curves."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb
from flyball.assembly.compiled_mechanism import compile_mechanism
from flyball.constraints.switches.lock import LOCK
from flyball.constraints.switches.switch_kind import G_LAW, HELD
from flyball.engine.entry_point import MOTION
from flyball.engine.guards import evaluate_guards
from flyball.tables.constraint_rows import released_joints, released_row_name
from flyball.tables.coordinate_choice import spanning_joints
from flyball.tables.table_definitions import EITHER, FALLING, RISING


def model(planar: bool = True) -> fb.Mechanism:
    """Two rods on hinges, the second held to the first by a joint that an event releases."""
    g = (0, -9.81) if planar else (0, 0, -9.81)
    m = fb.Mechanism("p", planar=planar, gravity=g, parameters={"k": 2.0})
    axis = {} if planar else {"axis": (0, 1, 0)}
    z = (0.1, 0.2) if planar else (0.1, 0, 0.2)
    I = 0.1 if planar else (0.1, 0.1, 0.1)
    m.add(fb.Body("rod", mass=1, inertia=I, position=(0.5, 0) if planar else (0.5, 0, 0)))
    m.add(fb.Body("tip", mass=1, inertia=I, position=z))
    m.add(fb.Revolute("A", "ground", "rod", at=(0, 0) if planar else (0, 0, 0), **axis))
    m.add(fb.Fixed("W", "rod", "tip", at=z))
    m.add(fb.Sensor("turned", "A.angle"))
    m.add(
        fb.Event("stop", "A.angle > 1", do=fb.Lock("A")),
        fb.Event("go", "turned + A.rate - k*t", direction="falling", do=[fb.Release("A.angle"), fb.Release("W")]),
        fb.Event("low", "tip.vx", direction="either"),
        fb.Event("kick", "start", do=fb.Impulse("tip", torque=1.0 if planar else (0, 1, 0))),
    )
    return m


def test_only_a_motion_has_them():
    m = model()
    assert len(compile_mechanism(m).structure.guards) == 0
    assert len(compile_mechanism(m).structure.switches) == 0
    assert compile_mechanism(m).structure.measured == {}


def test_one_row_for_each_coordinate_and_those_of_joints_that_let_go():
    s = compile_mechanism(model(), switches=True).structure
    assert [(x.element.name, x.switch.kind, x.held) for x in s.switches] == [
        ("stop", LOCK, False),
        *[("W", LOCK, True)] * 3,
    ]
    assert [s.rows[x.row].element.name for x in s.switches] == ["stop", "W", "W", "W"]
    assert [(k, w) for k, _, w in s.guards] == [(G_LAW, RISING), (G_LAW, FALLING), (G_LAW, EITHER)]
    assert {g: e.name for g, e in s.events.items()} == {0: "stop", 1: "go", 2: "low"}


def test_what_lets_go_is_no_tree_joint():
    m = model()
    assert [j.name for j in released_joints(m)] == ["W"]
    assert spanning_joints(m) == ("A",)
    m.events.pop(1)
    assert spanning_joints(m) == ("A", "W")


@pytest.mark.parametrize("planar", [True, False])
@pytest.mark.parametrize("tree", [(), ("A",)])
def test_rows_that_let_go_are_measured_as_they_are(planar, tree):
    """Away from closed, the measured copy of each row of the joint has its value and gradient."""
    c = compile_mechanism(model(planar), tree=tree, switches=True)
    s, S = c.structure, c.system
    c.work.modes.mode[:] = HELD
    rng = np.random.default_rng(3)
    q = c.values.q + 0.05 * rng.standard_normal(s.nq)
    v = rng.standard_normal(s.nv)
    c.at(0.5, q, v, MOTION)
    rows = s.slices["W"]
    J = c.jacobian()
    nr = len(S.rows.law)
    for k, row in enumerate(range(rows.start, rows.stop)):
        m = s.measured[released_row_name(s.model["W"], k)]
        assert c.work.sensed.value[m] == pytest.approx(c.work.rows.value[row], abs=1e-12)
        gradient = np.zeros(s.nv)
        at = slice(S.row_start[nr + m], S.row_start[nr + m + 1])
        np.add.at(gradient, S.column[at], c.work.G[at])
        assert gradient == pytest.approx(J[row], abs=1e-12)
    assert np.abs(J[rows]).max() > 0.1


def test_guards_read_curves_and_rates():
    """A turn of 0.3 at 0.7 rad/s: angle - 1, angle + rate - k t, and the tip's velocity."""
    m = model()
    m.events.pop(1)
    m.add(fb.Event("went", "turned + A.rate - k*t", direction="falling"))
    c = compile_mechanism(m, tree=("A", "W"), switches=True)
    c.at(0.5, np.array([0.3]), np.array([0.7]), MOTION)
    out = np.zeros(len(c.structure.guards))
    evaluate_guards(c.system, c.work, 0.5, out)
    angle = 0.3 + np.arctan2(0.2, 0.1)
    vx = -0.7 * np.hypot(0.1, 0.2) * np.sin(angle)
    names = [c.structure.events[g].name for g in range(len(out))]
    assert dict(zip(names, out, strict=True)) == pytest.approx({"stop": 0.3 - 1, "low": vx, "went": 1.0 - 2 * 0.5})
