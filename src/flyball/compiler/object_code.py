"""Object code of kernels: made by LLVM for a processor, and loaded into memory.

Code is made for a fixed baseline of a processor family, not for the present processor: x86-64-v3 (2013 and later), else
x86-64-v2; for other families, the features that all processors of the family have. Results thus have the same bits on
all of these: products and sums are not contracted, and nothing is reordered. Files of object code: `object_files`.
"""

from __future__ import annotations

import os
import threading
from functools import lru_cache
from typing import Any

from .formulas import LOCK, register_all

BASELINES = {"x86-64-v3": ("avx2", "bmi2", "f16c", "fma", "lzcnt", "movbe"), "x86-64-v2": ("sse4.2", "popcnt", "ssse3")}
"""Processors that code is made for, the best first, with the LLVM features that identify them."""
_LLVM_LOCK = threading.RLock()


@lru_cache(maxsize=1)
def llvm_binding() -> Any:
    """The binding of llvmlite, initialised for this machine."""
    import llvmlite.binding as binding

    binding.initialize_native_target()
    binding.initialize_native_asmprinter()
    return binding


@lru_cache(maxsize=1)
def baseline() -> str:
    """Processor that code is made for: ``FLYBALL_TARGET``, or the best baseline that this machine supports.

    Raises
    ------
    ValueError
        If ``FLYBALL_TARGET`` names none that is known.
    """
    wanted = os.environ.get("FLYBALL_TARGET", "")
    if wanted:
        if wanted not in BASELINES:
            raise ValueError(f"FLYBALL_TARGET={wanted} is not known: give one of {', '.join(BASELINES)}")
        return wanted
    if not target_triple().startswith("x86_64"):
        return "generic"
    has = llvm_binding().get_host_cpu_features()
    return next((name for name, needs in BASELINES.items() if all(has.get(x) for x in needs)), "x86-64")


def baselines() -> tuple[str, ...]:
    """Processors of this machine's family that object code is shipped for."""
    return tuple(BASELINES) if target_triple().startswith("x86_64") else (baseline(),)


@lru_cache(maxsize=1)
def target_triple() -> str:
    """Architecture, system and object format of this process."""
    return str(llvm_binding().get_process_triple())


def target_machine(cpu: str = "", system: str = "") -> Any:
    """LLVM's code generator for a processor and a system; an execution engine made with it takes ownership."""
    found = llvm_binding().Target.from_triple(system or target_triple())
    position = "static" if (system or target_triple()).startswith(("x86_64", "i686")) else "default"
    return found.create_target_machine(
        cpu=cpu or baseline(), features="", opt=3, reloc=position, codemodel="jitdefault", jit=True
    )


def object_code_of_text(text: str, level: int = 2) -> bytes:
    """Object code of one module in LLVM's language."""
    return emit_object(llvm_binding().parse_assembly(text), target_machine(), level, False)


def emit_object(module: Any, machine: Any, level: int, vectorised: bool) -> bytes:
    """Object code of a module, at an optimisation level of LLVM, with loops and straight code vectorised or not."""
    with _LLVM_LOCK:
        module.triple, module.data_layout = machine.triple, str(machine.target_data)
        options = llvm_binding().create_pipeline_tuning_options(speed_level=level)
        options.loop_vectorization = options.slp_vectorization = vectorised
        builder = llvm_binding().create_pass_builder(machine, options)
        builder.getModulePassManager().run(module, builder)
        module.verify()
        return bytes(machine.emit_object(module))


class LoadedCode:
    """Object code in memory, valid as long as this object exists.

    Raises
    ------
    RuntimeError
        If it is not object code for this machine.
    """

    def __init__(self, code: bytes) -> None:
        with _LLVM_LOCK:
            self._engine = llvm_binding().create_mcjit_compiler(
                llvm_binding().parse_assembly(""),
                target_machine(),
                use_lmm=target_triple().startswith(("aarch64", "arm64")),
            )
            self._engine.add_object_file(llvm_binding().ObjectFileRef.from_data(code))
            self._engine.finalize_object()

    def address(self, name: str) -> int:
        """Address of a function; 0 if there is none of that name."""
        return int(self._engine.get_function_address(name))


_started: list[bool] = []
OPTIMIZATION_LEVEL = 3
"""LLVM's optimisation level: 1 and 2 take a second less of twenty, and run 5 to 15 % longer."""


def compile_kernel(kernel: Any, cpus: tuple[str, ...], system: str = "") -> list[bytes]:
    """Compile the object code of a kernel for some processors.

    Parameters
    ----------
    kernel : kernels.Kernel
    cpus : tuple of str
        LLVM's names: see `object_code.BASELINES`.
    system : str
        Triple of the system; by default this one.
    """
    with LOCK:
        start_compiler()
        from .numba_target import linked_bitcode

        code = linked_bitcode(kernel)
        modules = [llvm_binding().parse_bitcode(code) for _ in cpus]
        pairs = zip(cpus, modules, strict=True)
        return [
            emit_object(module, target_machine(cpu, system or target_triple()), OPTIMIZATION_LEVEL, kernel.vectorised)
            for cpu, module in pairs
        ]


def start_compiler() -> None:
    """Import Numba, and register flyball's types and every formula."""
    with LOCK:
        if not _started:
            from . import numba_target

            _started.append(True)
            register_all(numba_target.overload)
