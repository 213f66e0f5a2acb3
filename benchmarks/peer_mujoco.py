"""The N-four-bar in MuJoCo: a tree of hinges closed by soft ``connect`` equalities, made as stiff as the step allows.

With MuJoCo's default softness it is another mechanism (it loses 0.9 J of 25 for N = 1 at any step), so ``solref`` and
``solimp`` are set as its documentation advises for stiff constraints: a time constant of two steps, critical damping.
"""

from __future__ import annotations

import time

import mujoco
import numpy as np

from mechanisms import GRAVITY, ROD, from_tree

SETTINGS = {"RK4, stiff": ("RK4", 2.0), "RK4, softer (4 steps)": ("RK4", 4.0)}
mujoco.set_mju_user_warning(lambda text: None)  # an unstable run is told by its data, not by a log file
THIN = 1e-6  # moment of inertia of a rod about itself: not zero for MuJoCo, without effect in the plane


def xml(n: int, h: float, setting: str) -> str:
    """The model as MJCF: upright rods on ground, each but the last carrying a level one."""
    integrator, time_constant = SETTINGS[setting]
    parts = [
        f'<mujoco><option gravity="0 {-GRAVITY} 0" integrator="{integrator}" timestep="{h!r}" tolerance="1e-14"'
        f' iterations="50"><flag contact="disable"/></option><default><equality solref="{time_constant * h!r} 1"'
        f' solimp="0.9999 0.9999 0.001"/></default><worldbody>'
    ]
    for i in range(n + 1):
        parts.append(f'<body pos="{i} 0 0"><joint name="up{i}" axis="0 0 1"/><site name="top{i}" pos="0 1 0"/>')
        parts.append(f'<inertial pos="0 0.5 0" mass="1" diaginertia="{ROD!r} {THIN} {ROD!r}"/>')
        if i < n:
            parts.append(f'<body pos="0 1 0"><joint name="level{i}" axis="0 0 1"/><site name="end{i}" pos="1 0 0"/>')
            parts.append(f'<inertial pos="0.5 0 0" mass="1" diaginertia="{THIN} {ROD!r} {ROD!r}"/></body>')
        parts.append("</body>")
    loops = "".join(f'<connect site1="end{i}" site2="top{i + 1}"/>' for i in range(n))
    return "".join(parts) + f"</worldbody><equality>{loops}</equality></mujoco>"


def solve(n: int, t_end: float, steps: int, setting: str, samples: int = 0):
    """Integrate. Returns (coordinates, rates, CPU seconds of the stepping); no arrays where samples is 0."""
    model = mujoco.MjModel.from_xml_string(xml(n, t_end / steps, setting))
    data = mujoco.MjData(model)
    up = [model.joint(f"up{i}").dofadr[0] for i in range(n + 1)]
    level = [model.joint(f"level{i}").dofadr[0] for i in range(n)]
    data.qvel[up], data.qvel[level] = -1.0, 1.0
    if not samples:
        begin = time.process_time()
        mujoco.mj_step(model, data, nstep=steps)
        return None, None, time.process_time() - begin
    at = np.unique(np.linspace(0, steps, samples + 1).round().astype(int))
    angle, rate = [data.qpos.copy()], [data.qvel.copy()]
    for count in np.diff(at):
        mujoco.mj_step(model, data, nstep=int(count))
        angle.append(data.qpos.copy())
        rate.append(data.qvel.copy())
    order = np.array(up + level)
    if any(w.number for w in data.warning):
        raise RuntimeError("MuJoCo warned of an unstable simulation")
    return *from_tree(n, np.array(angle)[:, order], np.array(rate)[:, order]), 0.0
