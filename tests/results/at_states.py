"""Results made of chosen states: evaluated one by one, nothing integrated."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from flyball.analysis.assemble import Assembly
from flyball.analysis.compiled import Compiled
from flyball.analysis.entry import MOTION
from flyball.analysis.mobility import mobility
from flyball.results.result import Result
from flyball.system.tables import LAM
from tests.results.made_up import healthy


def result_at(c: Compiled, times: Sequence[float], states: Sequence[tuple[np.ndarray, np.ndarray]]) -> Result:
    """The mechanism at those times in those states (q, v), with its accelerations and multipliers there."""
    s, nq, nv = c.structure, c.structure.nq, c.structure.nv
    rows = []
    for t, (q, v) in zip(times, states, strict=True):
        c.at(t, q, v)
        status, dy = c.at(t, q, v, MOTION)
        assert status == 0
        rows.append((q, v, c.z.copy(), dy[nq : nq + nv].copy(), c.work.row[LAM].copy()))
    q, v, z, vdot, lam = (np.array(x) for x in zip(*rows, strict=True))
    return Result(s.model, c.values, np.array(times), q, v, z, vdot, lam, healthy())


def assembled(a: Assembly) -> Result:
    """An assembled mechanism where it starts."""
    r = result_at(a.compiled, [a.t], [(a.q, a.v)])
    r.health.late["mobility"] = partial(mobility, a.compiled.structure.model, a)
    return r
