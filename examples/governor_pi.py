"""A flyball governor as the sensor of a PI controller: an engine under a load that rises, with droop and without.

Two balls of mass ``m`` on arms of length ``l`` turn with the shaft of an engine (inertia ``J``) and lift a sleeve.
Watt's governor sets the steam by the sleeve's height alone: under more load the engine turns slower for good (droop).
An integral of the sleeve's height takes the droop away. Steam follows the valve with a lag; a dashpot damps the sleeve.

In steady motion (m + M) g = m l W^2 cos(alpha), M being the sleeve's mass, ``alpha`` the arms' angle to the vertical.

Run it with ``python examples/governor_pi.py out``: it prints what is reached and writes plots and a page with the
animation into the folder.
"""

import sys
from pathlib import Path

import numpy as np

import flyball as fb

P = {"m": 1.0, "sleeve": 0.4, "l": 0.3, "alpha": 0.7, "J": 2.0, "b": 30.0, "g": 9.81}
P |= {"kp": 30.0, "ki": 0.0, "lag": 0.1, "load": 4.0, "more": 2.0, "at": 2.0}
SPEED = "sqrt((m + sleeve)*g/(m*l*cos(alpha)))"  # rad/s


def mechanism(**changed: float) -> fb.Mechanism:
    """The engine at speed under its load, which rises at the time ``at``; without an integral if ``ki`` is 0."""
    p = P | changed
    m = fb.Mechanism("engine and governor", gravity=(0, 0, "-g"), parameters=p | {"W": SPEED})
    foot, turning = (0, 0, "-2*l*cos(alpha)"), {"angular_velocity": (0, 0, "W")}
    small = ("1e-6", "1e-6", "1e-6")
    m.add(fb.Body("engine", mass=1, inertia=("J", "J", "J"), shape=fb.Cylinder(radius=0.15, length=0.05), **turning))
    m.add(fb.Body("sleeve", mass="sleeve", inertia=small, position=foot, shape=fb.Sphere(radius=0.03), **turning))
    m.add(fb.Revolute("shaft", "ground", "engine", at=(0, 0, 0), axis=(0, 0, 1)))
    m.add(fb.Prismatic("guide", "engine", "sleeve", at=foot, axis=(0, 0, 1)))
    for side, name in ((1, "right"), (-1, "left")):
        at = (f"{side}*l*sin(alpha)", 0, "-l*cos(alpha)")
        moving = {"velocity": (0, f"{side}*W*l*sin(alpha)", 0), **turning}
        m.add(fb.Body(name, mass="m", inertia=small, position=at, shape=fb.Sphere(radius=0.05), **moving))
        m.add(fb.Revolute(f"{name} hinge", "engine", name, at=(0, 0, 0), axis=(0, -side, 0)))
        m.add(fb.Distance(f"{name} link", name, "sleeve", at=(at, foot)))
    m.add(fb.CoordinateSpring("dashpot", "guide.displacement", damping="b"))
    gains = {"kp": "kp", "ki": "ki", "initial": "load"} if p["ki"] else {"kp": "kp", "bias": "load"}
    m.add(fb.PID("valve", setpoint="0", measured="guide.displacement", **gains))
    m.add(fb.Lag("steam", of="valve", time="lag", initial="load"))
    m.add(fb.Motor("engine torque", joint="shaft", torque="steam"))
    m.add(fb.Motor("load torque", joint="shaft", torque="-load - where(t < at, 0, more)"))
    return m


def speed(rise: float, **changed: float) -> float:
    """Of the steady motion with the sleeve so much higher than drawn [rad/s]."""
    p = P | changed
    height = 2 * p["l"] * np.cos(p["alpha"]) - rise  # of the hinges over the sleeve
    return float(np.sqrt(2 * (p["m"] + p["sleeve"]) * p["g"] / (p["m"] * height)))


def main(out: Path) -> None:
    """Both engines under more load."""
    out.mkdir(parents=True, exist_ok=True)
    for name, ki in (("droop", 0.0), ("integral", 8.0)):
        run = mechanism(ki=ki).simulate(60, outputs=1201)
        rate = run["shaft.angle_rate"]
        print(f"{name}: {rate[0]:.4f} rad/s before, {rate.min():.4f} at least, {rate[-1]:.4f} in the end")
        run.plot("shaft.angle_rate", path=out / f"{name}.png")
    print(f"droop by the formula: {speed(-P['more'] / P['kp']):.4f} rad/s")
    run.to_html(out / "governor_pi.html")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "."))
