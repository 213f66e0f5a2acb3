"""From text in LLVM's language to machine code, and from there to addresses.

No pass of Numba is run. The object code that comes out is what is kept on disk.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import lru_cache

import numpy as np

from ..compiler.layout import DATA, Struct, struct
from ..compiler.machine import LoadedCode, assembled, baseline, llvm, triple
from ..graph.printers.llvm import Module
from ..tables.system import System, Work
from ..tracing.trace import TRACED, traced_arrays
from .linked import ENTRIES, Linked

__all__ = ["Loaded", "assembled", "machine", "module_of", "tables_of"]
ARGUMENTS = "ptr %S, ptr %W, double %t, ptr %a, ptr %b, ptr %c, ptr %d"


@lru_cache(maxsize=1)
def offsets() -> dict[str, int]:
    """Where, from the begin of a `System` or `Work`, the addresses of their arrays' numbers stand [bytes]."""
    return dict(_places(struct(System), "S_", DATA)) | dict(_places(struct(Work), "W_", DATA))


def _places(of: Struct, prefix: str, at: int) -> Iterator[tuple[str, int]]:
    for name, x in of.fields:
        if isinstance(x, Struct):
            yield from _places(x, f"{prefix}{name}_", at + of.offset(name))
        else:
            yield prefix + name, at + of.offset(name)


def module_of(linked: Linked) -> str:
    """The whole module, as text."""
    module = Module(ARGUMENTS, _based)
    for p in linked.procedures:
        module.add(p)
    return str(module)


def _based(base: str) -> list[str]:
    """Lines that leave the address of a base's numbers in ``%base``."""
    if base in ("a", "b", "c", "d"):
        return []
    if base.startswith("C_"):  # one of the tables, whose addresses stand where S does
        at = 8 * _constants().index(base.removeprefix("C_"))
        holder = "S"
    else:
        at, holder = offsets()[base], base[0]
    return [
        f"%at_{base} = getelementptr i8, ptr %{holder}, i64 {at}",
        f"%{base} = load ptr, ptr %at_{base}, !invariant.load !0",
    ]


@lru_cache(maxsize=1)
def _constants() -> list[str]:
    """Names of the arrays whose addresses ``CONSTANTS`` holds, in their order: see `tables_of`."""
    numbers = {name: layout for name, layout in struct(System).fields if name in TRACED}
    fields = {name: [x for x, _ in of.fields] if isinstance(of, Struct) else [] for name, of in numbers.items()}
    return [full for name in TRACED for full in [f"{name}.{x}" for x in fields[name]] or [name]]


@lru_cache(maxsize=1)
def machine() -> str:
    """What the code is for: processor, versions."""
    import llvmlite

    return f"{triple()} {baseline()} {llvmlite.__version__} {llvm().llvm_version_info}"


class Loaded:
    """Machine code in memory, as long as this lives.

    Attributes
    ----------
    addresses : dict of str to int
        Of the procedures; 0 if there is none.
    """

    def __init__(self, code: bytes, laws: Sequence[str] = ()) -> None:
        self._code = LoadedCode(code)
        names = ("CONSTANTS", *ENTRIES[1:-1], *filter(None, laws))
        self.addresses = {name: self._code.address(name) for name in names}


def tables_of(S: System) -> np.ndarray:
    """Addresses of the tables, for ``CONSTANTS``."""
    return np.array([x.ctypes.data for x in traced_arrays(S).values()], np.int64)
