"""From a kernel to its object code."""

from __future__ import annotations

import gc
import time
from typing import Any

from .formulas import LOCK, register_all
from .layout import Array, Struct
from .machine import emitted, llvm, target_machine, triple

FAILED = -(2**63)  # what a kernel returns whose formulas ended in an error
ENTRY = "flyball_kernel"  # the name of a kernel's entry point in its object
_started: list[bool] = []
LEVEL = 3
"""Of optimisation: 1 and 2 take a second less of twenty, and run 5 to 15 % longer."""


def object_code(kernel: Any, cpus: tuple[str, ...], system: str = "") -> list[bytes]:
    """Object code of a kernel for some processors.

    Parameters
    ----------
    kernel : kernels.Kernel
    cpus : tuple of str
        In the words of LLVM: see `machine.BASELINES`.
    system : str
        Triple of the system; this one if it is empty.
    """
    with LOCK:
        start_compiler()
        from numba.core.compiler_lock import global_compiler_lock

        with global_compiler_lock:
            code = _linked(kernel)
        modules = [llvm().parse_bitcode(code) for _ in cpus]
        pairs = zip(cpus, modules, strict=True)
        return [emitted(module, target_machine(cpu, system or triple()), LEVEL) for cpu, module in pairs]


def start_compiler() -> None:
    """Import Numba, and tell it of flyball's types and of every formula."""
    with LOCK:
        if not _started:
            from . import references, target

            _started.append(True)
            references.register()
            register_all(target.overload)


def _linked(kernel: Any) -> bytes:
    """Bitcode of a kernel with all that it calls, behind an entry point in C's calling convention."""
    from .target import translated

    collecting = gc.isenabled()
    gc.disable()  # millions of small objects, hardly any garbage: looking for it takes a fifth of the time
    try:
        context, description, library = translated(kernel.function, _types(kernel), kernel.first_order)
    finally:
        if collecting:
            gc.enable()
    entry = _entry(context, description) if kernel.signature is None else _formula_entry(context, description, kernel)
    module = llvm().parse_assembly(entry)
    for text in library.modules():
        part = llvm().parse_assembly(text)
        for function in part.functions:
            if not function.is_declaration:
                function.linkage = "linkonce_odr"  # some stand in several texts
        module.link_in(part)
    for function in module.functions:
        if not function.is_declaration and function.name != ENTRY:
            function.linkage = "internal"  # nobody outside calls them: they may be inlined, and go
    return bytes(module.as_bitcode())


def _types(kernel: Any) -> tuple[Any, ...]:
    from numba import types

    from .references import numbers, reference

    if kernel.signature is not None:
        return tuple(numbers(x, kernel.first_order) for x in kernel.parameters)
    return tuple(
        reference(x) if isinstance(x, Struct | Array) else types.int64 if x is int else types.float64
        for x in kernel.parameters
    )


def _entry(context: Any, description: Any) -> str:
    """A function that calls the kernel's, and returns its number; `FAILED` where that ended in an error."""
    from llvmlite import ir
    from numba.core import types

    module = context.create_module("entry")
    of = context.call_conv.get_function_type(description.restype, description.argtypes)
    callee = ir.Function(module, of, description.llvm_func_name)
    returns = ir.DoubleType() if description.restype == types.float64 else ir.IntType(64)
    given = [context.get_value_type(x) for x in description.argtypes]
    entry = ir.Function(module, ir.FunctionType(returns, given), ENTRY)
    builder = ir.IRBuilder(entry.append_basic_block("entry"))
    status, found = context.call_conv.call_function(
        builder, callee, description.restype, description.argtypes, entry.args
    )
    if isinstance(description.restype, types.NoneType):
        found = returns(0)
    elif found.type != returns:
        found = context.cast(builder, found, description.restype, types.int64)
    failed = returns(float("nan") if returns == ir.DoubleType() else FAILED)
    builder.ret(builder.select(status.is_error, failed, found))
    return str(module)


def _formula_entry(context: Any, description: Any, code: Any) -> str:
    """A function that calls a formula on numbers in memory: see `references`; nan where that ended in an error.

    Raises
    ------
    TypeError
        If its result is not nested as that of its signature.
    """
    from llvmlite import ir

    from .references import leaves, loaded, nested, numbers, shape_of, stored

    if (found := shape_of(description.restype)) != code.signature.result:
        raise TypeError(
            f"the lengths of its result are {found or description.restype}, not {code.signature.result} (0: a number)"
        )
    module = context.create_module("entry")
    of = context.call_conv.get_function_type(description.restype, description.argtypes)
    callee = ir.Function(module, of, description.llvm_func_name)
    number = numbers(0, code.first_order)
    address = context.get_data_type(number).as_pointer()
    entry = ir.Function(module, ir.FunctionType(ir.VoidType(), [address, address]), ENTRY)
    builder = ir.IRBuilder(entry.append_basic_block("entry"))
    given = [x for t in description.argtypes for x in leaves(builder, t, ir.Constant(context.get_value_type(t), None))]
    taken = loaded(builder, number, entry.args[0], len(given))
    args = [nested(context, builder, t, taken) for t in description.argtypes]
    status, found = context.call_conv.call_function(builder, callee, description.restype, description.argtypes, args)
    results = list(leaves(builder, description.restype, found))
    nan = context.get_constant(number, float("nan"))
    with builder.if_else(status.is_error) as (failed, well):
        with failed:
            stored(context, builder, number, ((number, nan) for _ in results), entry.args[1])
        with well:
            stored(context, builder, number, iter(results), entry.args[1])
    builder.ret_void()
    return str(module)


def timed(kernel: Any, cpus: tuple[str, ...]) -> tuple[list[bytes], float]:
    """Its object code, and the seconds of processor time that it took."""
    began = time.process_time()
    return object_code(kernel, cpus), time.process_time() - began
