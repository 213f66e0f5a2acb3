"""Versions of Numba: our way of linking where it is known to work, the usual one with a notice elsewhere."""

import tomllib

import numba
import pytest

import flyball as fb
from flyball.compiler import ways
from flyball.compiler.link import linked_as_a_whole
from flyball.compiler.stamp import PACKAGE


@pytest.fixture
def asked_anew():
    ways.ours.cache_clear()
    yield
    ways.ours.cache_clear()


def test_what_is_declared_is_what_was_tried():
    declared = tomllib.loads((PACKAGE.parents[1] / "pyproject.toml").read_text(encoding="utf-8"))
    assert f"numba>={ways.TRIED[0]}" in declared["project"]["dependencies"]


def test_a_later_version_is_probed_and_served_our_way_if_it_serves(asked_anew, monkeypatch, recwarn):
    monkeypatch.setattr(numba, "__version__", "0.99.0")
    assert ways.ours()
    assert not recwarn.list


def test_where_internals_differ_compilation_takes_the_usual_way(asked_anew, monkeypatch):
    """As 0.61, whose optimiser is another: the probe fails, a notice says so, and kernels compile all the same."""
    monkeypatch.setattr(numba, "__version__", "0.99.0")

    def broken(top):
        raise AttributeError("'CPUCodeLibrary' object has no attribute '_final_module'")

    monkeypatch.setattr(ways, "linked_as_a_whole", broken)
    with pytest.warns(fb.PerformanceNotice, match=r"Numba 0\.99\.0 differs .*0\.62 to 0\.68.*usual way"):
        assert not ways.ours()

    @numba.njit
    def double(x):
        return 2 * x

    with ways.optimise_once("double"):
        assert double(3) == 6


def test_nothing_stays_patched():
    from numba.core import codegen

    before = codegen.CPUCodeLibrary.finalize, codegen.JITCPUCodegen.set_env
    with linked_as_a_whole("nothing"):
        assert codegen.CPUCodeLibrary.finalize is not before[0]
    assert (codegen.CPUCodeLibrary.finalize, codegen.JITCPUCodegen.set_env) == before
