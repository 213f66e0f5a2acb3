"""Numba's slowest spots, taken out while a kernel of ours compiles: the same answers, a fifth less time to wait.

Found by profiling cold compilation. Nearly all of it is Numba's own work in Python, and the most of that was to compare
the same compiler flags option by option, for each call of each function, and to look for variables in numbers, texts
and places of source. Like `link` this leans on internals of Numba and is used where they are as expected (`ways.ours`).
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

from .patched import patched


@contextmanager
def quickly() -> Iterator[None]:
    """Have Numba compare flags and list variables quickly.

    Raises
    ------
    AttributeError
        If Numba's internals are others.
    """
    from numba.core import base, event, ir, lowering, postproc, typeinfer
    from numba.core.targetconfig import TargetConfig
    from numba.core.typing.context import BaseContext
    from numba.core.typing.npydecl import NumpyRulesArrayOperator

    with patched(
        [
            (TargetConfig, "values", lambda _: _values),
            (TargetConfig, "__eq__", lambda _: _equal),
            (TargetConfig, "__hash__", lambda _: _hashed),
            (ir.Inst, "_rec_list_vars", lambda _: _variables_in(ir)),
            (BaseContext, "resolve_function_type", _remembered),
            (postproc.PostProcessor, "run", lambda _: _lifetimes_when_asked(postproc)),
            (NumpyRulesArrayOperator, "generic", _of_arrays),
            (base, "_has_loc", _takes_place),
            (event, "install_timer", lambda _: _untimed(event)),
            (event, "start_event", lambda told: _where_told(event, told)),
            (event, "end_event", lambda told: _where_told(event, told)),
            (typeinfer, "new_error_context", _explained),
            (lowering, "new_error_context", _explained),
        ]
    ):
        yield


@cache
def _defaults(of: Any) -> dict[str, Any]:
    """The default of every option of a class of flags."""
    return {name: option.default for name, option in of.options.items()}


def _values(self: Any) -> dict[str, Any]:
    """Every option with its value."""
    return _defaults(type(self)) | self._values


def _equal(self: Any, other: Any) -> Any:
    """Whether all options are equal; most often nothing but the same ones were set."""
    if self is other:
        return True
    if type(self) is type(other):
        return self._values == other._values or _values(self) == _values(other)
    return self.values() == other.values() if hasattr(other, "options") else NotImplemented


def _hashed(self: Any) -> int:
    """As Numba's: it hashes the names of the options."""
    return _hash_of(type(self))


@cache
def _hash_of(of: Any) -> int:
    return hash(tuple(sorted(of.options)))


def _variables_in(ir: Any) -> Any:
    """``Inst._rec_list_vars``: the variables in a value, and in what it holds, in their order."""
    variable, instruction = ir.Var, ir.Inst
    plain = {int, float, str, bool, type(None), ir.Loc, ir.Const, ir.Global, ir.FreeVar, ir.Arg, ir.Scope}

    def listed(self: Any, value: Any) -> list[Any]:
        if isinstance(value, variable):
            return [value]
        if isinstance(value, instruction):
            return value.list_vars()
        if isinstance(value, dict):
            value = value.values()
        elif not isinstance(value, list | tuple):
            return []
        out = []
        for x in value:
            of = type(x)
            if of is variable:
                out.append(x)
            elif of not in plain:
                out += listed(self, x)
        return out

    return listed


def _remembered(original: Any) -> Any:
    """``BaseContext.resolve_function_type``: a function has one signature for the same types."""
    from numba.core import types
    from numba.core.targetconfig import ConfigStack

    found: dict[Any, Any] = {}
    numbers = types.Number, types.Boolean

    def resolve(self: Any, func: Any, args: Any, kws: Any) -> Any:
        known = func.typing_key if type(func) is types.Function else func
        operator = getattr(known, "__module__", None) == "_operator"
        if kws or not (operator or known is not func):
            return original(self, func, args, kws)
        if operator and (isinstance(args[0], numbers) or getattr(args[0], "is_table", False)):
            args = tuple(types.unliteral(x) for x in args)  # what a number's value is tells nothing of the type
        key = self, func, tuple(args), ConfigStack.top_or_none()
        signature = found.get(key)
        if signature is None:
            signature = original(self, func, args, kws)
            if signature is not None:
                found[key] = signature
        return signature

    return resolve


def _lifetimes_when_asked(postproc: Any) -> Any:
    """``PostProcessor.run``: when variables live is found when asked for, and not after each of eight passes.

    What is alive on entry of a block is asked of generators only; ends of lifetimes where arrays are counted.
    """
    from numba.core.targetconfig import ConfigStack

    original = postproc.PostProcessor.run

    def run(self: Any, emit_dels: bool = False, extend_lifetimes: bool = False) -> None:
        made = self.func_ir
        flags = ConfigStack.top_or_none()
        if made.is_generator or (emit_dels and (flags is None or flags.nrt)):
            original(self, emit_dels, extend_lifetimes)
            return
        made.blocks = postproc.transforms.canonicalize_cfg(made.blocks)
        made.variable_lifetime = postproc.VariableLifetime(made.blocks)
        made.generator_info = None

    return run


def _of_arrays(original: Any) -> Any:
    """``NumpyRulesArrayOperator.generic``: what operators on arrays give; of numbers alone they give nothing."""
    from numba.core import types

    numbers = types.Number, types.Boolean

    def generic(self: Any, args: Any, kws: Any) -> Any:
        return None if all(isinstance(x, numbers) for x in args) else original(self, args, kws)

    return generic


def _takes_place(original: Any) -> Any:
    """``_has_loc``: whether a function has a parameter ``loc``, which functions know without `inspect`."""

    def takes(function: Any) -> bool:
        code = getattr(function, "__code__", None)
        if code is None or hasattr(function, "__wrapped__"):
            return bool(original(function))
        return "loc" in code.co_varnames[: code.co_argcount + code.co_kwonlyargcount]

    return takes


def _untimed(event: Any) -> Any:
    """``install_timer``: no stopwatch for every function, each told of all that those above it do."""

    @contextmanager
    def install(kind: Any, callback: Any) -> Iterator[Any]:
        yield event.TimingListener()

    return install


def _where_told(event: Any, told: Any) -> Any:
    """``start_event``, ``end_event``: events are made for those who listen."""

    def tell(kind: str, *args: Any, **more: Any) -> None:
        if event._registered.get(event._guard_kind(kind)):
            told(kind, *args, **more)

    return tell


def _explained(original: Any) -> Any:
    """``new_error_context``: where an error was, put together when there is one."""

    class Context:
        def __init__(self, *args: Any, **more: Any) -> None:
            self.args, self.more = args, more

        def __enter__(self) -> None:
            pass

        def __exit__(self, kind: Any, error: Any, trace: Any) -> None:
            if error is not None:
                with original(*self.args, **self.more):
                    raise error

    return Context
