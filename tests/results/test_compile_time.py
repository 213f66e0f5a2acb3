"""What was compiled at a first call is told apart from what was computed."""

from __future__ import annotations

import dataclasses
import time

import pytest

import flyball as fb
from flyball.analysis.compile_time import compiled_since
from flyball.compiler.jit import start_numba
from flyball.view.report import report
from tests.results.made_up import slider_crank


def test_compilations_are_counted():
    """Most of the first call of a function is compiling, nothing of the second one."""
    start_numba()
    from numba import njit

    @njit
    def more(x):
        return x + 1.0

    begin = time.perf_counter()
    more(1.0)
    took = time.perf_counter() - begin
    assert 0.0 < compiled_since(begin) <= took
    again = time.perf_counter()
    more(1.0)
    assert compiled_since(again) == 0.0


@pytest.mark.parametrize(
    ("compiling", "line", "tile"),
    [
        (3.5, "4.00 s, of which 3.50 s of compiling", "0.50 s of computing, after 3.5 s of compiling"),
        (0.0, "4.00 s", "4.00 s of computing"),
    ],
)
def test_told_apart(compiling, line, tile):
    r = slider_crank()
    r.health = dataclasses.replace(r.health, seconds=4.0, compiling=compiling)
    assert dict(r.health.lines())["time used"] == line
    assert f"refused, {tile}<" in report(r)


def test_no_more_than_the_whole():
    m = fb.Mechanism("free", planar=True)
    m.add(fb.Body("b", mass=1, inertia=1))
    h = m.simulate(1).health
    assert 0.0 <= h.compiling <= h.seconds
