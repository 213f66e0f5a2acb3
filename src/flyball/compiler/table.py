"""Fields of a held tuple: an array by the address at which it is described, read where it is used.

Numba takes an array apart into seven numbers, puts them together again and takes them apart for every element; in
formulas that only ask for elements that was half of all code before optimisation. Here ``S.field[i, j]`` reads the
place of the numbers and the width of a row, and the element. Views and whole arrays are Numba's own.
"""

from __future__ import annotations

from typing import Any

from .jit import on_numba

_TYPES: list[Any] = []


def table_type(array: Any) -> Any:
    """Numba's type of a field of a held tuple that is an array of type ``array``."""
    return _TYPES[0](array)


_OFFSETS: dict[tuple[Any, int], int] = {}


def offset(context: Any, of: Any, k: int) -> int:
    """Bytes from the begin of a structure, or of an array, to its member k."""
    from llvmlite import ir

    if isinstance(of, ir.ArrayType):
        return k * offset(context, ir.LiteralStructType([of.element] * 2), 1)
    key = of, k
    if key not in _OFFSETS:
        _OFFSETS[key] = of.get_element_offset(context.target_data, k)
    return _OFFSETS[key]


def parts(builder: Any, address: Any, skipped: int = 0) -> Any:
    """Read what stands at an address number by number: the optimiser splits no larger reads.

    Nothing writes there, so that it may read each number once and keep it. The first ``skipped`` are left out.
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
    """Where a table's numbers are: code that finds them."""

    def __init__(self, context: Any, builder: Any, typ: Any, value: Any) -> None:
        self.context, self.builder, self.array, self.address = context, builder, typ.array, value

    def at(self, name: str, *k: int) -> Any:
        """The address of a part of the array's description."""
        from llvmlite import ir

        whole = self.context.get_value_type(self.array)
        position = self.context.data_model_manager[self.array].get_field_position(name)
        part, at = whole.elements[position], offset(self.context, whole, position)
        for i in k:
            part, at = part.element, at + offset(self.context, part, i)
        place = self.builder.gep(self.address, [ir.IntType(64)(at)], inbounds=True) if at else self.address
        return self.builder.bitcast(place, part.as_pointer())

    def read(self, name: str, *k: int) -> Any:
        return parts(self.builder, self.at(name, *k))

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
            if of.signed:
                below = self.builder.icmp_signed("<", i, i.type(0))
                i = self.builder.select(below, self.builder.add(i, self.read("shape", k)), i)
            out.append(i)
        return out

    def element(self, indices: list[Any]) -> Any:
        """The address of an element; the first of a row where the last index is left out."""
        flat = indices[0]
        for k in range(1, self.array.ndim):
            flat = self.builder.mul(flat, self.read("shape", k))
            flat = self.builder.add(flat, indices[k]) if k < len(indices) else flat
        return self.builder.gep(self.read("data"), [flat], inbounds=True)

    def row(self, typ: Any, index: Any) -> Any:
        """A row of a table of two dimensions, as an array of type ``typ``."""
        from llvmlite import ir

        model, length = self.context.data_model_manager[typ], self.read("shape", 1)
        size = self.context.get_abi_sizeof(self.context.get_data_type(typ.dtype))
        width, made = length.type(size), ir.Constant(self.context.get_value_type(typ), None)
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


def _typed(table: Any) -> None:
    """What may be asked of a table: elements, rows and views, its shape."""
    import operator

    from numba.core import types
    from numba.core.typing.templates import AbstractTemplate, AttributeTemplate, infer_getattr, infer_global, signature

    class Item(AbstractTemplate):
        def generic(self, args: Any, kws: Any) -> Any:
            if not isinstance(args[0], table):
                return None
            found = self.context.resolve_function_type(self.key, (args[0].array, *args[1:]), kws)
            return found and signature(found.return_type, args[0], *found.args[1:])

    for asked in (operator.getitem, operator.setitem):
        infer_global(asked)(type("Item", (Item,), {}))

    @infer_getattr
    class Attributes(AttributeTemplate):  # type: ignore[misc]
        key = table

        def resolve_shape(self, typ: Any) -> Any:
            return types.UniTuple(types.intp, typ.array.ndim)


def _translated(table: Any) -> None:
    """The code of it."""
    import operator

    from numba.core import types
    from numba.core.extending import lower_builtin, lower_cast
    from numba.core.imputils import lower_getattr
    from numba.core.typing.templates import signature
    from numba.np.arrayobj import load_item, store_item

    def numbas_own(context: Any, builder: Any, sig: Any, place: _Place, args: Any, what: Any) -> Any:
        own = signature(sig.return_type, place.array, *sig.args[1:])
        return context.get_function(what, own)(builder, (place.whole(), *args[1:]))

    def get(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        place = _Place(context, builder, sig.args[0], args[0])
        indices, array = place.indices(sig.args[1], args[1]), place.array
        if indices is not None and len(indices) == array.ndim:
            return load_item(context, builder, array, place.element(indices))
        if indices is not None and array.ndim == 2:
            return place.row(sig.return_type, indices[0])
        return numbas_own(context, builder, sig, place, args, operator.getitem)

    def put(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        place = _Place(context, builder, sig.args[0], args[0])
        indices, array = place.indices(sig.args[1], args[1]), place.array
        if indices is None or len(indices) != array.ndim or isinstance(sig.args[2], types.Buffer):
            return numbas_own(context, builder, sig, place, args, operator.setitem)
        value = context.cast(builder, args[2], sig.args[2], array.dtype)
        store_item(context, builder, array, value, place.element(indices))
        return context.get_dummy_value()

    for index in (types.Integer, types.SliceType, types.BaseTuple):
        lower_builtin(operator.getitem, table, index)(get)
        lower_builtin(operator.setitem, table, index, types.Any)(put)

    @lower_getattr(table, "shape")
    def shape(context: Any, builder: Any, typ: Any, value: Any) -> Any:
        return _Place(context, builder, typ, value).read("shape")

    @lower_cast(table, types.Array)
    def whole(context: Any, builder: Any, of: Any, to: Any, value: Any) -> Any:
        return _Place(context, builder, of, value).whole()


@on_numba
def _register() -> None:
    from numba.core import types
    from numba.core.datamodel import models
    from numba.core.extending import register_model
    from numba.core.typeconv import Conversion

    class Table(types.Type):
        """An array by its address."""

        is_table = True

        def __init__(self, array: Any) -> None:
            self.array, self.dtype, self.ndim = array, array.dtype, array.ndim
            super().__init__(name=f"Table_{array.dtype}_{array.ndim}{'' if array.mutable else '_constant'}")

        def __reduce__(self) -> Any:
            """As the caches of all processes know it."""
            return table_type, (self.array,)

        def can_convert_to(self, typingctx: Any, other: Any) -> Any:
            return Conversion.safe if other == self.array else None

        def unify(self, typingctx: Any, other: Any) -> Any:
            return self.array if other == self.array else None

    _TYPES[:] = [Table]

    @register_model(Table)
    class TableModel(models.OpaqueModel):
        """An address."""

    _typed(Table)
    _translated(Table)
