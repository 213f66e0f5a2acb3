"""The step between two positions undoes ``retract``, in both coordinate layers, and half a turn is no division by zero."""

from __future__ import annotations

import numpy as np
import pytest

from flyball.assembly.compiled_mechanism import compile_mechanism, tangent_rate, tangent_step
from flyball.engine.kinematics import retract
from flyball.numerics.rank import column_space, fundamental_subspaces, null_space, rank
from tests.mechanisms import example, four_bar, free_body


@pytest.mark.parametrize("make", [free_body, four_bar, lambda: example("heavy_top.toml")])
@pytest.mark.parametrize("layer", ["absolute", "joint"])
def test_a_step_leads_from_one_position_to_another(make, layer):
    m = make()
    c = compile_mechanism(m, tree=[j.name for j in m.joints][:1] if layer == "joint" else ())
    random = np.random.default_rng(0)
    for _ in range(5):
        q, d = c.values.q.copy(), 0.7 * random.normal(size=c.structure.nv)
        retract(c.values.system, q, 0.5 * random.normal(size=len(d)))
        other = q.copy()
        retract(c.values.system, other, d)
        assert tangent_step(c, q, other) == pytest.approx(d, abs=1e-12)
        near = q.copy()
        retract(c.values.system, near, 1e-7 * d)
        assert tangent_rate(c, q, (near - q) / 1e-7) == pytest.approx(d, abs=1e-5)


def test_half_a_turn_is_a_step_with_an_end():
    c = compile_mechanism(free_body())
    q, other = np.array([0, 0, 0, 1.0, 0, 0, 0]), np.array([0, 0, 0, 0, 0, 0, 1.0])
    d = tangent_step(c, q, other)
    assert np.isfinite(d).all()
    assert d[5] > 1e3


def test_rank_and_its_spaces():
    """A product of known rank; nothing at all; what counts as zero is relative unless a size is given."""
    random = np.random.default_rng(1)
    A = random.normal(size=(7, 3)) @ random.normal(size=(3, 5))
    p = fundamental_subspaces(A)
    assert (p.rank, p.dependencies.shape, p.null.shape) == (3, (7, 4), (5, 2))
    assert np.abs(p.dependencies.T @ A).max() < 1e-13
    assert np.abs(A @ p.null).max() < 1e-13
    assert np.allclose(p.span @ np.diag(p.values) @ p.row_space.T, A)
    assert column_space(A).shape == (7, 3)
    assert (rank(np.zeros((0, 4))), null_space(np.zeros((0, 4))).shape, rank(np.zeros((2, 2)))) == (0, (4, 4), 0)
    assert (rank(1e-12 * A), rank(1e-12 * A, size=1.0)) == (3, 0)
