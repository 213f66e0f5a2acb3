"""Motions to be kept on the way: short ones, cut into parts of few steps, and killed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import flyball as fb
from flyball.simulation import checkpoints as keeper
from flyball.simulation.integration_intervals import Segment

STEPS = 40  # of a part


class Killed(BaseException):
    """Nobody catches it."""


def cut(patch: pytest.MonkeyPatch, steps: int = STEPS) -> None:
    """Have every part of so many steps, and be written at once."""

    def measure(self: Segment, step: float) -> None:
        self._whole = self._left = steps if self.first is not None else np.inf  # a motion without checkpoints is whole
        self._event = 1.0

    patch.setattr(Segment, "_measure", measure)
    patch.setattr(keeper, "EVERY", 0.0)


def killed(m: fb.Mechanism, path: Path, patch: pytest.MonkeyPatch, after: tuple[int, ...], **how) -> fb.Result:
    """The motion, killed after so many writes each time, and gone on with."""
    write = keeper.CheckpointFile.write
    for n in after:
        left = [n]

        def stop(self: keeper.CheckpointFile, left: list[int] = left) -> None:
            write(self)
            left[0] -= 1
            if left[0] == 0:
                raise Killed

        with patch.context() as within:
            within.setattr(keeper.CheckpointFile, "write", stop)
            with pytest.raises(Killed):
                m.simulate(checkpoint=path, **how)
    return m.simulate(checkpoint=path, **how)


def assert_same(a: fb.Result, b: fb.Result) -> None:
    """Equal to the last bit, all that both tell."""
    assert np.array_equal(a.t, b.t)
    others = b.channels()
    for name, (_, x) in a.channels().items():
        assert np.array_equal(x, others[name][1], equal_nan=True), name
    assert [h.as_dict() for h in a.events] == [h.as_dict() for h in b.events]
    assert (a.health.steps, a.health.rejected) == (b.health.steps, b.health.rejected)
    assert a.health.warnings == b.health.warnings


def double_pendulum() -> fb.Mechanism:
    """Two rods, a spring, a damper and a motor."""
    m = fb.Mechanism("double", planar=True, gravity=(0, -9.81), parameters={"c": 0.1})
    m.add(fb.Body("a", mass=1, inertia=0.1, position=(0.5, 0)), fb.Body("b", mass=1, inertia=0.1, position=(1.5, 0)))
    m.add(fb.Revolute("A", "ground", "a", at=(0, 0)), fb.Revolute("B", "a", "b", at=(1, 0)))
    m.add(fb.CoordinateSpring("S", "B.angle", stiffness=20, damping="c"), fb.Motor("M", "A", torque="sin(3*t)"))
    return m


def bouncer() -> fb.Mechanism:
    """A ball on a floor that changes its spring, counts, and comes to rest."""
    m = fb.Mechanism("bouncer", planar=True, gravity=(0, -10), parameters={"k": 4.0})
    m.add(fb.Body("b", mass=1, inertia=1, position=(0, 1)), fb.Limit("L", "b.y", lower=0, restitution=0.7))
    m.add(fb.CoordinateSpring("S", "b.x", stiffness="k"), fb.Initial("b.x", rate=1.0))
    m.add(fb.Event("down", "b.x", direction="falling", do=fb.Set("k", "2*k"), times=2))
    m.add(fb.Event("up", "b.vy", direction="falling", times=5))
    return m


def twisting() -> fb.Mechanism:
    """A relay with friction, whose swings end."""
    m = fb.Mechanism("twisting", planar=True, gravity=(0, 0))
    m.add(fb.Body("p", mass=1, inertia=0.1), fb.Prismatic("A", "ground", "p", at=(0, 0), axis=(1, 0)))
    m.add(fb.Actuator("M", "A.displacement", force="-3*sign(value)-sign(rate)+max(0,t-2)"))
    m.add(fb.Initial("A.displacement", rate=0.5))
    return m


def soft(damping: float = 100.0, turning: float = 10.0) -> fb.Mechanism:
    """A stiff bushing."""
    m = fb.Mechanism("soft", planar=True, gravity=(0, -9.81))
    m.add(fb.Body("a", mass=1, inertia=0.1, position=(1, 0)), fb.Revolute("A", "ground", "a", at=(0, 0)))
    m.add(fb.Body("b", mass=1, inertia=0.1, position=(2, 0)))
    stiff = {"stiffness": 1e5, "damping": damping, "torsional_stiffness": 1e4, "torsional_damping": turning}
    m.add(fb.Bushing("B", "a", "b", at=(1.5, 0), **stiff))
    return m


def pile() -> fb.Mechanism:
    """Balls and a pendulum on a floor, by steps of impulses."""
    m = fb.Mechanism("pile", gravity=(0, 0, -9.81))
    at = [[0.21 * x + 0.01 * z, 0.005 * z, 0.12 + 0.22 * z] for x in range(2) for z in range(3)]
    m.add(fb.Ground("floor", shape=fb.Plane(normal=(0, 0, 1))), fb.Contact(friction=0.3, restitution=0.3))
    m.add(fb.Bodies("balls", shape=fb.Sphere(radius=0.1), density=1000, position=np.array(at)))
    m.add(fb.Body("arm", shape=fb.Capsule(length=0.4, radius=0.03), density=1000, position=(0.6, 0, 0.5)))
    m.add(fb.Revolute("A", "ground", "arm", at=(0.3, 0, 0.5), axis=(0, 1, 0)))
    return m


def sampled() -> fb.Mechanism:
    """A pendulum held up by a sampled controller."""
    m = fb.Mechanism("sampled", planar=True, gravity=(0, -9.81))
    m.add(fb.Body("a", mass=1, inertia=0.1, position=(0.5, 0)), fb.Revolute("A", "ground", "a", at=(0, 0)))
    m.add(fb.PID("pid", measured="A.angle", setpoint="0.2", kp=60, ki=20, kd=8, filter="50 ms", period="10 ms"))
    m.add(fb.Motor("M", "A", torque="pid"))
    return m


def crank(**parameters: float) -> fb.Mechanism:
    """A four-bar that a driver turns: nothing of it is free."""
    m = fb.Mechanism("crank", planar=True, gravity=(0, -9.81))
    m.add(fb.Body("a", mass=1, inertia=0.1, position=(0.5, 0)), fb.Body("b", mass=2, inertia=0.5, position=(2, 0.75)))
    m.add(fb.Body("c", mass=1, inertia=0.3, position=(3, 0.75)))
    m.add(fb.Revolute("A", "ground", "a", at=(0, 0)), fb.Revolute("B", "a", "b", at=(1, 0)))
    m.add(fb.Revolute("C", "b", "c", at=(3, 1.5)), fb.Revolute("D", "ground", "c", at=(3, 0)))
    m.add(fb.Driver("turn", "A.angle", "2*t + 0.3*sin(5*t)"), fb.CoordinateSpring("S", "D.angle", stiffness=5))
    return m


def switched() -> fb.Mechanism:
    """A pendulum that is pushed to and fro, two hundred times a second: each step ends where the push turns."""
    m = fb.Mechanism("switched", planar=True, gravity=(0, -9.81))
    m.add(fb.Body("a", mass=1, inertia=0.1, position=(0.5, 0)), fb.Revolute("A", "ground", "a", at=(0, 0)))
    m.add(fb.Motor("M", "A", torque="sign(sin(628*t))"))
    return m


def watched() -> fb.Mechanism:
    """A sampled controller beside a stop that nothing meets, and an event at an instant: the loop stops at each."""
    m = sampled()
    m.add(fb.Limit("stop", "A.angle", upper=2.0), fb.Event("now", "t - 0.2"))
    return m
