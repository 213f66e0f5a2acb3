"""From LLVM's language to object code, and from object code to addresses (by llvmlite).

Code is made for a fixed baseline of a processor's family, not for the processor that happens to be there: x86-64-v3
(2013 and later), else x86-64-v2, of the others what all of their family have. So results have the same bits on all of
these, however their code came to be: products and sums are not contracted, and nothing is reordered.
"""

from __future__ import annotations

import os
import threading
from functools import lru_cache
from typing import Any

BASELINES = {"x86-64-v3": ("avx2", "bmi2", "f16c", "fma", "lzcnt", "movbe"), "x86-64-v2": ("sse4.2", "popcnt", "ssse3")}
"""Processors that code is made for, the best first, and features of theirs that LLVM knows them by."""
_LOCK = threading.RLock()


@lru_cache(maxsize=1)
def llvm() -> Any:
    """llvmlite's binding, ready for this machine."""
    import llvmlite.binding as binding

    binding.initialize_native_target()
    binding.initialize_native_asmprinter()
    return binding


@lru_cache(maxsize=1)
def baseline() -> str:
    """The processor that code is made for here: ``FLYBALL_TARGET``, or the best baseline that this machine has.

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
    if not triple().startswith("x86_64"):
        return "generic"
    has = llvm().get_host_cpu_features()
    return next((name for name, needs in BASELINES.items() if all(has.get(x) for x in needs)), "x86-64")


def baselines() -> tuple[str, ...]:
    """The processors that object code is shipped for, of this machine's family."""
    return tuple(BASELINES) if triple().startswith("x86_64") else (baseline(),)


@lru_cache(maxsize=1)
def triple() -> str:
    """Architecture, system and object format of this process."""
    return str(llvm().get_process_triple())


def target_machine(cpu: str = "", system: str = "") -> Any:
    """LLVM's generator of code for a processor and a system; who makes an engine of it, owns it."""
    found = llvm().Target.from_triple(system or triple())
    position = "static" if (system or triple()).startswith(("x86_64", "i686")) else "default"
    return found.create_target_machine(
        cpu=cpu or baseline(), features="", opt=3, reloc=position, codemodel="jitdefault", jit=True
    )


def assembled(text: str, level: int = 2) -> bytes:
    """Object code of one module in LLVM's language."""
    return emitted(llvm().parse_assembly(text), target_machine(), level)


def emitted(module: Any, machine: Any, level: int) -> bytes:
    """Object code of a module, optimised at a level of LLVM's.

    Loops and straight code are not vectorised: measured, the same speed or slower, and longer in the making.
    """
    with _LOCK:
        module.triple, module.data_layout = machine.triple, str(machine.target_data)
        options = llvm().create_pipeline_tuning_options(speed_level=level)
        options.loop_vectorization = options.slp_vectorization = False
        builder = llvm().create_pass_builder(machine, options)
        builder.getModulePassManager().run(module, builder)
        module.verify()
        return bytes(machine.emit_object(module))


class LoadedCode:
    """Object code in memory, as long as this lives.

    Raises
    ------
    RuntimeError
        If it is no object code for this machine.
    """

    def __init__(self, code: bytes) -> None:
        with _LOCK:
            self._engine = llvm().create_mcjit_compiler(
                llvm().parse_assembly(""), target_machine(), use_lmm=triple().startswith(("aarch64", "arm64"))
            )
            self._engine.add_object_file(llvm().ObjectFileRef.from_data(code))
            self._engine.finalize_object()

    def address(self, name: str) -> int:
        """Where a function begins; 0 if there is none of that name."""
        return int(self._engine.get_function_address(name))
