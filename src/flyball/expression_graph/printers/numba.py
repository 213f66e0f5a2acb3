"""Expressions as a module of functions compiled by Numba, from the state of one mechanism to arrays."""

from __future__ import annotations

import keyword
import textwrap
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..graph import Function
from .python import constant_definitions, docstring, docstring_escaped, literal, table_data
from .routines import Identifiers, Language, Routine, refuse_python_functions, spline_tables, statements

FUNCTIONS = {
    **{f: f"math.{f}({{0}})" for f in ("sqrt", "sin", "cos", "tan", "asin", "acos", "atan", "exp", "log")},
    **{f: f"math.{f}({{0}})" for f in ("sinh", "cosh", "tanh")},
    "atan2": "math.atan2({0}, {1})", "power": "math.pow({0}, {1})", "absolute": "abs({0})",
    "rounded": "np.floor({0} + 0.5)", "sign": "np.sign({0})", "minimum": "_minimum({0}, {1})",
    "maximum": "_maximum({0}, {1})", "choose": "({1} if {0} > 0.0 else {2})",
}  # fmt: skip

HELPERS = {
    "_minimum": "def _minimum(a, b):\n    return a if a <= b or a != a else b\n",
    "_maximum": "def _maximum(a, b):\n    return a if a >= b or a != a else b\n",
    "_spline": '''\
def _spline(data, order, x):
    """A derivative of a piecewise cubic: period, count, breaks, and four coefficients a piece."""
    count = int(data[1])
    shift = data[0] * math.floor((x - data[2]) / data[0]) if data[0] > 0.0 and x - x == 0.0 else 0.0
    low, high = 0, count
    while low < high:
        middle = (low + high) // 2
        if data[2 + middle] <= x - shift:
            low = middle + 1
        else:
            high = middle
    if low == count and x - shift == data[1 + count]:
        low = count - 1
    at = 2 + count + 4 * low
    s = x - (data[2 + max(low - 1, 0)] + shift)
    if order == 0:
        return data[at] + s * (data[at + 1] + s * (data[at + 2] + s * data[at + 3]))
    if order == 1:
        return data[at + 1] + s * (2.0 * data[at + 2] + 3.0 * data[at + 3] * s)
    return 2.0 * data[at + 2] + 6.0 * data[at + 3] * s if order == 2 else 6.0 * data[at + 3]
''',
    "_spline_with": '''\
def _spline_with(data, order, x, places, numbers):
    """The same where some of the data are given with the call."""
    data = data.copy()
    for k in range(len(places)):
        data[places[k]] = numbers[k]
    return _spline(data, order, x)
''',
}
DECORATOR = '@njit(error_model="numpy")\n'


def numba_module(routines: Sequence[Routine], head: str, constants: Mapping[str, Sequence[Any]] | None = None) -> str:
    """Text of a module of compiled functions.

    Raises
    ------
    ModelError
        If a routine calls a Python function, or takes too many operations.
    """
    refuse_python_functions(routines, "Numba")
    for r in routines:
        r.check()
    known = spline_tables(routines, Identifiers([*keyword.kwlist, *HELPERS, *[r.name for r in routines]]))

    def call(f: Function, args: Sequence[str]) -> str:
        t = known[id(f.details["value"])]
        if not t.moved:
            return f"_spline({t.name}, {f.details['order']}, {args[0]})"
        numbers = "".join(x + ", " for x in args[1:])
        return f"_spline_with({t.name}, {f.details['order']}, {args[0]}, {t.moved!r}, ({numbers}))"

    language = Language(literal, FUNCTIONS, call)
    body = "".join(_function(r, language) for r in routines)
    called = [f for f in HELPERS if f"{f}(" in body or (f == "_spline" and known)]
    helpers = "".join(f"\n\n{DECORATOR}{HELPERS[f]}" for f in called)
    return (
        f'"""{docstring_escaped(head)}\n"""\n\nimport math\n\nimport numpy as np\nfrom numba import njit\n'
        f"{constant_definitions(constants)}{table_data(known.values())}{helpers}{body}"
    )


def _function(r: Routine, language: Language) -> str:
    names = Identifiers([*keyword.kwlist, "math", "np", "njit", *HELPERS, *r.results])
    given = [names(a.name) for a in r.arguments]
    symbols: dict[int, str] = {}
    for a, name in zip(r.arguments, given, strict=True):
        symbols |= {x.index: name if a.single else f"{name}[{k}]" for k, x in enumerate(a.nodes)}
    counter = iter(range(1, 10**9))
    temporaries, numbers = statements(language, r.nodes, symbols, lambda: names(f"x{next(counter)}"))
    text = [f"{n} = {e}" for n, e in temporaries]
    left = iter(numbers)
    for name, array in r.arrays.items():
        if not array.shape:
            text.append(f"{name} = {next(left)}")
            continue
        text.append(f"{name} = np.zeros({array.shape!r})")
        for place in np.ndindex(array.shape):
            number = next(left)
            text += [f"{name}[{', '.join(map(str, place))}] = {number}"] if number != "0.0" else []
    text.append(f"return {', '.join(r.results)}")
    return (
        f"\n\n{DECORATOR}def {r.name}({', '.join(given)}):\n"
        + textwrap.indent(docstring(r, given) + "\n".join(text), "    ")
        + "\n"
    )
