"""Cost of a step from outside beyond the computation: N calls of one step against one call of N steps.

    python benchmarks/stepper_overhead.py

Both take the same steps of the same motion, and end in the same state but for rounding of times. CPU time, least of
several repetitions.
"""

from __future__ import annotations

import time

import flyball as fb

STEPS, REPEATS = 2000, 7


def cart_pole() -> fb.Mechanism:
    m = fb.Mechanism("cart and pole", planar=True, gravity=(0, -9.81))
    m.add(fb.Body("cart", mass=1.0, inertia=0.1), fb.Body("pole", mass=0.1, inertia=0.01, position=(0, 0.5)))
    m.add(fb.Prismatic("rail", "ground", "cart", at=(0, 0), axis=(1, 0)))
    m.add(fb.Revolute("pin", "cart", "pole", at=(0, 0)), fb.Actuator("push", "rail.displacement", force="0"))
    return m


def bricks() -> fb.Mechanism:
    m = fb.Mechanism("leg and brick on a floor", gravity=(0, 0, -9.81))
    m.add(fb.Ground("floor", shape=fb.Plane()), fb.Contact("touch", friction=0.7))
    m.add(fb.Body("trunk", shape=fb.Box(edges=(0.3, 0.2, 0.1)), density=500, position=(0, 0, 0.6)))
    m.add(fb.Body("leg", shape=fb.Capsule(radius=0.03, length=0.3), density=500, position=(0, 0, 0.35)))
    m.add(fb.Body("brick", shape=fb.Box(edges=(0.2, 0.1, 0.05)), density=500, position=(0, 1, 0.3)))
    m.add(fb.Revolute("hip", "trunk", "leg", at=(0, 0, 0.55), axis=(0, 1, 0)), fb.Motor("torque", "hip", torque="0"))
    return m


def cost(sim: fb.Stepper, calls: int) -> float:
    """CPU time of ``STEPS`` steps in that many calls, per step [us]."""
    least = float("inf")
    for _ in range(REPEATS):
        sim.reset()
        began = time.process_time()
        for _ in range(calls):
            sim.step([0.1], steps=STEPS // calls)
        least = min(least, time.process_time() - began)
    return 1e6 * least / STEPS


def main() -> None:
    outputs = {
        "cart and pole": ["rail.displacement", "pin.angle"],
        "leg and brick on a floor": ["hip.angle", "brick.z"],
    }
    for m, inputs, options in (
        (cart_pole(), ["push"], {"method": "rk45", "step": 1e-3}),
        (bricks(), ["torque"], {"method": fb.Stepping(step=1e-3)}),
    ):
        sim = m.stepper(1e-3, inputs=inputs, outputs=outputs[m.name], **options)
        cost(sim, STEPS)
        one, all_ = cost(sim, STEPS), cost(sim, 1)
        print(f"{m.name:26} a step {one:6.1f} us, of these beyond the computation {one - all_:5.1f} us")


if __name__ == "__main__":
    main()
