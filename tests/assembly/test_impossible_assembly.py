"""Assembly that cannot be: joints and gaps are named; and what closed means near singular places, far away, at any size."""

from dataclasses import replace

import numpy as np
import pytest

import flyball as fb
from flyball.assembly.assemble import assemble
from tests.assembly.rough import framed, rough_four_bar
from tests.mechanisms import four_bar


def test_an_impossible_assembly_names_joints_and_gaps():
    """Links too short to meet: 3 m between the pivots, 0.2 + 0.5 + 0.4 m of links."""
    m = rough_four_bar()
    far = fb.Mechanism("too short", planar=True)
    for e in m.elements():
        if e.name != "D F":
            far.add(e) if e.name != "D" else far.add(fb.Frame("D F", "ground", position=(3.0, 0)), e)
    with pytest.raises(fb.AssemblyError, match="'too short' cannot be assembled at t = 0 s") as caught:
        assemble(far)
    error = caught.value
    assert set(error.gaps) <= set("ABCD")
    assert len(error.gaps) > 0
    total = sum(metres for metres, _ in error.gaps.values())
    assert total == pytest.approx(1.9, abs=0.01)
    assert "from closed" in str(error)
    assert all(name in str(error) for name in error.gaps)


def test_axes_that_cannot_be_parallel_are_told_in_degrees():
    """A body on two hinges whose axes are 10 degrees apart on it and parallel on ground."""
    m = fb.Mechanism("twisted")
    m.add(fb.Body("b", mass=1, inertia=(1, 1, 1)))
    framed(m, fb.Revolute, "left", "ground", (0, 0, 0), "b", (0, 0, 0))
    framed(m, fb.Revolute, "right", "ground", (0, 0, 1), "b", (0, 0, 1), turn_j=("10 deg", 0, 0))
    with pytest.raises(fb.AssemblyError, match=r"deg from closed") as caught:
        assemble(m)
    assert set(caught.value.gaps) == {"left", "right"}


def test_contradictory_drivers():
    """Two drivers want different angles of the same loop; then the same angle at different rates."""
    m = four_bar()
    m.add(fb.Driver("one", "A.angle", "0.5"), fb.Driver("two", "D.angle", "2.0"))
    with pytest.raises(fb.AssemblyError) as caught:
        assemble(m)
    assert {"one", "two"} & set(caught.value.gaps)
    m = four_bar()
    m.add(fb.Driver("one", "A.angle", "t"), fb.Driver("two", "A.angle", "2*t"))
    with pytest.raises(fb.AssemblyError, match="no velocities satisfy all constraints") as caught:
        assemble(m)
    assert {"one", "two"} <= set(caught.value.gaps)


def test_fixed_bodies_that_cannot_meet():
    m = fb.Mechanism("apart", planar=True)
    m.add(
        fb.Body("a", mass=1, inertia=1, as_drawn=True), fb.Body("b", mass=1, inertia=1, position=(1, 0), as_drawn=True)
    )
    framed(m, fb.Revolute, "J", "a", (0, 0), "b", (0, 0))
    with pytest.raises(fb.AssemblyError, match="J is 1 m from closed"):
        assemble(m)


@pytest.mark.parametrize("off", [1e-5, 1e-7, 1e-9])
@pytest.mark.parametrize("resting", [True, False])
def test_velocities_all_but_at_a_singular_position(off, resting):
    """A parallelogram a hair from flat: its cranks can only turn at the same rate, and rest is always allowed."""
    m = fb.Mechanism("flat", planar=True)
    tip = (0.3 * np.cos(off), 0.3 * np.sin(off))
    given = {"velocity": (0, 0), "angular_velocity": 0} if resting else {}
    m.add(fb.Body("bar", mass=1, inertia=0.01, position=(tip[0] + 0.25, tip[1]), **given))
    for name, x in (("left", 0.0), ("right", 0.5)):
        m.add(fb.Body(name, mass=1, inertia=0.01, position=(x, 0), angular_velocity=4.0))
        m.add(fb.Revolute(f"A {name}", "ground", name, at=(x, 0)))
        m.add(fb.Revolute(f"B {name}", name, "bar", at=(x + tip[0], tip[1])))
    a = assemble(m)
    c = a.compiled
    c.at(0.0, a.q, a.v)
    assert np.abs(c.jacobian() @ a.v).max() < 1e-11
    turn = a.v.reshape(3, 3)[:, 2]  # of the bar and both cranks
    # the momentum of the two cranks, 2 x 0.01 x 4, is shared with the bar of 1 kg that they carry at 0.3 m
    # where it is said to rest; else it follows them
    w = 2 * 0.01 * 4.0 / (2 * 0.01 + 1.0 * 0.3**2) if resting else 4.0
    assert turn == pytest.approx([0.0, w, w], abs=1e-4)


def test_a_rate_at_every_hinge_of_a_long_chain():
    """Relative rates w add up along the chain: body k turns at (k + 1) w, its middle follows the hinges before it."""
    n, w = 800, 0.01
    m = fb.Mechanism("chain", planar=True)
    for k in range(n):
        m.add(fb.Body(f"b{k}", mass=1, inertia=0.1, position=(k + 0.5, 0)))
        m.add(
            fb.Revolute(f"J{k}", f"b{k - 1}" if k else "ground", f"b{k}", at=(k, 0)), fb.Initial(f"J{k}.angle", rate=w)
        )
    v = assemble(m).v.reshape(n, 3)
    turning = w * np.arange(1, n + 1)
    assert v[:, 2] == pytest.approx(turning, rel=1e-7)
    assert v[:, 1] == pytest.approx(np.cumsum(turning) - 0.5 * turning, rel=1e-7)
    assert np.abs(v[:, 0]).max() < 1e-7 * v[:, 1].max()


def test_a_law_without_a_value_at_the_start_is_named():
    m = fb.Mechanism("p", planar=True)
    m.add(fb.Body("rod", mass=1, inertia=1, position=(0, -0.5)))
    m.add(fb.Revolute("A", "ground", "rod", at=(0, 0)))
    m.add(fb.Driver("motor", "A.angle", "sqrt(t - 0.5)"))
    with pytest.raises(fb.AssemblyError, match="the law of Driver 'motor' has no finite value there"):
        m.assemble()
    assert m.assemble(t=0.75).q[2] == pytest.approx(0.5)


@pytest.mark.parametrize("away", [1e4, 1e8, 1e11])
def test_far_from_the_origin_closed_is_what_rounding_allows(away):
    """The planar four-bar by lengths only, its pivots that far away: coordinates there have eps times as much left."""
    near = rough_four_bar()
    m = fb.Mechanism("far", planar=True)
    for e in near.elements():
        if isinstance(e, fb.Body) or (isinstance(e, fb.Frame) and e.body == "ground"):
            e = replace(e, position=(e.position[0] + away, e.position[1]))
        m.add(e)
    a = m.assemble()
    a.compiled.at(0.0, a.q, a.v)
    assert np.abs(a.compiled.work.rows.value).max() < 1e-10 + 16 * np.finfo(float).eps * away


@pytest.mark.parametrize("size", [1e-6, 1e3])
def test_closed_is_relative_to_the_size(size):
    """The same a million times smaller, or larger: closed to the same part of its length."""
    near = rough_four_bar()
    m = fb.Mechanism("scaled", planar=True)
    for e in near.elements():
        m.add(replace(e, position=tuple(size * x for x in e.position)) if isinstance(e, (fb.Body, fb.Frame)) else e)
    a = m.assemble()
    a.compiled.at(0.0, a.q, a.v)
    assert np.abs(a.compiled.work.rows.value).max() < 1e-10 * size
