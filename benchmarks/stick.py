"""What true stick costs beside the regularised law: processor time for a simulated second, both in one run.

A block on a belt, tied to the wall by a spring: stick and slip for 20 s, static above kinetic friction; and a sled with
a pendulum on it whose hinge rubs by the load of the swinging bob. Both tolerances are the default. Usage:
``python stick.py``.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import timing  # noqa: F401  (before numpy: it fixes the thread counts)

import flyball as fb

STICK_SPEEDS = (1e-3, 1e-5, 1e-6)  # m/s
RUNS = 5


def belt(**law: float) -> fb.Mechanism:
    """Stick-slip oscillator: mu_s = 0.4, mu_k = 0.25, 1 kg, 50 N/m, 0.2 m/s."""
    m = fb.Mechanism("belt", planar=True, gravity=(0, -9.81))
    m.add(fb.Body("belt", mass=1.0, inertia=1.0), fb.Body("block", mass=1.0, inertia=0.1))
    m.add(fb.Translational("bed", "ground", "belt", at=(0, 0), axis=(1, 0)))
    m.add(fb.Translational("top", "belt", "block", at=(0, 0), axis=(1, 0)))
    m.add(fb.Driver("run", "bed.displacement", law="0.2*t"))
    m.add(fb.CoordinateSpring("spring", "block.x", stiffness=50.0))
    m.add(fb.JointFriction("rub", "top", static=0.4, kinetic=0.25, stribeck_speed=0.01 if law else None, **law))
    return m


def shaken(**law: float) -> fb.Mechanism:
    """A sled that a force shakes, with a pendulum on it: rail and hinge rub."""
    m = fb.Mechanism("shaken", planar=True, gravity=(0, -9.81))
    m.add(fb.Body("sled", mass=2.0, inertia=0.1), fb.Body("bob", mass=1.0, inertia=0.02, position=(0.0, -0.5)))
    m.add(fb.Translational("rail", "ground", "sled", at=(0, 0), axis=(1, 0)))
    m.add(fb.Revolute("hinge", "sled", "bob", at=(0, 0)))
    m.add(fb.CoordinateSpring("spring", "rail.displacement", stiffness=100.0))
    m.add(fb.Actuator("shake", "rail.displacement", force="12*sin(5*t)"))
    m.add(fb.Initial("hinge.angle", value=0.8, rate=1.0))
    m.add(fb.JointFriction("slides", "rail", static=0.2, **law))
    m.add(fb.JointFriction("turns", "hinge", static=0.2, radius=0.1, **law))
    return m


def cost(make: Callable[..., fb.Mechanism], seconds: float, **law: float) -> tuple[float, int]:
    """Milliseconds for a simulated second, the least of several runs; events."""
    best, events = float("inf"), 0
    for _ in range(RUNS):
        m = make(**law)
        before = time.process_time()
        r = m.simulate(seconds, outputs=2)
        best, events = min(best, time.process_time() - before), len(r.events)
    return 1e3 * best / seconds, events


def main() -> None:
    """Print a table."""
    for make, seconds in ((belt, 20.0), (shaken, 20.0)):
        make().simulate(0.1)
        make(stick_speed=1e-3).simulate(0.1)
        true, events = cost(make, seconds)
        print(f"{make.__name__:8} true stick          {true:8.3f} ms/s, {events} events in {seconds:g} s")
        for v in STICK_SPEEDS:
            creeping, _ = cost(make, seconds, stick_speed=v)
            print(f"{make.__name__:8} stick_speed {v:7.0e} {creeping:8.3f} ms/s, {creeping / true:6.1f} times")


if __name__ == "__main__":
    main()
