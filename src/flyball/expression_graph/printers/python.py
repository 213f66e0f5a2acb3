"""Expressions as a Python module that needs NumPy only: functions of one state, or of arrays of them."""

from __future__ import annotations

import keyword
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from ..graph import Function
from .routines import (
    LINE,
    Argument,
    Identifiers,
    Language,
    PrintedTable,
    Routine,
    python_functions_of,
    spline_tables,
    statements,
    wrapped_items,
)

FUNCTIONS = {
    "sqrt": "np.sqrt({0})", "sin": "np.sin({0})", "cos": "np.cos({0})", "tan": "np.tan({0})",
    "asin": "np.arcsin({0})", "acos": "np.arccos({0})", "atan": "np.arctan({0})", "exp": "np.exp({0})",
    "log": "np.log({0})", "sinh": "np.sinh({0})", "cosh": "np.cosh({0})", "tanh": "np.tanh({0})",
    "atan2": "np.arctan2({0}, {1})", "absolute": "np.abs({0})", "sign": "np.sign({0})",
    "rounded": "np.floor({0} + 0.5)", "minimum": "_minimum({0}, {1})", "maximum": "_maximum({0}, {1})",
    "choose": "np.where({0} > 0.0, {1}, {2})", "power": "np.power({0}, {1})",
}  # fmt: skip

HELPERS = {
    "_minimum": '''
def _minimum(a, b):
    return np.where((a <= b) | (a != a), a, b)
''',
    "_maximum": '''
def _maximum(a, b):
    return np.where((a >= b) | (a != a), a, b)
''',
    "_columns": '''
def _columns(name, x, count):
    """The numbers of an argument, each for all states."""
    x = np.asarray(x, dtype=float)
    if x.shape[-1:] != (count,):
        raise ValueError(f"{name} has {count} numbers in its last axis, not the shape {x.shape}")
    return np.moveaxis(x, -1, 0)
''',
    "_result": '''
def _result(states, shape, numbers):
    """An array of results; axes of states come first."""
    out = np.empty((*states, len(numbers)))
    for k, x in enumerate(numbers):
        out[..., k] = x
    return out.reshape((*states, *shape))[()]
''',
    "_spline": '''
def _spline(data, order, x, places=(), *numbers):
    """A derivative of a piecewise cubic: period, count, breaks, and four coefficients a piece."""
    if places:
        if any(np.ndim(n) for n in (x, *numbers)):
            one = np.vectorize(lambda x, *n: _spline(data, order, x, places, *n), otypes=[float])
            return one(x, *numbers)
        data = data.copy()
        data[list(places)] = numbers
    count = int(data[1])
    breaks, pieces = data[2 : 2 + count], data[2 + count :].reshape(-1, 4)
    shift = data[0] * np.floor((x - breaks[0]) / data[0]) if data[0] > 0.0 else 0.0 * x
    k = np.searchsorted(breaks, x - shift, side="right")
    k = np.where(x - shift == breaks[-1], count - 1, k)
    c = np.moveaxis(pieces[k], -1, 0)
    s = x - (breaks[np.maximum(k - 1, 0)] + shift)
    if order == 0:
        return c[0] + s * (c[1] + s * (c[2] + s * c[3]))
    if order == 1:
        return c[1] + s * (2.0 * c[2] + 3.0 * c[3] * s)
    return 2.0 * c[2] + 6.0 * c[3] * s if order == 2 else 6.0 * c[3]
''',
    "_called": '''
FUNCTIONS = dict.fromkeys({names!r})


def use(**functions):
    """Say what the Python functions of the mechanism are: ``use(name=function, ...)``."""
    unknown = set(functions) - set(FUNCTIONS)
    if unknown:
        raise ValueError(f"there is no function {{', '.join(sorted(unknown))}} here, but {{', '.join(FUNCTIONS)}}")
    FUNCTIONS.update(functions)


def _called(name, *numbers):
    function = FUNCTIONS[name]
    if function is None:
        raise ValueError(f"first say what the function {{name}} is: use({{name}}=...)")
    if any(np.ndim(x) for x in numbers):
        function = np.vectorize(function, otypes=[float])
    return function(*numbers)
''',
}  # fmt: skip
"""Texts of helper functions."""


def literal(x: float) -> str:
    """A number as text that reads back exactly."""
    return repr(float(x)) if np.isfinite(x) else "np.nan" if x != x else "np.inf" if x > 0.0 else "-np.inf"


def python_module(routines: Sequence[Routine], head: str, constants: Mapping[str, Sequence[Any]] | None = None) -> str:
    """Text of a module.

    Parameters
    ----------
    routines : sequence of Routine
    head : str
        Text of the module's docstring.
    constants : mapping, optional
        Name -> numbers or texts: tuples of the module.
    """
    for r in routines:
        r.check()
    names = Identifiers([*keyword.kwlist, "np", "use", "FUNCTIONS", *HELPERS, *[r.name for r in routines]])
    known = spline_tables(routines, names)
    told = python_functions_of(routines, Identifiers(keyword.kwlist))

    def call(f: Function, args: Sequence[str]) -> str:
        if id(f) in told:
            return f"_called({', '.join([repr(told[id(f)][0]), *args])})"
        t = known[id(f.details["value"])]
        moved = [repr(t.moved), *args[1:]] if t.moved else []
        return f"_spline({', '.join([t.name, str(f.details['order']), args[0], *moved])})"

    language = Language(literal, FUNCTIONS, call)
    body = "".join(_function(r, language) for r in routines)
    helpers = "".join(
        "\n" + (text.format(names=tuple(n for n, _ in told.values())) if name == "_called" else text)
        for name, text in HELPERS.items()
        if f"{name}(" in body
    )
    data = constant_definitions(constants) + table_data(known.values())
    return f'"""{docstring_escaped(head)}\n"""\n\nimport numpy as np\n{data}{helpers}{body}'


def constant_definitions(constants: Mapping[str, Sequence[Any]] | None) -> str:
    """Tuples of numbers or texts."""
    text = ""
    for name, items in (constants or {}).items():
        written = [repr(x) if isinstance(x, str) else literal(x) for x in items]
        text += "\n".join([f"\n{name.upper()} = (", *wrapped_items("    ", written), ")"])
    return text + "\n" if text else ""


def table_data(known: Iterable[PrintedTable]) -> str:
    """Numbers of tables, as arrays of the module."""
    text = ""
    for t in known:
        text += "\n".join([f"\n{t.name} = np.array([", *wrapped_items("    ", [literal(x) for x in t.data]), "])"])
    return text + "\n" if text else ""


def _function(r: Routine, language: Language) -> str:
    names = Identifiers([*keyword.kwlist, "np", "_columns", "_result", *r.results])
    states = names("states")
    symbols: dict[int, str] = {}
    taken: list[str] = []
    given = [names(a.name) for a in r.arguments]
    for a, name in zip(r.arguments, given, strict=True):
        texts = [name] if a.single else [names(f"{name}{k}") for k in range(len(a.nodes))]
        symbols |= {x.index: text for x, text in zip(a.nodes, texts, strict=True)}
        if a.single:
            taken.append(f"{name} = np.asarray({name}, dtype=float)[()]")
        else:
            taken.append(f"{', '.join(texts)}{',' * (len(texts) == 1)} = _columns({name!r}, {name}, {len(texts)})")
    counter = iter(range(1, 10**9))
    temporaries, numbers = statements(language, r.nodes, symbols, lambda: names(f"x{next(counter)}"))
    shapes = [f"{symbols[a.nodes[0].index]}.shape" for a in r.arguments]
    text = [*taken, f"{states} = np.broadcast_shapes({', '.join(shapes)})", 'with np.errstate(all="ignore"):']
    text += [f"    {n} = {e}" for n, e in temporaries]
    at = 0
    for name, array in r.arrays.items():
        begin, own = f"    {name} = _result({states}, {array.shape!r}, [", numbers[at : at + array.size]
        short = begin + ", ".join(own) + "])"
        text += [short] if len(short) < LINE else [begin, *wrapped_items(" " * 8, own), "    ])"]
        at += array.size
    text.append(f"return {', '.join(r.results)}")
    signature = ", ".join(n + _default(a) for n, a in zip(given, r.arguments, strict=True))
    return f"\n\ndef {r.name}({signature}):\n{textwrap.indent(docstring(r, given) + chr(10).join(text), '    ')}\n"


def docstring_escaped(text: str) -> str:
    """Escape text for a docstring."""
    return text.strip().replace("\\", "\\\\").replace('"""', "'''")


def _default(a: Argument) -> str:
    return "" if a.values is None else f"=({''.join(literal(x) + ', ' for x in a.values).strip()})"


def docstring(r: Routine, given: Sequence[str]) -> str:
    """Docstring of a function; ``given`` are the names of its arguments."""
    text = [f'"""{docstring_escaped(r.meaning) or r.name}', "", "Parameters", "----------"]
    for a, name in zip(r.arguments, given, strict=True):
        text.append(f"{name} : float" if a.single else f"{name} : ({len(a.nodes)},) array")
        told = docstring_escaped(", ".join(a.described()))
        text += textwrap.wrap(
            f"{docstring_escaped(a.meaning)}: {told}." if a.meaning else f"{told}.",
            110,
            initial_indent="    ",
            subsequent_indent="    ",
        )
    text += ["", "Returns", "-------"]
    for name, array in r.arrays.items():
        text.append(f"{name} : float" if not array.shape else f"{name} : {array.shape!r} array")
        text += [f"    {r.meanings[name]}"] if name in r.meanings else []
    return "\n".join([*text, "", f"{r.operations} operations.", '"""', ""])


def python_functions(routines: Sequence[Routine], **used: Any) -> dict[str, Any]:
    """The functions themselves, compiled by Python; ``used`` are the mechanism's own Python functions by name."""
    space: dict[str, Any] = {}
    exec(compile(python_module(routines, "Functions of a mechanism."), "<made by flyball>", "exec"), space)
    for name, f in python_functions_of(routines, Identifiers(keyword.kwlist)).values():
        space["use"](**{name: used.get(name, f.python)})
    return {r.name: space[r.name] for r in routines}
