"""Every joint, found by registry: two tumbling bodies that it joins keep every law that has to hold."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import flyball as fb
from flyball.engine.entry_point import MOTION
from flyball.engine.motion import derivative
from flyball.model.model_files import dumps, loads
from tests.contract.zoo import (
    AS_DRAWN,
    CASES,
    GRAVITY,
    JOINTS,
    MASS,
    PLANAR,
    REMOVED,
    SPATIAL,
    TIMES,
    at_moments,
    centre,
    closely,
    difference,
    joined,
    motion,
)
from tests.layers import both_layers, started

# The random starts of these tests are no consistent ones, and being told so is not what they ask about.
pytestmark = [both_layers, pytest.mark.filterwarnings("ignore::flyball.errors.StartWarning")]

every = pytest.mark.parametrize(("where", "name"), CASES, ids=lambda x: x)


def test_every_joint_is_here():
    """A new joint takes its place in the zoo, in space and in the plane as far as it can be there."""
    assert set(SPATIAL) == {c.__name__ for c in JOINTS if c.spatial}
    assert set(PLANAR) == {c.__name__ for c in JOINTS if c.planar_normal}


@every
def test_constraints_energy_and_freedoms(where, name):
    """g = 0 and G v = 0, energy kept, and the freedoms that textbooks give."""
    health = motion(where, name).health
    assert health.violation < 1e-13
    assert health.velocity_violation < 1e-11
    assert health.energy_drift < 1e-8
    assert health.freedoms == (12 if where == "space" else 6) - REMOVED[where][name]
    assert not health.redundant


@every
def test_a_joint_gives_no_momentum(where, name):
    """Momentum grows by gravity alone, angular momentum about the common centre of mass is kept."""
    r = motion(where, name)
    S, place = r.values.system, r.values.structure.place
    total = sum(MASS.values())
    states = {k: centre(r, k) for k in MASS}
    momentum = sum(MASS[k] * x[1] for k, x in states.items())
    gravity = np.array(GRAVITY if where == "space" else (*GRAVITY[:2], 0.0))
    assert momentum == pytest.approx(momentum[0] + total * np.outer(TIMES, gravity), abs=1e-9)
    middle = sum(MASS[k] * x[0] for k, x in states.items()) / total
    spin = np.zeros_like(middle)
    for k, (p, v, w, R) in states.items():
        inertia = S.bodies.inertia[place[k]].reshape(3, 3)
        spin += np.cross(p - middle, MASS[k] * v) + np.einsum("nij,jk,nlk,nl->ni", R, inertia, R, w)
    assert spin == pytest.approx(np.tile(spin[0], (len(TIMES), 1)), abs=1e-9)


@every
def test_coordinates_and_their_derivatives(where, name):
    """Rates and accelerations of all coordinates are the differences of their values, over whole turns too."""
    r = closely(where, name)
    joint = r["J"]
    own = joint.element.measured(where == "plane")
    for what in own:
        value, rate, second = joint._measure(what, True)
        # arc lengths of a curve are exact at the nodes of its spline, whose third derivatives jump
        close = (1e-6, 1e-3) if name == "PointOnCurve" else (1e-8, 1e-7)
        assert at_moments(rate) == pytest.approx(difference(value), rel=close[0], abs=1e-7)
        assert at_moments(second) == pytest.approx(difference(rate), rel=close[1], abs=1e-6)
        start = joint.element.offset(r.values.numbers["J"], what)
        start += AS_DRAWN[name](joint.element, what) if name in AS_DRAWN else 0.0
        if name != "PointOnCurve":  # its position is counted from the first point of the curve
            assert value[0] == pytest.approx(start, abs=1e-12), "as drawn"
    if "angle" in own:
        assert np.ptp(joint.angle) > 2.0 * np.pi, "a test of turns has to turn"


@every
def test_angles_and_displacements_mean_what_they_say(where, name):
    """Angle: the rotation vector of M seen from F along the axis, unwrapped; others: the way from F to M along axes."""
    r = motion(where, name)
    own = r["J"].element.measured(where == "plane")
    s = r.values.structure
    F, M = (r.records.frame(s.frame_at["J", k, ""]) for k in "FM")
    RF, RM = (np.stack(x[1], axis=1).reshape(-1, 3, 3) for x in (F, M))
    way = np.einsum("nji,nj->ni", RF, np.stack(M[0], axis=1) - np.stack(F[0], axis=1))
    if "angle" in own and name != "Planar" and (where, name) != ("space", "RopeSpan"):  # which leaves all turns free
        turn = Rotation.from_matrix(np.einsum("nji,njk->nik", RF, RM)).as_rotvec()
        axis = 1 if own["angle"].turn_F else 2
        value = np.unwrap(turn[:, axis]) + r["J"].angle[0]
        assert r["J"].angle == pytest.approx(value, abs=1e-9)
    for what, column in (("x", 0), ("y", 1), ("z", 2), ("displacement", 2)):
        if what in own:
            value = way[:, column] + getattr(r["J"], what)[0] - way[0, column]
            assert getattr(r["J"], what) == pytest.approx(value, abs=1e-12)


@every
def test_compiled_code_is_the_plain_python(where, name):
    """The right-hand side at the start, from compiled code and by running the same formulas in Python."""
    a = started(joined(where, name))
    c = a.compiled
    _, fast = c.at(0.0, a.q, a.v, MOTION)
    y, plain = np.r_[a.q, a.v, c.z], np.zeros(len(fast))
    assert derivative(0.0, y, plain, c.values.system, c.work) == 0
    assert fast == pytest.approx(plain, rel=1e-11, abs=1e-11 * np.abs(plain).max())


@every
def test_accelerations_fulfil_the_rows(where, name):
    """G vdot = gamma, in motion."""
    r = motion(where, name)
    c = started(joined(where, name)).compiled
    nq, nv = c.structure.nq, c.structure.nv
    for k in (0, 200, 400):
        c.z = r.states[k].copy()
        _, dy = c.at(r.t[k], r.q[k], r.v[k], MOTION)
        gamma = c.work.rows.gamma
        largest = np.abs(gamma).max(initial=0.0)  # a tree joint may have left no row
        assert c.jacobian() @ dy[nq : nq + nv] == pytest.approx(gamma, abs=1e-10 * (1.0 + largest))
        assert r.vdot[k] == pytest.approx(dy[nq : nq + nv], rel=1e-8, abs=1e-8 * np.abs(dy).max())


@every
def test_a_model_file_holds_it(where, name):
    m = joined(where, name)
    again = loads(dumps(m), fb.Mechanism, "zoo.toml")
    assert again == m
    assert dumps(again) == dumps(m)
