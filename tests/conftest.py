"""What tests of every room may ask for."""

from __future__ import annotations

import pytest

from tests.layers import LAYERS, take


@pytest.fixture(params=LAYERS)
def layer(request, monkeypatch) -> str:
    """One coordinate layer after the other, in force for the test."""
    take(request.param, monkeypatch)
    return request.param
