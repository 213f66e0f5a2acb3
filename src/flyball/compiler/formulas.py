"""Formulas: plain Python code that compiled code may call, and the sources that compiled code is made of.

``@formula`` marks a formula. The function itself stays plain Python, so the same source runs on floats, complex
numbers, arrays over time and symbols. It is registered with the compiler when something is compiled (`object_code`),
and never before: describing and checking a mechanism does not load a compiler.

The hash of a kernel's sources covers its file and all files that this imports, as far as they contain formulas or their
constants. An edit of a file that a kernel does not import leaves its code valid.
"""

from __future__ import annotations

import hashlib
import linecache
import math
import re
import sys
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import cache
from pathlib import Path
from types import CellType, CodeType, FunctionType, ModuleType
from typing import Any, TypeVar
from weakref import WeakSet, WeakValueDictionary

F = TypeVar("F", bound=Callable[..., Any])

OPTIONS: dict[str, Any] = {"error_model": "numpy", "_nrt": False}  # division as in C; no memory allocation
LOCK = threading.RLock()
ENTRY_NAME = "flyball_kernel"  # the name of a kernel's entry point in its object
FAILED = -(2**63)  # result of a kernel if one of its formulas raised an error
KERNELS: list[Any] = []  # every `kernels.Kernel`
FIRST_ADDRESS = 1 << 16
"""Smallest possible address of a code table; the numbers of the kinds of built-in elements are smaller."""
CODE_TABLES: WeakValueDictionary[int, Any] = WeakValueDictionary()
"""The `kernels.CodeTable` at an address, as long as it exists."""
_formulas: list[Callable[..., Any]] = []
_marked: WeakSet[Callable[..., Any]] = WeakSet()
_callbacks: list[Callable[[], None]] = []
_numba_overload: list[Any] = []  # `numba_target.overload`, once something is compiled


def formula(function: F) -> F:
    """Let compiled code call ``function``; the function itself stays plain Python and accepts any numbers."""
    _formulas.append(function)
    _marked.add(function)
    _register_waiting()
    return function


def when_compiling(callback: Callable[[], None]) -> Callable[[], None]:
    """Run ``callback`` once before anything is compiled (at once if something was)."""
    _callbacks.append(callback)
    _register_waiting()
    return callback


def register_all(overload: Any) -> None:
    """Register every formula with the compiler, including later ones, by ``target.overload``."""
    _numba_overload[:] = [overload]
    _register_waiting()


def _register_waiting() -> None:
    if _numba_overload:
        with LOCK:
            while _formulas:
                _make_callable(_formulas.pop(0))
            while _callbacks:
                _callbacks.pop(0)()


def _make_callable(function: Callable[..., Any]) -> None:
    _numba_overload[0](function, strict=False)(lambda *args, **more: function)


def by_address(fields):  # type: ignore[no-untyped-def]
    """Pass the named tuple by its address in compiled code; return the tuple itself in plain Python."""
    return fields


def call(address, A, B, C, D, E, task):  # type: ignore[no-untyped-def]
    """Call the kernel at ``address`` with five structures and a task; in compiled code only."""
    raise NotImplementedError("kernels are called by address from compiled code only")


def call_bound(words, task):  # type: ignore[no-untyped-def]
    """Call a kernel with structures bound to it (`kernels.BoundKernel.words`); in compiled code only."""
    raise NotImplementedError("kernels are called by address from compiled code only")


STORED_CALL_TABLES = 24
STORED_CALL_WORDS = 2 + STORED_CALL_TABLES
"""Size of a stored call: address of the code, number of structures, their addresses."""


def store_call(words, address, tables):  # type: ignore[no-untyped-def]
    """Store a call of the kernel at ``address`` with a tuple of structures in memory; in compiled code only."""
    raise NotImplementedError("kernels are called by address from compiled code only")


def run_stored_call(words, task):  # type: ignore[no-untyped-def]
    """Make a stored call with a task; in compiled code only.

    It passes `STORED_CALL_TABLES` arguments; in C's calling conventions a function ignores those that it does not take.
    """
    raise NotImplementedError("kernels are called by address from compiled code only")


def atomic_load(address):  # type: ignore[no-untyped-def]
    """Integer in memory; what another thread wrote before it stored that number is visible afterwards."""
    raise NotImplementedError("memory is shared with threads in compiled code only")


def atomic_store(address, value):  # type: ignore[no-untyped-def]
    """Store an integer in memory, after all that was written before."""
    raise NotImplementedError("memory is shared with threads in compiled code only")


def atomic_add(address, value):  # type: ignore[no-untyped-def]
    """Add to an integer in memory, indivisibly."""
    raise NotImplementedError("memory is shared with threads in compiled code only")


def atomic_replace(address, old, new):  # type: ignore[no-untyped-def]
    """Replace an integer in memory if it is ``old``, indivisibly; whether it was."""
    raise NotImplementedError("memory is shared with threads in compiled code only")


def formula_at(table, k, arguments, like):  # type: ignore[no-untyped-def]
    """Call formula k of the code table at an address.

    Compiled code calls the formula's code, plain Python the function itself.

    Parameters
    ----------
    table : int
        Address of a `kernels.CodeTable`; for any other number the result is ``like``.
    k : int
    arguments : tuple
    like : number or tuple
        The result without such a table; it has the type of every result.
    """
    found = CODE_TABLES.get(int(table))
    return like if found is None else found.functions[k](*arguments)


def has_formula(table, k):  # type: ignore[no-untyped-def]
    """Whether there is a code table at an address, with formula k in it."""
    found = CODE_TABLES.get(int(table))
    return found is not None and found.functions[k] is not None


PACKAGE = Path(__file__).parent.parent
COMPILED = (
    "collision",
    "constraints",
    "engine",
    "forces",
    "laws",
    "math",
    "numerics",
    "simulation/impulse_stepping",
    "tables/table_definitions.py",
)
"""Files and folders that contain formulas and kernels, and all constants that these use."""
COMPILER = ("formulas.py", "kernels.py", "numba_target.py", "numba_types.py", "object_code.py", "struct_layout.py")
"""Files of the compiler that determine the code."""
GENERATED_SOURCES: dict[str, str] = {}
"""Sources of formulas that were generated at import (`generated_formula`): module and name -> text."""

_IMPORT = re.compile(r"^[ \t]*from (\.+)([\w.]*) import (\([^)]*\)|[\w ,*]+)", re.MULTILINE)
_FOLDER_SEARCH = re.compile(r"^import pkgutil$", re.MULTILINE)


def compiled_files() -> set[Path]:
    """The source files of `COMPILED`."""
    files: set[Path] = set()
    for name in COMPILED:
        path = PACKAGE / name
        files |= set(path.rglob("*.py")) if path.is_dir() else {path}
    return files


def sources_of(file: Path) -> list[Path]:
    """Source files of a kernel in ``file``: all of them if it is not a file of flyball."""
    known, seen, todo = compiled_files(), set[Path](), [file, *(Path(__file__).parent / name for name in COMPILER)]
    if not file.is_relative_to(PACKAGE):
        todo += known
    while todo:
        path = todo.pop()
        if path not in seen:
            seen.add(path)
            todo += [p for p in _imported_files(path) if p in known]
    return sorted(seen)


@cache
def _imported_files(path: Path) -> frozenset[Path]:
    """Files that a file imports; all files of its folder if it searches that itself."""
    text = path.read_text(encoding="utf-8")
    out = set(path.parent.glob("*.py")) if _FOLDER_SEARCH.search(text) else set()
    for dots, module, names in _IMPORT.findall(text):
        base = path.parents[len(dots) - 1].joinpath(*module.split("."))
        if base.is_dir():  # the names may be files or folders in it
            named = [base / n for n in re.findall(r"\w+", names)]
            out |= {base / "__init__.py", *(n.with_suffix(".py") for n in named), *(n / "__init__.py" for n in named)}
            out |= set(base.glob("*.py")) if "*" in names else set()
        else:
            out.add(base.with_suffix(".py"))
    return frozenset(p for p in out if p.is_file())


def source_hash(function: Callable[..., Any]) -> str:
    """Hash of all sources of a kernel."""
    return _sources_hash(Path(function.__code__.co_filename))


def content_hash(function: Callable[..., Any]) -> str:
    """Hash of a function outside flyball: its code, and everything it reads from outside.

    Numbers that it reads from outside, such as global constants, are part of its code and of the hash; so are other
    functions. Functions of flyball are covered by the hash of their sources.
    """
    digest = hashlib.sha256(f"{sys.implementation.cache_tag} {_sources_hash(Path(__file__))}".encode())
    for part in _content_parts(function, []):
        digest.update(f"{part}\n".encode())
    return digest.hexdigest()


def fresh_copy(function: FunctionType, copies: dict[FunctionType, FunctionType]) -> FunctionType:
    """Copy of a function with the present values of what it reads from outside.

    Numba caches the compiled function with the outside numbers of that time. Functions outside flyball that it calls
    are replaced in the same way, and compiled code may call them.

    Parameters
    ----------
    function : function
    copies : dict
        Copies made already.
    """
    names = _used_names(function.__code__)

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
        return fresh_copy(value, copies)

    if function in copies:
        return copies[function]
    scope: dict[str, Any] = {"__builtins__": __builtins__, "__name__": function.__module__}
    cells = tuple(CellType() for _ in function.__closure__ or ())
    new = FunctionType(function.__code__, scope, function.__name__, function.__defaults__, cells or None)
    new.__kwdefaults__ = function.__kwdefaults__
    new.__module__, new.__qualname__ = function.__module__, function.__qualname__
    copies[function] = formula(new)
    for name in names & set(function.__globals__):
        scope[name] = known(function.__globals__[name])
    for cell, given in zip(cells, function.__closure__ or (), strict=True):
        with suppress(ValueError):  # an empty cell
            cell.cell_contents = known(given.cell_contents)
    return new


def _content_parts(x: Any, visited: list[Any]) -> Iterator[str]:
    """Texts that identify the code that a value contributes to compiled code."""
    x = getattr(x, "py_func", x)  # the Python function under Numba's decorators
    if isinstance(x, CodeType):
        yield f"{x.co_code.hex()} {x.co_names} {x.co_varnames} {x.co_argcount} {x.co_kwonlyargcount} {x.co_flags}"
        for constant in x.co_consts:
            yield from _content_parts(constant, visited)
    elif isinstance(x, tuple):
        yield f"{type(x).__name__} {len(x)}"
        for part in x:
            yield from _content_parts(part, visited)
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
    elif any(x is f for f in visited):
        yield f"function {next(k for k, f in enumerate(visited) if x is f)}"
    elif (file := Path(x.__code__.co_filename)).is_relative_to(PACKAGE):
        yield f"{x.__module__}.{x.__qualname__} {_sources_hash(file)}"
    else:
        visited.append(x)
        yield from _content_parts(x.__code__, visited)
        yield from _content_parts((x.__defaults__, *(x.__kwdefaults__ or {}).items()), visited)
        for name, value in _external_values(x):
            yield name
            yield from _content_parts(value, visited)


def _external_values(function: FunctionType) -> Iterator[tuple[str, Any]]:
    """Names and values that a function reads from outside."""
    names = _used_names(function.__code__)
    for name, cell in zip(function.__code__.co_freevars, function.__closure__ or (), strict=True):
        with suppress(ValueError):  # an empty cell
            yield name, cell.cell_contents
    for name in sorted(names & set(function.__globals__)):
        value = function.__globals__[name]
        yield name, value
        if isinstance(value, ModuleType):
            for attribute in sorted(names & set(vars(value))):
                inner = vars(value)[attribute]
                if not isinstance(inner, ModuleType | type):
                    yield f"{name}.{attribute}", inner


def _used_names(code: CodeType) -> set[str]:
    """Global names and attributes that code uses, including nested functions."""
    return set(code.co_names).union(*(_used_names(c) for c in code.co_consts if isinstance(c, CodeType)))


@cache
def _sources_hash(file: Path) -> str:
    digest = hashlib.sha256()
    files = sources_of(file)
    for path in files:
        digest.update(str(path.relative_to(PACKAGE)).encode() if path.is_relative_to(PACKAGE) else path.name.encode())
        digest.update(path.read_bytes())
    own = {".".join(("flyball", *p.relative_to(PACKAGE).with_suffix("").parts)) for p in files if PACKAGE in p.parents}
    for name, text in sorted(GENERATED_SOURCES.items()):
        if name.rpartition(".")[0] in own:
            digest.update(text.encode())
    return digest.hexdigest()


def generated_formula(home: str, name: str, arguments: str, lines: Sequence[str], names: Mapping[str, Any]) -> Any:
    """Formula with the given lines.

    Parameters
    ----------
    home : str
        The module that it belongs to: ``__name__``.
    name, arguments : str
        As in ``def name(arguments)``.
    lines : sequence of str
        The body, without indentation of its own.
    names : mapping
        Names that the body uses.
    """
    text = "".join([f"def {name}({arguments}):\n", *(f"    {line}\n" for line in lines)])
    file = f"<{home}.{name}>"
    made = dict(names)
    exec(compile(text, file, "exec"), made)
    linecache.cache[file] = (len(text), None, text.splitlines(keepends=True), file)
    GENERATED_SOURCES[f"{home}.{name}"] = text
    return formula(made[name])


def dispatch_by_kind(
    home: str,
    name: str,
    arguments: str,
    cases: Mapping[int, Callable],
    otherwise: str,
    form: int | None = None,
    more: str = "",
) -> Any:
    """Formula ``name(kind, arguments)`` that calls the formula of that kind.

    ``otherwise`` is the result for an unknown kind: nan, so that the formula of another element is never used. With a
    ``form``, ``kind`` may also be the address of a code table, whose formula of that number is called. ``more`` names a
    last argument that only formulas with one argument more are given.
    """
    if unmarked := [f"{f.__module__}.{f.__name__}" for f in cases.values() if f not in _marked]:
        raise RuntimeError(f"compiled code cannot call {', '.join(unmarked)}: put the decorator @formula above it")
    names: dict[str, Any] = {f"{_formula_name(f)}_{kind}": f for kind, f in sorted(cases.items())}
    lines = []
    for called, kind in zip(names, sorted(cases), strict=True):
        given = f"{arguments}, {more}" if _takes(cases[kind], arguments, more) else arguments
        lines += [f"if kind == {kind}:", f"    return {called}({given})"]
    last = otherwise if form is None else f"formula_at(kind, {form}, ({arguments},), {otherwise})"
    names |= {"nan": math.nan, "formula_at": formula_at}
    every = f"kind, {arguments}, {more}" if more else f"kind, {arguments}"
    return generated_formula(home, name, every, [*lines, f"return {last}"], names)


def _takes(f: Callable, arguments: str, more: str) -> bool:
    return bool(more) and f.__code__.co_argcount > len(arguments.split(","))


def _formula_name(f: Callable) -> str:
    return f"{f.__module__.rpartition('.')[2]}_{f.__name__}"
