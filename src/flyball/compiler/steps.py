"""Products of complex numbers that carry a step, to first order: (a + i b)(c + i d) = a c + i (a d + b c).

The step is 1e-40 of a number, so that b d is nothing beside a c: one product and one sum less of six.
"""

from __future__ import annotations

import operator
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from .operations import struct
from .patched import patched


@contextmanager
def products_of_first_order() -> Iterator[None]:
    """While what takes complex steps compiles, translate products of complex numbers like this."""
    from numba.core import types
    from numba.core.base import BaseContext

    def chosen(original: Any) -> Any:
        def get_function(self: Any, fn: Any, sig: Any, **more: Any) -> Any:
            known = getattr(fn, "typing_key", fn)
            if known in (operator.mul, operator.imul) and all(isinstance(x, types.Complex) for x in sig.args):
                return lambda builder, args, *_: _product(self, builder, sig, args)
            return original(self, fn, sig, **more)

        return get_function

    with patched([(BaseContext, "get_function", chosen)]):
        yield


def _product(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    (a, b), (c, d) = ([builder.extract_value(x, k) for k in range(2)] for x in args)
    moved = builder.fadd(builder.fmul(a, d), builder.fmul(b, c))
    return struct(context, builder, sig.return_type, (builder.fmul(a, c), moved))
