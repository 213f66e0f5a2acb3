"""m.symbolic(): whatever a result has, as an expression that gives the same number; symbols, refusals, what is shown."""

import numpy as np
import pytest

import flyball as fb
from tests import mechanisms
from tests.contract import zoo
from tests.examples.test_examples import FILES
from tests.identities.test_complex_values import with_forces
from tests.symbolic.states import random_state

NO_FUNCTION = ("work", "balance")  # integrals along the motion


def same_as_results(m, coordinates):
    """Every quantity of every part at a random state."""
    eq, result, values = random_state(m, coordinates)
    checked = 0
    for part in result.parts():
        names = [f"{part}.{k}" for k in result[part].names if k not in NO_FUNCTION]
        if f"{part}.e0" not in eq.named:
            names = [n for n in names if not n.endswith(".quaternion")]
        numbers = {n: np.asarray(result.channel(n)[1])[0] for n in names}
        size = max([1.0, *(np.abs(x).max() for x in numbers.values())])
        for name, number in numbers.items():
            found = eq[name].at(values)
            if name.endswith(".quaternion"):
                found = found * np.sign(found @ number)
            elif eq[name].unit == "rad" and not m.planar:
                found = number + np.angle(np.exp(1j * (found - number)))  # in (-pi, pi]
            np.testing.assert_allclose(found, number, rtol=1e-10, atol=1e-11 * size, err_msg=name)
            assert eq[name].unit == result.channel(name)[0]
            checked += 1
    assert checked > 10


@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
@pytest.mark.parametrize("name", FILES)
def test_quantities_of_examples(name, coordinates):
    same_as_results(mechanisms.example(name), coordinates)


@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
@pytest.mark.parametrize(("where", "name"), zoo.CASES)
def test_quantities_of_joints(where, name, coordinates):
    same_as_results(zoo.joined(where, name), coordinates)


@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
@pytest.mark.filterwarnings("ignore:invalid value")  # nan of a bushing that has turned by more than half a turn
@pytest.mark.parametrize("make", [lambda: with_forces("plane"), lambda: with_forces("space")])
def test_quantities_of_forces(make, coordinates):
    try:
        same_as_results(make(), coordinates)
    except fb.AnalysisError as error:  # friction that joint coordinates do not know
        assert coordinates == "joint" and "friction" in str(error)
