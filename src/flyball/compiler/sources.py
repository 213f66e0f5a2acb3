"""The sources that a kernel is made of: their hash, and formulas that are put together at import.

The hash covers the kernel's file and all that this imports, as far as it holds formulas or constants of theirs; an edit
of what a kernel does not import leaves its code valid.
"""

from __future__ import annotations

import hashlib
import linecache
import math
import re
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

from .formulas import formula

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


def ladder(home: str, name: str, arguments: str, cases: Mapping[int, Callable], otherwise: str) -> Any:
    """A formula ``name(kind, arguments)`` that hands on to the one of that kind.

    ``otherwise`` is what an unknown kind answers: nan, so that no element is ever answered by another one's formula.
    """
    names: dict[str, Any] = {f"{_plain(f)}_{kind}": f for kind, f in sorted(cases.items())}
    lines = []
    for called, kind in zip(names, sorted(cases), strict=True):
        lines += [f"if kind == {kind}:", f"    return {called}({arguments})"]
    return generated(home, name, f"kind, {arguments}", [*lines, f"return {otherwise}"], names | {"nan": math.nan})


def _plain(f: Callable) -> str:
    return f"{f.__module__.rpartition('.')[2]}_{f.__name__}"
