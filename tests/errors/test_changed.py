"""Parts that are exchanged in a copy of a mechanism: unknown names, parameters, and what is no part are refused."""

from __future__ import annotations

import pytest

import flyball as fb


@pytest.mark.parametrize(
    ("parts", "message"),
    [
        ({"rodd": None}, r"'m' has no part 'rodd' \(did you mean 'rod'\?\)"),
        ({"length": 0.0}, r"'length' is a parameter of 'm': m.parameters\['length'\] = ..., or parameters="),
        ({"rod": 3.0}, r"a part is exchanged for a part, or for None, not 3.0: 'rod'"),
        ([("rod", None)], r"parts maps names to parts"),
    ],
)
def test_what_cannot_be_exchanged_is_refused(parts, message):
    m = fb.Mechanism("m", planar=True, parameters={"length": 1.0})
    m.add(fb.Body("rod", mass=1, inertia=1, position=("length", 0)))
    with pytest.raises(fb.ModelError, match=message):
        m.changed(parts)
