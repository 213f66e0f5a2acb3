"""Large mechanisms at rest: sparse linear equations against closed forms, and against those of the dense way."""

from __future__ import annotations

import json
import pickle
import re

import numpy as np
import pytest
import scipy.sparse as sp

import flyball as fb
from flyball.linear import descriptor
from flyball.numerics.eigen import QuadraticPencil
from flyball.numerics.rank import saddle_point_solver
from tests.analyses.made import G, chain, parallelogram, rod
from tests.layers import LAYERS

N = 201


def line(n: int = N, damping: float = 0.3) -> fb.Mechanism:
    """Masses of 2 kg on rails, springs of 50 N/m and dampers between them and the walls, pushed at the first."""
    m = fb.Mechanism("line", planar=True)
    m.add(*(fb.Body(f"m{k}", mass=2, inertia=1, position=(k, 0)) for k in range(1, n + 1)))
    for k in range(1, n + 1):
        m.add(fb.Prismatic(f"rail {k}", "ground", f"m{k}", at=(k, 0), axis=(1, 0)))
    for k in range(n + 1):
        ends = [f"m{i}" if 1 <= i <= n else "ground" for i in (k, k + 1)]
        m.add(fb.SpringDamper(f"s{k}", *ends, at=((k, 0), (k + 1, 0)), stiffness=50, damping=damping))
    m.add(fb.PointForce("push", "m1", at=(1, 0), force=(0, 0)))
    return m


def line_eigenvalues(damping: float = 0.3) -> np.ndarray:
    """2 s^2 + (damping s + 50) 4 sin^2(j pi / 2 (n + 1)) = 0, slowest first, upper ones."""
    mu = 4.0 * np.sin(np.arange(1, N + 1) * np.pi / (2 * (N + 1))) ** 2
    return (-damping * mu + np.sqrt((damping * mu + 0j) ** 2 - 400.0 * mu)) / 4.0


def line_response(w: float, damping: float = 0.3) -> np.ndarray:
    """What a push at the first mass does to all."""
    T = 2 * np.eye(N) - np.eye(N, k=1) - np.eye(N, k=-1)
    return np.linalg.solve((50 + 1j * w * damping) * T - 2 * w * w * np.eye(N), np.eye(N)[0])


@pytest.mark.parametrize(("k", "d"), [(1e12, 1.0), (50.0, 0.3), (1e-12, 1e-20)])
def test_how_little_damping_is_none_depends_on_how_fast_it_swings(k, d):
    """s^2 + (d s + k) 4 sin^2(j pi / 2 (n + 1)) = 0, from stiff to soft."""
    n = 120
    mu = 4.0 * np.sin(np.arange(1, n + 1) * np.pi / (2 * (n + 1))) ** 2
    T = sp.diags([2.0 * np.ones(n), -np.ones(n - 1), -np.ones(n - 1)], [0, 1, -1]).tocsr()
    w = QuadraticPencil(sp.identity(n, format="csr"), d * T, k * T, sp.csr_matrix((0, n))).nearest(4)[0]
    exact = (-d * mu + np.sqrt((d * mu) ** 2 - 4.0 * k * mu + 0j)) / 2.0
    assert w[w.imag > 0][:2] == pytest.approx(exact[:2], rel=1e-9)
    assert w[w.imag > 0][:2].real == pytest.approx(exact[:2].real, rel=1e-3)


def test_a_damped_line_of_masses():
    """Eigenvalues, modes and responses by closed form; accelerations and spring forces are outputs too."""
    L = line().linearize(["push.x"], ["m3.x", "m5.vx", "m2.ax", "rail 4.fx", "s1.force"], coordinates="absolute")
    assert L.large
    expected = line_eigenvalues()[:5]
    found = L.descriptor.nearest(6)
    assert found[found.imag > 0][:3] == pytest.approx(expected[:3], rel=1e-9)
    near = line_eigenvalues()[60]
    assert L.descriptor.nearest(1, near=near + 0.01)[0] == pytest.approx(near, rel=1e-9)
    for wrong in (0, 2.5, "3"):
        with pytest.raises(fb.ModelError, match="count must be a whole number of at least 1"):
            L.descriptor.nearest(wrong)
    with pytest.raises(fb.ModelError, match="near must be a finite number"):
        L.descriptor.nearest(2, near=complex("nan"))
    w = [0.3, 2.0, 7.0]
    x = np.array([line_response(s) for s in w])
    assert L.response(w, output="m3.x") == pytest.approx(x[:, 2], rel=1e-9)
    assert L.response(w, output="m5.vx") == pytest.approx(1j * np.array(w) * x[:, 4], rel=1e-9)
    assert L.response(w, output="m2.ax") == pytest.approx(-np.square(w) * x[:, 1], rel=1e-9)
    pull = (50 + 0.3j * np.array(w)) * (x[:, 1] - x[:, 0])
    assert np.abs(L.response(w, output="s1.force")) == pytest.approx(np.abs(pull), rel=1e-9)
    assert np.abs(L.response(w, output="rail 4.fx")).max() < 1e-12
    assert L.output_values == pytest.approx([3, 0, 0, 0, 0], abs=1e-12)
    found = line().modes(count=5, coordinates="absolute")
    assert found.eigenvalues == pytest.approx(expected, rel=1e-9)
    assert found.residual < 1e-9
    shape = [found.shapes[found.names.index(f"m{k}.x"), 1] for k in range(1, N + 1)]
    wave = np.sin(2 * np.pi * np.arange(1, N + 1) / (N + 1))
    assert np.array(shape) / shape[49] == pytest.approx(wave / wave[49], abs=1e-6)


@pytest.mark.parametrize("coordinates", [*LAYERS, "auto"])
def test_so_many_freedoms_are_sparse_in_all_coordinates(coordinates):
    """201 freedoms, of which joint coordinates have no more velocities: all eigenvalues when asked for; some modes."""
    L = line().linearize(["push.x"], ["m3.x"], coordinates=coordinates)
    assert L.large
    assert L.response([2.0]) == pytest.approx([line_response(2.0)[2]], rel=1e-9)
    found = L.eigenvalues
    assert found[found.imag > 0] == pytest.approx(line_eigenvalues(), rel=1e-9)
    assert line().modes(count=4, coordinates=coordinates).eigenvalues == pytest.approx(line_eigenvalues()[:4], rel=1e-9)
    assert len(line().modes(coordinates="joint").eigenvalues) == N


def test_the_matrices_are_the_equations():
    """E, A, B, C, D as they stand, sparse, give the response; states have names; all of it is plain data, and pickled."""
    L = line().linearize(["push.x"], ["m3.x", "m2.ax"], coordinates="absolute")
    d, s = L.descriptor, 2.0j
    E, A, B, C = (getattr(d, k).tocsc() for k in ("E", "A", "B", "C"))
    assert A.nnz < 10 * A.shape[0]
    from scipy.sparse.linalg import spsolve

    z = spsolve((s * E - A).tocsc(), B.toarray()[:, 0].astype(complex))
    x = line_response(2.0)
    assert C @ z + d.D[:, 0] == pytest.approx([x[2], -4 * x[1]], rel=1e-9)
    assert z[d.states.index("m7.x rate")] == pytest.approx(2j * x[6], rel=1e-9)
    assert len(d.states) == A.shape[0] == 3 * 603 + 402
    data = json.loads(json.dumps(L.as_dict()))
    assert data["descriptor"]["A"]["shape"] == [2211, 2211]
    again = pickle.loads(pickle.dumps(L))
    assert again.response([2.0], output="m3.x") == pytest.approx([x[2]], rel=1e-9)
    text = dict(L.lines())
    assert text["states"].startswith("many: descriptor form: 2211 states")
    assert "slowest" in text
    figure = L.bode(output="m3.x", omega=[0.1, 1.0])
    drawn = figure.axes[0].lines[0].get_ydata()
    assert drawn == pytest.approx([20 * np.log10(abs(line_response(w)[2])) for w in (0.1, 1.0)], abs=1e-6)


def test_loops_with_more_constraints_than_count():
    """A row of 60 windows in space, 179 constraints too many: one freedom, its frequency by closed form."""
    n, m = 60, fb.Mechanism("row", gravity=(0, 0, -G))
    I = (1 / 12, 1 / 12, 1e-4)
    for k in range(n + 1):
        m.add(fb.Body(f"crank {k}", mass=1, inertia=I, position=(k, 0, -0.5)))
        m.add(fb.Revolute(f"A{k}", "ground", f"crank {k}", at=(k, 0, 0), axis=(0, 1, 0)))
        if k:
            m.add(fb.Body(f"bar {k}", mass=1, inertia=(1, 1, 1), position=(k - 0.5, 0, -1)))
            m.add(fb.Revolute(f"B{k}", f"crank {k - 1}", f"bar {k}", at=(k - 1, 0, -1), axis=(0, 1, 0)))
            m.add(fb.Revolute(f"C{k}", f"bar {k}", f"crank {k}", at=(k, 0, -1), axis=(0, 1, 0)))
    m.add(fb.PointForce("push", "bar 30", at=(29.5, 0, -1), force=(0, 0, 0)))
    inertia, stiffness = (n + 1) / 3 + n, G * ((n + 1) / 2 + n)
    L = m.linearize(["push.x"], ["bar 7.x"], coordinates="absolute")
    assert L.descriptor.constraints.shape == (725, 726)
    w = np.sqrt(stiffness / inertia)
    assert np.sort(L.descriptor.nearest(4).imag) == pytest.approx([-w, w], rel=1e-9)
    assert L.response([1.0]) == pytest.approx([1 / (stiffness - inertia)], rel=1e-9)
    assert m.modes(coordinates="absolute").omega == pytest.approx([w], rel=1e-9)
    with pytest.raises(fb.ModelError, match=r"'A3\.fy' is not determined: redundant constraints"):
        m.linearize(["push.x"], ["A3.fy"], coordinates="absolute")


def swung() -> fb.Mechanism:
    """A cart that is shaken with a rod on it, in a wind."""
    m = fb.Mechanism("cart", planar=True, gravity=(0, -G))
    m.add(fb.Body("cart", mass=2, inertia=1, position=(0, 0)), fb.Body("rod", mass=1, inertia=0.1, position=(0, -0.5)))
    m.add(fb.Translational("rail", "ground", "cart", at=(0, 0), axis=(1, 0)))
    m.add(fb.Revolute("pin", "cart", "rod", at=(0, 0)), fb.Driver("shake", "rail.displacement", "0*t"))
    m.add(fb.PointForce("wind", "rod", at=(0, -1), force=(0, 0)))
    return m


@pytest.mark.parametrize("coordinates", LAYERS)
def test_both_forms_answer_alike(coordinates):
    """A driver acts through its rates: in the descriptor by itself, in the state space by a shift of the states."""
    L = swung().linearize(["shake", "wind.x"], ["pin.angle", "rod.x"], coordinates=coordinates)
    assert not L.large
    w = [0.1, 3.0, 11.0]
    for i, name in enumerate(L.inputs):
        for k, output in enumerate(L.outputs):
            dense = L.response(w, name, output)
            assert L.descriptor.response(w, i, k) == pytest.approx(dense, rel=1e-11, abs=1e-14)


@pytest.fixture
def sparse(monkeypatch):
    """Take the way of large mechanisms always."""
    monkeypatch.setattr(descriptor, "DENSE_VELOCITIES", 0)


def test_what_is_dense_is_made_when_asked_for(sparse, monkeypatch):
    """State space, names and all eigenvalues of a model that began sparse, in the coordinates asked for."""
    m = chain(4)
    m.add(fb.PointForce("push", "rod 3", at=(0, -1), force=(0, 0)))
    L = m.linearize(["push.x"], ["rod 1.x"], coordinates="joint")
    assert L.large
    m.gravity = (0, 0)  # of no consequence: the model is the one that was linearised
    monkeypatch.setattr(descriptor, "DENSE_VELOCITIES", 600)
    assert L.states[:4] == ("J0.angle", "J1.angle", "J2.angle", "J3.angle")
    some = L.descriptor.nearest(8)
    assert np.sort_complex(some) == pytest.approx(np.sort_complex(L.eigenvalues), abs=1e-8)
    z = L.C @ np.linalg.solve(1j * np.eye(8) - L.A, L.B) + L.D
    assert L.response([1.0]) == pytest.approx(z[0], rel=1e-9)


def changing() -> fb.Mechanism:
    m = rod()
    m.add(fb.CoordinateSpring("s", "A.angle", stiffness=0), fb.Motor("m", "A", torque="-t*angle"))
    return m


def kinked() -> fb.Mechanism:
    m = rod()
    m.add(fb.Motor("m", "A", torque="-abs(angle)"))
    return m


def massless() -> fb.Mechanism:
    m = fb.Mechanism("weightless", planar=True)
    m.add(fb.Body("b", mass=1, inertia=0, position=(0, 0)), fb.Revolute("A", "ground", "b", at=(0, 0)))
    m.add(fb.CoordinateSpring("s", "A.angle", stiffness=1))
    return m


REFUSED = {
    "not at rest there": lambda: rod(1.0),
    "changes with time": changing,
    "a kink": kinked,
    "no inertia": massless,
    "a parallelogram that is flat": lambda: parallelogram(np.pi / 2),
}


@pytest.mark.parametrize("name", REFUSED)
def test_the_same_is_refused(name, monkeypatch):
    """Large or not: the same error."""
    texts = []
    for bound in (600, 0):
        monkeypatch.setattr(descriptor, "DENSE_VELOCITIES", bound)
        for ask in ("linearize", "modes"):
            with pytest.raises(fb.FlyballError) as said:
                getattr(REFUSED[name](), ask)(coordinates="absolute")
            texts.append((type(said.value), re.sub(r"-?\d+\.?\d*", "#", str(said.value))))
    assert texts == [texts[0]] * 4


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e6])
def test_sparse_equations_with_constraints_are_those_of_a_dense_solver(size):
    """P x - G^T l = f, H x = g, of a stiffness of any size, with rows of two kinds."""
    rng = np.random.default_rng(2)
    P, G, H = size * (rng.normal(size=(7, 7)) + 7 * np.eye(7)), rng.normal(size=(3, 7)), rng.normal(size=(3, 7))
    f, g = size * rng.normal(size=7), rng.normal(size=3)
    for of, rows in ((None, G), (H, H)):
        x, force = saddle_point_solver(sp.csc_array(P), sp.csc_array(G), None if of is None else sp.csc_array(of))(f, g)
        wanted = np.linalg.solve(np.block([[P, -G.T], [rows, np.zeros((3, 3))]]), np.r_[f, g])
        assert x == pytest.approx(wanted[:7], rel=1e-9)
        assert force == pytest.approx(wanted[7:], rel=1e-9)
