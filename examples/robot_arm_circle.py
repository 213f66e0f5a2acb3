"""A robot arm, read from a URDF file, draws a circle under computed torque control, with a load in its hand.

Inverse kinematics turns points of the circle into angles of the six joints, splines through these are the references.
The controller knows the masses of the arm and believes that the load is ``known``. If it is right the pen stays on the
circle to the accuracy of the splines; if not, it sags by what the gains leave.

Run it with ``python examples/robot_arm_circle.py out``: it prints the errors, and writes plots and pages with the
animation into the folder.
"""

import sys
import warnings
from pathlib import Path

import numpy as np

import flyball as fb

ROBOT = Path(__file__).with_name("arm.urdf")
JOINTS = tuple(f"joint_{k}" for k in range(1, 7))
CENTRE, RADIUS, DURATION = np.array([0.42, 0.0, 0.45]), 0.12, 4.0  # m, m, s
TIMES = np.linspace(0, DURATION, 81)
DOWN = np.diag([1.0, -1.0, -1.0])  # axes of the tip, as columns: its z points downwards
BENT = np.array([0, 0.3, 1.4, 0, 1.4, 0])  # rad: elbow up


def circle(t: np.ndarray) -> np.ndarray:
    """Points of a tilted circle at times, (n, 3): once around from rest to rest, by a quintic polynomial."""
    s = np.clip(np.asarray(t)[..., None] / DURATION, 0, 1)
    a = 2 * np.pi * s**3 * (10 - 15 * s + 6 * s**2)
    return CENTRE + RADIUS * (np.cos(a) * (0, 1, 0) + np.sin(a) * (0.8, 0, 0.6))


def waypoints(m: fb.Mechanism) -> np.ndarray:
    """Angles of the joints at the times of `TIMES`, (n, 6)."""
    p = m.prepare(coordinates="joint")
    q = [BENT]
    for point in circle(TIMES):
        q.append(p.inverse_kinematics("tip", point, DOWN, near=q[-1], starts=1).q[0])
    return np.array(q[1:])


def mechanism(known: float | str = "load") -> fb.Mechanism:
    """The arm with a load of 3 kg, of which the controller knows ``known`` [kg]."""
    m = fb.load(ROBOT)
    m.parameters["load"] = 3.0
    q = waypoints(m)
    m.add(
        fb.Body("load", mass="load", inertia=("load*0.0004",) * 3, position=(0, 0, 1.22), shape=fb.Sphere(radius=0.05))
    )
    m.add(fb.Fixed("grip", "tool", "load", at=(0, 0, 1.22)))
    for k, joint in enumerate(JOINTS):
        m.add(fb.Table(f"path_{k + 1}", x=TIMES, y=q[:, k], beyond="hold"))
        m.add(fb.Initial(f"{joint}.angle", value=q[0, k]))
    angles, paths = [f"{joint}.angle" for joint in JOINTS], [f"path_{k + 1}(t)" for k in range(6)]
    m.add(fb.ComputedTorque("ctc", coordinates=angles, reference=paths, kp=100, kd=20, parameters={"load": known}))
    m.add(*(fb.Motor(f"motor_{k + 1}", joint, torque=f"ctc.{joint}") for k, joint in enumerate(JOINTS)))
    return m


def distance(run: fb.Result) -> np.ndarray:
    """Distance of the tip from its place on the circle [m]."""
    return np.linalg.norm(run["tip"].position - circle(run.t), axis=1)


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    folder.mkdir(parents=True, exist_ok=True)
    warnings.simplefilter("ignore", fb.ModelWarning)
    for name, known in (("known", "load"), ("unknown", 0.0)):
        run = mechanism(known).simulate(DURATION, outputs=201)
        print(f"load {name}: the tip is at most {1e3 * distance(run).max():.3f} mm off")
        torques = [f"motor_{k}.torque" for k in range(1, 7)]
        run.plot(*torques, path=folder / f"robot_arm_circle_{name}.png")
        run.to_html(folder / f"robot_arm_circle_{name}.html")
