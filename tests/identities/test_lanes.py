"""Numbers for many runs at once: every table has, lane by lane, the bits that it has for each run by itself."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb
from flyball.analysis.compiled import places
from flyball.analysis.runs.spread import TABLES, Tables
from flyball.errors import ModelError
from flyball.math import scalar
from flyball.math.lanes import Diverged, Lanes, lanewise, spread
from flyball.math.products import product
from flyball.tables.spanning import spanning
from flyball.tables.structure import Choices, structure
from flyball.tables.values import values
from tests import mechanisms
from tests.complex_steps import with_parameters
from tests.contract import zoo
from tests.identities.test_complex_values import with_couplings, with_forces
from tests.model.test_shapes import SAMPLES

STEPS = (1e-3, 1.1e-3, 2e-3)  # of the parameter of a field: as parts of its numbers


def check(m, name, given):
    """All tables of a mechanism at values of a parameter, at once and one by one; what floats refuse is left out."""
    tree = spanning(m)
    for s in (structure(m), structure(m, Choices(tree=tree, switches=True))):
        try:
            single = [values(s, {name: x}) for x in given]
        except ModelError:
            return
        many = Tables.of(values(s, {name: Lanes(np.array(given))}), len(given))
        for k, x in enumerate(single):
            for table in TABLES:
                assert many.system[table].of_run(k).tobytes() == getattr(x.system, table).tobytes(), (name, table)
            assert many.q.of_run(k).tobytes() == x.q.tobytes()
            assert many.v.of_run(k).tobytes() == x.v.tobytes()
            assert many.z.of_run(k).tobytes() == places(x).tobytes()
            assert float(many.length[k]) == x.length
            assert many.is_of(x, k)


def check_all(m, skipped=()):
    """Every parameter, and every number of every element."""
    own = {name: x for name, x in m.environment().items() if name not in skipped}
    m, names = with_parameters(m)
    m = m.snapshot()
    for name, x in own.items():
        check(m, name, [x * (1.0 + 1e-3 * k) + 1e-4 * (k + 1) for k in range(3)])
    for field, name in names.items():
        if field not in skipped:
            check(m, name, STEPS)


CAM = ("Cam.points", "Cam.at", "Cam.axis", "Cam.centre")  # go through splines, which take floats only


@pytest.mark.parametrize(("where", "name"), zoo.CASES)
def test_every_joint(where, name):
    check_all(zoo.joined(where, name), CAM)


@pytest.mark.parametrize("where", ["space", "plane"])
def test_every_force(where):
    check_all(with_forces(where))


def test_every_coupling():
    check_all(with_couplings())


@pytest.mark.parametrize("name", ["andrews.toml", "governor.toml", "spatial_slider_crank.toml", "rolling_race.toml"])
def test_every_number_of_an_example(name):
    check_all(mechanisms.example(name))


@pytest.mark.parametrize("shape", SAMPLES, ids=lambda s: type(s).__name__)
def test_every_shape(shape):
    m = fb.Mechanism("shape")
    m.add(fb.Body("b", density=7850.0, shape=shape, orientation=(0.2, -0.4, 0.9)))
    check_all(m)


def test_decisions_that_differ_are_told():
    x = Lanes(np.array([1.0, -1.0, 2.0]))
    with pytest.raises(Diverged) as told:
        bool(x > 0.0)
    assert told.value.yes.tolist() == [True, False, True]
    assert bool(x > -2.0)
    assert not bool(x > 2.0)
    with pytest.raises(Diverged):
        _ = 1.0 / Lanes(np.array([1.0, 0.0]))
    with pytest.raises(ZeroDivisionError):
        _ = 1.0 / Lanes(np.zeros(2))
    with pytest.raises(TypeError):
        float(x)


@pytest.mark.parametrize("name", ["sin", "cos", "tan", "atan", "exp", "sinh", "absolute", "sign", "rounded"])
def test_functions_are_those_of_floats(name):
    x = np.random.default_rng(3).normal(size=50)
    f = getattr(scalar, name)
    assert f(Lanes(x)).x.tolist() == [f(a) for a in x.tolist()]
    assert lanewise(scalar.atan2, Lanes(x), 0.3).x.tolist() == [scalar.atan2(a, 0.3) for a in x.tolist()]


def test_products_add_in_order():
    """So that tables are the same on every machine, whatever its BLAS does."""
    rng = np.random.default_rng(0)
    for shapes in (((3, 3), (3,)), ((3, 3), (3, 3)), ((4, 3, 3), (4, 3, 3)), ((4, 3, 3), (4, 3, 1))):
        A, B = (rng.normal(size=s) for s in shapes)
        found = product(A, B)
        np.testing.assert_allclose(found, A @ B, rtol=1e-13, atol=1e-14)
        x, y = A.reshape(-1, 3, 3)[0], B.reshape(-1, *B.shape[-2:])[0] if B.ndim > 1 else B[:, None]
        first = x[0, 0] * y[0, 0] + x[0, 1] * y[1, 0] + x[0, 2] * y[2, 0]
        assert found.ravel()[0] == first
    lanes = np.array([Lanes(rng.normal(size=4)) for _ in range(9)], object).reshape(3, 3)
    many, one = spread(product(lanes, lanes), 4), spread(lanes, 4)
    assert many.tobytes() == np.array([product(a, a) for a in one]).tobytes()
