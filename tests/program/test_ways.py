"""Versions of Numba: our way of linking where it is known to work, the usual one with a notice elsewhere."""

import threading
import tomllib

import numba
import pytest

import flyball as fb
from flyball.compiler import ways
from flyball.compiler.lean import leanly
from flyball.compiler.link import linked_as_a_whole
from flyball.compiler.quick import quickly
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
    from llvmlite.ir import IRBuilder
    from numba.core import base, callconv, cgutils, codegen, event, ir, lowering, typeinfer
    from numba.core.postproc import PostProcessor
    from numba.core.targetconfig import TargetConfig
    from numba.core.typing.context import BaseContext
    from numba.core.typing.npydecl import NumpyRulesArrayOperator

    def patched():
        library, target = codegen.CPUCodeLibrary, codegen.JITCPUCodegen
        quick = TargetConfig.values, TargetConfig.__eq__, TargetConfig.__hash__, ir.Inst._rec_list_vars
        found = BaseContext.resolve_function_type, PostProcessor.run
        lower = lowering.Lower.storevar, lowering.Lower.alloca_lltype, lowering.Lower.lower_normal_function
        called = base.user_function, callconv.CPUCallConv._return_errcode_raw, cgutils.alloca_once
        target_of = base.BaseContext
        chosen = target_of.get_function, target_of.cast, target_of.pair_first, target_of.pair_second
        handed = lowering.Lower._find_singly_assigned_variable, target_of.declare_function
        folded = IRBuilder.icmp_signed, IRBuilder.select, IRBuilder.add, IRBuilder.mul
        told = event.install_timer, event.start_event, event.end_event, base._has_loc, NumpyRulesArrayOperator.generic
        explained = typeinfer.new_error_context, lowering.new_error_context, callconv.BaseCallConv.decode_arguments
        built = IRBuilder.insert_value, IRBuilder.extract_value
        lean = *lower, *called, *chosen, *handed, *folded, *told, *explained, *built
        return [library.finalize, library._optimize_functions, target.set_env, *quick, *found, *lean]

    before = patched()
    with linked_as_a_whole("nothing"), quickly(), leanly():
        assert all(now is not then for now, then in zip(patched(), before, strict=True))
    assert patched() == before


def test_flags_and_variables_are_what_numba_itself_finds():
    """The quick ways give the answers of the usual ones, in their order."""
    from numba.core import compiler
    from numba.core.compiler import Flags

    def sample(a, b):
        total = 0.0
        for i in range(a.shape[0]):
            x, y = (a[i], b), {"k": b}
            total += max(x[0], x[1] * i) if i % 2 else len(y)
        return total

    body = [s for block in compiler.run_frontend(sample).blocks.values() for s in block.body]
    flags = [Flags(), Flags(), Flags()]
    flags[1].release_gil = False  # what it is without being set
    flags[2].release_gil = True

    def answers():
        listed = [
            [v.name for v in x.list_vars()]
            for s in body
            for x in (s, getattr(s, "value", s))
            if hasattr(x, "list_vars")
        ]
        return listed, [[a == b for a in flags] for b in flags], [hash(x) for x in flags], [x.values() for x in flags]

    usual = answers()
    with quickly():
        assert answers() == usual
    assert answers() == usual


def test_nobody_elses_code_compiles_our_way():
    """A thread that compiles something of its own meanwhile waits: its library was never finalised, and it crashed."""
    found = []
    other = threading.Thread(target=lambda: found.append(numba.njit(lambda x: x + 1.0)(1.0)))
    with ways.optimise_once("some_kernel"):
        other.start()
        other.join(0.3)
        assert other.is_alive()
    other.join(60.0)
    assert found == [2.0]
