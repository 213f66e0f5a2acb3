"""Residuals of the solves of a motion over their iterations: the motion's own solves, whatever the solver."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb
from flyball.numerics.complementarity.contact_problem import allocate_solver
from flyball.numerics.complementarity.solve_history import (
    COMPLEMENTARITY,
    ENERGY,
    ITERATION,
    PRIMAL,
    VELOCITY,
    cuts,
    solve_history,
)
from flyball.numerics.complementarity.solver_choice import SOLVERS, solver_names
from tests.cone.problems import KINDS, dense, impulses, random_problem

WITHOUT_TORQUES = [k for k in KINDS if not len(random_problem(3, **KINDS[k])[0].turn)]  # rolling friction has some


def pile() -> fb.Mechanism:
    """Balls that fall on each other, and a pendulum that hits them."""
    m = fb.Mechanism("pile", gravity=(0, 0, -9.81))
    m.add(fb.Ground("floor", shape=fb.Plane()))
    x = np.random.default_rng(0).random((12, 3)) * (0.2, 0.2, 0.3) + (0, 0, 0.05)
    m.add(fb.Bodies("balls", shape=fb.Sphere(radius=0.05), density=1000, position=x))
    m.add(fb.Body("bob", mass=1, shape=fb.Sphere(radius=0.05), position=(0.4, 0.1, 0.3)))
    m.add(fb.Revolute("pivot", "ground", "bob", at=(0.1, 0.1, 0.5), axis=(0, 1, 0)))
    m.add(fb.Contact(friction=0.3))
    return m


def options(solver: str, **more) -> fb.Stepping:
    return fb.Stepping(step="5 ms", solver=solver, coulomb=solver != "barzilai-borwein", **more)


@pytest.mark.parametrize("solver", [n for n in solver_names() if n != "lcp"])  # refused, see test_lcp
def test_the_residuals_are_those_of_the_motion(solver):
    m = pile()
    plain = m.simulate(0.3, outputs=3, method=options(solver))
    run = m.simulate(0.3, outputs=3, method=options(solver, history="all"))
    assert np.array_equal(run["balls"].position, plain["balls"].position)
    h = run.contacts.history
    assert h.solver == solver and len(h) > 40 and (np.diff(h.t) > 0).all()
    worst = max(step.velocity[-1] for step in h)
    if solver != "pyramid":  # its residual is that of the cone
        assert worst == pytest.approx(run.health.contact.residual, rel=1e-6)
    assert h.iterations.sum() <= run.health.contact.iterations + len(h)  # those of positions count there, too


def test_which_steps():
    m = pile()
    some = {
        x: m.simulate(0.3, outputs=2, method=options("auto", history=x)).contacts.history
        for x in ("all", 5, (0.2, 0.25))
    }
    every = some["all"]
    assert set(some[5].t) < set(every.t) and len(some[5]) == pytest.approx(len(every) / 5, abs=1)
    assert some[0.2, 0.25].t == pytest.approx(np.arange(0.2, 0.2501, 0.005))
    assert np.array_equal(some[0.2, 0.25].at(0.22).energy, every.at(0.22).energy)


@pytest.mark.parametrize("kind", WITHOUT_TORQUES)
@pytest.mark.parametrize("solver", ["gauss-seidel", "jacobi", "barzilai-borwein", "apgd", "apgd-lean", "newton"])
def test_the_columns_are_what_they_say(solver, kind):
    P, X, _, _, _ = random_problem(3, **KINDS[kind])
    _, _, N, b = dense(P, X)
    start = allocate_solver(P)[0]
    start.v[:], start.wide[:] = X.v, X.wide
    O = allocate_solver(P)[2]
    O.count.most, O.real.enough = 60, 0.0
    rows = solve_history(solver, P, start, O)
    assert list(rows[:5, ITERATION]) == [1, 2, 3, 4, 5]
    if solver == "gauss-seidel":
        assert (np.diff(rows[:, ENERGY]) <= 1e-14).all()  # every visit is a descent in the convex form
    Y, W, _, F = allocate_solver(P)
    if solver == "newton":
        assert rows[-1, VELOCITY] < 1e-9
        return
    Y.v[:], Y.wide[:] = X.v, X.wide
    SOLVERS[solver](P, Y, W, O, F, 0)
    p = impulses(P, Y)
    u = (N @ p + b)[: 3 * len(P.mu)].reshape(-1, 3)
    assert rows[-1, VELOCITY] == pytest.approx(O.real.residual, rel=1e-6, abs=1e-12)
    assert rows[-1, ENERGY] == pytest.approx(0.5 * p @ N @ p + b @ p)
    assert rows[-1, PRIMAL] == pytest.approx(max(0.0, -u[:, 0].min()), abs=1e-9)
    assert rows[-1, COMPLEMENTARITY] == pytest.approx(np.abs((u * Y.p).sum(axis=1)).max(), abs=1e-9)


def test_cuts():
    assert cuts(1) == [1] and cuts(32) == list(range(1, 33))
    assert cuts(100)[31:] == [32, 36, 40, 45, 50, 56, 63, 70, 78, 87, 97, 100]


@pytest.mark.parametrize("wrong", ["some", 0, True, -3, (0.3, 0.1), (1,), 0.5])
def test_wrong_steps_are_refused(wrong):
    with pytest.raises(fb.ModelError, match=r"history of Stepping is .*; give 'all', a number n"):
        fb.Stepping(history=wrong)


def test_where_a_history_would_do_nothing():
    m = pile()
    with pytest.raises(fb.ModelError, match="no result that would keep history='all'"):
        m.stepper(0.01, method=fb.Stepping(history="all"))


def test_times_are_quantities_and_texts_are_short():
    kept = pile().simulate(0.3, outputs=2, method=options("auto", history=("200 ms", 0.25))).contacts.history
    assert (kept.t[0], kept.t[-1]) == pytest.approx((0.2, 0.25))
    assert kept.at("0.23 s").t == kept.at(0.23).t == pytest.approx([0.23])
    assert len(repr(kept)) < 130 and f"{len(kept)} steps from 0.2 s to 0.25 s" in repr(kept)
    with pytest.raises(fb.ModelError, match="t: "):
        kept.at("5 kg")
    with pytest.raises(fb.ModelError, match="history: unknown name 'a'"):
        fb.Stepping(history=("a", "b"))


def test_a_range_that_the_motion_does_not_reach_is_refused():
    with pytest.raises(fb.ModelError, match=r"from 0\.5 s to 0\.6 s, and the motion from 0 s to 0\.3 s"):
        pile().simulate(0.3, method=options("auto", history=(0.5, 0.6)))
