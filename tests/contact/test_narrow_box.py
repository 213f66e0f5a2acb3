"""A box and another convex shape: where a side answers at once, the search for the nearest points says the same."""

from __future__ import annotations

import numpy as np
import pytest

from flyball.collision.shape_kinds import BOX, CAPSULE, CONE, CYLINDER
from tests.contact.pairs import separations
from tests.contact.scenes import contacts, geometry, turned
from tests.contact.solids import rotation


@pytest.mark.parametrize("kind", [CAPSULE, CYLINDER, CONE])
def test_sides_agree_with_the_search(kind):
    """Plates and needles too, which are left the other way soon."""
    rng = np.random.default_rng(kind)
    overlaps = 0
    for _ in range(150):
        a = BOX, np.exp(rng.uniform(np.log(0.01), np.log(2), 3))
        b = kind, np.exp(rng.uniform(np.log(0.01), np.log(2), 2))
        R = rotation(rng)
        Q = (rotation(rng), R @ turned(rng.normal(size=3), 0.01), R @ turned((0, 1, 0), np.pi / 2))[rng.integers(3)]
        q = R @ (rng.normal(size=3) * (a[1] + max(b[1]) * rng.choice([0.1, 1])))
        found = contacts(a, b, (np.zeros(3), R), (q, Q))[:, 6].min()
        cores = separations(geometry(a, b), np.array([[0, 0, 0, *R.ravel()], [*q, *Q.ravel()]]))[0, 0]
        np.testing.assert_allclose(found, cores - (b[1][0] if kind == CAPSULE else 0), rtol=0, atol=5e-6)
        overlaps += found < 0
    assert overlaps > 20
