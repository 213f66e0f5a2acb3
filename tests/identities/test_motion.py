"""The integration itself: compiled as plain, its order, restart, chunks, repeats, singular positions, whole turns."""

from itertools import pairwise

import numpy as np
import pytest

import flyball as fb
from flyball.assembly.assemble import assemble
from flyball.assembly.compiled_mechanism import CompiledMechanism, compile_mechanism
from flyball.engine import motion, stabilization
from flyball.engine.entry_point import MOTION, run_task
from flyball.numerics.integrators import time_loop as explicit
from flyball.numerics.integrators.butcher_tableaux import tableau
from flyball.simulation import simulate
from tests.layers import both_layers, cached
from tests.mechanisms import G, bricard, door, example, four_bar, spatial_four_bar
from tests.verification.test_reactions import actuated

pytestmark = both_layers

# ---------------------------------------------------------------------------------------- compiled = plain Python

MECHANISMS = {
    "actuated": (actuated, ()),
    "bricard": (bricard, ()),
    "four-bar": (four_bar, ()),
    "four-bar in joint coordinates": (four_bar, ("A", "B")),
    "spatial four-bar, driven": (lambda: spatial_four_bar(driven=True), ()),
    "slider-crank": (lambda: example("slider_crank.toml"), ()),
    "thin rod": (lambda: example("thin_rod.toml"), ()),
    "governor in joint coordinates": (lambda: example("governor.toml"), ("bearing", "left hinge")),
}


def ready(name, stabilize):
    """A compiled mechanism and a state slightly off its constraints, so that projection has work to do."""
    make, tree = MECHANISMS[name]
    model = make()
    c = compile_mechanism(model, tree=tree)
    if tree:
        q, v = c.values.q, c.values.v
    else:
        a = assemble(model)
        q, v = a.q, a.v
    c.at(0.0, q, v)
    y = np.r_[q, v, c.z]
    y[: len(q) + len(v)] += 1e-5 * np.sin(np.arange(len(q) + len(v)))
    (
        c.work.options.stabilization,
        c.work.options.position_tolerance,
        c.work.options.velocity_tolerance,
        c.work.options.solve_tolerance,
    ) = stabilize, 1e-12, 1e-11, 1e-13
    return c, y


@pytest.mark.parametrize("name", MECHANISMS)
def test_compiled_is_plain_python(name):
    """The right-hand side, projection included, run as the plain function it is: the same numbers to 1e-12."""
    c, y = ready(name, stabilization.STAGES)
    plain, _ = ready(name, stabilization.STAGES)
    clock = explicit.StepState(
        explicit.StepReals.blank(),
        explicit.StepCounts.blank(),
        np.zeros(0),
        explicit.StateVectors.blank(len(y)),
        np.zeros((1, len(y))),
        np.zeros(0, np.int64),
        np.zeros((6, 0)),
    )
    clock.real.t, clock.y.current = 1e-3, y
    status = run_task(c.values.system, c.work, tableau("rk45"), clock, np.zeros((0, 0)), MOTION)
    dy = np.zeros(len(y))
    again = motion.derivative(1e-3, y.copy(), dy, plain.values.system, plain.work)
    assert status == again == 0
    size = np.abs(dy).max()
    assert size > 0.1
    assert clock.K[0] == pytest.approx(dy, rel=1e-10, abs=1e-12 * size)
    assert c.work.counts[:4].tolist() == plain.work.counts[:4].tolist()


# ------------------------------------------------------------------------------------------------- order of accuracy


def swinging():
    """A spatial mechanism with a closed loop, a spring and a damper."""
    m = spatial_four_bar()
    m.add(fb.SpringDamper("s", "ground", "rocker", at=((0.2, 0, 0.35), (0.2, 0.5, 0.35)), stiffness=30.0, damping=1.0))
    return m


@cached
def exact():
    return swinging().simulate(0.48, rtol=1e-13, atol=1e-14, outputs=17)


def fixed_steps(monkeypatch, h, method):
    """The motion with steps of one width."""
    original = simulate.clock_for

    def clock(start, *args):
        made = original(start, *args)
        made.real.rtol = made.real.atol = 1e6
        made.real.h = made.real.h_max = h
        (
            start.assembly.compiled.work.options.position_tolerance,
            start.assembly.compiled.work.options.velocity_tolerance,
        ) = 1e-13, 1e-12
        return made

    monkeypatch.setattr(simulate, "clock_for", clock)
    r = swinging().simulate(0.48, method=method, outputs=17)
    assert (r.health.steps, r.health.rejected) == (round(0.48 / h), 0)
    return r


@pytest.mark.parametrize(("method", "order", "steps"), [("rk45", 5, (48, 96, 192)), ("dop853", 8, (27, 36, 48, 64))])
def test_order_is_kept(monkeypatch, method, order, steps):
    """Positions, velocities and multipliers converge with the method's order, on steps and between them."""
    true = exact()  # before the steps are fixed
    found = {}
    for n in steps:
        r = fixed_steps(monkeypatch, 0.48 / n, method)
        assert r.t == pytest.approx(true.t)
        for what in ("q", "v", "multipliers"):
            size = np.abs(getattr(true, what)).max()
            error = np.abs(getattr(r, what) - getattr(true, what)).max(axis=1) / size
            found.setdefault(what, []).append(error[-1])
            found.setdefault(f"{what} between steps", []).append(error[:-1].max())
    width = -np.log(np.array(steps))
    for what, errors in found.items():
        slope = np.polyfit(width, np.log(errors), 1)[0]
        assert slope > order - 0.6 - ("between" in what), (what, errors, slope)


# ------------------------------------------------------------------------------------ restart, chunks, repetition


def equal(one, two):
    return all(
        np.array_equal(getattr(one, k), getattr(two, k)) for k in ("t", "q", "v", "vdot", "multipliers", "states")
    )


@pytest.mark.parametrize("make", [actuated, lambda: example("slider_crank.toml"), lambda: example("t_handle.toml")])
def test_restart_goes_on_with_the_same_motion(make):
    """Two halves, the second begun from the first: the same motion, works and turns as in one go."""
    whole = make().simulate(2.0, outputs=21, rtol=1e-10, atol=1e-12)
    first = make().simulate(1.0, outputs=11, rtol=1e-10, atol=1e-12)
    second = make().simulate(2.0, outputs=11, rtol=1e-10, atol=1e-12, start=first)
    assert second.t[0] == 1.0
    assert second.t[-1] == 2.0
    for what in ("q", "v", "states"):
        assert getattr(second, what)[0] == pytest.approx(getattr(first, what)[-1], abs=1e-11)
        size = np.abs(getattr(whole, what)).max(initial=1.0)
        assert getattr(second, what) == pytest.approx(getattr(whole, what)[10:], abs=1e-7 * size)


def test_restart_from_a_saved_result(tmp_path):
    """A result read back from its file starts a run as the result itself does, bit for bit."""
    first = actuated().simulate(0.5, outputs=6)
    first.save(tmp_path / "first.nc")
    read = fb.load_result(tmp_path / "first.nc")
    one, two = (actuated().simulate(1.0, outputs=6, start=r) for r in (first, read))
    assert equal(one, two)


def one_step_a_call(monkeypatch):
    original = simulate.clock_for

    def clock(*args):
        made = original(*args)
        made.count.quota = 1
        return made

    monkeypatch.setattr(simulate, "clock_for", clock)
    monkeypatch.setattr(simulate, "SLICE", 1e-12)


@pytest.mark.parametrize("make", [actuated, bricard, lambda: example("n_four_bar.py", windows=2)])
def test_chunks_change_nothing(monkeypatch, make):
    """One step at a time, three rows of output at a time: the same result, bit for bit."""
    whole = make().simulate(1.0, outputs=101)
    again = make().simulate(1.0, outputs=101)
    assert equal(whole, again), "two runs are the same"
    one_step_a_call(monkeypatch)
    calls = []
    stepwise = make().simulate(1.0, outputs=101, progress=calls.append)
    assert len(calls) == whole.health.steps + whole.health.rejected
    assert all(a <= b for a, b in pairwise(calls))
    assert calls[-1] == 1.0
    assert equal(whole, stepwise)
    original = CompiledMechanism.bound
    monkeypatch.setattr(CompiledMechanism, "bound", lambda self, R, clock, out: original(self, R, clock, out[:3]))
    narrow = make().simulate(1.0, outputs=101)
    assert equal(whole, narrow)
    assert (narrow.health.violation, narrow.health.steps) == (whole.health.violation, whole.health.steps)


def test_interrupt_keeps_what_was_computed(monkeypatch):
    """Ctrl-C ends the run with a result that says so and equals the uninterrupted one as far as it goes."""
    whole = actuated().simulate(2.0, outputs=201)
    one_step_a_call(monkeypatch)

    def stop(part):
        if part > 0.5:
            raise KeyboardInterrupt

    with pytest.raises(fb.Interrupted, match="interrupted by the user at t = ") as ended:
        actuated().simulate(2.0, outputs=201, progress=stop)
    r = ended.value.result
    assert not r.health.success
    assert "interrupted by the user at t = " in r.health.message
    assert 0.9 < r.t[-1] < 2.0
    assert np.array_equal(r.q, whole.q[: len(r.t)])


def test_restart_where_the_last_run_stopped():
    """A run is gone on from where it got to, which is not the last time that was asked for."""
    first = actuated().simulate(1.0, outputs=[0.5])
    rest = actuated().simulate(2.0, outputs=[2.0], start=first)
    whole = actuated().simulate(2.0, outputs=[2.0])
    assert rest.q[-1] == pytest.approx(whole.q[-1], abs=1e-6)


def test_outputs_do_not_steer():
    """Where results are asked for changes no step: bit-equal at common times."""
    few = actuated().simulate(1.0, outputs=[0.25, 0.5, 1.0])
    many = actuated().simulate(1.0, outputs=201)
    at = np.searchsorted(many.t, few.t)
    assert np.array_equal(few.q, many.q[at])
    assert few.health.steps == many.health.steps


# ------------------------------------------------------------------------------------------------ singular positions


@pytest.mark.parametrize("rtol", [1e-5, 1e-6, 1e-7, 1e-8])
@pytest.mark.parametrize("windows", [1, 2, 3, 10])
def test_singular_positions_are_passed(windows, rtol):
    """The N-four-bar goes flat again and again and keeps to the branch where all windows move as one."""
    m = example("n_four_bar.py", windows=windows)
    drifts = []
    # where steps end beside the singular positions is chance, and with it the drift: of one run in fifteen ten times
    # the usual one at loose tolerances
    for chance in (0.9, 0.95, 1.0, 1.05, 1.1):
        r = m.simulate(10.0, rtol=chance * rtol, atol=1e-2 * rtol, outputs=201)
        assert r.health.success
        assert r.health.violation < 1e-9
        drifts.append(r.energy.drift)
    assert np.median(drifts) < 100 * rtol * (windows + 1) * G
    angles = np.stack([r[f"A{i}"].angle for i in range(windows + 1)])
    assert np.abs(angles - angles[0]).max() < 1e3 * rtol
    assert np.ptp(angles[0]) > 4 * np.pi


@pytest.mark.parametrize("t_end", [0.4, 1.7, 3.3, 20.0])
def test_singular_positions_at_other_horizons(t_end):
    """Where the steps happen to fall does not matter."""
    r = example("n_four_bar.py", windows=1).simulate(t_end, rtol=1e-7, atol=1e-9)
    assert r.health.violation < 1e-9
    assert r.energy.drift < 1e-4


# -------------------------------------------------------------------------------------------- ways of keeping closed


def test_ways_to_stay_closed():
    """Projection keeps rounding, Baumgarte a little error, nothing the most; all of them the same motion at first."""
    runs = {k: four_bar().simulate(5.0, rtol=1e-6, stabilization=k) for k in simulate.STABILIZATION}
    off = {k: r.health.violation for k, r in runs.items()}
    assert off["projection"] < 1e-12
    assert off["projection-steps"] < 1e-12
    assert 1e-12 < off["baumgarte"] < 1e-4
    assert off["none"] > max(v for k, v in off.items() if k != "none")
    true = four_bar().simulate(5.0, rtol=1e-11, atol=1e-12)
    for k, r in runs.items():
        assert r["D"].angle[:100] == pytest.approx(true["D"].angle[:100], abs=1e-3), k


def test_redundant_rows_do_not_disturb_the_motion():
    """A door on two hinges swings as on one: J theta'' = 0 without gravity about the axis, at any tilt with it."""
    one, two = door(gravity=(0, G, 0)), door(gravity=(0, G, 0))
    one = fb.Mechanism("one hinge", gravity=(0, G, 0))
    for e in two.elements():
        if e.name != "lower":
            one.add(e)
    a, b = (m.simulate(3.0, rtol=1e-11, atol=1e-12) for m in (one, two))
    assert a.health.redundant == ()
    assert b["upper"].angle == pytest.approx(a["upper"].angle, abs=1e-8)
    assert np.ptp(a["upper"].angle) > 3


# ------------------------------------------------------------------------------------------------------ whole turns


@pytest.mark.parametrize("planar", [False, True])
def test_angles_count_whole_turns(planar):
    """Forty turns seen at five times: the angle is w t, not its remainder, offset in the drawn position included."""
    m = fb.Mechanism("rotor", planar=planar)
    w = 2 * np.pi * 40
    more = {"at": (0, 0)} if planar else {"at": (0, 0, 0), "axis": (1, 2, -1)}
    body = {"inertia": 0.1} if planar else {"inertia": (0.1, 0.12, 0.2)}
    m.add(fb.Body("rotor", mass=1, **body))
    m.add(fb.Revolute("A", "ground", "rotor", angle=0.5, **more), fb.Initial("A.angle", rate=w))
    m.add(fb.TorsionalSpringDamper("none", "A"))
    r = m.simulate(1.0, outputs=5, rtol=1e-10)
    assert r["A"].angle == pytest.approx(0.5 + w * r.t, abs=1e-6)
    assert r["A"].rate == pytest.approx(np.full(5, w), rel=1e-9)


@pytest.mark.parametrize("planar", [False, True])
def test_a_spiral_spring_winds_up(planar):
    """J theta'' = -k theta over many turns: the spring knows them (closed form)."""
    m = fb.Mechanism("spiral", planar=planar)
    body = {"inertia": 0.1} if planar else {"inertia": (0.1, 0.1, 0.1)}
    more = {"at": (0, 0)} if planar else {"at": (0, 0, 0), "axis": (0, 1, 1)}
    m.add(fb.Body("rotor", mass=1, **body), fb.Revolute("A", "ground", "rotor", **more))
    m.add(fb.TorsionalSpringDamper("coil", "A", stiffness=0.4), fb.Initial("A.angle", rate=100.0))
    r = m.simulate(2.0, rtol=1e-11, atol=1e-12, outputs=21)
    assert r["A"].angle == pytest.approx(50 * np.sin(2 * r.t), abs=1e-6)
    assert r["coil"].torque == pytest.approx(-20 * np.sin(2 * r.t), abs=1e-6)
    assert r.energy.drift < 1e-5
