"""Where stability changes, against publications and closed forms, in both layers."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb
from tests.analyses.classical import CAPSIZE, WEAVE, G, bicycle, column, disk, stand

layers = pytest.mark.parametrize("layer", ["absolute", "joint"])


def accounted(locus) -> bool:
    """Whether the crossings explain every change of `unstable`, and lie where it changes."""
    changes = np.diff(locus.unstable)
    for k, change in enumerate(changes):
        low, high = sorted(locus.values[k : k + 2])
        if sum(c.change for c in locus.crossings if low < c.value <= high) != change:
            return False
    return True


@layers
@pytest.mark.parametrize("damping", [0.0, 0.4])
def test_a_rod_stands_from_half_its_weight_on(layer, damping):
    """k = m g l / 2 = 4.905, whatever the damping, though the cart rolls away freely (two zeros all along)."""
    locus = stand(damping).root_locus("k", np.linspace(0, 10, 11), coordinates=layer)
    (only,) = locus.crossings
    assert only.value == pytest.approx(4.905, rel=1e-12)
    assert (only.kind, only.change, only.eigenvalue) == ("divergence", -1, 0j)
    assert accounted(locus)
    zeros = (locus.path == 0.0).all(axis=0)
    assert zeros.sum() == 2  # those of the cart, never taken for others
    if damping:  # real ones meet where c^2 = 4 J (k - k_0) with J = m l^2 / 3 - (m l / 2)^2 / (M + m) = 1/4
        assert np.abs(locus.path_values - (4.905 + damping**2)).min() < 1e-9


@layers
def test_close_to_where_stability_changes(layer):
    """The capsize is told from the zeros beside it as close as its square is from nothing."""
    locus = bicycle().root_locus("v", CAPSIZE * np.array([1 - 1e-4, 1 - 1e-6, 1 + 1e-6, 1 + 1e-4]), coordinates=layer)
    assert locus.unstable.tolist() == [0, 0, 1, 1]
    (only,) = locus.crossings
    assert only.value == pytest.approx(CAPSIZE, rel=1e-11)


@layers
def test_the_upright_disk(layer):
    """Uniform: v^2 = g r / 3 (Routh 1905)."""
    locus = disk().root_locus("v", np.linspace(0.5, 2, 7), coordinates=layer)
    (only,) = locus.crossings
    assert only.value == pytest.approx(np.sqrt(G * 0.5 / 3), rel=1e-12)
    assert only.kind == "divergence"
    assert locus.seen_from == ("the ground",)
    assert accounted(locus)


@layers
def test_the_benchmark_bicycle(layer):
    """Weave and capsize speeds to the digits published (Meijaard et al. 2007)."""
    locus = bicycle().root_locus("v", np.linspace(1, 8, 8), coordinates=layer)
    weave, capsize = locus.crossings
    assert weave.value == pytest.approx(WEAVE, rel=1e-11)
    assert (weave.kind, weave.change) == ("flutter", -2)
    assert weave.eigenvalue.imag == pytest.approx(3.4350338487, rel=1e-9)
    assert capsize.value == pytest.approx(CAPSIZE, rel=1e-11)
    assert (capsize.kind, capsize.change) == ("divergence", 1)
    assert accounted(locus)
    assert ((locus.eigenvalues == 0.0).sum(axis=1) == 6).all()  # where it stands, how it heads, how wheels are turned


@layers
def test_ziegler_without_damping(layer):
    """Flutter of masses 2 m and m: P = (7/2 - sqrt 2) k / l (Ziegler 1952), where two pairs meet on the axis."""
    locus = column(2, follows=True).root_locus("P", np.linspace(0.1, 6, 13), coordinates=layer)
    (only,) = locus.crossings
    assert only.value == pytest.approx(3.5 - np.sqrt(2), rel=1e-12)
    assert (only.kind, only.change) == ("flutter", 2)
    assert only.eigenvalue == pytest.approx(1j * 0.5**0.25, rel=1e-7)
    assert accounted(locus)


@layers
def test_ziegler_with_damping(layer):
    """Equal dampers b in both hinges: P = 41/28 k / l + b^2 / (2 m l^3), less than without any (Ziegler's paradox)."""
    locus = column(2, follows=True, damping=0.1).root_locus("P", np.linspace(0.1, 6, 13), coordinates=layer)
    (only,) = locus.crossings
    assert only.value == pytest.approx(41 / 28 + 0.1**2 / 2, rel=1e-11)
    assert only.kind == "flutter"
    assert accounted(locus)


@layers
def test_two_columns_at_once(layer):
    """The same twice: eigenvalues are double all along, and four begin to grow at once."""
    locus = column(2, follows=True, columns=2).root_locus("P", [1.0, 2.0, 3.0], coordinates=layer)
    (only,) = locus.crossings
    assert only.value == pytest.approx(3.5 - np.sqrt(2), rel=1e-10)
    assert only.change == 4


@layers
def test_a_column_of_six_links_buckles_six_times(layer):
    """Under a load that keeps its direction: P = 2 (1 - cos((2 j - 1) pi / 13)) k / l."""
    locus = column(6, follows=False).root_locus("P", np.linspace(0, 4, 9), coordinates=layer)
    wanted = 2 * (1 - np.cos((2 * np.arange(1, 7) - 1) * np.pi / 13))
    assert [c.value for c in locus.crossings] == pytest.approx(wanted, rel=1e-10)
    assert {(c.kind, c.change) for c in locus.crossings} == {("divergence", 1)}
    assert accounted(locus)


def test_a_column_of_twelve_links_flutters():
    """Under a load that follows: six pairs, each where two frequencies of M and K - P L meet (by bisection here)."""
    n = 12
    locus = column(n, follows=True).root_locus("P", np.linspace(0, 1, 5))
    reach = np.tril(np.ones((n, n)))  # the ends' places by the links' angles
    M = reach.T @ reach
    bends = np.eye(n) - np.eye(n, k=-1)
    K = bends.T @ bends

    def turned(P: float) -> int:
        load = np.eye(n)  # along each link, less what turns with the last
        load[:, -1] -= 1.0
        w = np.linalg.eigvals(np.linalg.solve(M, K - P * load))
        return int((np.abs(w.imag) > 1e-9).sum())

    for c in locus.crossings:
        assert turned(c.value * (1 + 1e-7)) - turned(c.value * (1 - 1e-7)) == 2
    assert len(locus.crossings) == 2
    assert accounted(locus)


def test_damping_that_changes_its_sign():
    """Two modes at once, at a value that is given; from there on as well."""
    m = column(2, follows=True)
    m.parameters["d"] = 0.0
    for k in range(2):
        m.add(fb.CoordinateSpring(f"damper {k}", f"hinge {k} of 0.angle", force="-d*rate"))
    locus = m.root_locus("d", [-1, -0.5, 0.0, 0.5])
    assert [c.value for c in locus.crossings] == pytest.approx([0.0, 0.0], abs=1e-12)
    assert {c.kind for c in locus.crossings} == {"flutter"}
    assert accounted(locus)
    begun = m.root_locus("d", [0.0, -0.5, -1.0])
    assert [c.value for c in begun.crossings] == pytest.approx([0.0, 0.0], abs=1e-10)
    assert sum(c.change for c in begun.crossings) == begun.unstable[-1] == 4


def test_two_changes_between_two_values():
    """One eigenvalue less and one more that grows: `unstable` is the same at both ends."""
    m = fb.Mechanism("two", planar=True, parameters={"c": 0.0})
    for k, law in enumerate(("(1 - c)*rate", "(c - 3)*rate")):
        m.add(fb.Body(f"mass {k}", mass=1, inertia=1, position=(1, k)))
        m.add(fb.Prismatic(f"rail {k}", "ground", f"mass {k}", at=(1, k), axis=(1, 0)))
        m.add(fb.CoordinateSpring(f"spring {k}", f"rail {k}.displacement", stiffness=4.0 + 5 * k, force=law))
    locus = m.root_locus("c", [0.0, 4.0])
    assert locus.unstable.tolist() == [2, 2]
    assert [(c.value, c.change) for c in locus.crossings] == [
        (pytest.approx(1.0, rel=1e-12), -2),
        (pytest.approx(3.0, rel=1e-12), 2),
    ]


def test_where_branches_meet_is_drawn():
    """x'' + c x' + 4 x = 0 is critically damped at c = 4: there the drawn branches meet, at -2."""
    m = fb.Mechanism("mass", planar=True, parameters={"c": 1.0})
    m.add(fb.Body("mass", mass=1, inertia=1, position=(1, 0)))
    m.add(fb.Prismatic("rail", "ground", "mass", at=(1, 0), axis=(1, 0)))
    m.add(fb.SpringDamper("spring", "ground", "mass", at=((0, 0), (1, 0)), stiffness=4, damping="c"))
    locus = m.root_locus("c", [1.0, 3.0, 5.0, 7.0])
    k = int(np.argmin(np.abs(locus.path_values - 4.0)))
    assert locus.path_values[k] == pytest.approx(4.0, rel=1e-9)
    assert locus.path[k] == pytest.approx(np.array([-2.0, -2.0]), abs=1e-4)
    c = locus.path_values[:, None]
    exact = (-c + np.array([1, -1]) * np.emath.sqrt(c * c - 16)) / 2
    assert np.sort_complex(locus.path) == pytest.approx(np.sort_complex(exact), abs=1e-6)
    near = locus.path[(locus.path_values >= 3) & (locus.path_values <= 5)]
    assert np.abs(np.diff(near, axis=0)).max() < 1.3  # 2.8 from one given value to the next
    assert locus.values.tolist() == [1.0, 3.0, 5.0, 7.0]
    assert locus.crossings == []
    assert len(locus.plot().axes[0].lines) > 0


def test_the_text_says_what_happens():
    m = stand(0.0)
    text = str(m.root_locus("k", [0, 10]))
    assert "k = 4.905, imaginary part 0 rad/s: divergence, 1 fewer unstable" in text
    run = m.simulate(0.1)
    with pytest.raises(fb.ModelError, match="give either about or equilibrium=True"):
        m.root_locus("k", [6, 10], about=run, equilibrium=True)
