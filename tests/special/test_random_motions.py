"""Random mechanisms of every family: made code and the engine's loops compute the same motion, or fail alike."""

from __future__ import annotations

import re

import numpy as np
import pytest

import flyball as fb
from tests.robust.families import FAMILIES, made

SMALL = 1e-3  # [m, rad, m/s, rad/s] below which nothing is asked of last digits
SEED, TRIES = 20, 20
SHORT = 0.1  # [s]: small differences grow


def ran(m: fb.Mechanism, t_end: float, wish: bool, **options):
    try:
        return m.simulate(t_end, specialize=wish, progress=False, **{**options, "outputs": 5}), ""
    except fb.SimulationError as error:
        return error.result, re.sub(r"[\d.e+-]+", "", str(error))[:40]


def begun(family: str):
    """A case that can begin, and its motion by the engine's loops: in the plane and in space, by turns."""
    first = SEED + list(FAMILIES).index(family)
    for seed in range(first, first + TRIES, 2):
        case = made(family, seed)
        try:
            return case, *ran(case.mechanism, min(case.t_end, SHORT), False, **case.options)
        except (fb.AnalysisError, fb.ModelError):  # it cannot be assembled, or begins beyond a stop
            continue
    raise AssertionError("a family of which nothing begins tests nothing")


# stepped by impulses, or implicitly: for these no code is made
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("family", [f for f in FAMILIES if f not in ("crowds", "stiff")])
def test_they_are_the_same(family):
    case, b, why_not = begun(family)
    t_end = min(case.t_end, SHORT)
    if b.values.structure.guards:
        with pytest.raises(fb.ModelError, match="does not support stops"):
            ran(case.mechanism, t_end, True, **case.options)
        return
    a, why = ran(case.mechanism, t_end, True, **case.options)
    assert why == why_not
    if why:
        return
    assert a.health.engine.startswith("made")
    for x, y in ((a.q, b.q), (a.v, b.v), (a.states, b.states)):
        if y.size:
            assert np.abs(x - y).max() <= 1e-5 * max(np.abs(y).max(), SMALL)
