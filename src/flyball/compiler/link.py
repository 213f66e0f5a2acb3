"""Compile a kernel's callees once: link all of them into the kernel, and optimise the whole.

Numba links, optimises and emits every callee as a library of its own, then again inside each of its callers, level by
level. A kernel of ours takes in some hundred small formulas and is optimised as a whole anyway, so while one compiles
its callees are only translated; the kernel then links them all and is optimised and emitted. The code is the same in
kind and cold compilation several times faster. This leans on internals of Numba; where they are not as expected
(`ways.ours`), compilation takes the usual, slower way.
"""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any


@contextmanager
def linked_as_a_whole(top: str) -> Iterator[None]:
    """While the kernel with the (unique) name ``top`` compiles, leave all optimisation and emission to it.

    Raises
    ------
    AttributeError
        If Numba's internals are others.
    """
    from numba.core import codegen

    library, target = codegen.CPUCodeLibrary, codegen.JITCPUCodegen
    finalize, functions, set_env = library.finalize, library._optimize_functions, target.set_env

    def finalize_top(self: Any) -> None:
        if self.name == top:
            _link_all(self)
        else:
            self._finalize_dynamic_globals()
            self._finalized = True
            # should other code ever link this callee, it has to bring its own callees along
            self._get_module_for_linking = lambda: _with_callees(self, library._get_module_for_linking)

    def functions_top(self: Any, module: Any) -> None:
        if self.name == top:
            functions(self, module)

    def set_env_top(self: Any, name: str, env: Any) -> None:
        if self._engine.get_global_value_address(name):
            set_env(self, name, env)

    library.finalize, library._optimize_functions, target.set_env = finalize_top, functions_top, set_env_top
    collecting = gc.isenabled()
    gc.disable()  # millions of small objects, hardly any garbage: looking for it takes a fifth of the time
    try:
        yield
    finally:
        if collecting:
            gc.enable()
        library.finalize, library._optimize_functions, target.set_env = finalize, functions, set_env


def _link_all(self: Any) -> None:
    """Finalise the kernel's library: take in every library that it needs, however deep, and optimise once."""
    from llvmlite import binding

    seen: dict[int, Any] = {}
    todo = list(self._linking_libraries)
    while todo:
        lib = todo.pop()
        if id(lib) not in seen:
            seen[id(lib)] = lib
            todo += lib._linking_libraries
    for lib in seen.values():
        if hasattr(lib, "_reload_init"):  # since 0.63
            self._reload_init.update(lib._reload_init)
        self._final_module.link_in(_shared(lib), preserve=False)
    for function in self._final_module.functions:
        # nobody outside calls them: the optimiser may inline them, and drop arguments that they do not use
        if not function.is_declaration and function.linkage == binding.Linkage.linkonce_odr:
            function.linkage = "internal"
    # without vectorisation at level 1: measured, the same speed as Numba's choice, and seconds less to wait
    full, builder = self._codegen._module_pass_manager(loop_vectorize=False, slp_vectorize=False, opt=1)
    full.run(self._final_module, builder)
    self._final_module.verify()
    self._finalize_final_module()


def _shared(lib: Any) -> Any:
    """The library's own functions, marked so that several definitions may meet and unused ones may go."""
    from llvmlite import binding

    module = lib._final_module.clone()
    for function in module.functions:
        if not function.is_declaration and function.linkage == binding.Linkage.external:
            function.linkage = "linkonce_odr"
    return module


def _with_callees(lib: Any, original: Any) -> Any:
    """What Numba's own linking expects: the library together with all that it calls."""
    if lib._shared_module is None:
        for callee in lib._linking_libraries:
            lib._final_module.link_in(callee._get_module_for_linking(), preserve=True)
    return original(lib)
