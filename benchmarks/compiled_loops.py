"""flyball's own compiled pieces in loops of their own: right-hand sides again and again, kinematics at given times.

The loops are compiled when first called and not cached, which takes about half a minute.
"""

from __future__ import annotations

from typing import Any

import timing  # isort: skip  (before numpy: it fixes the thread counts)
import numpy as np

from flyball.compiler.kernels import kernel
from flyball.compiler.struct_layout import Float1
from flyball.engine.kinematics import retract
from flyball.engine.motion import (
    STAGES,
    TIGHT_G,
    TIGHT_V,
    derivative,
    project_and_evaluate,
    project_state,
    remember,
    set_prescribed,
)
from flyball.engine.solve import MAX_REFINEMENTS, factor, solve
from flyball.tables.table_definitions import System, Work

RIGHT_HAND_SIDE, KINEMATICS, REACTIONS = range(3)


@kernel
def follow(S: System, W: Work, times: Float1, y: Float1, dy: Float1, task: int) -> int:
    """Visit the times; ``y`` goes along from each to the next. Returns 0 or a status.

    KINEMATICS: positions by Newton's method from those before, carried on with velocities and accelerations; then
    velocities, and accelerations from the constraints alone. REACTIONS: the same with forces, accelerations and
    reactions, as a simulation reports them.
    """
    nq, nv = S.sizes.coordinates, W.velocities.solved.shape[0]
    q, v, z = y[:nq], y[nq : nq + nv], y[nq + nv :]
    a, step = W.velocities.solved, W.velocities.scratch_3
    for k in range(times.shape[0]):
        if task == RIGHT_HAND_SIDE:
            status = derivative(times[k], y, dy, S, W)
        else:
            if k > 0:
                h = times[k] - times[k - 1]
                for d in range(nv):
                    step[d] = h * (v[d] + 0.5 * h * a[d])
                    v[d] += h * a[d]
                retract(S, q, step)
            if task == REACTIONS:
                status = project_and_evaluate(times[k], y, dy, S, W)[0]
            else:
                set_prescribed(S, W, times[k], q, v)
                status, _, factored = project_state(S, W, times[k], q, v, z, TIGHT_G * S.scales.length, TIGHT_V)
                remember(S, W, z)
                if not factored:
                    factor(S, W)
                solve(S, W, W.velocities.applied, W.rows.gamma, a, W.rows.multiplier, False, MAX_REFINEMENTS)
        if status != 0:
            return status
    return 0


def clock(c: Any, y: np.ndarray, times: np.ndarray, task: int) -> float:
    """CPU seconds of the loop over the times, from the state y of a compiled mechanism.

    Raises
    ------
    RuntimeError
        If the loop could not go on.
    """
    S, W = c.values.system, c.work
    W.options.stabilization, W.options.solve_tolerance = STAGES, 1e-13
    W.options.position_tolerance, W.options.velocity_tolerance = 1e-10, 1e-9  # those of a simulation at rtol 1e-8
    y, dy = y.copy(), np.zeros(len(y))
    run = follow
    run(S, W, times[:1], y.copy(), dy, task)  # compiles, and brings the arrays into the cache
    status = []
    seconds = timing.cpu(lambda: status.append(run(S, W, times, y, dy, task)))
    if status[0] != 0:
        raise RuntimeError(f"the loop ended with the status {status[0]}")
    return seconds
