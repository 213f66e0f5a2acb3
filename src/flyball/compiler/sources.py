"""The sources that a kernel is made of: their hash, and formulas that are put together at import.

The hash covers the kernel's file and all that this imports, as far as it holds formulas or constants of theirs; an edit
of what a kernel does not import leaves its code valid.
"""

from __future__ import annotations

import hashlib
import linecache
import math
import re
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import cache
from pathlib import Path
from types import CellType, CodeType, FunctionType, ModuleType
from typing import Any

from .formulas import formula, formula_at

PACKAGE = Path(__file__).parent.parent
COMPILED = (
    "constraints",
    "contact",
    "equations",
    "forces",
    "laws",
    "math",
    "numerics",
    "stepping",
    "tables/system.py",
)
"""Files and folders that hold formulas and kernels, and all constants that these take from elsewhere."""
COMPILER = ("emit.py", "formulas.py", "layout.py", "machine.py", "references.py", "target.py")
"""Files of the compiler that decide what code is made."""
TEXTS: dict[str, str] = {}
"""Sources of formulas that were put together at import (`generated`): module and name -> text."""

_IMPORT = re.compile(r"^[ \t]*from (\.+)([\w.]*) import (\([^)]*\)|[\w ,*]+)", re.MULTILINE)
_SEARCH = re.compile(r"^import pkgutil$", re.MULTILINE)


def compiled_files() -> set[Path]:
    """The source files of `COMPILED`."""
    files: set[Path] = set()
    for name in COMPILED:
        path = PACKAGE / name
        files |= set(path.rglob("*.py")) if path.is_dir() else {path}
    return files


def sources_of(file: Path) -> list[Path]:
    """The source files that a kernel which stands in ``file`` is made of: all, where it is not one of ours."""
    known, seen, todo = compiled_files(), set[Path](), [file, *(Path(__file__).parent / name for name in COMPILER)]
    if not file.is_relative_to(PACKAGE):
        todo += known
    while todo:
        path = todo.pop()
        if path not in seen:
            seen.add(path)
            todo += [p for p in _imported(path) if p in known]
    return sorted(seen)


@cache
def _imported(path: Path) -> frozenset[Path]:
    """Files that a file imports; where it looks for the files of its folder by itself, all of these."""
    text = path.read_text(encoding="utf-8")
    out = set(path.parent.glob("*.py")) if _SEARCH.search(text) else set()
    for dots, module, names in _IMPORT.findall(text):
        base = path.parents[len(dots) - 1].joinpath(*module.split("."))
        if base.is_dir():  # what is named may be files of it, or folders
            named = [base / n for n in re.findall(r"\w+", names)]
            out |= {base / "__init__.py", *(n.with_suffix(".py") for n in named), *(n / "__init__.py" for n in named)}
            out |= set(base.glob("*.py")) if "*" in names else set()
        else:
            out.add(base.with_suffix(".py"))
    return frozenset(p for p in out if p.is_file())


def source_hash(function: Callable[..., Any]) -> str:
    """Hash of every source that a kernel is made of."""
    return _hash(Path(function.__code__.co_filename))


def content(function: Callable[..., Any]) -> str:
    """Hash of a function that is not flyball's: its code, and all that this takes from outside.

    Numbers that it finds outside, such as global constants, are part of its code and of the hash; so are other
    functions. Those of flyball count by their sources.
    """
    digest = hashlib.sha256(f"{sys.implementation.cache_tag} {_hash(Path(__file__))}".encode())
    for part in _parts(function, []):
        digest.update(f"{part}\n".encode())
    return digest.hexdigest()


def twin(function: FunctionType, made: dict[FunctionType, FunctionType]) -> FunctionType:
    """The same function as another object, with what it takes from outside as that is now.

    Numba keeps what it has made of a function, with the numbers that it took from outside then. Functions that are not
    flyball's and that it calls are replaced in the same way, and compiled code may call them.

    Parameters
    ----------
    function : function
    made : dict
        Twins that were made already.
    """
    names = _names(function.__code__)

    def known(value: Any) -> Any:
        if isinstance(value, ModuleType):
            inner = {name: vars(value)[name] for name in names & set(vars(value))}
            new = {name: known(x) for name, x in inner.items() if not isinstance(x, ModuleType)}
            if all(x is inner[name] for name, x in new.items()):
                return value
            module = ModuleType(value.__name__)
            vars(module).update(vars(value) | new)
            return module
        if not isinstance(value, FunctionType) or Path(value.__code__.co_filename).is_relative_to(PACKAGE):
            return value
        return twin(value, made)

    if function in made:
        return made[function]
    scope: dict[str, Any] = {"__builtins__": __builtins__, "__name__": function.__module__}
    cells = tuple(CellType() for _ in function.__closure__ or ())
    new = FunctionType(function.__code__, scope, function.__name__, function.__defaults__, cells or None)
    new.__kwdefaults__ = function.__kwdefaults__
    new.__module__, new.__qualname__ = function.__module__, function.__qualname__
    made[function] = formula(new)
    for name in names & set(function.__globals__):
        scope[name] = known(function.__globals__[name])
    for cell, given in zip(cells, function.__closure__ or (), strict=True):
        with suppress(ValueError):  # not filled yet
            cell.cell_contents = known(given.cell_contents)
    return new


def _parts(x: Any, seen: list[Any]) -> Iterator[str]:
    """Texts that say what compiled code is made of where it uses a value."""
    x = getattr(x, "py_func", x)  # the Python under decorators of Numba
    if isinstance(x, CodeType):
        yield f"{x.co_code.hex()} {x.co_names} {x.co_varnames} {x.co_argcount} {x.co_kwonlyargcount} {x.co_flags}"
        for constant in x.co_consts:
            yield from _parts(constant, seen)
    elif isinstance(x, tuple):
        yield f"{type(x).__name__} {len(x)}"
        for part in x:
            yield from _parts(part, seen)
    elif isinstance(x, float):
        yield f"{type(x).__name__} {float(x).hex()}"
    elif hasattr(x, "tobytes"):
        yield f"{x.dtype} {x.shape} {x.tobytes().hex()}"
    elif not isinstance(x, FunctionType):
        yield (
            repr(x)
            if isinstance(x, bool | int | complex | str | None)
            else f"{getattr(x, '__module__', '')}.{getattr(x, '__qualname__', type(x).__qualname__)}"
        )
    elif any(x is f for f in seen):
        yield f"function {next(k for k, f in enumerate(seen) if x is f)}"
    elif (file := Path(x.__code__.co_filename)).is_relative_to(PACKAGE):
        yield f"{x.__module__}.{x.__qualname__} {_hash(file)}"
    else:
        seen.append(x)
        yield from _parts(x.__code__, seen)
        yield from _parts((x.__defaults__, *(x.__kwdefaults__ or {}).items()), seen)
        for name, value in _outside(x):
            yield name
            yield from _parts(value, seen)


def _outside(function: FunctionType) -> Iterator[tuple[str, Any]]:
    """Names and values that a function finds outside of itself."""
    names = _names(function.__code__)
    for name, cell in zip(function.__code__.co_freevars, function.__closure__ or (), strict=True):
        with suppress(ValueError):  # not filled yet
            yield name, cell.cell_contents
    for name in sorted(names & set(function.__globals__)):
        value = function.__globals__[name]
        yield name, value
        if isinstance(value, ModuleType):
            for attribute in sorted(names & set(vars(value))):
                inner = vars(value)[attribute]
                if not isinstance(inner, ModuleType | type):
                    yield f"{name}.{attribute}", inner


def _names(code: CodeType) -> set[str]:
    """Global names and attributes that code uses, functions inside it included."""
    return set(code.co_names).union(*(_names(c) for c in code.co_consts if isinstance(c, CodeType)))


@cache
def _hash(file: Path) -> str:
    digest = hashlib.sha256()
    files = sources_of(file)
    for path in files:
        digest.update(str(path.relative_to(PACKAGE)).encode() if path.is_relative_to(PACKAGE) else path.name.encode())
        digest.update(path.read_bytes())
    own = {".".join(("flyball", *p.relative_to(PACKAGE).with_suffix("").parts)) for p in files if PACKAGE in p.parents}
    for name, text in sorted(TEXTS.items()):
        if name.rpartition(".")[0] in own:
            digest.update(text.encode())
    return digest.hexdigest()


def generated(home: str, name: str, arguments: str, lines: Sequence[str], names: Mapping[str, Any]) -> Any:
    """A formula with these lines.

    Parameters
    ----------
    home : str
        The module that it belongs to: ``__name__``.
    name, arguments : str
        As in ``def name(arguments)``.
    lines : sequence of str
        The body, without indentation of its own.
    names : mapping
        What the body calls.
    """
    text = "".join([f"def {name}({arguments}):\n", *(f"    {line}\n" for line in lines)])
    file = f"<{home}.{name}>"
    made = dict(names)
    exec(compile(text, file, "exec"), made)
    linecache.cache[file] = (len(text), None, text.splitlines(keepends=True), file)
    TEXTS[f"{home}.{name}"] = text
    return formula(made[name])


def ladder(
    home: str, name: str, arguments: str, cases: Mapping[int, Callable], otherwise: str, form: int | None = None
) -> Any:
    """A formula ``name(kind, arguments)`` that hands on to the one of that kind.

    ``otherwise`` is what an unknown kind answers: nan, so that no element is ever answered by another one's formula.
    Where there is a ``form``, ``kind`` may also be the address of a code table, whose formula of that number is called.
    """
    names: dict[str, Any] = {f"{_plain(f)}_{kind}": f for kind, f in sorted(cases.items())}
    lines = []
    for called, kind in zip(names, sorted(cases), strict=True):
        lines += [f"if kind == {kind}:", f"    return {called}({arguments})"]
    last = otherwise if form is None else f"formula_at(kind, {form}, ({arguments},), {otherwise})"
    names |= {"nan": math.nan, "formula_at": formula_at}
    return generated(home, name, f"kind, {arguments}", [*lines, f"return {last}"], names)


def _plain(f: Callable) -> str:
    return f"{f.__module__.rpartition('.')[2]}_{f.__name__}"
