"""Signals that follow from each other at one instant: what linear algebra says of them, and of what it cannot."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm

import flyball as fb
from tests.control.slide import TIGHT, slide


def test_two_gains_and_a_lead():
    """A = 2 + 0.5 B, B = k A - A.displacement; and a lead that feeds itself back: against a matrix exponential."""
    m = slide(
        fb.StateSpace("a", inputs=["2 + 0.5*b"], D=1),
        fb.StateSpace("b", inputs=["k*a - A.displacement"], D=1),
        fb.Lag("lead", of="a - 3*lead", time=0.1, lead=0.2),
        force="lead",
        k=-3.0,
    )
    r = m.simulate(0.8, outputs=5, **TIGHT)
    # a = (2 - 0.5 x) / 2.5; lead = z + 2 (a - 3 lead - z): lead = (2 a - z) / 7, z' = 10 (a - 3 lead - z)
    A = np.zeros((4, 4))  # x, x', z, 1
    a = np.array([-0.2, 0, 0, 0.8])
    lead = (2 * a - np.eye(4)[2]) / 7
    A[0, 1] = 1.0
    A[1] = lead + [-10, -2, 0, 0]
    A[2] = 10 * (a - 3 * lead - np.eye(4)[2])
    y = np.array([expm(A * t) @ [0, 0, 0, 1] for t in r.t])
    assert r["A.displacement"] == pytest.approx(y[:, 0], abs=1e-9)
    assert r["lead.output"] == pytest.approx(y @ lead, abs=1e-9)
    assert r["a.output"] == pytest.approx(y @ a, abs=1e-9)
    assert r["b.output"] == pytest.approx(-3 * (y @ a) - y[:, 0], abs=1e-9)


def test_several_rings_through_one_signal():
    """Three signals, each of the other two: the solution of the three equations."""
    m = slide(
        fb.StateSpace("p", inputs=["1", "q", "s"], D=[[1, 0.2, -0.7]]),
        fb.StateSpace("q", inputs=["t", "p", "s"], D=[[1, 3, 0.4]]),
        fb.StateSpace("s", inputs=["p", "q"], D=[[-2, 0.5]]),
        force="0.0*p",
    )
    r = m.simulate(1, outputs=3)
    M = np.array([[1, -0.2, 0.7], [-3, 1, -0.4], [2, -0.5, 1]])
    for k, t in enumerate(r.t):
        exact = np.linalg.solve(M, [1, t, 0])
        assert [r[f"{n}.output"][k] for n in "pqs"] == pytest.approx(exact, rel=1e-10)


@pytest.mark.parametrize(
    ("made", "said"),
    [
        (lambda: fb.PID("b", setpoint="a", measured="A.displacement", kp=2, upper=1), "not linearly"),
        (lambda: fb.StateSpace("b", inputs=["sin(a)"], D=1), r"b\.output -> a\.output -> a\.input -> b\.output\. Have"),
        (lambda: fb.StateSpace("b", inputs=["a*a"], D=1), "not linearly"),
        (lambda: fb.StateSpace("b", inputs=["2*a"], D=1), "with the gain 1, so it is not determined"),
    ],
)
def test_what_has_no_solution_or_several(made, said):
    with pytest.raises(fb.ModelError, match=said):
        slide(fb.Lag("a", of="b", time=1, lead=0.5), made(), force="b")
