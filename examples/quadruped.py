"""A quadruped, read from a URDF file, falls on its feet and stands up, under PD control with gravity compensation.

It drops with folded legs, lands, stretches its legs, and shifts its weight. The twelve joints follow a posture by PD
control; the efforts that carry the legs are computed from their masses. The trunk is free: what it weighs bends the
springs of the gains. Impulse time stepping solves the contact of feet and trunk with the floor; its step follows from
the size of the bodies, and the feet are smaller, so that it is limited.

Run it with ``flyball run examples/quadruped.py --t-end 4 --outputs 201 --max-step 4ms --out out``.
"""

import warnings
from dataclasses import replace
from pathlib import Path

import flyball as fb

ROBOT = Path(__file__).with_name("quadruped.urdf")
LEGS = ("front_left", "front_right", "rear_left", "rear_right")
FOLDED, STANDING = (0.0, 1.25, -2.3), (0.0, 0.65, -1.3)  # rad: hip, thigh, shank
DROP = 0.45  # m: height of the trunk at the start


def posture(joint: int) -> str:
    """Reference of a joint of every leg: folded, and up by a smooth step that takes 1 s."""
    return f"step5(t, 1, {FOLDED[joint]}, 2, {STANDING[joint]})"


def mechanism() -> fb.Mechanism:
    """The robot above the floor, with its controller."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", fb.ModelWarning)  # URDF has no gravity: it is that of the Earth
        m = fb.load(ROBOT, floating=True)
    touching = ["trunk", *(f"{leg}_shank" for leg in LEGS)]
    for name in touching:  # shapes of robot files are for display; these are to touch the floor as well
        m.replace(replace(m[name], shape=tuple(replace(s, contact=True) for s in m[name].shape)))
    joints = [f"{leg}_{part}_joint" for leg in LEGS for part in ("hip", "thigh", "shank")]
    sway = "0.1*sin(3*(t - 2.5))*step5(t, 2.5, 0, 3, 1)"  # rad: all hips together
    references = [f"{posture(k % 3)} + {sway}" if k % 3 == 0 else posture(k % 3) for k in range(12)]
    angles = [f"{joint}.angle" for joint in joints]
    m.add(fb.GravityCompensatedPD("pd", coordinates=angles, reference=references, kp=90, kd=3, base="trunk"))
    for k, joint in enumerate(joints):
        m.add(fb.Motor(f"{joint} motor", joint, torque=f"pd.{joint}"))
        m.add(fb.Initial(f"{joint}.angle", value=FOLDED[k % 3]))
    m.add(fb.Ground("floor", shape=fb.Plane(), position=(0, 0, -DROP)))
    m.add(fb.Contact(between=touching, others="floor", friction=0.7))
    return m
