"""Compiled code is kept between processes, and never served when the sources have changed.

Small kernels in processes of their own; what is compiled for a whole motion is `test_added_elements`'.
"""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from flyball.compiler import formulas, object_files
from flyball.compiler.formulas import PACKAGE, sources_of
from flyball.engine.entry_point import engine
from flyball.engine.residual import residuals_kernel
from flyball.engine.sensitivity_equations import variation_kernel
from flyball.numerics.sparse_factorisation import ldl_factor_kernel
from tests.program.copied import Copy


def names_of(kernel):
    return {str(p.relative_to(PACKAGE)) for p in sources_of(Path(kernel.function.__code__.co_filename))}


def test_an_edit_of_one_loop_does_not_compile_the_others():
    """A kernel's stamp covers what it imports, registries with all they find, and nothing else."""
    of_engine, of_residual, of_factor = map(names_of, (engine, residuals_kernel, ldl_factor_kernel))
    explicit = "numerics/integrators/explicit_runge_kutta.py"
    assert explicit in of_engine
    assert explicit not in of_residual | of_factor
    for shared in (
        "engine/rows.py",
        "constraints/skew_lines.py",
        "forces/bushing.py",
        "tables/table_definitions.py",
        "math/vec.py",
    ):
        assert shared in of_engine & of_residual
    assert "numerics/sparse_factorisation.py" in of_engine & of_factor
    of_variation = names_of(variation_kernel)
    assert explicit in of_variation
    assert not of_variation & {"engine/rows.py", "engine/loads.py", "forces/bushing.py", "engine/entry_point.py"}
    assert not of_factor & {"engine/rows.py", "forces/bushing.py"}
    assert not {x for x in of_engine if x.startswith(("model/", "analysis/", "joints/"))}


def test_stamps_see_every_way_to_import(tmp_path, monkeypatch):
    """By name, by folder, with a star, within a function; a loop of somebody else's holds all that could be in it."""
    room = tmp_path / "math"
    (tmp_path / "numerics").mkdir()
    room.mkdir()
    for name in ("a", "b", "c", "d", "e"):
        (room / f"{name}.py").write_text("")
    (tmp_path / "numerics" / "__init__.py").write_text("from ..math.e import x")
    text = "from .b import *\nfrom . import c\nfrom .. import numerics\ndef f():\n    from .d import y\n"
    (room / "a.py").write_text(text)
    monkeypatch.setattr(formulas, "PACKAGE", tmp_path)
    monkeypatch.setattr(formulas, "COMPILED", ("math", "numerics"))
    names = {p.name for p in formulas.sources_of(room / "a.py") if tmp_path in p.parents}
    assert names == {"a.py", "b.py", "c.py", "d.py", "e.py", "__init__.py"}
    elsewhere = tmp_path.parent / "loop.py"
    elsewhere.write_text("")
    assert formulas.compiled_files() < set(formulas.sources_of(elsewhere))


def test_the_files_used_longest_ago_are_removed(tmp_path, monkeypatch):
    """Beyond so many bytes; whatever else is in the folder stays."""
    monkeypatch.setattr(object_files, "MAX_FOLDER_BYTES", 250)
    other = tmp_path / "mine.o"
    other.write_bytes(bytes(1000))
    files = [tmp_path / f"kernel-{k:024x}.o" for k in range(4)]
    for k, path in enumerate(files):
        path.write_bytes(bytes(100))
        os.utime(path, (k, k))
    object_files.mark_used(files[1])
    object_files.remove_oldest(tmp_path)
    assert sorted(tmp_path.iterdir()) == [files[1], files[3], other]


FACTOR = """
import numpy as np
from flyball.numerics.sparse_factorisation import analyse_ldl, ldl_factor_kernel
P, _ = analyse_ldl(1, np.zeros(0, int), np.zeros(0, int))
L, D, Y = np.zeros(len(P.Li)), np.zeros(1), np.zeros(1)
"""


@pytest.fixture(scope="module")
def package(tmp_path_factory):
    return Copy(tmp_path_factory.mktemp("copied"))


@pytest.fixture
def small(package, tmp_path):
    """A copy of the package with an empty cache."""
    return package.with_cache(tmp_path)


def test_an_edited_formula_is_never_served_from_the_cache(small):
    """A formula in another file than the kernel's."""
    script = FACTOR + "says = ldl_factor_kernel(P, np.full(len(P.Ai) + 1, 4.0), L, D, Y)\n"
    script += "print(json.dumps(cache_counts() | {'says': int(says), 'inverse': D[0]}))\n"
    first = small.run(script)
    assert (first["misses"], first["says"], first["inverse"]) == (1, 0, 0.25)
    was, becomes = "return lambda x: not (x.real == 0.0 or x.real != x.real)", "return lambda x: x.real != x.real"
    small.edit("math/scalar.py", was, becomes)
    try:
        edited = small.run(script)
    finally:
        small.edit("math/scalar.py", becomes, was)
    assert (edited["misses"], edited["says"]) == (1, 1), "no pivot is good any more"


@pytest.mark.parametrize("damage", [b"", b"no object code", None])
def test_damaged_cache_files_are_compiled_anew(small, damage):
    """Empty, foreign or cut short: as if they were not there, and written again."""
    script = (
        FACTOR
        + """
ldl_factor_kernel(P, np.full(len(P.Ai) + 1, 4.0), L, D, Y)
print(json.dumps(cache_counts() | {"inverse": D[0]}))
"""
    )
    assert small.run(script)["misses"] == 1
    files = [f for f in small.cache.rglob("*.o") if f.is_file()]
    assert len(files) == 1
    for file in files:
        file.write_bytes(file.read_bytes()[:40] if damage is None else damage)
    again = small.run(script)
    assert (again["misses"], again["inverse"]) == (1, 0.25)
    assert small.run(script)["hits"] == 1


def test_a_folder_that_cannot_be_written_is_said(small):
    """The code runs all the same, and says where it could be kept."""
    script = (
        FACTOR
        + """
import os, warnings
with warnings.catch_warnings(record=True) as told:
    warnings.simplefilter("always")
    ldl_factor_kernel(P, np.full(len(P.Ai) + 1, 4.0), L, D, Y)
print(json.dumps(cache_counts() | {"inverse": D[0], "told": [str(w.message) for w in told]}))
"""
    )
    small.cache.mkdir(exist_ok=True)
    occupied = small.with_cache(small.cache)
    occupied.cache = small.cache / "a file"
    occupied.cache.write_text("")
    again = occupied.run(script)
    assert (again["misses"], again["inverse"]) == (1, 0.25)
    assert any("cannot be kept" in text and "FLYBALL_CACHE" in text for text in again["told"])


def test_compiled_code_is_kept_in_the_home_folder_by_default(tmp_path):
    """Without ``FLYBALL_CACHE`` it is in the user's cache folder."""
    without = {k: v for k, v in os.environ.items() if k not in ("FLYBALL_CACHE", "XDG_CACHE_HOME")}
    code = "from flyball.compiler.object_files import cache_folder; print(cache_folder())"
    env = without | {"HOME": str(tmp_path), "LOCALAPPDATA": str(tmp_path)}
    found = subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, text=True, check=True)
    assert Path(found.stdout.strip()).is_relative_to(tmp_path)
