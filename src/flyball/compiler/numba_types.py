"""Numba's types of what kernels take by address: structures and arrays; nested tuples of numbers.

Numba passes a tuple of arrays as its parts, some two hundred numbers for a mechanism; here ``S.field`` is the address
of a structure or of an array's description in it, and ``S.field[i, j]`` reads the data address, the length of a row,
and the element. Nothing writes to descriptions, so that the optimiser may read each part once and keep it
(`invariant.load`). Views and whole arrays are Numba's own.
"""

from __future__ import annotations

import operator
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.core.datamodel import models
from numba.core.errors import TypingError
from numba.core.extending import lower_builtin, lower_cast, register_model, type_callable
from numba.core.imputils import lower_getattr, lower_getattr_generic, lower_setattr_generic
from numba.core.typeconv import Conversion
from numba.core.typing.templates import AbstractTemplate, AttributeTemplate, infer_getattr, infer_global, signature
from numba.np.arrayobj import load_item, store_item
from numba.np.numpy_support import from_dtype

from .formulas import by_address
from .struct_layout import DATA, HEAD, Array, RecordLayout, Struct, struct_layout

INTEGER = ir.IntType(64)


def reference(layout: Struct | Array | RecordLayout) -> Any:
    """Numba's type of a structure or of an array that a kernel takes by address."""
    return StructureType(layout) if isinstance(layout, Struct) else Reference(layout)


def load_members(builder: Any, address: Any, skipped: int = 0) -> Any:
    """Read the value at an address number by number: the optimiser does not split larger reads.

    The first ``skipped`` members are left out.
    """
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
        place = self.builder.gep(self.address, [INTEGER(8 * k)], inbounds=True)
        return load_members(self.builder, self.builder.bitcast(place, (of or INTEGER).as_pointer()))

    def shape(self, k: int) -> Any:
        """Length of dimension k."""
        if self.part is not None and k == self.array.ndim - 1 and self.part.count > 1:
            return INTEGER(self.part.count)
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
                before = self.builder.mul(self.shape(0), self.shape(0).type(self.part.first))
                indices = [self.builder.add(indices[0], before)]
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


class StructureType(types.Type):
    """Type of a structure passed by address."""

    def __init__(self, layout: Struct) -> None:
        self.layout, self.of = layout, dict(layout.fields)
        super().__init__(name=f"{layout.of.__module__}.{layout}")


@register_model(StructureType)
class StructureModel(models.OpaqueModel):
    """Data model: an address."""


@infer_getattr
class _StructureFields(AttributeTemplate):  # type: ignore[misc]
    key = StructureType

    def generic_resolve(self, typ: Any, attr: str) -> Any:  # type: ignore[override]
        return reference(typ.of[attr]) if attr in typ.of else None


@lower_getattr_generic(StructureType)
def _field_address(context: Any, builder: Any, typ: Any, value: Any, name: str) -> Any:
    return builder.gep(value, [INTEGER(typ.layout.offset(name))], inbounds=True)


@type_callable(by_address)
def _type_by_address(context):  # type: ignore[no-untyped-def]
    return lambda fields: StructureType(_layout_of(fields))


# not an overload, which would be a function of its own whose memory is gone when it returns
@lower_builtin(by_address, types.BaseNamedTuple)
def _store_by_address(context: Any, builder: Any, signature: Any, args: Any) -> Any:
    address = builder.bitcast(cgutils.alloca_once_value(builder, args[0]), cgutils.voidptr_t)
    # an empty piece of assembly: no read through its result may be moved before the writes of the tuple
    through = ir.FunctionType(address.type, [address.type])
    return builder.asm(through, "", "=r,0,~{memory}", [address], True)


def _layout_of(fields: Any) -> Struct:
    """Layout of a named tuple of arrays that compiled code creates."""
    is_complex = any(str(getattr(x, "dtype", "")).startswith("complex") for x in fields.types)
    layout = struct_layout(fields.instance_class, is_complex)
    wanted = [reference(of).array for of in layout.arrays()]
    if list(fields.types) != wanted:
        raise TypingError(f"{layout.of.__name__}: the arrays {fields.types} are not those that it declares: {wanted}")
    return layout


class Reference(types.Type):
    """Type of an array passed by the address of its description."""

    def __init__(self, named: Array | RecordLayout) -> None:
        layout = named.array if isinstance(named, RecordLayout) else named
        self.entries = named.of.layout.entries if isinstance(named, RecordLayout) else {}
        self.layout, self.part = named, None
        self.array = types.Array(from_dtype(np.dtype(layout.dtype)), layout.ndim, "C")
        self.dtype, self.ndim = self.array.dtype, layout.ndim
        super().__init__(name=f"Array_{named}")

    def can_convert_to(self, typingctx: Any, other: Any) -> Any:
        """Numba converts it to an array of its own."""
        return Conversion.safe if other == self.array and self.part is None else None

    def unify(self, typingctx: Any, other: Any) -> Any:
        """Numba's array, where either may occur."""
        return self.array if other == self.array and self.part is None else None


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


class _ItemAccess(AbstractTemplate):
    def generic(self, args: Any, kws: Any) -> Any:
        if not isinstance(args[0], Reference):
            return None
        found = self.context.resolve_function_type(self.key, (args[0].array, *args[1:]), kws)
        return found and signature(found.return_type, args[0], *found.args[1:])


for _item in (operator.getitem, operator.setitem):
    infer_global(_item)(type("ItemAccess", (_ItemAccess,), {}))


@infer_getattr
class _ArrayAttributes(AttributeTemplate):  # type: ignore[misc]
    key = Reference

    def resolve_shape(self, typ: Any) -> Any:
        return types.UniTuple(types.intp, typ.array.ndim)

    def generic_resolve(self, typ: Any, attr: str) -> Any:  # type: ignore[override]
        if attr not in typ.entries:
            return None
        if attr in typ.layout.of.layout.arrays:
            return types.Array(typ.dtype, 1, "C")
        return typ.dtype if typ.ndim == 1 and typ.entries[attr][1] == 1 else PartReference(typ, attr)


def _by_numba(context: Any, builder: Any, sig: Any, place: _ArrayReader, args: Any, what: Any) -> Any:
    if place.part is not None:
        raise TypingError(f"{sig.args[0]}: entries of a record are read by integers")
    own = signature(sig.return_type, place.array, *sig.args[1:])
    return context.get_function(what, own)(builder, (place.whole(), *args[1:]))


def _get_item(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    place = _ArrayReader(context, builder, sig.args[0], args[0])
    indices, array = place.indices(sig.args[1], args[1]), place.array
    if indices is not None and len(indices) == array.ndim:
        return load_item(context, builder, array, place.element(indices))
    if indices is not None and array.ndim == 2:
        return place.row(sig.return_type, indices[0])
    return _by_numba(context, builder, sig, place, args, operator.getitem)


def _set_item(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    place = _ArrayReader(context, builder, sig.args[0], args[0])
    indices, array = place.indices(sig.args[1], args[1]), place.array
    if indices is None or len(indices) != array.ndim or isinstance(sig.args[2], types.Buffer):
        return _by_numba(context, builder, sig, place, args, operator.setitem)
    value = context.cast(builder, args[2], sig.args[2], array.dtype)
    store_item(context, builder, array, value, place.element(indices))
    return context.get_dummy_value()


for _index in (types.Integer, types.SliceType, types.BaseTuple):
    lower_builtin(operator.getitem, Reference, _index)(_get_item)
    lower_builtin(operator.setitem, Reference, _index, types.Any)(_set_item)


@lower_getattr(Reference, "shape")
def _shape(context: Any, builder: Any, typ: Any, value: Any) -> Any:
    place = _ArrayReader(context, builder, typ, value)
    return cgutils.pack_array(builder, [place.shape(k) for k in range(typ.ndim)])


@lower_getattr_generic(Reference)
def _get_entry(context: Any, builder: Any, typ: Any, value: Any, name: str) -> Any:
    first, count = typ.entries[name]
    place, index = _ArrayReader(context, builder, typ, value), context.get_constant(types.intp, first)
    if name in typ.layout.of.layout.arrays:
        return place.row(types.Array(typ.dtype, 1, "C"), index)
    return value if typ.ndim > 1 or count > 1 else load_item(context, builder, typ.array, place.element([index]))


@lower_setattr_generic(Reference)
def _set_entry(context: Any, builder: Any, sig: Any, args: Any, name: str) -> Any:
    typ, of = sig.args
    place = _ArrayReader(context, builder, typ, args[0])
    at = place.element([context.get_constant(types.intp, typ.entries[name][0])])
    store_item(context, builder, typ.array, context.cast(builder, args[1], of, typ.dtype), at)


@lower_cast(Reference, types.Array)
def _whole_array(context: Any, builder: Any, of: Any, to: Any, value: Any) -> Any:
    return _ArrayReader(context, builder, of, value).whole()


def number_type(shape: Any, is_complex: bool) -> Any:
    """Numba's type of nested tuples of numbers, from their lengths, nested likewise; 0 is a number."""
    if isinstance(shape, tuple):
        return types.BaseTuple.from_types([number_type(x, is_complex) for x in shape])
    number = types.complex128 if is_complex else types.float64
    return types.UniTuple(number, shape) if shape else number


def nested_lengths(typ: Any) -> Any:
    """Lengths of nested tuples of numbers, as in `number_type`; None if they contain anything else."""
    if isinstance(typ, types.Number | types.Boolean):
        return 0
    if not isinstance(typ, types.BaseTuple):
        return None
    inner = [nested_lengths(x) for x in typ]
    return len(inner) if not any(x != 0 for x in inner) else None if None in inner else tuple(inner)


def tuple_leaves(builder: Any, typ: Any, value: Any) -> Iterator[tuple[Any, Any]]:
    """Types and values of the numbers in nested tuples."""
    if isinstance(typ, types.BaseTuple):
        for k, x in enumerate(typ):
            yield from tuple_leaves(builder, x, builder.extract_value(value, k))
    else:
        yield typ, value


def nested_value(context: Any, builder: Any, typ: Any, given: Iterator[tuple[Any, Any]]) -> Any:
    """Value of nested tuples, from types and values of numbers."""
    if isinstance(typ, types.BaseTuple):
        return context.make_tuple(builder, typ, [nested_value(context, builder, x, given) for x in typ])
    of, value = next(given)
    return context.cast(builder, value, of, typ)


def load_numbers(builder: Any, number: Any, start: Any, count: int) -> Iterator[tuple[Any, Any]]:
    """Types and values of consecutive numbers in memory."""
    for k in range(count):
        yield number, builder.load(builder.gep(start, [INTEGER(k)]))


def store_numbers(context: Any, builder: Any, number: Any, given: Iterator[tuple[Any, Any]], start: Any) -> None:
    """Store numbers consecutively in memory, converted to one type."""
    for k, (of, value) in enumerate(given):
        builder.store(context.cast(builder, value, of, number), builder.gep(start, [INTEGER(k)]))
