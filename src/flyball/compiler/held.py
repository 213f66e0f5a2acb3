"""Tuples of arrays handed from formula to formula by address.

Numba passes a tuple of arrays as its parts, some two hundred numbers for a mechanism, which every callee puts together
again: half of all the code a kernel is made of, before the optimiser throws it away. ``held(S)`` leaves the tuple where
it is and passes its address; ``S.field`` then reads the field there. Nothing writes to the tuple itself, so that the
optimiser may read each part once and keep it (`invariant.load`). A tuple in a tuple is held as well. In plain Python
``held(S)`` is ``S``.
"""

from __future__ import annotations

import hashlib
from typing import Any

from .jit import on_numba
from .table import offset, parts, table_type


def held(fields):  # type: ignore[no-untyped-def]
    """The named tuple by its address, in compiled code; the tuple itself in plain Python."""
    return fields


_TYPES: list[Any] = []


def held_type(whole: Any) -> Any:
    """Numba's type of ``held(x)`` for an x of type ``whole``."""
    return _TYPES[0](whole)


@on_numba
def _register() -> None:
    from llvmlite import ir
    from numba import types
    from numba.core import cgutils
    from numba.core.datamodel import models
    from numba.core.extending import lower_builtin, register_model, type_callable
    from numba.core.imputils import lower_getattr_generic
    from numba.core.typing.templates import AttributeTemplate, infer_getattr

    class Held(types.Type):
        def __init__(self, whole: Any) -> None:
            self.whole = whole
            digest = hashlib.sha1(whole.name.encode(), usedforsecurity=False).hexdigest()[:8]
            super().__init__(name=f"{whole.instance_class.__name__}_{digest}")

        def __reduce__(self) -> Any:
            """As the caches of all processes know it."""
            return held_type, (self.whole,)

    _TYPES[:] = [Held]

    @register_model(Held)
    class HeldModel(models.OpaqueModel):
        """An address."""

    @infer_getattr
    class Fields(AttributeTemplate):  # type: ignore[misc]
        key = Held

        def generic_resolve(self, typ: Any, attr: str) -> Any:  # type: ignore[override]
            if attr not in typ.whole.fields:
                return None
            field = typ.whole[typ.whole.fields.index(attr)]
            if isinstance(field, types.BaseNamedTuple):
                return Held(field)
            return table_type(field) if is_table(field) else field

    @lower_getattr_generic(Held)
    def read(context: Any, builder: Any, typ: Any, value: Any, name: str) -> Any:
        k = typ.whole.fields.index(name)
        whole = context.get_value_type(typ.whole)
        field = builder.gep(value, [ir.IntType(64)(offset(context, whole, k))], inbounds=True)
        if is_table(typ.whole[k]) or isinstance(typ.whole[k], types.BaseNamedTuple):
            return field
        of = whole.element if isinstance(whole, ir.ArrayType) else whole.elements[k]
        return parts(builder, builder.bitcast(field, of.as_pointer()))

    def is_table(typ: Any) -> bool:
        return isinstance(typ, types.Array) and typ.layout == "C"

    @type_callable(held)
    def of(context):  # type: ignore[no-untyped-def]
        return lambda fields: Held(fields)

    # not an overload: that would be a function of its own, and its memory gone when it returns
    @lower_builtin(held, types.BaseNamedTuple)
    def put(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        address = builder.bitcast(cgutils.alloca_once_value(builder, args[0]), cgutils.voidptr_t)
        # an empty piece of assembly: no read through its result may be moved to before the tuple was written
        through = ir.FunctionType(address.type, [address.type])
        return builder.asm(through, "", "=r,0,~{memory}", [address], True)
