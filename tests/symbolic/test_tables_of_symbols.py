"""Every number of every element as a symbol: the traced equations are those of the numbers that the symbols stand for."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb
from flyball.errors import ModelError
from flyball.expression_graph.graph import evaluate_array
from flyball.expression_graph.tracing import object_tables, trace_equations, trace_model
from flyball.tables.coordinate_choice import spanning_joints
from flyball.tables.values import values
from tests import mechanisms
from tests.complex_steps import with_parameters
from tests.contract import zoo
from tests.examples.test_examples import EQUATIONS as EXAMPLES
from tests.identities.test_complex_values import with_forces
from tests.model.test_shapes import SAMPLES

EQUATIONS = ("T", "M", "f", "g", "nu", "G", "gamma", "measured", "gradients", "zdot", "returned")


def agree(m):
    """With the numbers as they are, and with others: tables filled in anew."""
    m, _ = with_parameters(m)
    m = m.snapshot()
    for tree in {(), tuple(spanning_joints(m))}:
        symbolic = trace_model(m, tree)
        named = [x for x in symbolic.graph if x.op == "symbol" and x.data.kind == "parameter"]
        for seed in range(2):
            rng = np.random.default_rng(seed)
            told = {x.data.name: x.value * (1.0 + 1e-3 * seed * rng.normal()) for x in named}
            try:
                numeric = trace_equations(symbolic.structure, object_tables(values(symbolic.structure, told).system))
            except ModelError:
                continue  # right angles and the like allow no change
            state = {x.data.name: 0.4 * rng.normal() for x in (*numeric.q, *numeric.v, *numeric.lam, *numeric.loads)}
            state |= {x.data.name: 0.1 for x in numeric.z} | {"t": 0.3}
            heavy = max(1.0, np.abs(evaluate_array(numeric.M, state).astype(float)).max(initial=0.0))
            for name in EQUATIONS:
                a, b = (evaluate_array(getattr(x, name), state | told).astype(float) for x in (symbolic, numeric))
                size = max(heavy, np.abs(b[np.isfinite(b)]).max(initial=0.0))
                np.testing.assert_allclose(a, b, rtol=1e-11, atol=1e-11 * size, err_msg=name)


@pytest.mark.parametrize(("where", "name"), [c for c in zoo.CASES if c[1] not in zoo.SPLINED])
def test_every_joint(where, name):
    agree(zoo.joined(where, name))


def test_forces():
    agree(with_forces("plane"))


@pytest.mark.parametrize(
    "shape", [s for s in SAMPLES if len(getattr(s, "outline", ())) != 7], ids=lambda s: type(s).__name__
)
def test_every_shape(shape):
    m = fb.Mechanism("shape")
    m.add(fb.Body("b", density=7850.0, shape=shape, orientation=(0.2, -0.4, 0.9)))
    agree(m)


@pytest.mark.parametrize("name", [f for f in EXAMPLES if f not in ("cam.py", "stewart.py")])
def test_examples(name):
    agree(mechanisms.example(name))


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("Cam", "points of its profile follow parameters"),
        ("FlatFacedCam", "follow"),
        ("PointOnCurve", "its curve follows parameters, and a curve through symbols is not written out"),
    ],
)
def test_a_curve_through_symbols_is_refused(name, message):
    m, _ = with_parameters(zoo.joined("plane", name))
    with pytest.raises(ModelError, match=message):
        trace_model(m.snapshot())
