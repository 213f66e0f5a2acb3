"""Object files of kernels: what is in them, where they are found, and what is never used of them."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys

import numpy as np
import pytest

from flyball.compiler.ahead_of_time import all_kernels, missing_kernels
from flyball.compiler.formulas import FAILED
from flyball.compiler.kernels import kernel
from flyball.compiler.object_code import BASELINES, baseline, compile_kernel, target_triple
from flyball.compiler.object_files import SHIPPED, cache_folder, file_name, object_folders, read_object
from flyball.compiler.struct_layout import Float1
from tests.program.copied import Copy

C_LIBRARY = {
    *[
        "acos",
        "acosh",
        "asin",
        "asinh",
        "atan",
        "atan2",
        "atanh",
        "ceil",
        "cos",
        "cosh",
        "exp",
        "expm1",
        "floor",
        "fmod",
        "hypot",
        "ldexp",
        "log",
        "log10",
        "log1p",
        "log2",
        "pow",
    ],
    *[
        "round",
        "sin",
        "sincos",
        "sinh",
        "sqrt",
        "tan",
        "tanh",
        "trunc",
        "copysign",
        "fmax",
        "fmin",
        "memset",
        "memcpy",
        "memmove",
        "_GLOBAL_OFFSET_TABLE_",
    ],
}

HASHES = """
import hashlib, json, sys
import numpy as np
import flyball as fb
out = {}
for name in sys.argv[2:]:
    m = fb.load(f"{sys.argv[1]}/{name}.toml")
    r = m.simulate(0.02, **({"method": fb.Stepping(step=1e-3)} if m.contacts else {"specialize": False}))
    out[name] = hashlib.sha256(b"".join(np.ascontiguousarray(x).tobytes() for x in (r.q, r.v, r.vdot))).hexdigest()
from flyball.engine.entry_point import engine
print(json.dumps(out | {"origin": engine.origin, "numba": "numba" in sys.modules}))
"""


def process(code: str, *args: str, **env: str) -> dict:
    """What a fresh process prints last, as JSON."""
    ended = subprocess.run(
        [sys.executable, "-c", code, *args], env=os.environ | env, capture_output=True, text=True, timeout=600
    )
    assert ended.returncode == 0, ended.stderr
    return json.loads(ended.stdout.splitlines()[-1])


@pytest.mark.skipif(shutil.which("nm") is None, reason="binutils are not installed")
@pytest.mark.skipif(not target_triple().endswith("gnu"), reason="objects of another format")
def test_objects_need_the_c_library_only(tmp_path):
    """Neither Python nor Numba's runtime: so they run where neither compiler is."""
    seen = set()
    for k in all_kernels():
        for _, folder in object_folders():
            if (code := read_object(folder / file_name(k, baseline()))) is not None:
                path = tmp_path / "kernel.o"
                path.write_bytes(code)
                lines = subprocess.run(
                    ["nm", "-u", path], capture_output=True, text=True, check=True
                ).stdout.splitlines()
                seen |= {line.split()[-1] for line in lines}
                break
    assert seen
    assert seen <= C_LIBRARY


def test_a_motion_whose_code_is_found_imports_no_numba(tmp_path):
    """And its numbers are, to the last bit, those of the other baseline."""
    others = [x for x in BASELINES if x != baseline()] if target_triple().startswith("x86_64") else []
    every = sorted(path.stem for path in Copy.examples().glob("*.toml"))
    made = cache_folder() is not None and not missing_kernels(
        cache_folder(), others
    )  # else compiling them takes minutes
    args = str(Copy.examples()), *(every if made else ("governor", "slider_crank", "andrews"))
    process(HASHES, *args)
    found = process(HASHES, *args)
    assert found.pop("origin") in ("cache", "shipped")
    assert not found.pop("numba")
    if others and BASELINES[others[-1]]:
        other = process(HASHES, *args, FLYBALL_TARGET=others[-1])
        assert {k: other[k] for k in found} == found


def test_nothing_inside_numba_is_replaced():
    """Attributes of its classes and modules are those of before a kernel was compiled."""
    code = """
import inspect, json, sys
import numba
from numba.core import base, callconv, cgutils, codegen, compiler, cpu, dispatcher, ir, lowering, postproc, typeinfer
from numba.core import typing
from numba.core.typing import context, templates
import llvmlite.ir as ir_module
MODULES = [base, callconv, cgutils, codegen, compiler, cpu, dispatcher, ir, lowering, postproc, typeinfer, context]
MODULES += [templates, ir_module]

def attributes():
    out = {}
    for m in MODULES:
        for name, x in vars(m).items():
            out[m.__name__, name] = id(x)
            if inspect.isclass(x) and x.__module__.partition(".")[0] in ("numba", "llvmlite"):
                out |= {(m.__name__, name, k): id(v) for k, v in vars(x).items() if inspect.isfunction(v)}
    return out

before = attributes()
from flyball.compiler.object_code import compile_kernel
from flyball.compiler.object_code import baseline
from flyball.numerics.sparse_factorisation import ldl_factor_kernel
compile_kernel(ldl_factor_kernel, (baseline(),))
after = attributes()
print(json.dumps([str(k) for k in before if before[k] != after.get(k)]))
"""
    assert process(code) == []


def test_code_of_other_sources_is_not_used(tmp_path):
    """An object that came with the installation, beside a formula that was edited afterwards."""
    copy = Copy(tmp_path)
    script = """
import numpy as np
from flyball.compiler.object_files import SHIPPED, code_of, file_name, write_object
from flyball.compiler.object_code import baseline
from flyball.compiler.object_code import compile_kernel
from flyball.numerics.sparse_factorisation import analyse_ldl, ldl_factor_kernel
if SHIP:
    write_object(SHIPPED / file_name(ldl_factor_kernel, baseline()), compile_kernel(ldl_factor_kernel, (baseline(),))[0])
P, _ = analyse_ldl(1, np.zeros(0, int), np.zeros(0, int))
L, D, Y = np.zeros(len(P.Li)), np.zeros(1), np.zeros(1)
ldl_factor_kernel(P, np.full(len(P.Ai) + 1, 4.0), L, D, Y)
print(json.dumps({"origin": ldl_factor_kernel.origin, "inverse": D[0]}))
"""
    assert copy.run(script.replace("SHIP:", "True:")) == {"origin": "shipped", "inverse": 0.25}
    was, becomes = "return lambda x: not (x.real == 0.0 or x.real != x.real)", "return lambda x: x.real != x.real"
    copy.edit("math/scalar.py", was, becomes)
    assert copy.run(script.replace("SHIP:", "False:"))["origin"] == "compiled"


@kernel
def first(x: Float1) -> float:
    """A kernel of one's own."""
    return x[0]


def test_what_a_kernel_takes_is_checked():
    assert first(np.array([3.0, 1.0])) == 3.0
    for wrong in (np.array([3]), np.zeros((2, 2)), np.zeros(4)[::2]):
        with pytest.raises(TypeError, match="an array of float64 with 1 dimensions and without gaps is needed"):
            first(wrong)


def test_a_parameter_without_a_declared_layout_is_refused():
    @kernel
    def bare(x) -> int:
        return 0

    with pytest.raises(TypeError, match="parameter 'x' needs the annotation"):
        bare(np.zeros(1))


def test_an_unknown_processor_is_refused():
    code = "import json\nfrom flyball.compiler.object_code import baseline\n"
    code += "try:\n    baseline()\nexcept ValueError as error:\n    print(json.dumps(str(error)))"
    assert "x86-64-v3" in process(code, FLYBALL_TARGET="z80")


def test_every_object_has_an_entry_for_each_baseline():
    codes = compile_kernel(first, tuple(BASELINES) if target_triple().startswith("x86_64") else (baseline(),))
    assert all(b"flyball_kernel" in code for code in codes)
    assert FAILED < 0
    assert SHIPPED.name == "objects"
