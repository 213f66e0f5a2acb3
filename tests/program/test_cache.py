"""Compiled code is kept between processes, and never served when the sources have changed.

The processes themselves are those of `tests.program.conftest`: compiling costs twenty seconds each time.
"""

import pytest


def test_the_copy_is_what_ran(runs):
    copy, *each = runs
    assert {r["where"] for r in each} == {str(copy.package / "__init__.py")}


def test_a_second_process_compiles_nothing(runs):
    _, first, second, _ = runs
    assert first["misses"] == len(first["kernels"]) > 0
    assert (second["misses"], second["hits"]) == (0, len(second["kernels"]))
    assert second["kernels"] == first["kernels"]
    assert first["y"] == second["y"] == pytest.approx(-5.0, abs=1e-9)


def test_an_edited_formula_is_never_served_from_the_cache(runs):
    """Numba's own cache looks at the kernel's file only, and would go on with the old formula."""
    *_, edited = runs
    assert runs[1]["y"] == pytest.approx(-5.0, abs=1e-9)
    assert edited["y"] == pytest.approx(5.0, abs=1e-9)
    assert edited["misses"] == len(edited["kernels"])


def test_the_right_hand_side_is_compiled_once(runs):
    """One kernel holds it, whatever is simulated: planar, spatial, with and without constraints."""
    _, first, *_ = runs
    assert first["kernels"] == ["motion_kernel"]
