"""What printing a result costs: it judges itself from what the run recorded."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any

import pytest

import flyball as fb
from flyball.compiler.kernels import BoundKernel, Kernel
from flyball.engine.calls import POSITION
from tests.mechanisms import example

MOST_CALLS = 500


def pendulum() -> fb.Mechanism:
    m = fb.Mechanism("pendulum", planar=True, gravity=(0, -9.81))
    m.add(fb.Body("rod", mass=1, inertia=0.1, position=(1, 0)), fb.Revolute("A", "ground", "rod", at=(0, 0)))
    m.add(fb.TorsionalSpringDamper("spring", joint="A", stiffness=10))
    return m


def hammer() -> fb.Mechanism:
    """It falls on a stop, and rebounds."""
    m = pendulum()
    m.add(fb.Limit("stop", "A.angle", lower=-0.5, restitution=0.5))
    return m


def controlled() -> fb.Mechanism:
    m = pendulum()
    m.add(fb.PID("servo", setpoint="0.2", measured="A.angle", kp=30, ki=10, kd=3, filter=0.05))
    m.add(fb.Motor("motor", joint="A", torque="servo"))
    return m


def counted(function: Callable[[], Any]) -> tuple[Any, list[str]]:
    """The result, and the files of the functions called."""
    files: list[str] = []
    sys.setprofile(lambda frame, event, _: files.append(frame.f_code.co_filename) if event == "call" else None)
    try:
        return function(), files
    finally:
        sys.setprofile(None)


@pytest.mark.parametrize(
    "make", [pendulum, hammer, controlled, lambda: example("governor.toml"), lambda: example("double_wishbone.toml")]
)
def test_printing_evaluates_no_equation_of_motion(make, monkeypatch):
    """Degrees of freedom are counted where the motion starts: its kinematics are evaluated once."""
    run = make().simulate(0.5)
    called: list[tuple[str, Any]] = []

    def recorded(call: Callable[..., Any], name: Callable[[Any], str]) -> Callable[..., Any]:
        def replacement(self: Any, *args: Any) -> Any:
            called.append((name(self), args[-1]))
            return call(self, *args)

        return replacement

    monkeypatch.setattr(Kernel, "__call__", recorded(Kernel.__call__, lambda k: k.__qualname__))
    monkeypatch.setattr(BoundKernel, "__call__", recorded(BoundKernel.__call__, lambda k: k.kernel.__qualname__))
    text = repr(run)
    assert set(called) <= {("engine", POSITION)}
    assert "energy balance" in text
    assert run.health.energy_drift >= 0.0


@pytest.mark.parametrize("make", [pendulum, hammer, controlled, lambda: example("governor.toml")])
def test_printing_takes_few_calls(make):
    m = make()
    repr(m.simulate(0.5))
    run = m.simulate(0.5)
    _, files = counted(lambda: repr(run))
    assert len(files) < MOST_CALLS
    _, files = counted(lambda: repr(run))
    assert len(files) < MOST_CALLS // 2  # nothing is judged twice


def test_simulating_takes_few_calls():
    m = pendulum()
    m.simulate(0.1)
    _, files = counted(lambda: m.simulate(1.0))
    own = [x for x in files if "flyball" in x]
    assert len(own) < 600
    assert len(set(own)) <= 40


def test_the_recorded_energies_are_those_of_the_result():
    """Of every kind of energy, at the recorded times, also where an event has changed a parameter."""
    m = example("governor.toml")
    m.add(fb.Event("later", "t > 0.2", do=[fb.Set("damping", "2*damping"), fb.Set("stiffness", "1.2*stiffness")]))
    for run in (m.simulate(0.5), hammer().simulate(1.0), controlled().simulate(0.5)):
        rows, figures, budget = run.record.rows, run.record.figures, run.budget
        size = abs(run.energy.total).max() + run.energy.kinetic.max()
        assert figures.kinetic.sum(axis=1) == pytest.approx(run.energy.kinetic[rows], abs=1e-12 * size)
        assert budget.stored[0] == pytest.approx(run.energy.gravity[rows], abs=1e-12 * size)
        assert budget.stored[1] == pytest.approx(run.energy.elastic[rows], abs=1e-12 * size)
        assert budget.balance == pytest.approx(run.energy.balance[rows], abs=1e-11 * size)
