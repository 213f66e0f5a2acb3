"""flyball as a target of Numba: kernels are translated function by function, then linked and optimised as a whole.

Numba links, optimises and emits every callee as a library of its own, then again inside each of its callers. Here a
callee is only translated to LLVM's language (`Library`), and `Library.modules` returns all those of a kernel. Numba
allows additional targets (`numba.core.target_extension`): nothing of Numba's is replaced.

Structures and arrays are passed by address. Numba passes a tuple of arrays as its parts, some two hundred numbers for a
mechanism; here ``S.field`` is the address of a structure or of an array's description in it, and ``S.field[i, j]``
reads the data address, the length of a row, and the element. Nothing writes to descriptions, so that the optimiser may
read each part once and keep it (`invariant.load`). Views and whole arrays are Numba's own.
"""

from __future__ import annotations

import operator
from collections.abc import Iterator
from functools import cached_property, partial
from importlib import import_module
from typing import Any, NamedTuple

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

from .formulas import FIRST_ADDRESS, KERNELS, OPTIONS, by_address, call, call_bound, formula_at, has_formula
from .struct_layout import DATA, HEAD, Array, RecordLayout, Struct, struct_layout

_REFERENCE_TYPES: dict[str, Any] = {}


def reference(layout: Struct | Array | RecordLayout) -> Any:
    """Numba's type of a structure or of an array that a kernel takes by address."""
    return _REFERENCE_TYPES["structure" if isinstance(layout, Struct) else "array"](layout)


def load_members(builder: Any, address: Any, skipped: int = 0) -> Any:
    """Read the value at an address number by number: the optimiser does not split larger reads.

    The first ``skipped`` members are left out.
    """
    from llvmlite import ir
    from numba.core import cgutils

    of = address.type.pointee
    if not isinstance(of, ir.Aggregate):
        number = builder.load(address)
        number.set_metadata("invariant.load", builder.module.add_metadata([]))
        return number
    whole = ir.Constant(of, None)
    for k in range(skipped, len(of)):
        whole = builder.insert_value(whole, load_members(builder, cgutils.gep_inbounds(builder, address, 0, k)), k)
    return whole


class _ArrayReader:
    """Generator of code that reads an array's description; of entries of a record, that of the record."""

    def __init__(self, context: Any, builder: Any, typ: Any, value: Any) -> None:
        self.context, self.builder, self.array, self.address = context, builder, typ.array, value
        self.part = typ.part

    def word(self, k: int, of: Any = None) -> Any:
        """Word k of the description: see `layout`."""
        from llvmlite import ir

        integer = ir.IntType(64)
        place = self.builder.gep(self.address, [integer(8 * k)], inbounds=True)
        return load_members(self.builder, self.builder.bitcast(place, (of or integer).as_pointer()))

    def shape(self, k: int) -> Any:
        """Length of dimension k."""
        from llvmlite import ir

        if self.part is not None and k == self.array.ndim - 1 and self.part.count > 1:
            return ir.IntType(64)(self.part.count)
        return self.word(HEAD // 8 + k + (self.part is not None and self.part.vector))

    def data(self) -> Any:
        """Address of the numbers."""
        return self.word(DATA // 8, self.context.get_data_type(self.array.dtype).as_pointer())

    def whole(self) -> Any:
        """The array in Numba's form, without ownership: references are not counted here."""
        of = self.context.get_value_type(self.array).as_pointer()
        return load_members(self.builder, self.builder.bitcast(self.address, of), 2)

    def indices(self, typ: Any, value: Any) -> list[Any] | None:
        """Integers of an index, counted from the end where negative; None if it contains anything else."""
        from numba.core import cgutils, types

        several = isinstance(typ, types.BaseTuple)
        given = list(typ) if several else [typ]
        if not all(isinstance(x, types.Integer) for x in given):
            return None
        values = cgutils.unpack_tuple(self.builder, value, len(given)) if several else [value]
        out = []
        for k, (x, of) in enumerate(zip(values, given, strict=True)):
            i = self.context.cast(self.builder, x, of, types.intp)
            known = getattr(x, "constant", None)
            if of.signed and not (isinstance(known, int) and known >= 0):
                below = self.builder.icmp_signed("<", i, i.type(0))
                i = self.builder.select(below, self.builder.add(i, self.shape(k)), i)
            out.append(i)
        return out

    def element(self, indices: list[Any]) -> Any:
        """Address of an element; of the first of a row if the last index is left out."""
        if self.part is not None:
            if self.part.vector:
                indices = [
                    self.builder.add(indices[0], self.builder.mul(self.shape(0), self.shape(0).type(self.part.first)))
                ]
            else:
                indices = [self.part.place(self.builder, indices)]
            return self.builder.gep(self.data(), indices, inbounds=True)
        flat = indices[0]
        for k in range(1, self.array.ndim):
            flat = self.builder.mul(flat, self.shape(k))
            flat = self.builder.add(flat, indices[k]) if k < len(indices) else flat
        return self.builder.gep(self.data(), [flat], inbounds=True)

    def row(self, typ: Any, index: Any) -> Any:
        """Row of a two-dimensional table, as an array of type ``typ``."""
        from llvmlite import ir

        model, length = self.context.data_model_manager[typ], self.shape(1)
        width = length.type(self.context.get_abi_sizeof(self.context.get_data_type(typ.dtype)))
        made = ir.Constant(self.context.get_value_type(typ), None)
        filled: list[tuple[str, Any, list[int]]] = [
            ("nitems", length, []),
            ("itemsize", width, []),
            ("data", self.element([index]), []),
            ("shape", length, [0]),
            ("strides", width, [0]),
        ]
        for name, value, k in filled:
            made = self.builder.insert_value(made, value, [model.get_field_position(name), *k])
        return made


class _Part(NamedTuple):
    """Entries of a record: first number, count, length of a row (0: the record is one row), whether it is a row."""

    first: int
    count: int
    width: int
    vector: bool

    def place(self, builder: Any, indices: list[Any]) -> Any:
        """Place of a number in the record's array; without a last index, of the first of its row."""
        first, *more = indices
        flat = first
        if self.width:
            flat = builder.mul(first, first.type(self.width))
            flat = builder.add(flat, more[0]) if more else flat
        return builder.add(flat, flat.type(self.first))


def _register_structures(types: Any) -> None:
    """Register references to structures, and their fields."""
    from llvmlite import ir
    from numba.core import cgutils
    from numba.core.datamodel import models
    from numba.core.extending import lower_builtin, register_model, type_callable
    from numba.core.imputils import lower_getattr_generic
    from numba.core.typing.templates import AttributeTemplate, infer_getattr

    class Structure(types.Type):
        """Type of a structure passed by address."""

        def __init__(self, layout: Struct) -> None:
            self.layout, self.of = layout, dict(layout.fields)
            super().__init__(name=f"{layout.of.__module__}.{layout}")

    _REFERENCE_TYPES["structure"] = Structure

    @register_model(Structure)
    class StructureModel(models.OpaqueModel):
        """Data model: an address."""

    @infer_getattr
    class Fields(AttributeTemplate):  # type: ignore[misc]
        key = Structure

        def generic_resolve(self, typ: Any, attr: str) -> Any:  # type: ignore[override]
            return reference(typ.of[attr]) if attr in typ.of else None

    @lower_getattr_generic(Structure)
    def read(context: Any, builder: Any, typ: Any, value: Any, name: str) -> Any:
        return builder.gep(value, [ir.IntType(64)(typ.layout.offset(name))], inbounds=True)

    @type_callable(by_address)
    def of(context):  # type: ignore[no-untyped-def]
        return lambda fields: Structure(_layout_of(fields))

    # not an overload, which would be a function of its own whose memory is gone when it returns
    @lower_builtin(by_address, types.BaseNamedTuple)
    def put(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        address = builder.bitcast(cgutils.alloca_once_value(builder, args[0]), cgutils.voidptr_t)
        # an empty piece of assembly: no read through its result may be moved before the writes of the tuple
        through = ir.FunctionType(address.type, [address.type])
        return builder.asm(through, "", "=r,0,~{memory}", [address], True)


def _layout_of(fields: Any) -> Struct:
    """Layout of a named tuple of arrays that compiled code creates."""
    from numba.core.errors import TypingError

    is_complex = any(str(getattr(x, "dtype", "")).startswith("complex") for x in fields.types)
    layout = struct_layout(fields.instance_class, is_complex)
    wanted = [reference(of).array for of in layout.arrays()]
    if list(fields.types) != wanted:
        raise TypingError(f"{layout.of.__name__}: the arrays {fields.types} are not those that it declares: {wanted}")
    return layout


def _register_arrays(types: Any) -> None:
    """Register references to arrays, and the operations on them in formulas."""
    from numba.core.datamodel import models
    from numba.core.errors import TypingError
    from numba.core.extending import lower_builtin, lower_cast, register_model
    from numba.core.imputils import lower_getattr, lower_getattr_generic, lower_setattr_generic
    from numba.core.typeconv import Conversion
    from numba.core.typing.templates import (
        AbstractTemplate,
        AttributeTemplate,
        infer_getattr,
        infer_global,
        signature,
    )
    from numba.np.arrayobj import load_item, store_item
    from numba.np.numpy_support import from_dtype
    from numpy import dtype

    class Reference(types.Type):
        """Type of an array passed by the address of its description."""

        def __init__(self, named: Array | RecordLayout) -> None:
            layout = named.array if isinstance(named, RecordLayout) else named
            self.entries = named.of.layout.entries if isinstance(named, RecordLayout) else {}
            self.layout, self.part = named, None
            self.array = types.Array(from_dtype(dtype(layout.dtype)), layout.ndim, "C")
            self.dtype, self.ndim = self.array.dtype, layout.ndim
            super().__init__(name=f"Array_{named}")

        def can_convert_to(self, typingctx: Any, other: Any) -> Any:
            return Conversion.safe if other == self.array and self.part is None else None

        def unify(self, typingctx: Any, other: Any) -> Any:
            return self.array if other == self.array and self.part is None else None

    _REFERENCE_TYPES["array"] = Reference

    class PartReference(Reference):
        """Type of some entries of a record, passed by the address of the record's description."""

        def __init__(self, record: Any, name: str) -> None:
            (first, count), ndim = record.entries[name], record.ndim
            self.layout, self.entries = (record.layout, name), {}
            form = record.layout.of.layout
            self.part = _Part(first, count, form.width if ndim == 2 else 0, form.vectors)
            self.array = types.Array(record.dtype, ndim if count > 1 else 1, "C")
            self.dtype, self.ndim = record.dtype, self.array.ndim
            types.Type.__init__(self, name=f"{record.name}.{name}")

    @register_model(Reference)
    @register_model(PartReference)
    class ReferenceModel(models.OpaqueModel):
        """Data model: an address."""

    class Item(AbstractTemplate):
        def generic(self, args: Any, kws: Any) -> Any:
            if not isinstance(args[0], Reference):
                return None
            found = self.context.resolve_function_type(self.key, (args[0].array, *args[1:]), kws)
            return found and signature(found.return_type, args[0], *found.args[1:])

    for item in (operator.getitem, operator.setitem):
        infer_global(item)(type("Item", (Item,), {}))

    @infer_getattr
    class Attributes(AttributeTemplate):  # type: ignore[misc]
        key = Reference

        def resolve_shape(self, typ: Any) -> Any:
            return types.UniTuple(types.intp, typ.array.ndim)

        def generic_resolve(self, typ: Any, attr: str) -> Any:  # type: ignore[override]
            if attr not in typ.entries:
                return None
            if attr in typ.layout.of.layout.arrays:
                return types.Array(typ.dtype, 1, "C")
            return typ.dtype if typ.ndim == 1 and typ.entries[attr][1] == 1 else PartReference(typ, attr)

    def by_numba(context: Any, builder: Any, sig: Any, place: _ArrayReader, args: Any, what: Any) -> Any:
        if place.part is not None:
            raise TypingError(f"{sig.args[0]}: entries of a record are read by integers")
        own = signature(sig.return_type, place.array, *sig.args[1:])
        return context.get_function(what, own)(builder, (place.whole(), *args[1:]))

    def get(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        place = _ArrayReader(context, builder, sig.args[0], args[0])
        indices, array = place.indices(sig.args[1], args[1]), place.array
        if indices is not None and len(indices) == array.ndim:
            return load_item(context, builder, array, place.element(indices))
        if indices is not None and array.ndim == 2:
            return place.row(sig.return_type, indices[0])
        return by_numba(context, builder, sig, place, args, operator.getitem)

    def put(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        place = _ArrayReader(context, builder, sig.args[0], args[0])
        indices, array = place.indices(sig.args[1], args[1]), place.array
        if indices is None or len(indices) != array.ndim or isinstance(sig.args[2], types.Buffer):
            return by_numba(context, builder, sig, place, args, operator.setitem)
        value = context.cast(builder, args[2], sig.args[2], array.dtype)
        store_item(context, builder, array, value, place.element(indices))
        return context.get_dummy_value()

    for index in (types.Integer, types.SliceType, types.BaseTuple):
        lower_builtin(operator.getitem, Reference, index)(get)
        lower_builtin(operator.setitem, Reference, index, types.Any)(put)

    @lower_getattr(Reference, "shape")
    def shape(context: Any, builder: Any, typ: Any, value: Any) -> Any:
        from numba.core import cgutils

        place = _ArrayReader(context, builder, typ, value)
        return cgutils.pack_array(builder, [place.shape(k) for k in range(typ.ndim)])

    @lower_getattr_generic(Reference)
    def entry(context: Any, builder: Any, typ: Any, value: Any, name: str) -> Any:
        first, count = typ.entries[name]
        place, index = _ArrayReader(context, builder, typ, value), context.get_constant(types.intp, first)
        if name in typ.layout.of.layout.arrays:
            return place.row(types.Array(typ.dtype, 1, "C"), index)
        return value if typ.ndim > 1 or count > 1 else load_item(context, builder, typ.array, place.element([index]))

    @lower_setattr_generic(Reference)
    def set_entry(context: Any, builder: Any, sig: Any, args: Any, name: str) -> Any:
        typ, of = sig.args
        place = _ArrayReader(context, builder, typ, args[0])
        at = place.element([context.get_constant(types.intp, typ.entries[name][0])])
        store_item(context, builder, typ.array, context.cast(builder, args[1], of, typ.dtype), at)

    @lower_cast(Reference, types.Array)
    def whole(context: Any, builder: Any, of: Any, to: Any, value: Any) -> Any:
        return _ArrayReader(context, builder, of, value).whole()


def _register_calls(types: Any) -> None:
    """Register calls by address."""
    from llvmlite import ir
    from numba.core.errors import TypingError
    from numba.extending import intrinsic

    integer = ir.IntType(64)

    @intrinsic
    def jump(typing, address, A, B, C, D, E, task):  # type: ignore[no-untyped-def]
        given = A, B, C, D, E
        layouts = tuple(getattr(x, "layout", None) for x in given)
        if not any(k.parameters[:-1] == layouts for k in KERNELS):
            raise TypingError(f"no kernel takes {given}")

        def generate(context, builder, signature, args):  # type: ignore[no-untyped-def]
            of = ir.FunctionType(integer, [x.type for x in args[1:]])
            return builder.call(builder.inttoptr(args[0], of.as_pointer()), list(args[1:]))

        return types.int64(types.int64, *given, types.int64), generate

    @intrinsic
    def leap(typing, address, A, B, C, D, E, task):  # type: ignore[no-untyped-def]
        def generate(context, builder, signature, args):  # type: ignore[no-untyped-def]
            of = ir.FunctionType(integer, [integer] * 6)
            return builder.call(builder.inttoptr(args[0], of.as_pointer()), list(args[1:]))

        return types.int64(*[types.int64] * 7), generate

    @overload(call)
    def choose(address, A, B, C, D, E, task):  # type: ignore[no-untyped-def]
        return lambda address, A, B, C, D, E, task: jump(address, A, B, C, D, E, task)

    @overload(call_bound)
    def choose_bound(words, task):  # type: ignore[no-untyped-def]
        return lambda words, task: leap(words[0], words[1], words[2], words[3], words[4], words[5], types.int64(task))


def number_type(shape: Any, is_complex: bool) -> Any:
    """Numba's type of nested tuples of numbers, from their lengths, nested likewise; 0 is a number."""
    from numba.core import types

    if isinstance(shape, tuple):
        return types.BaseTuple.from_types([number_type(x, is_complex) for x in shape])
    number = types.complex128 if is_complex else types.float64
    return types.UniTuple(number, shape) if shape else number


def nested_lengths(typ: Any) -> Any:
    """Lengths of nested tuples of numbers, as in `number_type`; None if they contain anything else."""
    from numba.core import types

    if isinstance(typ, types.Number | types.Boolean):
        return 0
    if not isinstance(typ, types.BaseTuple):
        return None
    inner = [nested_lengths(x) for x in typ]
    return len(inner) if not any(x != 0 for x in inner) else None if None in inner else tuple(inner)


def tuple_leaves(builder: Any, typ: Any, value: Any) -> Iterator[tuple[Any, Any]]:
    """Types and values of the numbers in nested tuples."""
    from numba.core import types

    if isinstance(typ, types.BaseTuple):
        for k, x in enumerate(typ):
            yield from tuple_leaves(builder, x, builder.extract_value(value, k))
    else:
        yield typ, value


def nested_value(context: Any, builder: Any, typ: Any, given: Iterator[tuple[Any, Any]]) -> Any:
    """Value of nested tuples, from types and values of numbers."""
    from numba.core import types

    if isinstance(typ, types.BaseTuple):
        return context.make_tuple(builder, typ, [nested_value(context, builder, x, given) for x in typ])
    of, value = next(given)
    return context.cast(builder, value, of, typ)


def load_numbers(builder: Any, number: Any, start: Any, count: int) -> Iterator[tuple[Any, Any]]:
    """Types and values of consecutive numbers in memory."""
    from llvmlite import ir

    for k in range(count):
        yield number, builder.load(builder.gep(start, [ir.IntType(64)(k)]))


def store_numbers(context: Any, builder: Any, number: Any, given: Iterator[tuple[Any, Any]], start: Any) -> None:
    """Store numbers consecutively in memory, converted to one type."""
    from llvmlite import ir

    for k, (of, value) in enumerate(given):
        builder.store(context.cast(builder, value, of, number), builder.gep(start, [ir.IntType(64)(k)]))


def _register_code_tables(types: Any) -> None:
    """Register calls of formulas by the address of a code table.

    It has two words for each formula, its code for floats and for complex numbers. The code takes two addresses: of the
    consecutive numbers of the arguments, and of the memory for those of the result.
    """
    from llvmlite import ir
    from numba.core import cgutils
    from numba.extending import intrinsic

    @intrinsic
    def word(typing, address):  # type: ignore[no-untyped-def]
        def generate(context, builder, signature, args):  # type: ignore[no-untyped-def]
            return builder.load(builder.inttoptr(args[0], ir.IntType(64).as_pointer()))

        return types.int64(types.int64), generate

    @intrinsic
    def run(typing, code, arguments, like):  # type: ignore[no-untyped-def]
        first = like
        while isinstance(first, types.BaseTuple):
            first = first[0]
        number = types.complex128 if isinstance(first, types.Complex) else types.float64

        def generate(context, builder, signature, args):  # type: ignore[no-untyped-def]
            given = list(tuple_leaves(builder, arguments, args[1]))
            count = len(list(tuple_leaves(builder, like, args[2])))
            of = context.get_data_type(number)
            begin, end = (cgutils.alloca_once(builder, of, ir.IntType(64)(n)) for n in (len(given), count))
            store_numbers(context, builder, number, iter(given), begin)
            function = ir.FunctionType(ir.VoidType(), [of.as_pointer()] * 2)
            builder.call(builder.inttoptr(args[0], function.as_pointer()), [begin, end])
            return nested_value(context, builder, like, load_numbers(builder, number, end, count))

        return like(types.int64, arguments, like), generate

    @overload(formula_at)
    def choose(table, k, arguments, like):  # type: ignore[no-untyped-def]
        first = like
        while isinstance(first, types.BaseTuple):
            first = first[0]
        if isinstance(first, types.Complex):
            return lambda table, k, arguments, like: (
                run(word(table + 16 * k + 8), arguments, like) if table >= FIRST_ADDRESS else like
            )
        return lambda table, k, arguments, like: (
            run(word(table + 16 * k), arguments, like) if table >= FIRST_ADDRESS else like
        )

    @overload(has_formula)
    def look(table, k):  # type: ignore[no-untyped-def]
        return lambda table, k: word(table + 16 * k) != 0 if table >= FIRST_ADDRESS else False


def register_types() -> None:
    """Register these types, and calls, with Numba."""
    from numba.core import types

    _register_structures(types)
    _register_arrays(types)
    _register_calls(types)
    _register_code_tables(types)


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
        self.texts.append(normalize_ir_text(str(ir_module)))

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
