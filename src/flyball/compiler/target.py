"""flyball as a target of Numba: kernels are translated function by function, then linked and optimised as a whole.

Numba links, optimises and emits every callee as a library of its own, then again inside each of its callers. Here a
callee is only translated to LLVM's language (`Library`), and `modules` hands all of a kernel's on. Numba lets others
add targets (`numba.core.target_extension`): nothing of Numba's is replaced, and code of others compiles as ever.
"""

from __future__ import annotations

import operator
from collections.abc import Iterator
from functools import cached_property, partial
from importlib import import_module
from typing import Any

from llvmlite import ir
from numba.core import codegen, cpu, typed_passes, types, typing, untyped_passes
from numba.core.cgutils import normalize_ir_text
from numba.core.compiler import CompilerBase
from numba.core.compiler_machinery import PassManager
from numba.core.descriptors import TargetDescriptor
from numba.core.dispatcher import Dispatcher
from numba.core.target_extension import (
    CPU,
    JitDecorator,
    dispatcher_registry,
    jit_registry,
    target_override,
    target_registry,
)
from numba.extending import overload as numba_overload

from .formulas import OPTIONS

NAME = "flyball"
PASSES = (
    (untyped_passes, "TranslateByteCode FixupArgs IRProcessing GenericRewrites"),
    (untyped_passes, "MakeFunctionToJitFunction ReconstructSSA"),
    (typed_passes, "NopythonTypeInference PreLowerStripPhis IRLegalization NativeLowering NoPythonBackend"),
)
"""Of Numba's passes those that formulas need: no closures, generators, literal unrolling, array expressions."""
IMPLEMENTATIONS = (
    "core.optional cpython.builtins cpython.iterators cpython.numbers cpython.rangeobj cpython.slicing "
    "cpython.tupleobj np.arraymath np.arrayobj"
)
REGISTRIES = "cpython.cmathimpl cpython.mathimpl np.npyimpl"


class Flyball(CPU):
    """The target."""


class FirstOrder(Flyball):
    """The same where complex numbers carry steps."""


class Library(codegen.CPUCodeLibrary):
    """The text of a translated function, and the libraries of those that it calls."""

    def __init__(self, owner: Any, name: str) -> None:
        codegen.CodeLibrary.__init__(self, owner, name)
        self.texts: list[str] = []
        self._linking_libraries: list[Library] = []

    def add_linking_library(self, library: Any) -> None:
        """Note a callee."""
        self._linking_libraries.append(library)

    def add_ir_module(self, ir_module: Any) -> None:
        """Keep the text; nothing is optimised here."""
        self.texts.append(normalize_ir_text(str(ir_module)))

    def finalize(self) -> None:
        """Nothing more comes."""
        self._finalized = True

    def modules(self) -> Iterator[str]:
        """The texts of it and of all that it calls, each once."""
        seen: set[int] = set()
        todo: list[Any] = [self]
        while todo:
            library = todo.pop()
            if id(library) not in seen:
                seen.add(id(library))
                todo += library._linking_libraries
                yield from library.texts


class Codegen(codegen.JITCPUCodegen):
    """Makes libraries."""

    _library_class = Library

    def set_env(self, env_name: str, env: Any) -> None:
        """Formulas have no environment: they raise nothing that needs one."""


class Context(cpu.CPUContext):
    """How formulas are translated."""

    def init(self) -> None:
        """As for the processor, with libraries of our own and without Numba's runtime."""
        self.is32bit = False
        self._internal_codegen = Codegen(NAME)

    def load_additional_registries(self) -> None:
        """What formulas use of Numba: numbers, loops, tuples, arrays, mathematics; no runtime."""
        for name in IMPLEMENTATIONS.split():
            import_module(f"numba.{name}")
        for name in REGISTRIES.split():
            self.install_registry(import_module(f"numba.{name}").registry)

    def post_lowering(self, mod: Any, library: Any) -> None:
        """Nothing is added to what was translated."""

    def create_cpython_wrapper(self, *args: Any, **more: Any) -> None:
        """Python calls no formula."""

    def create_cfunc_wrapper(self, *args: Any, **more: Any) -> None:
        """Nor does C."""

    def get_executable(self, library: Any, fndesc: Any, env: Any) -> Any:
        """Something by which Numba knows the function: there is no code of it alone."""
        return partial(_no_code).__reduce__


class FirstOrderContext(Context):
    """The same, with products of complex numbers to first order of their imaginary parts."""

    def get_function(self, fn: Any, sig: Any, _firstcall: bool = True) -> Any:
        """The code of an operation."""
        known = getattr(fn, "typing_key", fn)
        if known in (operator.mul, operator.imul) and all(isinstance(x, types.Complex) for x in sig.args):
            return lambda builder, args, *_: _product(self, builder, sig, args)
        return super().get_function(fn, sig, _firstcall)


def _no_code() -> None:
    raise RuntimeError("formulas are compiled with the kernel that calls them")


def _product(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    """(a + i b)(c + i d) = a c + i (a d + b c): the step is 1e-40 of a number, so that b d is nothing beside a c."""
    (a, b), (c, d) = ([builder.extract_value(x, k) for k in range(2)] for x in args)
    made = ir.Constant(context.get_value_type(sig.return_type), ir.Undefined)
    made = builder.insert_value(made, builder.fmul(a, c), 0)
    return builder.insert_value(made, builder.fadd(builder.fmul(a, d), builder.fmul(b, c)), 1)


class TypingContext(typing.Context):
    """What functions return; of operators on the same types it is found once."""

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
    """The contexts of a target.

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
        """What types there are."""
        return TypingContext()

    @cached_property
    def target_context(self) -> Any:
        """How they are translated."""
        return self._make(self.typing_context, self._target_name)


class Compiler(CompilerBase):
    """`PASSES`."""

    def define_pipelines(self) -> list[Any]:
        """One list of passes."""
        passes = PassManager(NAME)
        for module, names in PASSES:
            for name in names.split():
                passes.add_pass(getattr(module, name), name)
        passes.finalize()
        return [passes]


class Formula(Dispatcher):
    """A formula as Numba calls it."""

    targetdescr = Target(NAME, Context)

    def compile(self, sig: Any) -> Any:
        """Translate it for arguments of these types."""
        with target_override(self.targetdescr._target_name):
            return super().compile(sig)


class FirstOrderFormula(Formula):
    """The same where complex numbers carry steps."""

    targetdescr = Target(f"{NAME}-first-order", FirstOrderContext)


class jit(JitDecorator):
    """What Numba makes of functions for the target."""

    make = Formula

    def __init__(self, *args: Any, **options: Any) -> None:
        self.options = {k: v for k, v in options.items() if k in OPTIONS}

    def __call__(self, function: Any) -> Any:
        """A `Formula`."""
        options = OPTIONS | self.options | {"nopython": True, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
        return self.make(function, targetoptions=options, pipeline_class=Compiler)


class first_order_jit(jit):
    """The same where complex numbers carry steps."""

    make = FirstOrderFormula


for _target, _jit in ((Flyball, jit), (FirstOrder, first_order_jit)):
    target_registry[_jit.make.targetdescr._target_name] = _target
    dispatcher_registry[_target] = _jit.make
    jit_registry[_target] = _jit
overload = partial(numba_overload, jit_options=OPTIONS, target=NAME)
"""``@overload(function)``: what stands for a Python function in compiled code."""


def translated(function: Any, argument_types: tuple[Any, ...], first_order: bool) -> tuple[Any, Any, Library]:
    """A function and all that it calls in LLVM's language.

    Returns
    -------
    context, description, library
        How it is called, and its text.
    """
    made = (first_order_jit if first_order else jit)()(function)
    made.compile(argument_types)
    found = made.overloads[argument_types]
    return made.targetdescr.target_context, found.fndesc, found.library
