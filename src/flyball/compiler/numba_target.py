"""flyball as a target of Numba: kernels are translated function by function, then linked and optimised as a whole.

Numba links, optimises and emits every callee as a library of its own, then again inside each of its callers. Here a
callee is only translated to LLVM's language (`Library`), and `Library.modules` returns all those of a kernel. Numba
allows additional targets (`numba.core.target_extension`): nothing of Numba's is replaced.
"""

from __future__ import annotations

import gc
import operator
from collections.abc import Iterator
from functools import cached_property, partial
from importlib import import_module
from typing import Any

from llvmlite import binding, ir
from numba.core import cgutils, codegen, cpu, typed_passes, types, typing, untyped_passes
from numba.core.compiler import CompilerBase
from numba.core.compiler_lock import global_compiler_lock
from numba.core.compiler_machinery import PassManager
from numba.core.descriptors import TargetDescriptor
from numba.core.dispatcher import Dispatcher
from numba.core.errors import TypingError
from numba.core.target_extension import (
    CPU,
    JitDecorator,
    dispatcher_registry,
    jit_registry,
    target_override,
    target_registry,
)
from numba.extending import intrinsic
from numba.extending import overload as numba_overload

from .formulas import (
    ENTRY_NAME,
    FAILED,
    FIRST_ADDRESS,
    KERNELS,
    OPTIONS,
    STORED_CALL_TABLES,
    atomic_add,
    atomic_load,
    atomic_replace,
    atomic_store,
    call,
    call_bound,
    formula_at,
    has_formula,
    run_stored_call,
    store_call,
)
from .numba_types import (
    INTEGER,
    load_numbers,
    nested_lengths,
    nested_value,
    number_type,
    reference,
    store_numbers,
    tuple_leaves,
)
from .struct_layout import Array, Struct

TARGET_NAME = "flyball"
PASSES = (
    (untyped_passes, "TranslateByteCode FixupArgs IRProcessing GenericRewrites"),
    (untyped_passes, "MakeFunctionToJitFunction ReconstructSSA"),
    (typed_passes, "NopythonTypeInference PreLowerStripPhis IRLegalization NativeLowering NoPythonBackend"),
)
"""Numba's passes that formulas need: no closures, generators, literal unrolling, array expressions."""
IMPLEMENTATIONS = (
    "core.optional cpython.builtins cpython.iterators cpython.numbers cpython.rangeobj cpython.slicing "
    "cpython.tupleobj np.arraymath np.arrayobj"
)
REGISTRIES = "cpython.cmathimpl cpython.mathimpl np.npyimpl"


class Flyball(CPU):
    """Target of formulas."""


class FirstOrder(Flyball):
    """Target of formulas in which complex numbers carry first-order steps."""


class Library(codegen.CPUCodeLibrary):
    """Text of a translated function, and the libraries of those that it calls."""

    def __init__(self, owner: Any, name: str) -> None:
        codegen.CodeLibrary.__init__(self, owner, name)
        self.texts: list[str] = []
        self._linking_libraries: list[Library] = []

    def add_linking_library(self, library: Any) -> None:
        """Add the library of a callee."""
        self._linking_libraries.append(library)

    def add_ir_module(self, ir_module: Any) -> None:
        """Store the text; nothing is optimised here."""
        self.texts.append(cgutils.normalize_ir_text(str(ir_module)))

    def finalize(self) -> None:
        """No final work."""
        self._finalized = True

    def modules(self) -> Iterator[str]:
        """Texts of the function and of all that it calls, each once."""
        seen: set[int] = set()
        todo: list[Any] = [self]
        while todo:
            library = todo.pop()
            if id(library) not in seen:
                seen.add(id(library))
                todo += library._linking_libraries
                yield from library.texts


class Codegen(codegen.JITCPUCodegen):
    """Creates libraries."""

    _library_class = Library

    def set_env(self, env_name: str, env: Any) -> None:
        """Do nothing: formulas raise no exceptions, so they need no environment."""


class FormulaContext(cpu.CPUContext):
    """Translation of formulas."""

    def init(self) -> None:
        """Initialise as for the CPU, with this module's libraries and without Numba's runtime."""
        self.is32bit = False
        self._internal_codegen = Codegen(TARGET_NAME)

    def load_additional_registries(self) -> None:
        """Load the parts of Numba that formulas use: numbers, loops, tuples, arrays, mathematics; no runtime."""
        for name in IMPLEMENTATIONS.split():
            import_module(f"numba.{name}")
        for name in REGISTRIES.split():
            self.install_registry(import_module(f"numba.{name}").registry)

    def post_lowering(self, mod: Any, library: Any) -> None:
        """Do nothing after translation."""

    def create_cpython_wrapper(self, *args: Any, **more: Any) -> None:
        """Do nothing: Python does not call formulas."""

    def create_cfunc_wrapper(self, *args: Any, **more: Any) -> None:
        """Do nothing: C does not call formulas."""

    def get_executable(self, library: Any, fndesc: Any, env: Any) -> Any:
        """Placeholder for a function's code: there is none for a formula alone."""
        return partial(_no_code).__reduce__


class FirstOrderContext(FormulaContext):
    """Translation of formulas with first-order products of complex numbers."""

    def get_function(self, fn: Any, sig: Any, _firstcall: bool = True) -> Any:
        """Code of an operation."""
        known = getattr(fn, "typing_key", fn)
        if known in (operator.mul, operator.imul) and all(isinstance(x, types.Complex) for x in sig.args):
            return lambda builder, args, *_: _first_order_product(self, builder, sig, args)
        return super().get_function(fn, sig, _firstcall)


def _no_code() -> None:
    raise RuntimeError("formulas are compiled with the kernel that calls them")


def _first_order_product(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    """(a + i b)(c + i d) = a c + i (a d + b c): the step is 1e-40 of a number, so b d is negligible beside a c."""
    (a, b), (c, d) = ([builder.extract_value(x, k) for k in range(2)] for x in args)
    made = ir.Constant(context.get_value_type(sig.return_type), ir.Undefined)
    made = builder.insert_value(made, builder.fmul(a, c), 0)
    return builder.insert_value(made, builder.fadd(builder.fmul(a, d), builder.fmul(b, c)), 1)


class TypingContext(typing.Context):
    """Types of functions; those of operators on the same types are cached."""

    def __init__(self) -> None:
        self._signatures: dict[Any, Any] = {}
        super().__init__()

    def resolve_function_type(self, func: Any, args: Any, kws: Any) -> Any:
        """The signature of a call."""
        known = func.typing_key if type(func) is types.Function else func
        if kws or getattr(known, "__module__", None) != "_operator":
            return super().resolve_function_type(func, args, kws)
        if isinstance(args[0], types.Number | types.Boolean):
            args = tuple(types.unliteral(x) for x in args)
        key = func, tuple(args)
        found = self._signatures.get(key)
        if found is None:
            found = super().resolve_function_type(func, args, kws)
            if found is not None:
                self._signatures[key] = found
        return found


class Target(TargetDescriptor):
    """Contexts of a target.

    Parameters
    ----------
    name : str
    make : type of Context
    """

    options = cpu.CPUTargetOptions

    def __init__(self, name: str, make: type) -> None:
        super().__init__(name)
        self._make = make

    @cached_property
    def typing_context(self) -> Any:
        """Typing context."""
        return TypingContext()

    @cached_property
    def target_context(self) -> Any:
        """Translation context."""
        return self._make(self.typing_context, self._target_name)


class Compiler(CompilerBase):
    """Numba compiler that runs `PASSES`."""

    def define_pipelines(self) -> list[Any]:
        """Define the one list of passes."""
        passes = PassManager(TARGET_NAME)
        for module, names in PASSES:
            for name in names.split():
                passes.add_pass(getattr(module, name), name)
        passes.finalize()
        return [passes]


class FormulaDispatcher(Dispatcher):
    """Dispatcher of a formula."""

    targetdescr = Target(TARGET_NAME, FormulaContext)

    def compile(self, sig: Any) -> Any:
        """Translate the formula for arguments of these types."""
        with target_override(self.targetdescr._target_name):
            return super().compile(sig)


class FirstOrderDispatcher(FormulaDispatcher):
    """Dispatcher of a formula in which complex numbers carry first-order steps."""

    targetdescr = Target(f"{TARGET_NAME}-first-order", FirstOrderContext)


class jit(JitDecorator):
    """Decorator that Numba uses for functions of this target."""

    make = FormulaDispatcher

    def __init__(self, *args: Any, **options: Any) -> None:
        self.options = {k: v for k, v in options.items() if k in OPTIONS}

    def __call__(self, function: Any) -> Any:
        """`FormulaDispatcher` of a function."""
        options = OPTIONS | self.options | {"nopython": True, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
        return self.make(function, targetoptions=options, pipeline_class=Compiler)


class first_order_jit(jit):
    """Decorator for functions in which complex numbers carry first-order steps."""

    make = FirstOrderDispatcher


for _target, _jit in ((Flyball, jit), (FirstOrder, first_order_jit)):
    target_registry[_jit.make.targetdescr._target_name] = _target
    dispatcher_registry[_target] = _jit.make
    jit_registry[_target] = _jit
overload = partial(numba_overload, jit_options=OPTIONS, target=TARGET_NAME)
"""``@overload(function)``: the replacement of a Python function in compiled code."""


@intrinsic
def _call_kernel(typing, address, A, B, C, D, E, task):  # type: ignore[no-untyped-def]
    given = A, B, C, D, E
    layouts = tuple(getattr(x, "layout", None) for x in given)
    if not any(k.parameters[:-1] == layouts for k in KERNELS):
        raise TypingError(f"no kernel takes {given}")

    def generate(context, builder, signature, args):  # type: ignore[no-untyped-def]
        of = ir.FunctionType(INTEGER, [x.type for x in args[1:]])
        return builder.call(builder.inttoptr(args[0], of.as_pointer()), list(args[1:]))

    return types.int64(types.int64, *given, types.int64), generate


@intrinsic
def _call_words(typing, address, A, B, C, D, E, task):  # type: ignore[no-untyped-def]
    def generate(context, builder, signature, args):  # type: ignore[no-untyped-def]
        of = ir.FunctionType(INTEGER, [INTEGER] * 6)
        return builder.call(builder.inttoptr(args[0], of.as_pointer()), list(args[1:]))

    return types.int64(*[types.int64] * 7), generate


@overload(call)
def _choose_call(address, A, B, C, D, E, task):  # type: ignore[no-untyped-def]
    return lambda address, A, B, C, D, E, task: _call_kernel(address, A, B, C, D, E, task)


@overload(call_bound)
def _choose_call_bound(words, task):  # type: ignore[no-untyped-def]
    return lambda words, task: _call_words(
        words[0], words[1], words[2], words[3], words[4], words[5], types.int64(task)
    )


def _word(builder: Any, address: Any, k: int = 0) -> Any:
    """Pointer to word k at an address."""
    return builder.gep(builder.inttoptr(address, INTEGER.as_pointer()), [INTEGER(k)])


@intrinsic
def _store_call(typing, words, address, tables):  # type: ignore[no-untyped-def]
    layouts = tuple(getattr(x, "layout", None) for x in tables)
    if not any(k.parameters[:-1] == layouts for k in KERNELS) or len(layouts) >= STORED_CALL_TABLES:
        raise TypingError(f"no kernel takes {tables}")

    def generate(context, builder, signature, args):  # type: ignore[no-untyped-def]
        given = [builder.ptrtoint(builder.extract_value(args[2], k), INTEGER) for k in range(len(layouts))]
        for k, x in enumerate((args[1], INTEGER(len(layouts)), *given)):
            builder.store(x, _word(builder, args[0], k))
        return context.get_dummy_value()

    return types.none(types.int64, types.int64, tables), generate


@intrinsic
def _run_stored_call(typing, words, task):  # type: ignore[no-untyped-def]
    def generate(context, builder, signature, args):  # type: ignore[no-untyped-def]
        code, count = (builder.load(_word(builder, args[0], k)) for k in range(2))
        given = [
            builder.select(
                builder.icmp_signed("==", count, INTEGER(k)), args[1], builder.load(_word(builder, args[0], 2 + k))
            )
            for k in range(STORED_CALL_TABLES)
        ]
        of = ir.FunctionType(INTEGER, [INTEGER] * STORED_CALL_TABLES)
        return builder.call(builder.inttoptr(code, of.as_pointer()), given)

    return types.int64(types.int64, types.int64), generate


@intrinsic
def _atomic_load(typing, address):  # type: ignore[no-untyped-def]
    def generate(context, builder, signature, args):  # type: ignore[no-untyped-def]
        return builder.load_atomic(_word(builder, args[0]), "acquire", 8)

    return types.int64(types.int64), generate


@intrinsic
def _atomic_store(typing, address, value):  # type: ignore[no-untyped-def]
    def generate(context, builder, signature, args):  # type: ignore[no-untyped-def]
        builder.store_atomic(args[1], _word(builder, args[0]), "release", 8)
        return context.get_dummy_value()

    return types.none(types.int64, types.int64), generate


@intrinsic
def _atomic_add(typing, address, value):  # type: ignore[no-untyped-def]
    def generate(context, builder, signature, args):  # type: ignore[no-untyped-def]
        return builder.atomic_rmw("add", _word(builder, args[0]), args[1], "acq_rel")

    return types.int64(types.int64, types.int64), generate


@intrinsic
def _atomic_replace(typing, address, old, new):  # type: ignore[no-untyped-def]
    def generate(context, builder, signature, args):  # type: ignore[no-untyped-def]
        found = builder.cmpxchg(_word(builder, args[0]), args[1], args[2], "acq_rel", "acquire")
        return builder.extract_value(found, 1)

    return types.boolean(types.int64, types.int64, types.int64), generate


@overload(store_call)
def _choose_store_call(words, address, tables):  # type: ignore[no-untyped-def]
    return lambda words, address, tables: _store_call(words, address, tables)


@overload(run_stored_call)
def _choose_run_stored_call(words, task):  # type: ignore[no-untyped-def]
    return lambda words, task: _run_stored_call(words, types.int64(task))


@overload(atomic_load)
def _choose_atomic_load(address):  # type: ignore[no-untyped-def]
    return lambda address: _atomic_load(address)


@overload(atomic_store)
def _choose_atomic_store(address, value):  # type: ignore[no-untyped-def]
    return lambda address, value: _atomic_store(address, types.int64(value))


@overload(atomic_add)
def _choose_atomic_add(address, value):  # type: ignore[no-untyped-def]
    return lambda address, value: _atomic_add(address, types.int64(value))


@overload(atomic_replace)
def _choose_atomic_replace(address, old, new):  # type: ignore[no-untyped-def]
    return lambda address, old, new: _atomic_replace(address, old, new)


def _is_complex(typ: Any) -> bool:
    """Whether the first number of nested tuples is complex."""
    while isinstance(typ, types.BaseTuple):
        typ = typ[0]
    return isinstance(typ, types.Complex)


# A code table has two words for each formula: the addresses of its code for floats and for complex numbers. The code
# takes two addresses: of the consecutive numbers of the arguments, and of the memory for those of the result.
@intrinsic
def _word_at(typing, address):  # type: ignore[no-untyped-def]
    def generate(context, builder, signature, args):  # type: ignore[no-untyped-def]
        return builder.load(builder.inttoptr(args[0], INTEGER.as_pointer()))

    return types.int64(types.int64), generate


@intrinsic
def _run_formula(typing, code, arguments, like):  # type: ignore[no-untyped-def]
    number = types.complex128 if _is_complex(like) else types.float64

    def generate(context, builder, signature, args):  # type: ignore[no-untyped-def]
        given = list(tuple_leaves(builder, arguments, args[1]))
        count = len(list(tuple_leaves(builder, like, args[2])))
        of = context.get_data_type(number)
        begin, end = (cgutils.alloca_once(builder, of, INTEGER(n)) for n in (len(given), count))
        store_numbers(context, builder, number, iter(given), begin)
        function = ir.FunctionType(ir.VoidType(), [of.as_pointer()] * 2)
        builder.call(builder.inttoptr(args[0], function.as_pointer()), [begin, end])
        return nested_value(context, builder, like, load_numbers(builder, number, end, count))

    return like(types.int64, arguments, like), generate


@overload(formula_at)
def _choose_formula_at(table, k, arguments, like):  # type: ignore[no-untyped-def]
    if _is_complex(like):
        return lambda table, k, arguments, like: (
            _run_formula(_word_at(table + 16 * k + 8), arguments, like) if table >= FIRST_ADDRESS else like
        )
    return lambda table, k, arguments, like: (
        _run_formula(_word_at(table + 16 * k), arguments, like) if table >= FIRST_ADDRESS else like
    )


@overload(has_formula)
def _choose_has_formula(table, k):  # type: ignore[no-untyped-def]
    return lambda table, k: _word_at(table + 16 * k) != 0 if table >= FIRST_ADDRESS else False


def translate(function: Any, argument_types: tuple[Any, ...], first_order: bool) -> tuple[Any, Any, Library]:
    """Translate a function and all that it calls to LLVM's language.

    Returns
    -------
    context, description, library
        Its translation context, its calling description, and its text.
    """
    made = (first_order_jit if first_order else jit)()(function)
    made.compile(argument_types)
    found = made.overloads[argument_types]
    return made.targetdescr.target_context, found.fndesc, found.library


@global_compiler_lock
def linked_bitcode(kernel: Any) -> bytes:
    """Bitcode of a kernel with all that it calls, with an entry point in C's calling convention."""
    collecting = gc.isenabled()
    gc.disable()  # millions of small objects and hardly any garbage: collection takes a fifth of the time
    try:
        context, description, library = translate(kernel.function, _argument_types(kernel), kernel.first_order)
    finally:
        if collecting:
            gc.enable()
    entry = (
        _kernel_entry(context, description)
        if kernel.signature is None
        else _formula_entry(context, description, kernel)
    )
    module = binding.parse_assembly(entry)
    for text in library.modules():
        part = binding.parse_assembly(text)
        for function in part.functions:
            if not function.is_declaration:
                function.linkage = "linkonce_odr"  # some occur in several texts
        module.link_in(part)
    for function in module.functions:
        if not function.is_declaration and function.name != ENTRY_NAME:
            function.linkage = "internal"  # not called from outside: they may be inlined and removed
    return bytes(module.as_bitcode())


def _argument_types(kernel: Any) -> tuple[Any, ...]:
    if kernel.signature is not None:
        return tuple(number_type(x, kernel.first_order) for x in kernel.parameters)
    return tuple(
        reference(x) if isinstance(x, Struct | Array) else types.int64 if x is int else types.float64
        for x in kernel.parameters
    )


def _kernel_entry(context: Any, description: Any) -> str:
    """Function that calls the kernel's, and returns its number; `FAILED` if that raised an error."""
    module = context.create_module("entry")
    of = context.call_conv.get_function_type(description.restype, description.argtypes)
    callee = ir.Function(module, of, description.llvm_func_name)
    returns = ir.DoubleType() if description.restype == types.float64 else INTEGER
    given = [context.get_value_type(x) for x in description.argtypes]
    entry = ir.Function(module, ir.FunctionType(returns, given), ENTRY_NAME)
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
    """Function that calls a formula on numbers in memory: see `numba_target`; nan if that raised an error.

    Raises
    ------
    TypeError
        If its result is not nested as that of its signature.
    """
    if (found := nested_lengths(description.restype)) != code.signature.result:
        raise TypeError(
            f"the lengths of its result are {found or description.restype}, not {code.signature.result} (0: a number)"
        )
    module = context.create_module("entry")
    of = context.call_conv.get_function_type(description.restype, description.argtypes)
    callee = ir.Function(module, of, description.llvm_func_name)
    number = number_type(0, code.first_order)
    address = context.get_data_type(number).as_pointer()
    entry = ir.Function(module, ir.FunctionType(ir.VoidType(), [address, address]), ENTRY_NAME)
    builder = ir.IRBuilder(entry.append_basic_block("entry"))
    given = [
        x for t in description.argtypes for x in tuple_leaves(builder, t, ir.Constant(context.get_value_type(t), None))
    ]
    taken = load_numbers(builder, number, entry.args[0], len(given))
    args = [nested_value(context, builder, t, taken) for t in description.argtypes]
    status, found = context.call_conv.call_function(builder, callee, description.restype, description.argtypes, args)
    results = list(tuple_leaves(builder, description.restype, found))
    nan = context.get_constant(number, float("nan"))
    with builder.if_else(status.is_error) as (failed, well):
        with failed:
            store_numbers(context, builder, number, ((number, nan) for _ in results), entry.args[1])
        with well:
            store_numbers(context, builder, number, iter(results), entry.args[1])
    builder.ret_void()
    return str(module)
