"""Inverse dynamics against forward dynamics and published values; dependencies found by one factor a position."""

import numpy as np
import pytest

import flyball as fb
from flyball.assembly.compiled_mechanism import compile_mechanism
from flyball.kinematics import inverse_dynamics as own
from flyball.numerics.rank import fundamental_subspaces
from tests.analyses.linkages import four_bar_driven
from tests.analyses.test_inverse_dynamics import arm
from tests.assembly.test_mobility import parallelogram
from tests.layers import LAYERS
from tests.mechanisms import door, example, four_bar
from tests.verification.test_ivp_test_set import FIRST_ACCELERATIONS, FIRST_MULTIPLIERS, loop_forces


def andrews_driven(law: str) -> fb.Mechanism:
    m = example("andrews.toml")
    m.forces[:] = [f for f in m.forces if not isinstance(f, fb.Motor)]
    m.add(fb.Driver("drive", "crank.angle", law))
    return m


@pytest.mark.parametrize("coordinates", LAYERS)
def test_andrews_start_as_published(coordinates):
    """Test Set II-13: accelerated as by its motor of 33 mN m the crank takes 33 mN m, and the loops carry as much."""
    m = andrews_driven(f"beta + {FIRST_ACCELERATIONS[0] / 2!r}*t**2")
    found = m.inverse_dynamics([0.0, 1e-4], coordinates=coordinates)
    assert found.efforts["drive"][0] == pytest.approx(0.033, rel=1e-11)
    assert loop_forces(found, 0) == pytest.approx(FIRST_MULTIPLIERS, rel=1e-10, abs=1e-9)
    assert found.undetermined == {}


MOVED = {
    "arm": (arm, {"shoulder.angle": "0.3*sin(2*t)", "elbow.angle": "1 - cos(3*t)"}),
    "four-bar": (four_bar, {"A.angle": "0.5*sin(3*t)"}),
    "door": (door, {"upper.angle": "0.5*sin(2*t)"}),
}


@pytest.mark.parametrize("coordinates", LAYERS)
@pytest.mark.parametrize("name", MOVED)
def test_the_efforts_found_move_it_so(name, coordinates):
    """Motors that give the efforts found, by a spline through 401 of them, move the mechanism as it was asked to."""
    make, motion = MOVED[name]
    found = make().inverse_dynamics(401, motion, t_end=1.0, coordinates=coordinates)
    m = make()
    for k, (label, effort) in enumerate(found.efforts.items()):
        joint = label.removesuffix(".angle")
        m.add(fb.Table(f"effort_{k}", x=tuple(found.t.tolist()), y=tuple(effort.tolist()), interpolation="cubic"))
        m.add(fb.Motor(f"motor {k}", joint, torque=f"effort_{k}(t)"))
        m.add(fb.Initial(label, rate=float(found[joint].rate[0])))
    run = m.simulate(1.0, outputs=11, rtol=1e-10, atol=1e-12, coordinates=coordinates)
    for label in motion:
        assert run[label] == pytest.approx(found[label][::40], abs=1e-7)


def by_singular_values(c, t, q, v):
    """Rank, least part and the space of dependencies at a state, the plain way."""
    c.at(t, q, v)
    G = c.jacobian() * (c.sizes / c.values.length)
    size = np.linalg.norm(G, axis=1)
    p = fundamental_subspaces(G / size[:, None])
    return p, size


MADE = {
    "andrews": lambda: (andrews_driven("beta + 200*t"), 0.03),
    "four-bar in space": lambda: (four_bar_driven(space=True), 1.0),
    "parallelogram": lambda: (parallelogram(4), 1.0),
}


@pytest.mark.parametrize("name", MADE)
def test_dependencies_are_those_of_singular_values(name, monkeypatch):
    """Counts, least singular values and the space of dependencies; no position needs singular values to be found."""
    m, end = MADE[name]()
    if not m.drivers:
        m.add(fb.Driver("drive", "A0.angle", "0.4*t"))
    done = []
    monkeypatch.setattr(own, "fundamental_subspaces", lambda A: done.append(1) or fundamental_subspaces(A))
    r = m.inverse_dynamics(21, t_end=end, coordinates="absolute")
    assert not done
    c = compile_mechanism(m)
    lam, sizes = own.dependent_rows(
        c.values.system,
        c.work,
        own.absolute_states(r.result, c, c),
        own.velocity_scales(c),
        int(r.determinacy.count[0]),
    )
    for k in range(0, 21, 5):
        p, size = by_singular_values(c, r.t[k], r.result.q[k], r.result.v[k])
        assert r.determinacy.count[k] == p.dependencies.shape[1]
        assert r.determinacy.least[k] == pytest.approx(p.values[-1] / p.values[0], rel=0.05)
        X = lam[k] * size[:, None]  # unit vectors that span the same space
        assert np.eye(X.shape[1]) == pytest.approx(X.T @ X, abs=1e-12)
        assert p.dependencies @ (p.dependencies.T @ X) == pytest.approx(X, abs=1e-9)


def test_singular_positions_are_looked_at_by_singular_values(monkeypatch):
    """A parallelogram driven through where it is flat: only there the rank falls, and only there it is doubtful."""
    m = parallelogram(2)
    flat = np.pi / 2 - np.arctan2(0.3, 1.0)
    done = []
    monkeypatch.setattr(own, "fundamental_subspaces", lambda A: done.append(1) or fundamental_subspaces(A))
    m.add(fb.Driver("drive", "A0.angle", f"{-flat}*t"))
    r = m.inverse_dynamics([0.0, 0.25, 0.5, 0.75, 1.0 - 1e-13])
    assert r.determinacy.count.tolist() == [0, 0, 0, 0, 1]
    assert len(done) == 1
    assert r.near_singular.tolist() == [False] * 4 + [True]
