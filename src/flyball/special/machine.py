"""From text in LLVM's language to machine code, and from there to addresses.

`llvmlite` comes with Numba; no pass of Numba is run. The object file that comes out is what is kept on disk.
"""

from __future__ import annotations

import threading
from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from ..compiler.jit import start_numba
from ..graph.printers.llvm import Module
from ..tables.system import System, Work
from ..tracing.trace import TABLES
from .layout import DIMENSIONS
from .linked import ENTRIES, Linked

ARGUMENTS = "ptr %S, ptr %W, double %t, ptr %a, ptr %b, ptr %c, ptr %d"
HEAD, DATA, A_DIMENSION = 40, 32, 16
"""Bytes of an array of a held tuple without its shape, where its numbers' address stands, and of a dimension."""
_LOCK = threading.RLock()


@lru_cache(maxsize=1)
def offsets() -> dict[str, int]:
    """Where, from the begin of a held `System` or `Work`, the addresses of their arrays' numbers stand."""
    out: dict[str, int] = {}
    for letter, of in (("S", System), ("W", Work)):
        at = 0
        for name, dimensions in DIMENSIONS[of.__name__]:
            out[f"{letter}_{name}"] = at + DATA
            at += HEAD + A_DIMENSION * dimensions
    return out


def module_of(linked: Linked) -> str:
    """The whole module, as text."""
    module = Module(ARGUMENTS, _based)
    for p in linked.procedures:
        module.add(p)
    return str(module)


def _based(base: str) -> list[str]:
    """Lines that leave the address of a base's numbers in ``%base``."""
    if base in ("a", "b", "c", "d"):
        return []
    if base.startswith("C_"):  # one of the tables, whose addresses stand where S does
        at = 8 * TABLES.index(base.removeprefix("C_"))
        holder = "S"
    else:
        at, holder = offsets()[base], base[0]
    return [
        f"%at_{base} = getelementptr i8, ptr %{holder}, i64 {at}",
        f"%{base} = load ptr, ptr %at_{base}, !invariant.load !0",
    ]


def _target() -> Any:
    """A target machine; whoever makes an engine of it, owns it."""
    start_numba()
    import llvmlite.binding as llvm

    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    features = llvm.get_host_cpu_features().flatten()
    target = llvm.Target.from_default_triple()
    return target.create_target_machine(
        cpu=llvm.get_host_cpu_name(),
        features=features,
        opt=2,
        jit=True,
        codemodel="jitdefault",
    )


@lru_cache(maxsize=1)
def machine() -> str:
    """What the code is for: processor, its features, versions."""
    start_numba()
    import llvmlite
    import llvmlite.binding as llvm

    features = llvm.get_host_cpu_features().flatten()
    versions = f"{llvmlite.__version__} {llvm.llvm_version_info}"
    return f"{llvm.get_default_triple()} {llvm.get_host_cpu_name()} {features} {versions}"


def assembled(text: str) -> bytes:
    """The object file of a module."""
    import llvmlite.binding as llvm

    with _LOCK:
        target = _target()
        module = llvm.parse_assembly(text)
        module.triple = llvm.get_default_triple()
        module.data_layout = str(target.target_data)
        options = llvm.create_pipeline_tuning_options(speed_level=2)
        options.slp_vectorization = False  # measured: slower, and longer in the making
        builder = llvm.create_pass_builder(target, options)
        passes = builder.getModulePassManager()
        passes.run(module, builder)
        return bytes(target.emit_object(module))


class Loaded:
    """Machine code in memory, as long as this lives.

    Attributes
    ----------
    addresses : dict of str to int
        Of the procedures; 0 if there is none.
    """

    def __init__(self, code: bytes, laws: Sequence[str] = ()) -> None:
        import llvmlite.binding as llvm

        with _LOCK:
            self._engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), _target())
            self._engine.add_object_file(llvm.ObjectFileRef.from_data(code))
            self._engine.finalize_object()
            names = ("CONSTANTS", *ENTRIES[1:-1], *filter(None, laws))
            self.addresses = {name: int(self._engine.get_function_address(name)) for name in names}


def tables_of(S: System) -> np.ndarray:
    """Addresses of the tables, for ``CONSTANTS``."""
    return np.array([getattr(S, name).ctypes.data for name in TABLES], np.int64)
