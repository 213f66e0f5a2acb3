"""Root loci of sampled loops against closed forms of the sampled double integrator and first-order system."""

import numpy as np
import pytest

import flyball as fb

PERIOD, MASS, DAMPING = 0.1, 2.0, 1.5


def servo(law):
    """A mass on a guide, held by a sampled law of position and speed."""
    m = fb.Mechanism("servo", planar=True, parameters={"k": 10.0, "d": 5.0})
    m.add(fb.Body("cart", mass=MASS, inertia=1), fb.Prismatic("G", "ground", "cart", at=(0, 0), axis=(1, 0)))
    m.add(fb.State("u", next=law, period=PERIOD))
    m.add(fb.Actuator("drive", "G.displacement", force="u"))
    return m


def cycle(k, d):
    """Exact matrix of x, v over a period with u = -k x - d v held: [[1, T], [0, 1]] + [T^2/2, T]/m [-k, -d]."""
    T = PERIOD
    held = np.array([[T * T / 2], [T]]) / MASS
    return np.array([[1.0, T], [0.0, 1.0]]) - held @ np.array([[k, d]])


def largest(w, n):
    return sorted(w, key=lambda z: (-abs(z), z.imag))[:n]


def test_branches_of_a_held_law():
    m = servo("-k*G.displacement - d*G.displacement_rate")
    locus = m.root_locus("d", np.linspace(2, 38, 10), progress=False)
    assert locus.period == pytest.approx(PERIOD)
    for d, w in zip(locus.values, locus.eigenvalues, strict=True):
        exact = np.linalg.eigvals(cycle(10.0, d))
        assert largest(w, 2) == pytest.approx(largest(exact.astype(complex), 2), abs=1e-9)


def test_alternation_at_minus_one():
    """Too much damping: a multiplier is -1 where det(Phi + 1) = 0, that is 4 = 2 d T / m (for any k)."""
    m = servo("-k*G.displacement - d*G.displacement_rate")
    locus = m.root_locus("d", [5, 20, 60], progress=False)
    (c,) = locus.crossings
    assert c.kind == "alternation"
    assert c.change == 1
    assert c.value == pytest.approx(2 * MASS / PERIOD, rel=1e-10)
    assert c.eigenvalue == pytest.approx(-1.0, abs=1e-9)
    assert locus.unstable.tolist() == [0, 0, 1]


def test_flutter_of_a_pair():
    """Too much stiffness: det Phi = 1 where k T / 2 = d."""
    m = servo("-k*G.displacement - d*G.displacement_rate")
    locus = m.root_locus("k", [10, 80, 300], progress=False)
    (c,) = locus.crossings
    assert c.kind == "flutter"
    assert c.change == 2
    assert c.value == pytest.approx(2 * 5.0 / PERIOD, rel=1e-9)
    assert abs(c.eigenvalue) == pytest.approx(1.0, abs=1e-9)
    assert "flutter" in repr(locus)


def test_divergence_at_one():
    m = servo("-k*G.displacement - d*G.displacement_rate")
    (c,) = m.root_locus("k", [-20, -1, 30], progress=False).crossings
    assert c.kind == "divergence"
    assert c.change == -1
    assert c.value == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(
    ("parameter", "values", "kind", "value"),
    [
        ("d", [5, 60], "alternation", 40.0),
        ("d", [5, 60, 20], "alternation", 40.0),
        ("d", [60, 5], "alternation", 40.0),
        ("k", [5, -5], "divergence", 0.0),
        ("k", [10, 5, -5, -10], "divergence", 0.0),
    ],
)
def test_a_pair_that_becomes_real_on_the_way(parameter, values, kind, value):
    m = servo("-k*G.displacement - d*G.displacement_rate")
    c = m.root_locus(parameter, values, progress=False).crossings[0]
    assert c.kind == kind
    assert c.value == pytest.approx(value, abs=1e-8)
    assert abs(c.eigenvalue) == pytest.approx(1.0, abs=1e-9)


def test_plot(tmp_path):
    m = servo("-k*G.displacement - d*G.displacement_rate")
    m.root_locus("d", np.linspace(2, 60, 30), progress=False).plot(tmp_path / "locus.png")
    assert (tmp_path / "locus.png").stat().st_size > 5000
