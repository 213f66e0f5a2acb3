"""What tests of elements of a user's own have in common."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from flyball.numerics.integrators.butcher_tableaux import TABLEAUX


@pytest.fixture(autouse=True)
def built_in_methods() -> Iterator[None]:
    """A method that a test defines is gone after it: messages that other tests look at list the methods."""
    before = dict(TABLEAUX)
    yield
    TABLEAUX.clear()
    TABLEAUX.update(before)
