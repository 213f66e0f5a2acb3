"""Products of small matrices: sums in a fixed order, so that tables are the same on every machine, whatever its BLAS."""

from __future__ import annotations

import numpy as np
import pytest

from flyball.math.vec import matrix_product

SHAPES = [((3, 3), (3,)), ((3, 3), (3, 3)), ((4, 3, 3), (4, 3, 3)), ((4, 3, 3), (4, 3, 1))]


@pytest.mark.parametrize("shapes", SHAPES, ids=str)
def test_products_add_in_order(shapes):
    rng = np.random.default_rng(0)
    A, B = (rng.normal(size=s) for s in shapes)
    found = matrix_product(A, B)
    np.testing.assert_allclose(found, A @ B, rtol=1e-13, atol=1e-14)
    x, y = A.reshape(-1, 3, 3)[0], B.reshape(-1, *B.shape[-2:])[0] if B.ndim > 1 else B[:, None]
    assert found.ravel()[0] == x[0, 0] * y[0, 0] + x[0, 1] * y[1, 0] + x[0, 2] * y[2, 0]
