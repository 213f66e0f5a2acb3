"""Numba's types of structures and arrays that kernels take by address, and of their fields.

Numba passes a tuple of arrays as its parts, some two hundred numbers for a mechanism, which every callee puts together
again: half of all code that a kernel is made of, before the optimiser throws it away. Here a structure is an address;
``S.field`` is the address of a structure or of an array's description in it, and ``S.field[i, j]`` reads where the
numbers stand, the length of a row, and the element. Nothing writes to descriptions, so that the optimiser may read each
part once and keep it (`invariant.load`). Views and whole arrays are Numba's own.
"""

from __future__ import annotations

import operator
from collections.abc import Iterator
from typing import Any

from .formulas import FIRST_ADDRESS, KERNELS, by_address, call, call_bound, formula_at, has_formula
from .layout import DATA, HEAD, Array, RecordLayout, Struct, struct

_MADE: dict[str, Any] = {}


def reference(layout: Struct | Array | RecordLayout) -> Any:
    """Numba's type of a structure or of an array that a kernel takes by address."""
    return _MADE["structure" if isinstance(layout, Struct) else "array"](layout)


def parts(builder: Any, address: Any, skipped: int = 0) -> Any:
    """Read what stands at an address number by number: the optimiser splits no larger reads.

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
        whole = builder.insert_value(whole, parts(builder, cgutils.gep_inbounds(builder, address, 0, k)), k)
    return whole


class _Place:
    """Code that finds what an array's description says."""

    def __init__(self, context: Any, builder: Any, typ: Any, value: Any) -> None:
        self.context, self.builder, self.array, self.address = context, builder, typ.array, value

    def word(self, k: int, of: Any = None) -> Any:
        """The k-th word of the description: see `layout`."""
        from llvmlite import ir

        integer = ir.IntType(64)
        place = self.builder.gep(self.address, [integer(8 * k)], inbounds=True)
        return parts(self.builder, self.builder.bitcast(place, (of or integer).as_pointer()))

    def shape(self, k: int) -> Any:
        """The k-th length."""
        return self.word(HEAD // 8 + k)

    def data(self) -> Any:
        """The address of the numbers."""
        return self.word(DATA // 8, self.context.get_data_type(self.array.dtype).as_pointer())

    def whole(self) -> Any:
        """The array as Numba has it, without owners: nobody counts references here."""
        of = self.context.get_value_type(self.array).as_pointer()
        return parts(self.builder, self.builder.bitcast(self.address, of), 2)

    def indices(self, typ: Any, value: Any) -> list[Any] | None:
        """Integers of an index, counted from the end where negative; None if it holds anything else."""
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
        """The address of an element; the first of a row where the last index is left out."""
        flat = indices[0]
        for k in range(1, self.array.ndim):
            flat = self.builder.mul(flat, self.shape(k))
            flat = self.builder.add(flat, indices[k]) if k < len(indices) else flat
        return self.builder.gep(self.data(), [flat], inbounds=True)

    def row(self, typ: Any, index: Any) -> Any:
        """A row of a table of two dimensions, as an array of type ``typ``."""
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


def _structures(types: Any) -> None:
    """References to structures, and their fields."""
    from llvmlite import ir
    from numba.core import cgutils
    from numba.core.datamodel import models
    from numba.core.extending import lower_builtin, register_model, type_callable
    from numba.core.imputils import lower_getattr_generic
    from numba.core.typing.templates import AttributeTemplate, infer_getattr

    class Structure(types.Type):
        """A structure by its address."""

        def __init__(self, layout: Struct) -> None:
            self.layout, self.of = layout, dict(layout.fields)
            super().__init__(name=f"{layout.of.__module__}.{layout}")

    _MADE["structure"] = Structure

    @register_model(Structure)
    class StructureModel(models.OpaqueModel):
        """An address."""

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

    # not an overload: that would be a function of its own, and its memory gone when it returns
    @lower_builtin(by_address, types.BaseNamedTuple)
    def put(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        address = builder.bitcast(cgutils.alloca_once_value(builder, args[0]), cgutils.voidptr_t)
        # an empty piece of assembly: no read through its result may be moved to before the tuple was written
        through = ir.FunctionType(address.type, [address.type])
        return builder.asm(through, "", "=r,0,~{memory}", [address], True)


def _layout_of(fields: Any) -> Struct:
    """Layout of a named tuple of arrays that compiled code puts together."""
    from numba.core.errors import TypingError

    is_complex = any(str(getattr(x, "dtype", "")).startswith("complex") for x in fields.types)
    layout = struct(fields.instance_class, is_complex)
    wanted = [reference(of).array for of in layout.arrays()]
    if list(fields.types) != wanted:
        raise TypingError(f"{layout.of.__name__}: the arrays {fields.types} are not those that it declares: {wanted}")
    return layout


def _arrays(types: Any) -> None:
    """References to arrays, and what formulas do with them."""
    from numba.core.datamodel import models
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
        """An array by the address of its description."""

        def __init__(self, named: Array | RecordLayout) -> None:
            layout = named.array if isinstance(named, RecordLayout) else named
            self.names = named.of.names if isinstance(named, RecordLayout) else ()
            self.layout = named
            self.array = types.Array(from_dtype(dtype(layout.dtype)), layout.ndim, "C")
            self.dtype, self.ndim = self.array.dtype, layout.ndim
            super().__init__(name=f"Array_{named}")

        def can_convert_to(self, typingctx: Any, other: Any) -> Any:
            return Conversion.safe if other == self.array else None

        def unify(self, typingctx: Any, other: Any) -> Any:
            return self.array if other == self.array else None

    _MADE["array"] = Reference

    @register_model(Reference)
    class ReferenceModel(models.OpaqueModel):
        """An address."""

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
            return typ.dtype if attr in typ.names else None

    def by_numba(context: Any, builder: Any, sig: Any, place: _Place, args: Any, what: Any) -> Any:
        own = signature(sig.return_type, place.array, *sig.args[1:])
        return context.get_function(what, own)(builder, (place.whole(), *args[1:]))

    def get(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        place = _Place(context, builder, sig.args[0], args[0])
        indices, array = place.indices(sig.args[1], args[1]), place.array
        if indices is not None and len(indices) == array.ndim:
            return load_item(context, builder, array, place.element(indices))
        if indices is not None and array.ndim == 2:
            return place.row(sig.return_type, indices[0])
        return by_numba(context, builder, sig, place, args, operator.getitem)

    def put(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        place = _Place(context, builder, sig.args[0], args[0])
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

        place = _Place(context, builder, typ, value)
        return cgutils.pack_array(builder, [place.shape(k) for k in range(typ.ndim)])

    @lower_getattr_generic(Reference)
    def entry(context: Any, builder: Any, typ: Any, value: Any, name: str) -> Any:
        place = _Place(context, builder, typ, value)
        at = place.element([context.get_constant(types.intp, typ.names.index(name))])
        return load_item(context, builder, typ.array, at)

    @lower_setattr_generic(Reference)
    def set_entry(context: Any, builder: Any, sig: Any, args: Any, name: str) -> Any:
        typ, of = sig.args
        place = _Place(context, builder, typ, args[0])
        at = place.element([context.get_constant(types.intp, typ.names.index(name))])
        store_item(context, builder, typ.array, context.cast(builder, args[1], of, typ.dtype), at)

    @lower_cast(Reference, types.Array)
    def whole(context: Any, builder: Any, of: Any, to: Any, value: Any) -> Any:
        return _Place(context, builder, of, value).whole()


def _calls(types: Any) -> None:
    """Calls by address."""
    from llvmlite import ir
    from numba.core.errors import TypingError
    from numba.extending import intrinsic

    from .target import overload

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


def numbers(shape: Any, is_complex: bool) -> Any:
    """Numba's type of nested tuples of numbers: lengths, nested as the tuples are; 0 is a number."""
    from numba.core import types

    if isinstance(shape, tuple):
        return types.BaseTuple.from_types([numbers(x, is_complex) for x in shape])
    number = types.complex128 if is_complex else types.float64
    return types.UniTuple(number, shape) if shape else number


def shape_of(typ: Any) -> Any:
    """The lengths of nested tuples of numbers, as in `numbers`; None if there is anything else in them."""
    from numba.core import types

    if isinstance(typ, types.Number | types.Boolean):
        return 0
    if not isinstance(typ, types.BaseTuple):
        return None
    inner = [shape_of(x) for x in typ]
    return len(inner) if not any(x != 0 for x in inner) else None if None in inner else tuple(inner)


def leaves(builder: Any, typ: Any, value: Any) -> Iterator[tuple[Any, Any]]:
    """Types and values of the numbers in nested tuples."""
    from numba.core import types

    if isinstance(typ, types.BaseTuple):
        for k, x in enumerate(typ):
            yield from leaves(builder, x, builder.extract_value(value, k))
    else:
        yield typ, value


def nested(context: Any, builder: Any, typ: Any, given: Iterator[tuple[Any, Any]]) -> Any:
    """A value of nested tuples, of types and values of numbers."""
    from numba.core import types

    if isinstance(typ, types.BaseTuple):
        return context.make_tuple(builder, typ, [nested(context, builder, x, given) for x in typ])
    of, value = next(given)
    return context.cast(builder, value, of, typ)


def loaded(builder: Any, number: Any, start: Any, count: int) -> Iterator[tuple[Any, Any]]:
    """Types and values of numbers that stand one after the other in memory."""
    from llvmlite import ir

    for k in range(count):
        yield number, builder.load(builder.gep(start, [ir.IntType(64)(k)]))


def stored(context: Any, builder: Any, number: Any, given: Iterator[tuple[Any, Any]], start: Any) -> None:
    """Put numbers into memory one after the other, as numbers of one type."""
    from llvmlite import ir

    for k, (of, value) in enumerate(given):
        builder.store(context.cast(builder, value, of, number), builder.gep(start, [ir.IntType(64)(k)]))


def _tables_of_code(types: Any) -> None:
    """Calls of formulas by the address of a code table: two words a formula, its code for floats and complex numbers.

    The code takes two addresses: where the numbers of the arguments stand one after the other, and where those of the
    result are to be put.
    """
    from llvmlite import ir
    from numba.core import cgutils
    from numba.extending import intrinsic

    from .target import overload

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
            given = list(leaves(builder, arguments, args[1]))
            count = len(list(leaves(builder, like, args[2])))
            of = context.get_data_type(number)
            begin, end = (cgutils.alloca_once(builder, of, ir.IntType(64)(n)) for n in (len(given), count))
            stored(context, builder, number, iter(given), begin)
            function = ir.FunctionType(ir.VoidType(), [of.as_pointer()] * 2)
            builder.call(builder.inttoptr(args[0], function.as_pointer()), [begin, end])
            return nested(context, builder, like, loaded(builder, number, end, count))

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


def register() -> None:
    """Tell Numba of these types, and of calls."""
    from numba.core import types

    _structures(types)
    _arrays(types)
    _calls(types)
    _tables_of_code(types)
