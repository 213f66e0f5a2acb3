"""What events cost: a guard that watches a motion and never fires, and an event that does nothing but happen.

    python benchmarks/events.py [rounds]

Ratios to the same motion without a guard, in one process, of the least time each took; and what an event takes with all
that belongs to it: it is located, the step is taken again, Python decides, the motion goes on. Most of what a guard
costs is the quantity that it measures, found in every evaluation of the equations (0.14 us for an angle). Then whole
calls of examples, and how long what is decided at an instant takes, of jumps and modes too. What motions without events
cost beside an earlier flyball: `against.py`; stick: `stick.py`.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from typing import Any

import flyball as fb
import mechanisms
from flyball.simulation.events import event_loop as eventful

EXAMPLES = {
    "bouncing_ball.toml": 4.0,
    "geneva_drive.toml": 2.0,
    "ratchet.toml": 2.0,
    "clock_escapement.toml": 5.0,
    "stick_slip.toml": 10.0,
}
"""Examples, and how long they are followed [s]."""


def pendulums(n: int) -> fb.Mechanism:
    """A chain of n rods that hangs from a side."""
    m = fb.Mechanism("chain", planar=True, gravity=(0, -9.81))
    for k in range(n):
        m.add(fb.Body(f"b{k}", mass=1.0, inertia=0.1, position=(k + 0.5, 0)))
        m.add(fb.Revolute(f"J{k}", f"b{k - 1}" if k else "ground", f"b{k}", at=(k, 0)))
    return m


def least(motions: list[Callable[[], fb.Result]], rounds: int) -> list[float]:
    """The least time of the processor that each takes [s], taken by turns."""
    for motion in motions:
        motion()
    best = [1e9] * len(motions)
    for _ in range(rounds):
        for k, motion in enumerate(motions):
            begun = time.process_time()
            motion()
            best[k] = min(best[k], time.process_time() - begun)
    return best


def watched(n: int, guards: int, coordinates: str, rounds: int) -> tuple[float, float, float]:
    """A chain with guards that never fire: seconds without, and ratios of time and of evaluations."""
    plain, other = pendulums(n), pendulums(n)
    for k in range(guards):
        other.add(fb.Event(f"e{k}", when=f"J{k % n}.angle - 1000", direction="rising", do=[]))
    choices = {"outputs": 101, "coordinates": coordinates, "specialize": False}
    runs = [lambda: plain.simulate(10.0, **choices), lambda: other.simulate(10.0, **choices)]
    a, b = least(runs, rounds)
    return a, b / a, runs[1]().health.evaluations / runs[0]().health.evaluations


def happening(rounds: int) -> tuple[float, int]:
    """What an event takes [s], and how many there are: a wheel that turns past 400 marks."""
    plain = fb.Mechanism("wheel", planar=True)
    plain.add(fb.Body("b", mass=1.0, inertia=0.1, angular_velocity=1.0), fb.Revolute("A", "ground", "b", at=(0, 0)))
    other = plain.changed({})
    other.add(fb.Event("mark", when="sin(400*pi*A.angle + 0.3)", do=[]))
    a, b = least([lambda: plain.simulate(1.0, outputs=2), lambda: other.simulate(1.0, outputs=2)], rounds)
    n = len(other.simulate(1.0, outputs=2).events)
    return (b - a) / n, n


def decided(name: str, seconds: float, rounds: int) -> tuple[float, float, int]:
    """CPU seconds of a whole call and of one instant in it, the least of some rounds; how many instants there are."""
    m = mechanisms.example(name)
    m.simulate(seconds, outputs=2)
    happen, spent = eventful.resolve_event, [0.0, 0.0]

    def timed(*given: Any) -> None:
        begun = time.process_time()
        happen(*given)
        spent[0] += time.process_time() - begun
        spent[1] += 1.0

    call, one = 1e9, 1e9
    eventful.resolve_event = timed
    try:
        for _ in range(rounds):
            spent[:] = 0.0, 0.0
            begun = time.process_time()
            m.simulate(seconds, outputs=2)
            call, one = min(call, time.process_time() - begun), min(one, spent[0] / max(spent[1], 1.0))
    finally:
        eventful.resolve_event = happen
    return call, one, int(spent[1])


def main() -> None:
    rounds = int(sys.argv[1]) if len(sys.argv) > 1 else 10
    print(f"{'chain of':>9} {'guards':>7} {'coordinates':>12} {'without':>10} {'time':>6} {'evaluations':>12}")
    for n, guards in ((1, 1), (2, 1), (6, 1), (6, 12)):
        for coordinates in ("absolute", "joint"):
            a, ratio, more = watched(n, guards, coordinates, rounds)
            print(f"{n:9d} {guards:7d} {coordinates:>12} {1e3 * a:7.2f} ms {ratio:6.2f} {more:12.2f}")
    each, n = happening(rounds)
    print(f"an event takes {1e6 * each:.0f} us ({n} in a second)")
    print(f"\n{'example':>22} {'motion':>7} {'whole call':>11} {'instants':>9} {'one of them':>12}")
    for name, seconds in EXAMPLES.items():
        call, one, n = decided(name, seconds, rounds)
        print(f"{name:>22} {seconds:5.0f} s {1e3 * call:8.1f} ms {n:9d} {1e6 * one:9.0f} us")


if __name__ == "__main__":
    main()
