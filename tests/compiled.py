"""Formulas compiled for the arguments that a test gives them."""

from __future__ import annotations

import copy
import functools

import numpy as np

from flyball.compiler.formulas import formula
from flyball.compiler.kernels import kernel

KINDS = {"float64": "Float", "complex128": "Complex", "int64": "Int", "int32": "Short"}


def compiled(function):
    """``function`` compiled, called with numbers, tuples of numbers, arrays and named tuples; it returns such numbers."""
    formula(function)
    made = {}

    @functools.wraps(function)
    def call(*args):
        key = tuple(map(_kind, args))
        if key not in made:
            made[key] = _kernel(function, args, function(*copy.deepcopy(args)))
        entry, result = made[key]
        out = np.zeros(np.size(result) if result is not None else 1, complex)
        entry(*(np.atleast_1d(x) if isinstance(x, complex | np.complexfloating) or _plain(x) else x for x in args), out)
        found = [complex(x) if isinstance(y, complex | np.complexfloating) else type(y)(x.real)
                 for x, y in zip(out, np.atleast_1d(result).tolist() if result is not None else [], strict=False)]  # fmt: skip
        return None if result is None else tuple(found) if isinstance(result, tuple) else found[0]

    call.function = function
    return call


def _plain(x):
    return isinstance(x, tuple) and not hasattr(x, "_fields")


def _kind(x):
    if isinstance(x, np.ndarray):
        return str(x.dtype), x.ndim
    return (_kind(np.array(x)), len(x)) if _plain(x) else type(x)


def _kernel(function, args, result):
    """A kernel of such arguments that puts what the function returns into its last one."""
    scope, heads, given = {"function": function}, [], []
    for k, x in enumerate(args):
        if hasattr(x, "_fields"):
            scope[type(x).__name__] = type(x)
            annotation, use = type(x).__name__, f"a{k}"
        elif isinstance(x, np.ndarray):
            annotation, use = f"{KINDS[str(x.dtype)]}{x.ndim}", f"a{k}"
        elif _plain(x):
            annotation = f"{KINDS[str(np.array(x).dtype)]}1"
            use = f"({', '.join(f'a{k}[{i}]' for i in range(len(x)))},)"
        elif isinstance(x, complex | np.complexfloating):
            annotation, use = "Complex1", f"a{k}[0]"
        else:
            annotation, use = ("int" if isinstance(x, int | np.integer) else "float"), f"a{k}"
        heads.append(f"a{k}: {annotation}")
        given.append(use)
    lines = [f"    r = function({', '.join(given)})"]
    if isinstance(result, tuple):
        lines += [f"    out[{i}] = r[{i}]" for i in range(len(result))]
    elif result is not None:
        lines.append("    out[0] = r")
    sizes = "_".join(str(len(x)) if _plain(x) else "" for x in args)
    name = f"{function.__module__}.{function.__qualname__}_{sizes}".replace(".", "_").replace("<", "").replace(">", "")
    text = "\n".join([f"def {name}({', '.join(heads)}, out: Complex1) -> int:", *lines, "    return 0"])
    exec(compile(text, function.__code__.co_filename, "exec"), scope)
    return kernel(scope[name]), result
