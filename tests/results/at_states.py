"""Results made of chosen states: evaluated one by one, nothing integrated."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from flyball.assembly.assembled_state import Assembly
from flyball.assembly.compiled_mechanism import CompiledMechanism
from flyball.engine.entry_point import MOTION
from flyball.mobility.mobility import mobility
from flyball.results.result import Result
from tests.results.made_up import healthy


def result_at(c: CompiledMechanism, times: Sequence[float], states: Sequence[tuple[np.ndarray, ...]]) -> Result:
    """The mechanism at those times in those states (q, v, z), with its accelerations and multipliers there."""
    s, S, W = c.structure, c.values.system, c.work
    driven = S.tree.v[S.tree.law >= 0]
    rows = []
    for t, (q, v, z) in zip(times, states, strict=True):
        c.z = z.copy()
        c.at(t, q, v)
        status, _ = c.at(t, q, v, MOTION)
        assert status == 0
        rows.append(
            (q, v, c.z.copy(), W.velocities.solved.copy(), np.r_[W.rows.multiplier, W.velocities.effort[driven]])
        )
    q, v, z, vdot, lam = (np.array(x) for x in zip(*rows, strict=True))
    return Result(s.model, c.values, np.array(times), q, v, z, vdot, lam, healthy())


def assembled(a: Assembly) -> Result:
    """An assembled mechanism where it starts."""
    r = result_at(a.compiled, [a.t], [(a.q, a.v, a.compiled.z)])
    r.health.late["mobility"] = partial(mobility, a.compiled.structure.model, a)
    return r


def in_other_coordinates(r: Result, c: CompiledMechanism, from_: CompiledMechanism) -> Result:
    """The same states of the same mechanism in the coordinates of ``c``; ``from_`` has those of the result."""
    states = []
    for t, q, v, z in zip(r.t.tolist(), r.q, r.v, r.states, strict=True):
        from_.z = z.copy()
        states.append((*c.take(from_, t, q, v), c.z.copy()))
    out = result_at(c, r.t.tolist(), states)
    out.health = r.health
    return out
