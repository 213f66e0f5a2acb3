"""Splines in made code: the piece is looked for once, tried where it was last, and is the one that `math/spline.py` takes."""

from __future__ import annotations

import ctypes
from itertools import pairwise

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from flyball.codegen import machine_code
from flyball.compiler.object_code import object_code_of_text
from flyball.expression_graph.graph import Graph
from flyball.expression_graph.printers.llvm import Module, Procedure
from flyball.math.spline import pack_spline, spline

X = np.array([0.3, 0.5, 1.1, 1.2, 2.0, 3.7, 4.0])
Y = np.array([[1.0, -0.3, 2.0, 0.4, 0.0, 1.3, 1.0], [0.2, 0.1, -2.0, 0.7, 1.0, 0.9, 0.2]])


def tables(beyond):
    """Two splines with the same breaks."""
    ends = "periodic" if beyond == "repeat" else "not-a-knot"
    return [pack_spline(X, y, CubicSpline(X, y, bc_type=ends).c[::-1].T, beyond) for y in Y]


def text_of(data):
    """Value and three derivatives of both splines at two places: the text of a procedure "A"."""
    graph = Graph()
    x = [graph.symbol(f"x[{k}]") for k in range(2)]
    both = np.concatenate(data).tolist()
    stores = []
    for place in x:
        for at in (0, len(data[0])):
            orders, _ = graph.functions.table(both, at)
            stores += [graph.call(f, place) for f in orders]
    module = Module(machine_code.ARGUMENTS, lambda base: [])
    reads = {node.index: ("a", k) for k, node in enumerate(x)}
    module.add(Procedure("A", reads, [(("b", k), f) for k, f in enumerate(stores)]))
    return str(module)


def running(text):
    """The procedure as a Python function of two numbers."""
    loaded = machine_code.LoadedProcedures(object_code_of_text(text), ["A"])
    pointer, number = ctypes.c_void_p, ctypes.c_double
    kind = ctypes.CFUNCTYPE(number, pointer, pointer, number, pointer, pointer, pointer, pointer)
    call = kind(loaded.addresses["A"])

    def run(*x):
        given, out = np.array(x), np.zeros(16)
        call(None, None, 0.0, given.ctypes.data, out.ctypes.data, None, None)
        return out.reshape(2, 2, 4)

    run.loaded = loaded
    return run


@pytest.mark.parametrize("beyond", ["hold", "line", "repeat", "refuse"])
def test_pieces_values_and_derivatives(beyond):
    data = tables(beyond)
    run = running(text_of(data))
    rng = np.random.default_rng(1)
    near = [np.nextafter(X, -np.inf), X, np.nextafter(X, np.inf)]
    x = np.concatenate([*near, rng.uniform(-8.0, 12.0, 200), [np.nan, 4.0 + 3.7, 0.3 - 3.7, 4.0 + 1e-12]])
    rng.shuffle(x)
    for two in pairwise(x.tolist()):
        found = run(*two)
        for n, place in enumerate(two):
            for k in range(2):
                expected = spline(data[k], 0, place)
                np.testing.assert_allclose(found[n, k, :3], expected, rtol=1e-13, atol=1e-12)


def test_the_piece_is_looked_for_once_for_all_at_a_place():
    assert text_of(tables("line")).count("call { i64, double } @piece(") == 2
