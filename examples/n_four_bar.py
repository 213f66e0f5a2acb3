"""IFToMM benchmark A02: N windows of rods 1 m long; the motion passes its singular (flat) position again and again.

Run it with ``flyball run examples/n_four_bar.py --t-end 10 --out out``.
"""

import flyball as fb


def mechanism(windows: int = 3, speed: float = 1.0) -> fb.Mechanism:
    """N windows, upright; the upper bars start at ``speed`` [m/s]."""
    m = fb.Mechanism(f"{windows} four-bars", planar=True, gravity=(0, -9.81), parameters={"speed": speed})
    for i in range(windows + 1):
        m.add(
            fb.Body(f"post {i}", mass=1, inertia=1 / 12, position=(i, 0.5), angle="90 deg", angular_velocity="-speed")
        )
        m.add(fb.Revolute(f"A{i}", "ground", f"post {i}", at=(i, 0)))
    for i in range(windows):
        m.add(fb.Body(f"bar {i}", mass=1, inertia=1 / 12, position=(i + 0.5, 1), velocity=("speed", 0)))
        m.add(fb.Revolute(f"B{i}", f"post {i}", f"bar {i}", at=(i, 1)))
        m.add(fb.Revolute(f"C{i}", f"bar {i}", f"post {i + 1}", at=(i + 1, 1)))
    m.add(fb.Initial("A0.angle", rate="-speed"))
    return m
