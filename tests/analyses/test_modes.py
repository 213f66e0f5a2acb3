"""Modes against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.special import jn_zeros

import flyball as fb
from tests.analyses.classical import AT_FIVE, bicycle, foucault
from tests.analyses.made import G, chain, chain_matrices, rod


def test_double_pendulum():
    """The two modes of two rods, by Lagrange's equations in their angles."""
    squares, V = eigh(*chain_matrices(2)[::-1])
    for layer in ("absolute", "joint"):
        found = chain(2).modes(coordinates=layer)
        assert found.omega == pytest.approx(np.sqrt(squares), rel=1e-10)
        assert found.frequency == pytest.approx(np.sqrt(squares) / (2 * np.pi), rel=1e-10)
        assert found.damping_ratio == pytest.approx([0, 0], abs=1e-12)
        assert found.kinds == ("oscillation",) * 2
        assert found.stable
    for k in range(2):  # absolute angles of the rods are sums of the joints'
        shape = [found.shapes[found.names.index(f"J{i}.angle"), k].real for i in range(2)]
        wanted = V[:, k] / V[:, k][0]
        assert np.cumsum(shape) / shape[0] == pytest.approx(wanted, rel=1e-9)


def test_damping_ratio_and_instability():
    """theta'' + 2 zeta w theta' + w^2 theta = 0 with a hinge's damper; upside down one mode grows."""
    m = rod(damping=1.0)
    m.add(fb.TorsionalSpringDamper("damper", joint="A", damping="damping"))
    w = np.sqrt(1.5 * G)
    found = m.modes()
    assert found.omega == pytest.approx([w], rel=1e-10)
    assert found.damping_ratio == pytest.approx([1.0 / (2 * w / 3)], rel=1e-10)
    up = rod(np.pi).modes()
    assert not up.stable
    assert set(up.kinds) == {"unstable", "decay"}
    assert np.sort(up.eigenvalues.real) == pytest.approx([-w, w], rel=1e-10)


def test_rigid_motions_are_told():
    m = fb.Mechanism("two", planar=True)
    for k in (0, 1):
        m.add(fb.Body(f"mass {k}", mass=1, inertia=1, position=(k, 0)))
        m.add(fb.Prismatic(f"rail {k}", "ground", f"mass {k}", at=(k, 0), axis=(1, 0)))
    m.add(fb.SpringDamper("spring", "mass 0", "mass 1", at=((0, 0), (1, 0)), stiffness=8))
    found = m.modes()
    assert found.kinds.count("oscillation") == 1
    assert found.omega.max() == pytest.approx(4.0, rel=1e-9)
    assert set(found.kinds) == {"rigid", "oscillation"}


def test_the_slowest_of_many():
    """A chain of 250 links: sparse, against Lagrange's matrices, and near the hanging rope's Bessel zeros."""
    n = 250
    found = chain(n).modes(count=6)
    M, K = chain_matrices(n)
    assert len(found) == 6
    assert found.omega == pytest.approx(np.sqrt(eigh(K, M, eigvals_only=True, subset_by_index=[0, 5])), rel=1e-8)
    assert found.omega == pytest.approx(jn_zeros(0, 6) / 2 * np.sqrt(G), rel=1e-3)


def test_a_mode_as_a_motion_keeps_the_joints_closed():
    found = chain(3).modes()
    r = found.motion(0, amplitude=1e-4)
    gap = r["rod 1"].position - r["rod 0"].position
    size = np.hypot(gap[:, 0], gap[:, 1])
    assert r.t[-1] == pytest.approx(1 / found.frequency[0])
    assert size == pytest.approx(np.full(len(r.t), 1 / 3), abs=1e-7)
    swing = r["J0"].angle
    assert swing[0] == pytest.approx(-swing[len(swing) // 2], rel=1e-3)


def test_questions_that_make_no_sense():
    with pytest.raises(fb.ModelError, match="count must be at least 1"):
        chain(2).modes(count=0)
    with pytest.raises(fb.AnalysisError, match="not in equilibrium"):
        rod(1.0).modes()


def test_fewer_freedoms_than_asked_for():
    """A row of 210 hanging parallelograms moves in one way: as many cranks and bars over again."""
    n = 210
    m = fb.Mechanism("row", planar=True, gravity=(0, -G))
    for k in range(n + 1):
        m.add(fb.Body(f"crank {k}", mass=1, inertia=1 / 12, position=(k, -0.5)))
        m.add(fb.Revolute(f"A{k}", "ground", f"crank {k}", at=(k, 0)))
        if k:
            m.add(fb.Body(f"bar {k}", mass=1, inertia=1 / 12, position=(k - 0.5, -1)))
            m.add(fb.Revolute(f"B{k}", f"crank {k - 1}", f"bar {k}", at=(k - 1, -1)))
            m.add(fb.Revolute(f"C{k}", f"bar {k}", f"crank {k}", at=(k, -1)))
    square = G * ((n + 1) / 2 + n) / ((n + 1) / 3 + n)
    assert m.modes(count=5).omega == pytest.approx([np.sqrt(square)], rel=1e-8)


def test_slow_modes_beside_fast_ones_are_no_rigid_ones():
    m = fb.Mechanism("two", planar=True)
    for k, stiffness in enumerate((0.01, 1e8)):
        m.add(fb.Body(f"mass {k}", mass=1, inertia=1, position=(1, k)))
        m.add(fb.Prismatic(f"rail {k}", "ground", f"mass {k}", at=(1, k), axis=(1, 0)))
        m.add(fb.SpringDamper(f"spring {k}", "ground", f"mass {k}", at=((0, k), (1, k)), stiffness=stiffness))
    found = m.modes()
    assert found.kinds == ("oscillation",) * 2
    assert found.omega == pytest.approx([0.1, 1e4], rel=1e-9)


def test_no_freedom_no_modes():
    m = rod(0.3)
    m.add(fb.Driver("motor", "A.angle", "2*t"))
    found = m.modes()
    assert len(found) == 0
    assert "no freedom" in repr(found)


@pytest.mark.parametrize("layer", ["absolute", "joint"])
def test_the_bicycle_at_five_metres_a_second(layer):
    """Published eigenvalues (Meijaard et al. 2007), six zeros; the weave moves nothing forwards and turns no wheel."""
    m = bicycle()
    L, found = m.linearize(coordinates=layer), m.modes(coordinates=layer)
    own = [w for w in found.eigenvalues if w]
    assert sorted(own, key=lambda w: w.real) == pytest.approx(sorted(AT_FIVE, key=lambda w: w.real), rel=1e-10)
    w, V = np.linalg.eig(L.A)
    assert np.abs(L.A @ V - V * w).max() < 1e-11  # no entry of 1e-29 leads the solver astray
    assert found.residual < 1e-12
    rigid = np.array(found.kinds) == "rigid"
    assert (found.multiplicity[rigid] == 6).all()
    assert (found.geometric_multiplicity[rigid] == 4).all()
    assert rigid.sum() == 4  # x, y and two wheels; heading and speed move on
    assert "the eigenvalue is 6-fold, with 4 shapes only: defective" in str(found)
    assert "seen from the ground" in str(found)
    weave = int(np.argmax(found.eigenvalues.imag))
    shape = dict(zip(found.names, found.shapes[:, weave], strict=True))
    for name, size in shape.items():
        if name.endswith((".x", ".z", "hub.angle", "turn y")):
            assert abs(size) < 1e-9, name


def test_shapes_are_the_same_in_both_layers():
    """The weave and the capsize as motions of the bodies, but for size and phase."""
    found = [bicycle().modes(coordinates=layer) for layer in ("absolute", "joint")]
    for kind in ("oscillation", "decay"):
        shapes = []
        for f in found:
            wheel = f.motion(f.kinds.index(kind), 1e-4, 21)["front wheel"]
            amplitudes = [np.fft.fft(x[:-1], axis=0)[1].ravel() for x in (wheel.position, wheel.rotation)]
            shapes.append(np.concatenate(amplitudes) / amplitudes[0][1])  # relative to the lateral motion
        assert shapes[0] == pytest.approx(shapes[1], abs=3e-3)


@pytest.mark.parametrize("layer", ["absolute", "joint"])
def test_a_foucault_pendulum_is_seen_from_the_ground(layer):
    """It is steady from the ground and from the table; what stands still is taken: omega0 twice, in both layers."""
    found = foucault(1.0).modes(coordinates=layer)
    assert found.omega == pytest.approx(np.sqrt([G, G]), rel=1e-5)
    assert found.seen_from == "the ground"
    assert (found.turning == 0.0).all()
    assert foucault(1.0).linearize(coordinates=layer).seen_from == "the ground"


@pytest.mark.parametrize("layer", ["absolute", "joint"])
def test_repeated_and_defective_eigenvalues_are_told(layer):
    """Two masses on equal springs: twice the same, two shapes. One nothing holds: zero twice, one shape."""
    m = fb.Mechanism("three", planar=True)
    for k in range(3):
        m.add(fb.Body(f"mass {k}", mass=1, inertia=1, position=(1, k)))
        m.add(fb.Prismatic(f"rail {k}", "ground", f"mass {k}", at=(1, k), axis=(1, 0)))
    for k in range(2):
        m.add(fb.SpringDamper(f"spring {k}", "ground", f"mass {k}", at=((0, k), (1, k)), stiffness=9))
    found = m.modes(coordinates=layer)
    assert found.eigenvalues.tolist() == pytest.approx([0, 3j, 3j])
    assert found.multiplicity.tolist() == [2, 2, 2]
    assert found.geometric_multiplicity.tolist() == [1, 2, 2]
    assert np.linalg.matrix_rank(found.shapes) == 3
    assert "mode 0: the eigenvalue is 2-fold, with 1 shape only: defective" in str(found)
    assert "modes 1 to 2: the eigenvalue is 2-fold, with 2 shapes" in str(found)
    assert found.as_dict()["modes"][0]["multiplicity"] == 2


@pytest.mark.parametrize("layer", ["absolute", "joint"])
def test_critical_damping_is_defective(layer):
    """theta'' + 2 w theta' + w^2 theta = 0: -w twice, one shape, and no pair that rounding makes."""
    w = np.sqrt(1.5 * G)
    m = rod(damping=2 * w / 3)
    m.add(fb.TorsionalSpringDamper("damper", joint="A", damping="damping"))
    found = m.modes(coordinates=layer)
    assert found.eigenvalues == pytest.approx([-w], rel=1e-10)
    assert (found.eigenvalues.imag == 0.0).all()
    assert (found.multiplicity[0], found.geometric_multiplicity[0]) == (2, 1)
    assert "defective" in str(found)


def test_what_is_undamped_shows_no_rounding():
    """Real parts of 1e-16 are none; a small damping stays."""
    found = chain(5).modes()
    assert (found.eigenvalues.real == 0.0).all()
    assert (found.shapes.imag == 0.0).all()
    m = rod(damping=1e-9)
    m.add(fb.TorsionalSpringDamper("damper", joint="A", damping="damping"))
    assert m.modes().eigenvalues.real == pytest.approx([-1.5e-9], rel=1e-3)
