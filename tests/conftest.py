"""What tests of every room may ask for."""

from __future__ import annotations

import gc
import os

for name in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ.setdefault(name, "1")  # before NumPy: threads of two test processes wait for each other, busily

import pytest  # noqa: E402

from tests.layers import LAYERS, take  # noqa: E402

LONG = ("program/test_added_elements", "robust/test_random", "view/test_p", "checkpoints/", "identities/", "view/")
"""Files that take longest, wherever they stand: one that began last would leave one of two processes alone."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Longest files first."""
    items.sort(key=lambda item: next((k for k, x in enumerate(LONG) if f"tests/{x}" in item.nodeid), len(LONG)))


@pytest.fixture(params=LAYERS)
def layer(request, monkeypatch) -> str:
    """One coordinate layer after the other, in force for the test."""
    take(request.param, monkeypatch)
    return request.param


@pytest.fixture(scope="module", autouse=True)
def only_what_is_new_is_looked_at() -> None:
    """Garbage is looked for among what a file of tests makes: thirteen thousand tests and what Numba keeps are a second."""
    gc.collect()
    gc.freeze()
