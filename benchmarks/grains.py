"""Grains in space: an hourglass of 5000 balls and a wheel with lugs on 10,000, beside MuJoCo on the same scenes.

Usage: ``python benchmarks/grains.py [hourglass wheel] [--seconds T] [--count N] [--alone] [--json FILE]``. CPU seconds
of one thread per simulated second; stretches of both engines are taken in turn, so that a busy spell of the machine
hits both. MuJoCo stops after `LIMIT`, and its ratio is over the same stretches. It has CG, elliptic cones and its
stiffest stable contacts for the step.
"""

from __future__ import annotations

import argparse
import runpy
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import timing  # isort: skip  (before numpy: it fixes the thread counts)
import numpy as np

import flyball as fb

EXAMPLES = Path(__file__).parents[1] / "examples"
HOURGLASS, WHEEL = (runpy.run_path(str(EXAMPLES / f"{name}.py")) for name in ("hourglass", "wheel_in_gravel"))
STRETCH, LIMIT = 0.05, 60.0  # s, of motion in turn; CPU seconds after which MuJoCo stops
LENGTH, BREADTH, MASS, SLIP = 1.2, 0.12, 1.5, 0.3  # m, of the trough; kg, of the wheel
STEPS = {"hourglass": 5e-4, "wheel": 1e-3}
COUNTS = {"hourglass": 5000, "wheel": 10_000}
COLUMNS = {
    "scene": "scene",
    "engine": "engine",
    "grains": "grains",
    "seconds": "simulated [s]",
    "cpu": "CPU s a second",
    "ratio": "times flyball",
    "overlap": "overlap at the end [mm]",
    "figure": "passed, or height of the axle [mm]",
}


def wheel(count: int) -> fb.Mechanism:
    """The wheel of the example with a breadth, on a bed in a trough, x along it and y upwards."""
    grain, r = WHEEL["GRAIN"], WHEEL["RADIUS"] + WHEEL["LUG"]
    pitch = 1.1 * grain
    n, b = int(LENGTH / pitch), int(BREADTH / pitch)
    k = np.arange(count)
    start = pitch * np.stack([k % n + 0.6, k // (n * b) + 0.6, k // n % b - (b - 1) / 2], axis=1)
    start += np.random.default_rng(1).uniform(-0.02, 0.02, start.shape) * grain
    x, y = 0.2, float(start[:, 1].max()) + grain + r
    m = fb.Mechanism(
        "wheel", gravity=(0, -9.81, 0), parameters={"w": WHEEL["SPEED"], "v": WHEEL["SPEED"] * r * (1 - SLIP)}
    )
    m.add(
        fb.Ground("trough", shape=tuple(trough(y))),
        fb.Body("carriage", mass=0.1, inertia=(1e-4,) * 3, position=(x, y, 0)),
        fb.Body("fork", mass=0.1 * MASS, inertia=(1e-4,) * 3, position=(x, y, 0)),
        fb.Body(
            "wheel", mass=0.9 * MASS, inertia=(0.004,) * 3, position=(x, y, 0), shape=WHEEL["wheel"](0.6 * BREADTH)
        ),
        fb.Prismatic("rail", "ground", "carriage", at=(x, y, 0), axis=(1, 0, 0)),
        fb.Prismatic("guide", "carriage", "fork", at=(x, y, 0), axis=(0, 1, 0)),
        fb.Revolute("axle", "fork", "wheel", at=(x, y, 0), axis=(0, 0, 1)),
        fb.Driver("pull", "rail.displacement", "v*t"),
        fb.Driver("motor", "axle.angle", "-w*t"),
        fb.Bodies("grains", shape=fb.Sphere(radius=grain / 2), density=2500, position=start),
        fb.Contact(friction=WHEEL["FRICTION"]),
    )
    return m


def trough(tall: float) -> list[fb.Solid]:
    """A floor and four walls."""
    t, middle = WHEEL["GRAIN"], LENGTH / 2
    sides = [fb.Box(edges=(LENGTH, tall, t), position=(middle, tall / 2, s * (BREADTH + t) / 2)) for s in (-1, 1)]
    ends = [fb.Box(edges=(t, tall, BREADTH), position=(middle + s * (LENGTH + t) / 2, tall / 2, 0)) for s in (-1, 1)]
    return [fb.Box(edges=(LENGTH, t, BREADTH), position=(middle, -t / 2, 0)), *sides, *ends]


def scene(what: str, count: int) -> fb.Mechanism:
    """The mechanism."""
    if what == "wheel":
        return wheel(count)
    return HOURGLASS["mechanism"](10 * HOURGLASS["GRAIN"], count, 0.05, False)


def text(values: Any) -> str:
    """Numbers for an attribute."""
    return " ".join(repr(float(x)) for x in np.ravel(values))


def mjcf_shape(shape: Any, name: str) -> tuple[str, str]:
    """A mesh, if it is one, and the geometry of a shape of the scenes."""
    if isinstance(shape, fb.Hull):
        return f'<mesh name="{name}" vertex="{text(shape.vertices)}"/>', f'<geom type="mesh" mesh="{name}"/>'
    pose = f'pos="{text(shape.position)}"' + ("" if shape.orientation is None else f' quat="{text(shape.orientation)}"')
    if isinstance(shape, fb.Box):
        return "", f'<geom type="box" size="{text(np.array(shape.edges) / 2)}" {pose}/>'
    return "", f'<geom type="cylinder" size="{shape.radius} {shape.length / 2}" {pose}/>'


def mjcf(m: Any, friction: float, step: float) -> str:
    """The scene for MuJoCo, from the shapes of the mechanism."""
    ground: Any = next(g for g in m.elements() if isinstance(g, fb.Ground))
    made = [mjcf_shape(s, f"g{k}") for k, s in enumerate(ground.shape)]
    grains = "".join(
        f'<body pos="{text(x)}"><freejoint/><geom type="sphere" size="{s.shape.radius}" density="2500"/></body>'
        for s in m.bulk
        for x in np.column_stack([s.position, np.zeros((len(s.position), 3 - s.position.shape[1]))])
    )
    extra = motors = ""
    if m.bodies:
        at = next(b for b in m.bodies if b.name == "wheel")
        shapes = "".join(mjcf_shape(s, "")[1].replace("<geom", '<geom mass="0"') for s in at.shape)
        extra = f"""<body pos="{text(at.position)}"><joint name="rail" type="slide" axis="1 0 0"/>
<inertial pos="0 0 0" mass="0.1" diaginertia="1e-4 1e-4 1e-4"/>
<body><joint type="slide" axis="0 1 0"/><inertial pos="0 0 0" mass="{0.1 * MASS}" diaginertia="1e-4 1e-4 1e-4"/>
<body name="wheel"><joint name="axle" type="hinge" axis="0 0 1"/>
<inertial pos="0 0 0" mass="{0.9 * MASS}" diaginertia="0.004 0.004 0.004"/>{shapes}</body></body></body>"""
        motors = """<actuator><velocity joint="rail" kv="1000"/><velocity joint="axle" kv="10"/></actuator>"""
    return f"""<mujoco><size memory="8G"/>
<option cone="elliptic" timestep="{step}" gravity="0 -9.81 0" solver="CG" integrator="implicitfast"/>
<default><geom friction="{friction} 0 0" condim="3" solref="{2 * step} 1" solimp="0.99 0.999 0.001"/></default>
<asset>{"".join(a for a, _ in made)}</asset>
<worldbody>{"".join(g for _, g in made)}{extra}{grains}</worldbody>{motors}</mujoco>"""


def flyball_run(m: fb.Mechanism, step: float) -> tuple[Callable[[float], None], Callable[[], dict[str, float]]]:
    """What goes on by a time, and what tells figures."""
    runs: list[Any] = []
    method = fb.Stepping(step=step, solver="gauss-seidel")

    def advance(t: float) -> None:
        runs[:] = [m.simulate(t, outputs=2, method=method, start=runs[-1] if runs else None)]

    def figures() -> dict[str, float]:
        run = runs[-1]
        places = np.concatenate([run[s.name].position[-1] for s in run.model.bulk])
        height = run["wheel.y"][-1] * 1e3 if m.bodies else (places[:, 1] < 0).sum()
        return {"overlap": -1e3 * np.min(run.contacts.at(run.t[-1]).gap, initial=0.0), "figure": float(height)}

    return advance, figures


def mujoco_run(m: fb.Mechanism, step: float) -> tuple[Callable[[float], None], Callable[[], dict[str, float]]]:
    """The same by MuJoCo."""
    import mujoco

    model = mujoco.MjModel.from_xml_string(mjcf(m, WHEEL["FRICTION"], step))
    data = mujoco.MjData(model)
    if model.nu:
        data.ctrl[:] = WHEEL["SPEED"] * (WHEEL["RADIUS"] + WHEEL["LUG"]) * (1 - SLIP), -WHEEL["SPEED"]

    def advance(t: float) -> None:
        while data.time < t - step / 2:
            mujoco.mj_step(model, data)

    def figures() -> dict[str, float]:
        free = model.jnt_bodyid[model.jnt_type == mujoco.mjtJoint.mjJNT_FREE]
        height = 1e3 * data.body("wheel").xpos[1] if model.nu else (data.xpos[free, 1] < 0).sum()
        return {"overlap": -1e3 * np.min(data.contact.dist[: data.ncon], initial=0.0), "figure": float(height)}

    return advance, figures


def contest(what: str, count: int, seconds: float, alone: bool) -> list[dict[str, Any]]:
    """A scene on both engines, stretch by stretch."""
    m, step = scene(what, count), STEPS[what]
    runs = {"flyball": flyball_run(m, step)}
    if not alone:
        runs["MuJoCo"] = mujoco_run(m, step)
    spent: dict[str, list[float]] = {name: [] for name in runs}
    for t in STRETCH * np.arange(1, round(seconds / STRETCH) + 1):
        for name, (advance, _) in runs.items():
            if name == "flyball" or sum(spent[name]) < LIMIT:
                began = time.process_time()
                advance(float(t))
                spent[name].append(time.process_time() - began)
    rows = []
    for name, (_, figures) in runs.items():
        n = len(spent[name])
        row = {"scene": what, "engine": name, "grains": count, "seconds": n * STRETCH, **figures()}
        row["cpu"] = sum(spent[name]) / (n * STRETCH)
        rows.append(row | {"ratio": sum(spent[name]) / sum(spent["flyball"][:n])})
    return rows


def main() -> None:
    """Run what is asked."""
    p = argparse.ArgumentParser(description=__doc__)
    p.add_argument("scenes", nargs="*", default=list(STEPS))
    p.add_argument("--seconds", type=float, default=0.5)
    p.add_argument("--count", type=int)
    p.add_argument("--alone", action="store_true", help="flyball only")
    p.add_argument("--json")
    a = p.parse_args()
    print(timing.heading())
    for what in a.scenes:
        contest(what, 50, STRETCH, True)  # compiled before
    rows = [r for what in a.scenes for r in contest(what, a.count or COUNTS[what], a.seconds, a.alone)]
    print(timing.table(rows, COLUMNS), flush=True)
    timing.write_json(a.json, rows)


if __name__ == "__main__":
    main()
