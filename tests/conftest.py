"""What tests of every room may ask for."""

from __future__ import annotations

import gc
import os
import sys
from collections.abc import Generator

for name in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ.setdefault(name, "1")  # before NumPy: threads of two test processes wait for each other, busily
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)  # the hundred processes that tests start find what others have read
sys.dont_write_bytecode = False

import pytest  # noqa: E402

from tests.layers import LAYERS, take  # noqa: E402

LONG = ("program/test_added_elements", "robust/test_random", "view/test_p", "checkpoints/", "identities/", "view/")
"""Files that take longest, wherever they stand: one that began last would leave one of two processes alone."""
SECOND = os.environ.get("PYTEST_XDIST_WORKER", "gw0")[-1] in "13579"


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report(
    collector: pytest.Collector,
) -> Generator[None, pytest.CollectReport, pytest.CollectReport]:
    """Of two processes one reads the files from the end: asserts are rewritten once, by the one that comes first."""
    report = yield
    if SECOND and isinstance(collector, pytest.Directory):
        report.result.reverse()
    return report


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Longest files first, in each process the same order."""
    names = [f"tests/{x}" for x in LONG]
    first = {
        path: next((k for k, x in enumerate(names) if x in path), len(LONG)) for path in {str(i.path) for i in items}
    }
    items.sort(key=lambda item: (first[str(item.path)], str(item.path)))


def pytest_addoption(parser: pytest.Parser) -> None:
    """What the tests of an installed wheel are to show."""
    parser.addoption("--shipped", action="store_true", help="fail unless every kernel ran, from shipped object code")


def pytest_sessionfinish(session: pytest.Session) -> None:
    """With ``--shipped``: name the kernels that were not run, or whose object code was not the wheel's."""
    if session.config.getoption("--shipped"):
        from flyball.compiler.ahead_of_time import all_kernels

        missing = [f"{k.name}: {k.origin or 'not run'}" for k in all_kernels() if k.origin != "shipped"]
        if missing or ("numba" in sys.modules and sys.modules["numba"] is not None):
            print("\nnot run from shipped object code:", *missing or ["Numba was imported"], sep="\n    ")
            session.exitstatus = pytest.ExitCode.TESTS_FAILED


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
