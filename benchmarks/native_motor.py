"""Motors of a tree as a compiled callback of MuJoCo's, so that no Python runs within its steps.

MuJoCo calls it in every stage of a step. The time comes from an actuator without a force that integrates 1, since the
layout of its structures is not public; coordinates, rates and torques from the addresses of their arrays.
"""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
from numba import carray, cfunc, types
from numba.extending import intrinsic
from trees import Tree

HEAD = 4  # addresses: time, coordinates, rates, torques
_kept: list[Any] = []  # what the callback reads must outlive it


@intrinsic
def pointer(typing_context, address):
    """An address as a pointer to doubles."""

    def build(context, builder, signature, arguments):
        return builder.inttoptr(arguments[0], context.get_value_type(types.CPointer(types.float64)))

    return types.CPointer(types.float64)(types.int64), build


def add_clock(spec: Any, joint: str) -> None:
    """An actuator whose activation is the time."""
    clock = spec.add_actuator(name="clock", target=joint)
    clock.trntype = mujoco.mjtTrn.mjTRN_JOINT
    clock.dyntype = mujoco.mjtDyn.mjDYN_INTEGRATOR
    clock.gaintype, clock.gainprm[0] = mujoco.mjtGain.mjGAIN_FIXED, 0.0


def install(tree: Tree, model: Any, data: Any, joints: list[int]) -> None:
    """Have the motors act in this simulation; ``joints``: MuJoCo's number of each joint of the tree."""
    data.ctrl[:] = 1.0
    numbers = np.array([[m.stiffness, m.damping, m.swing, m.speed, m.torque] for m in tree.motors])
    place = np.array([[model.jnt_qposadr[joints[m.axis]], model.jnt_dofadr[joints[m.axis]]] for m in tree.motors])
    act, qpos, qvel, force = (a.ctypes.data for a in (data.act, data.qpos, data.qvel, data.qfrc_applied))
    nq, nv, n = model.nq, model.nv, len(numbers)

    @cfunc("void(voidptr, voidptr)")
    def control(_model, _data):
        t = carray(pointer(act), 1)[0]
        q, v, f = carray(pointer(qpos), nq), carray(pointer(qvel), nv), carray(pointer(force), nv)
        for k in range(n):
            angle, rate = q[place[k, 0]], v[place[k, 1]]
            turn = numbers[k, 3] * t
            f[place[k, 1]] = (
                numbers[k, 4]
                + numbers[k, 0] * (numbers[k, 2] * (1.0 - np.cos(turn)) - angle)
                + numbers[k, 1] * (numbers[k, 2] * numbers[k, 3] * np.sin(turn) - rate)
            )

    _kept[:] = [control]
    mujoco.set_mjcb_control(control.ctypes)
