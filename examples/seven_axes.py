"""A robot of seven axes whose gears are elastic and whose motors have dry friction, under computed torque control.

Each axis has a rotor, with the moment of inertia that it has behind its gear, and a link; the gear between them is a
torsional spring with a damper. The controller measures the links and knows a rigid robot: neither the elasticity of the
gears, nor friction, nor the weight of the rotors. The error of the angles is what the controller does not know, divided
by its gains.

Run it with ``python examples/seven_axes.py out``: it prints the errors, and writes a page with the animation.
"""

import sys
from pathlib import Path

import numpy as np

import flyball as fb

LENGTHS = (0.16, 0.18, 0.20, 0.20, 0.18, 0.16, 0.08)  # m, of the links, one above the other as drawn
MASSES = (4.0, 4.0, 3.0, 2.7, 1.7, 1.8, 0.6)  # kg
ROTORS = (0.4, 0.4, 0.3, 0.3, 0.15, 0.15, 0.05)  # kg m^2, moments of inertia behind the gear
STIFFNESS = (2e4, 2e4, 1.5e4, 1.5e4, 8e3, 8e3, 4e3)  # N m/rad
FRICTION = (3.0, 3.0, 2.0, 2.0, 1.0, 1.0, 0.3)  # N m
REACH = (0.9, 0.7, -0.6, -1.2, 0.8, 0.9, 1.2)  # rad, from the drawn position
COLORS = ("#5b6770", "#e5862b", "#9aa6b3", "#e5862b", "#9aa6b3", "#e5862b", "#2f6fb7")
DURATION = 2.0  # s


def axis(k: int) -> tuple[float, float, float]:
    """Of joint ``k``: upright and across in turn."""
    return (0.0, 1.0, 0.0) if k % 2 else (0.0, 0.0, 1.0)


def mechanism(friction: float = 1.0, axes: int = 7, kp: float = 100.0, kd: float = 20.0) -> fb.Mechanism:
    """The arm at rest, or the first ``axes`` of it; ``friction`` multiplies that of all motors."""
    m = fb.Mechanism("robot of seven axes", gravity=(0, 0, -9.81), parameters={"friction": friction})
    carrier, height = "ground", 0.0
    m.add(
        fb.Ground(
            "pedestal", shape=fb.Cylinder(radius=0.09, length=0.1, position=(0, 0, -0.05), looks=True), color="#3c444b"
        )
    )
    for k, (length, mass) in enumerate(zip(LENGTHS[:axes], MASSES, strict=False)):
        j, at = k + 1, (0.0, 0.0, height)
        thick = 0.06 - 0.005 * k
        tube = fb.Cylinder(radius=thick, length=length, looks=True)
        drum = fb.Cylinder(radius=1.15 * thick, length=2.6 * thick, position=(0, 0, -length / 2), looks=True)
        hub = fb.Rod(start=tuple(-1.4 * thick * np.array(axis(k))), end=tuple(1.4 * thick * np.array(axis(k))),
                     radius=0.7 * thick, looks=True)  # fmt: skip
        wide, slim = 0.01 + mass * length**2 / 12, 0.01
        link = {"mass": mass, "inertia": (wide, wide, slim), "position": (0, 0, height + length / 2)}
        rotor = {"mass": 0.5, "inertia": (ROTORS[k],) * 3, "position": at}
        m.add(fb.Body(f"rotor_{j}", shape=hub, color="#3c444b", **rotor))
        m.add(fb.Body(f"link_{j}", shape=[tube, drum][: 1 + (k % 2 == 0)], color=COLORS[k], **link))
        m.add(fb.Revolute(f"motor_{j}", carrier, f"rotor_{j}", at=at, axis=axis(k)))
        m.add(fb.Revolute(f"joint_{j}", carrier, f"link_{j}", at=at, axis=axis(k)))
        gear = {"weights": (1, -1), "stiffness": STIFFNESS[k], "damping": 1e-3 * STIFFNESS[k]}
        m.add(fb.CoordinateSpring(f"gear_{j}", (f"joint_{j}.angle", f"motor_{j}.angle"), **gear))
        m.add(fb.Brake(f"friction_{j}", f"motor_{j}.angle", capacity=f"{FRICTION[k]}*friction"))
        carrier, height = f"link_{j}", height + length
    m.add(fb.Frame("tool", carrier, position=(0, 0, length / 2)))
    angles = [f"joint_{j}.angle" for j in range(1, axes + 1)]
    paths = [f"step5(t, 0, 0, {DURATION}, {x})" for x in REACH[:axes]]
    rotors = [f"rotor_{j}" for j in range(1, axes + 1)]
    m.add(fb.ComputedTorque("ctc", coordinates=angles, reference=paths, kp=kp, kd=kd, ignored=rotors))
    for j, rotor in enumerate(ROTORS[:axes], start=1):
        m.add(fb.Motor(f"drive_{j}", f"motor_{j}", torque=f"ctc.joint_{j} + {rotor}*ctc.joint_{j}_acceleration"))
    return m


def errors(run: fb.Result) -> np.ndarray:
    """Of the seven angles [rad], (times, 7)."""
    s = np.clip(run.t / DURATION, 0, 1)[:, None]
    wanted = np.array(REACH) * s**3 * (10 - 15 * s + 6 * s**2)
    return np.column_stack([run[f"joint_{j}.angle"] for j in range(1, 8)]) - wanted


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    folder.mkdir(parents=True, exist_ok=True)
    for friction in (0.0, 1.0):
        run = mechanism(friction).simulate(DURATION + 0.5, outputs=251)
        print(f"friction times {friction}: angles are at most {np.degrees(abs(errors(run)).max()):.2f} deg off")
    run.to_html(folder / "seven_axes.html")
