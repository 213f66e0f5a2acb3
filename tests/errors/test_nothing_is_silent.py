"""What would otherwise go wrong without a word: each of these once gave a wrong answer that looked healthy."""

import numpy as np
import pytest

import flyball as fb


def block(**settings):
    m = fb.Mechanism("block", planar=True, **settings)
    m.add(fb.Body("b", mass=1, inertia=1))
    return m


@pytest.mark.parametrize("law", ["sqrt(0.5 - t)", "log(0.5 - t)"])
def test_a_law_that_leaves_its_range_stops_the_motion(law):
    """Without constraints no residual grows: only the finite check can see it."""
    m = block()
    m.add(fb.PointForce("F", "b", force=(law, 0)))
    with pytest.raises(
        fb.SimulationError, match=r"not finite just after t = 0.*(the law of PointForce 'F'|'b')"
    ) as stopped:
        m.simulate(1.0, outputs=11)
    partial = stopped.value.result
    assert np.isfinite(partial["b"].velocity).all()
    assert 0.3 < partial.t[-1] <= 0.5


@pytest.mark.parametrize("planar", [True, False])
def test_whole_turns_that_were_asked_for_count(planar):
    """A spring wound up by a driver, or by the initial angle, pulls with all its turns."""
    m = fb.Mechanism("spring", planar=planar)
    m.add(fb.Body("b", mass=1, inertia=1 if planar else (1, 1, 1)))
    m.add(fb.Revolute("J", "ground", "b", at=(0, 0) if planar else (0, 0, 0), axis=None if planar else (0, 0, 1)))
    m.add(fb.TorsionalSpringDamper("T", "J", stiffness=2.0))
    wound = m.copy()
    m.add(fb.Driver("d", "J.angle", "10 + t"))
    r = m.simulate(1.0)
    assert r["J"].angle == pytest.approx(10 + r.t, abs=1e-9)
    assert r["T"].torque == pytest.approx(-2 * (10 + r.t), abs=1e-8)
    wound.add(fb.Initial("J.angle", value=12.0))
    r = wound.simulate(1.0)
    assert r["J"].angle == pytest.approx(12 * np.cos(np.sqrt(2) * r.t), abs=1e-6)
    assert r.energy.total == pytest.approx(144.0, rel=1e-7)


def test_changed_parameters_reach_everything_that_uses_them():
    m = block(gravity=(0, "-g"), parameters={"g": 10.0, "r": 1.0, "d": "2*r"})
    m.add(fb.PointForce("F", "b", force=("d", 0)))
    assert m.simulate(1.0, parameters={"g": 0.0})["b"].position[-1] == pytest.approx([1.0, 0.0])
    assert m.simulate(1.0, parameters={"r": "300 cm", "g": "2 m/s^2"})["b"].position[-1] == pytest.approx([3.0, -1.0])
    with pytest.raises(fb.ModelError, match=r"no parameter 'dd'.*did you mean 'd'"):
        m.simulate(1.0, parameters={"dd": 1.0})


def test_a_result_keeps_the_mechanism_it_was_made_with():
    m = block(gravity=(0, -10))
    r = m.simulate(1.0)
    m.add(fb.Body("c", mass=1, inertia=1))
    m.add(fb.SpringDamper("k", "b", "c", at=((0, 0), (1, 1)), stiffness=1))
    assert r.health.energy_drift < 1e-9
    assert not any(name.startswith(("c.", "k.")) for name in r.channels())


def test_going_on_with_another_mechanism_is_refused():
    m = block(parameters={"x": 1.0})
    m.add(fb.Distance("J", "ground", "b", at=((0, -1), (0, 0)), length="x"))
    r = m.simulate(1.0)
    with pytest.raises(fb.ModelError, match="a different one"):
        block().simulate(2.0, start=r)
    with pytest.raises(fb.ModelError, match="cannot be continued"):
        m.simulate(2.0, start=r, parameters={"x": 2.0})


@pytest.mark.parametrize("coordinates", ["absolute", "joint"])
def test_going_on_elsewhere_than_a_result_ended_is_refused(coordinates):
    """In joint coordinates another length closes as well, with all bodies beyond it somewhere else."""
    m = fb.Mechanism("two", planar=True, gravity=(0, -9.81), parameters={"L": 1.0, "k": 20.0, "w": 1.0, "u": 0.0})
    m.add(
        fb.Body("a", mass=1, inertia=0.1, position=("L/2", 0)), fb.Body("b", mass=1, inertia=0.1, position=("1.5*L", 0))
    )
    m.add(fb.Revolute("A", "ground", "a", at=(0, 0)), fb.Revolute("B", "a", "b", at=("L", 0)))
    m.add(fb.SpringDamper("s", "ground", "b", at=((0, 1), ("2*L", 0)), stiffness="k", length=1))
    m.add(fb.Driver("d", "A.angle", "w*t + u*(t - 0.5)"))
    r = m.simulate(0.5, outputs=3, coordinates=coordinates)
    far = "cannot be continued.* from where the result ended"
    for changed in ({"L": 1.3}, {"w": 1.3}, {"u": 4.0}):  # lengths, an angle, a velocity
        with pytest.raises(fb.ModelError, match=far):
            m.simulate(1.0, start=r, parameters=changed, coordinates=coordinates)
    if coordinates == "joint":
        other = m.copy()
        other.drivers.clear()
        free = other.simulate(0.5, outputs=3, coordinates=coordinates)
        other.replace(fb.Revolute("B", "b", "a", at=("L", 0)))  # turns the other way
        with pytest.raises(fb.ModelError, match=far):
            other.simulate(1.0, start=free, coordinates=coordinates)
    on = m.simulate(1.0, outputs=3, start=r, parameters={"k": 30.0}, coordinates=coordinates)
    assert on["b"].position[0] == pytest.approx(r["b"].position[-1], abs=1e-12)


def test_units_of_initial_conditions_and_times():
    m = block()
    m.add(fb.Revolute("J", "ground", "b", at=(0, 0)))
    with pytest.raises(fb.UnitError, match=r"value of Initial 'J.angle'"):
        m.add(fb.Initial("J.angle", value="5 mm"))
    with pytest.raises(fb.UnitError, match=r"rate of Initial 'J.angle'"):
        m.add(fb.Initial("J.angle", rate="5 deg"))
    with pytest.raises(fb.UnitError, match="t_end"):
        block().simulate("1 kg")
    assert block().simulate("10 ms").t[-1] == 0.01
    with pytest.raises(fb.ModelError, match="rtol must be greater than 0, got 'x'"):
        block().simulate(1.0, rtol="x")
    with pytest.raises(fb.ModelError, match="outputs"):
        block().simulate(1.0, outputs="abc")


@pytest.mark.parametrize("outputs", [10**12, 1, -5, 1j, None, "x", [], [[0.0, 1.0]], [float("nan")]])
def test_outputs_that_cannot_be(outputs):
    """A billion of them once ended in a MemoryError."""
    with pytest.raises(fb.ModelError, match="output"):
        block().simulate(1.0, outputs=outputs)


@pytest.mark.parametrize("outputs", [10**12, 10**400, 10000, list(np.linspace(0, 1, 10000))])
def test_more_outputs_than_the_memory_holds(outputs, monkeypatch):
    """On a machine of 1 MiB; what is kept of each time counts, not the times alone."""
    monkeypatch.setattr("os.sysconf", lambda name: 1024)
    with pytest.raises(fb.ModelError, match=r"times take [\d,.]+ MiB of memory or more, and this machine has 1 MiB"):
        block().simulate(1.0, outputs=outputs, coordinates="absolute")
    assert len(block().simulate(1.0, outputs=101).t) == 101


def test_places_beyond_all_measure():
    m = fb.Mechanism("far")
    m.add(fb.Body("b", mass=1, inertia=(1, 1, 1)))
    with pytest.raises(fb.ModelError, match=r"at of Revolute 'P': 1e\+160 m is beyond 1e\+50"):
        m.add(fb.Revolute("P", "ground", "b", at=[1e160, 0, 0], axis=(1, 0, 0)))
    for parameters in (5, "x", [1]):
        with pytest.raises(fb.ModelError, match="maps names to values"):
            fb.Mechanism("m", parameters=parameters)


def test_parameters_and_times_that_are_none():
    m = block(parameters={"x": 1.0})
    for wrong in ({1: 1.0}, {None: 1.0}):
        with pytest.raises(fb.ModelError, match="parameters maps names to values"):
            m.simulate(1.0, parameters=wrong)
    for ask in (lambda **k: m.simulate(1.0, **k), m.prepare, m.mobility, m.modes):
        with pytest.raises(fb.ModelError, match=r"parameter 'x': .* is complex"):
            ask(parameters={"x": 1 + 0j})
    with pytest.raises(fb.ModelError, match="t_end"):
        m.simulate(None)
    assert m.simulate(1e-300, outputs=2).t[-1] == 1e-300


@pytest.mark.parametrize(
    "spring",
    [
        fb.SpringDamper("s", "ground", "b", at=((0, 1), (0, 0)), length=0.5),
        fb.SpringDamper("s", "ground", "b", at=((0, 1), (0, 0)), length=0.5, damping=1),
        fb.CoordinateSpring("s", "b.x", rest=1, force="1"),
        fb.TorsionalSpringDamper("s", "J", angle="10 deg", damping=2),
    ],
)
def test_where_a_spring_without_stiffness_carries_nothing(spring):
    m = block()
    m.add(fb.Revolute("J", "ground", "b", at=(0, 0)))
    with pytest.raises(fb.ModelError, match=r"'s': (length|rest|angle) has no effect without stiffness"):
        m.add(spring)
