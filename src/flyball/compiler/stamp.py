"""What a cached kernel must agree with: a hash of every source file that it is made of.

Numba's own cache looks at the file of the kernel only, and silently serves old code after an edit of a callee
elsewhere. Here the stamp covers the kernel's file and all that this imports, as far as it holds formulas or constants
of theirs; an edit of what one kernel does not import leaves its code in the cache.
"""

from __future__ import annotations

import hashlib
import re
from functools import cache
from pathlib import Path

PACKAGE = Path(__file__).parent.parent
COMPILED = (
    "compiler",
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
TEXTS: dict[str, str] = {}
"""Sources of formulas that were put together at import (`written`): module and name -> text."""

_IMPORT = re.compile(r"^[ \t]*from (\.+)([\w.]*) import (\([^)]*\)|[\w ,*]+)", re.MULTILINE)
_SEARCH = re.compile(r"^import pkgutil$", re.MULTILINE)


def compiled_files() -> set[Path]:
    """The source files of `COMPILED`."""
    files: set[Path] = set()
    for name in COMPILED:
        path = PACKAGE / name
        files |= set(path.rglob("*.py")) if path.is_dir() else {path}
    return files


def stamped(file: Path) -> list[Path]:
    """The source files that a kernel which stands in ``file`` is made of: all, where it is not one of ours."""
    known, seen, todo = compiled_files(), set[Path](), [file, *Path(__file__).parent.glob("*.py")]
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


@cache
def source_stamp(file: Path) -> str:
    """Hash of every source that a kernel which stands in ``file`` is made of."""
    digest = hashlib.sha256()
    files = stamped(file)
    for path in files:
        digest.update(str(path.relative_to(PACKAGE)).encode() if path.is_relative_to(PACKAGE) else path.name.encode())
        digest.update(path.read_bytes())
    own = {".".join(("flyball", *p.relative_to(PACKAGE).with_suffix("").parts)) for p in files if PACKAGE in p.parents}
    for name, text in sorted(TEXTS.items()):
        if name.rpartition(".")[0] in own:
            digest.update(text.encode())
    return digest.hexdigest()
