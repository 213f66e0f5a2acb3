"""A mass of 1 kg on a slide, with a spring of 10 N/m and a damper of 2 N s/m: P = 1 / (s^2 + 2 s + 10)."""

from __future__ import annotations

import flyball as fb


def slide(*controllers, force: str = "pid", **parameters: float) -> fb.Mechanism:
    """The slide "A" under a force that controllers say."""
    m = fb.Mechanism("slide", planar=True, parameters=parameters)
    m.add(fb.Body("cart", mass=1.0, inertia=1.0))
    m.add(fb.Prismatic("A", "ground", "cart", at=(0, 0), axis=(1, 0)))
    m.add(fb.CoordinateSpring("spring", coordinate="A.displacement", stiffness=10, damping=2))
    m.add(*controllers)
    m.add(fb.Actuator("drive", coordinate="A.displacement", force=force))
    return m


TIGHT = {"rtol": 1e-11, "atol": 1e-12}
