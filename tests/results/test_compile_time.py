"""What was compiled at a first call is told apart from what was computed."""

from __future__ import annotations

import dataclasses
import time
from typing import NamedTuple

import numpy as np
import pytest

import flyball as fb
from flyball.compiler.kernels import kernel
from flyball.compiler.object_code import baseline, compile_kernel
from flyball.compiler.object_files import announce_compilation, compiled_since
from flyball.compiler.struct_layout import Float1
from flyball.view.report import report_html
from tests.results.made_up import slider_crank


class Pair(NamedTuple):
    x: Float1


def test_compilations_are_counted():
    """Most of the first call of a kernel is compiling, nothing of the second one."""

    @kernel
    def more(p: Pair, by: float) -> float:
        return p.x[0] + by

    begin = time.perf_counter()
    compile_kernel(more, (baseline(),))  # whether or not there is a file of it
    with announce_compilation(more):
        pass
    assert compiled_since(begin) < time.perf_counter() - begin
    assert more(Pair(np.ones(1)), 2.0) == 3.0
    again = time.perf_counter()
    more(Pair(np.ones(1)), 2.0)
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
    assert f"refused, {tile}<" in report_html(r)


def test_no_more_than_the_whole():
    m = fb.Mechanism("free", planar=True)
    m.add(fb.Body("b", mass=1, inertia=1))
    h = m.simulate(1).health
    assert 0.0 <= h.compiling <= h.seconds
