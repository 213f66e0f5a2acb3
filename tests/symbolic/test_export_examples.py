"""The right-hand side of every example, exported to Python, is the engine's."""

import numpy as np
import pytest

from tests.examples.test_examples import PREPARED
from tests.symbolic.exported import example, given_at, states


@pytest.mark.parametrize("name", PREPARED)
def test_accelerations_are_the_engines(name):
    m = example(name)
    eq, p = m.symbolic(coordinates="joint"), m.prepare(coordinates="joint")
    code = eq.export(language="python", functions=["right_hand_side"])
    for state in states(p, 2):
        given = given_at(eq, code, state)
        found = code["right_hand_side"](*[given[a.name] for a in code.routines[0].arguments])[1]
        free = np.linalg.lstsq(p.mass_matrix(state[1]), p.forces(*state), rcond=None)[0]  # without constraints
        expected = p.acceleration(*state)
        size = max(np.abs(expected).max(initial=0.0), np.abs(free).max(initial=0.0))
        np.testing.assert_allclose(found, expected, rtol=0, atol=2e-12 * size)
