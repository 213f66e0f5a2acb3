"""Expressions as C99: a source file and its header, which need only the C math library."""

from __future__ import annotations

import json
import re
import textwrap
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from ..graph import Function, nodes_in_order
from .routines import (
    Argument,
    Identifiers,
    Language,
    PrintedTable,
    Routine,
    refuse_python_functions,
    spline_tables,
    statements,
    wrapped_items,
)

KEYWORDS = [
    *("auto", "break", "case", "char", "const", "continue", "default", "do", "double", "else", "enum", "extern"),
    *("float", "for", "goto", "if", "inline", "int", "long", "register", "restrict", "return", "short", "signed"),
    *("sizeof", "static", "struct", "switch", "typedef", "union", "unsigned", "void", "volatile", "while"),
    *("y0", "y1", "yn", "j0", "j1", "jn", "gamma", "main"),  # C library functions that would be hidden
]

FUNCTIONS = {
    **{f: f + "({0})" for f in ("sqrt", "sin", "cos", "tan", "asin", "acos", "atan", "exp", "log")},
    **{f: f + "({0})" for f in ("sinh", "cosh", "tanh")},
    "atan2": "atan2({0}, {1})", "power": "pow({0}, {1})", "absolute": "fabs({0})", "rounded": "floor({0} + 0.5)",
    "sign": "sign({0})", "minimum": "minimum({0}, {1})", "maximum": "maximum({0}, {1})",
    "choose": "({0} > 0.0 ? {1} : {2})",
}  # fmt: skip

HELPERS = {
    "sign": "static double sign(double x)\n{\n    return x != x ? x : (double)((x > 0.0) - (x < 0.0));\n}\n",
    "minimum": "static double minimum(double a, double b)\n{\n    return a <= b || a != a ? a : b;\n}\n",
    "maximum": "static double maximum(double a, double b)\n{\n    return a >= b || a != a ? a : b;\n}\n",
    "spline": """\
/* A derivative of a piecewise cubic: period, count, breaks, and four coefficients a piece. */
static double spline(const double *data, int order, double x)
{
    const int count = (int)data[1];
    const double *breaks = data + 2;
    const double *c;
    double shift = 0.0, s;
    int low = 0, high = count;
    if (data[0] > 0.0)
        shift = data[0] * floor((x - breaks[0]) / data[0]);
    while (low < high) {
        const int middle = (low + high) / 2;
        if (breaks[middle] <= x - shift)
            low = middle + 1;
        else
            high = middle;
    }
    if (low == count && x - shift == breaks[count - 1])
        low = count - 1;
    c = breaks + count + 4 * low;
    s = x - (breaks[low > 0 ? low - 1 : 0] + shift);
    switch (order) {
    case 0:
        return c[0] + s * (c[1] + s * (c[2] + s * c[3]));
    case 1:
        return c[1] + s * (2.0 * c[2] + 3.0 * c[3] * s);
    case 2:
        return 2.0 * c[2] + 6.0 * c[3] * s;
    default:
        return 6.0 * c[3];
    }
}
""",
}


class Sources(NamedTuple):
    """Texts of the two files."""

    source: str
    header: str


def literal(x: float) -> str:
    """A number as text that reads back exactly."""
    return repr(float(x)) if np.isfinite(x) else "NAN" if x != x else "INFINITY" if x > 0.0 else "-INFINITY"


def c_sources(
    routines: Sequence[Routine], name: str, head: str, constants: Mapping[str, Sequence[Any]] | None = None
) -> Sources:
    """Text of a source and its header.

    Parameters
    ----------
    routines : sequence of Routine
    name : str
        Name of the files, and prefix of all names.
    head : str
        Text of the header comment of both.
    constants : mapping, optional
        Name -> numbers or texts: arrays beside the functions.

    Raises
    ------
    ModelError
        If a routine calls a Python function, or takes too many operations.
    """
    refuse_python_functions(routines, "C")
    for r in routines:
        r.check()
    known = spline_tables(routines, Identifiers(KEYWORDS + list(HELPERS)))

    def call(f: Function, args: Sequence[str]) -> str:
        t = known[id(f.details["value"])]
        if not t.moved:
            return f"spline({t.name}, {f.details['order']}, {args[0]})"
        return f"{t.name}_with({f.details['order']}, {args[0]}, (const double[]){{{', '.join(args[1:])}}})"

    language = Language(literal, FUNCTIONS, call)
    told = {f"{name}_{k}": x for k, x in (constants or {}).items() if x}
    body = "\n".join(_function(r, name, language) for r in routines)
    data = "".join(_table(t) for t in known.values())
    helpers = "".join(text + "\n" for f, text in HELPERS.items() if re.search(rf"\b{f}\(", data + body))
    first = f'{_comment(head)}#include "{name}.h"\n\n#include <math.h>\n\n'
    guard = name.upper() + "_H"
    declared = "\n".join(_comment(_description(r)) + _signature(r, name) + ";\n" for r in routines)
    arrays = "".join(_constant(k, x, declared=True) for k, x in told.items()) + "\n" * bool(told)
    header = (
        f"{_comment(head)}#ifndef {guard}\n#define {guard}\n\n"
        f'#ifdef __cplusplus\nextern "C" {{\n#endif\n\n{arrays}{declared}\n#ifdef __cplusplus\n}}\n#endif\n\n#endif\n'
    )
    defined = "".join(_constant(k, x) + "\n" for k, x in told.items())
    return Sources(first + defined + helpers + data + body, header)


def _constant(name: str, items: Sequence[Any], declared: bool = False) -> str:
    """An array of numbers or texts."""
    texts = isinstance(items[0], str)
    kind = f"{'extern ' * declared}const {'char *const' if texts else 'double'} {name}[{len(items)}]"
    if declared:
        return f"{kind};\n"
    written = [json.dumps(x, ensure_ascii=False) if texts else literal(x) for x in items]
    return "\n".join([f"{kind} = {{", *wrapped_items("    ", written), "};\n"])


def _comment(text: str) -> str:
    """A comment of several lines."""
    text = text.strip().replace("*/", "* /").replace("/*", "/ *")
    return "/* " + "\n".join(("   " + x).rstrip() for x in text.splitlines()).lstrip() + " */\n"


def _table(t: PrintedTable) -> str:
    numbers = wrapped_items("    ", [literal(x) for x in t.data])
    text = "\n".join([f"static const double {t.name}[] = {{", *numbers, "};\n\n"])
    if t.moved:
        put = "".join(f"    data[{k}] = moved[{n}];\n" for n, k in enumerate(t.moved))
        text += (
            f"static double {t.name}_with(int order, double x, const double *moved)\n{{\n"
            f"    double data[{len(t.data)}];\n    int k;\n"
            f"    for (k = 0; k < {len(t.data)}; k++)\n        data[k] = {t.name}[k];\n{put}"
            "    return spline(data, order, x);\n}\n\n"
        )
    return text


def _argument_names(r: Routine) -> list[str]:
    """Names of arguments and results."""
    names = Identifiers(KEYWORDS + list(HELPERS))
    return [names(x) for x in (*(a.name for a in r.arguments), *r.results)]


def _signature(r: Routine, prefix: str) -> str:
    given = _argument_names(r)
    parts = [f"{'double ' if a.single else 'const double *'}{n}" for a, n in zip(r.arguments, given)]
    parts += [f"double *{n}" for n in given[len(r.arguments) :]]
    return textwrap.fill(f"void {prefix}_{r.name}({', '.join(parts)})", 110, subsequent_indent="    ")


def _function(r: Routine, prefix: str, language: Language) -> str:
    given = _argument_names(r)
    names = Identifiers([*KEYWORDS, *HELPERS, *given])
    symbols: dict[int, str] = {}
    for a, name in zip(r.arguments, given):
        symbols |= {x.index: name if a.single else f"{name}[{k}]" for k, x in enumerate(a.nodes)}
    counter = iter(range(1, 10**9))
    temporaries, numbers = statements(language, r.nodes, symbols, lambda: names(f"x{next(counter)}"))
    text = [f"    const double {n} = {e};" for n, e in temporaries]
    used = {x.index for x in nodes_in_order(r.nodes)}
    for a, name in zip(r.arguments, given):
        if not any(x.index in used for x in a.nodes):
            text.append(f"    (void){name};")
    at = 0
    for name, array in zip(given[len(r.arguments) :], r.arrays.values()):
        text += [f"    {name}[{k}] = {e};" for k, e in enumerate(numbers[at : at + array.size])]
        if not array.size:
            text.append(f"    (void){name};")
        at += array.size
    return f"{_signature(r, prefix)}\n{{\n" + "\n".join(text) + "\n}\n"


def _description(r: Routine) -> str:
    """Description of the arguments and results of a function."""
    text = [r.meaning or r.name]
    given = _argument_names(r)
    for a, name in zip(r.arguments, given):
        text += _wrapped_lines(f"  {name}{_size(a)}: ", f"{a.meaning}: " * bool(a.meaning) + ", ".join(a.described()))
    for name, (result, array) in zip(given[len(r.arguments) :], r.arrays.items()):
        size = "".join(f"[{n}]" for n in array.shape) or "[1]"
        text += _wrapped_lines(f"  {name}{size}: ", r.meanings.get(result, "") + ", row by row" * (array.ndim > 1))
    return "\n".join([*text, f"{r.operations} operations. Results must not overlap arguments."])


def _size(a: Argument) -> str:
    return "" if a.single else f"[{len(a.nodes)}]"


def _wrapped_lines(first: str, text: str) -> list[str]:
    return textwrap.wrap(text, 105, initial_indent=first, subsequent_indent="      ") or [first.rstrip(": ")]
