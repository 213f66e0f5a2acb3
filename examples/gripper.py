"""A gripper lifts a box by friction: two fingers press with a force each, and a driver raises the hand.

A finger holds up to friction times its force, so the box stays as long as 2 mu F > m (g + a).

Run it with ``flyball run examples/gripper.py --t-end 3 --outputs 91 --out out``.
"""

import flyball as fb

EDGE, MASS, FRICTION = 0.1, 1.0, 0.5  # of the box [m], [kg]


def mechanism(force: float = 20.0) -> fb.Mechanism:
    """Each finger presses with ``force`` [N]; 9.81 N is needed to hold the box at rest."""
    m = fb.Mechanism("gripper", gravity=(0, 0, -9.81), parameters={"F": force, "height": 0.25})
    m.add(
        fb.Ground("table", shape=fb.Box(edges=(0.6, 0.4, 0.04), position=(0, 0, -0.02)), color="#9aa6b3"),
        fb.Body("box", shape=fb.Box(edges=(EDGE,) * 3), mass=MASS, position=(0, 0, EDGE / 2), color="#e5862b"),
        fb.Body("hand", shape=fb.Box(edges=(0.3, 0.06, 0.04)), mass=1.0, position=(0, 0, 0.22), color="#5b6b7c"),
        fb.Prismatic("lift", "ground", "hand", at=(0, 0, 0.22), axis=(0, 0, 1)),
        # at rest for 0.5 s, then up by a smooth step that takes 1.5 s
        fb.Driver("hoist", "lift.displacement", "step5(t, 0.5, 0, 2, height)"),
    )
    for name, side in (("left", -1), ("right", 1)):
        x = side * (EDGE / 2 + 0.03)
        finger = fb.Box(edges=(0.02, 0.06, 0.16))
        m.add(
            fb.Body(name, shape=finger, mass=0.2, position=(x, 0, 0.12), color="#2f6fb7"),
            fb.Prismatic(f"{name} slide", "hand", name, at=(x, 0, 0.2), axis=(-side, 0, 0)),
            fb.Actuator(f"{name} press", f"{name} slide.displacement", force="F - 20*rate"),
        )
    m.add(fb.Contact(friction=FRICTION))
    return m
