"""Formulas of a kernel hand over what the callee uses, and look at how a call ended only where it can have failed.

Numba takes every tuple apart into numbers at a call, and the callee puts it together again: a record of a frame and its
motion is 24 numbers. That was half of all code before optimisation; the optimiser takes it out where a callee is put in
its caller's place, which is nearly everywhere. So a formula is translated with its tuples whole, and then told which of
their members it uses; callers hand these over (`parted`), as single numbers. What is called so is known by its name, so
that kernels, callbacks and what Numba itself compiles are called as ever.
"""

from __future__ import annotations

from typing import Any

_WHOLE: dict[str, _Whole] = {}  # functions, by their names in LLVM, that get tuples whole, and how
_SOUND: set[str] = set()  # those, and others, that were translated here and return no error
_FAILING: set[str] = set()  # those that may
_CALLING_THEMSELVES: set[str] = set()


def noted(original: Any) -> Any:
    """``_return_errcode_raw``: which functions may end in an error."""
    from numba.core import callconv

    fine = callconv.RETCODE_OK, callconv.RETCODE_NONE

    def end(self: Any, builder: Any, code: Any) -> None:
        if not any(code is x for x in fine):
            _FAILING.add(builder.function.name)
        original(self, builder, code)

    return end


def remembered(original: Any) -> Any:
    """``lower_normal_function``: how a function is to be called, and whether it can end in an error."""

    def lower(self: Any, fndesc: Any) -> None:
        if self.flags.no_cpython_wrapper and self.flags.no_cfunc_wrapper and _is_formula(fndesc):
            _WHOLE[fndesc.mangled_name] = _Whole(self.context, fndesc.argtypes)
        original(self, fndesc)
        if self.function.name not in _FAILING:
            _SOUND.add(self.function.name)

    return lower


def _is_formula(fndesc: Any) -> bool:
    """Whether it is called by what we compile only: what Numba compiles for itself may be called by others later."""
    return fndesc.modname.partition(".")[0] in ("flyball", "<dynamic>")


def declared(original: Any) -> Any:
    """``declare_function``."""

    def declare(self: Any, module: Any, fndesc: Any) -> Any:
        return _declared(self, module, fndesc) if fndesc.mangled_name in _WHOLE else original(self, module, fndesc)

    return declare


def decoded(original: Any) -> Any:
    """``decode_arguments``."""

    def decode(self: Any, builder: Any, argtypes: Any, func: Any) -> Any:
        if func.name not in _WHOLE:
            return original(self, builder, argtypes, func)
        return _WHOLE[func.name].from_arguments(builder, self.get_arguments(func))

    return decode


def called(original: Any) -> Any:
    """``user_function``: a call; how it ended is looked at where it may have failed."""
    from numba.core import cgutils, imputils, types

    def user_function(fndesc: Any, libs: Any) -> Any:
        usual, name = original(fndesc, libs), fndesc.mangled_name
        whole = name in _WHOLE
        sure = name in _SOUND and not isinstance(fndesc.restype, types.Optional)

        def imp(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            if sure:
                return _surely(context, builder, fndesc, args)
            if not whole:
                return usual(context, builder, sig, args)
            conv = _conv(context, fndesc)
            function = _declared(context, builder.module, fndesc)
            status, found = conv.call_function(builder, function, fndesc.restype, fndesc.argtypes, args)
            with cgutils.if_unlikely(builder, status.is_error):
                conv.return_status_propagate(builder, status)
            return imputils.fix_returning_optional(context, builder, sig, status, found)

        imp.signature, imp.libs = usual.signature, usual.libs
        return imp

    return user_function


def _surely(context: Any, builder: Any, fndesc: Any, args: Any) -> Any:
    """Call what cannot fail."""
    whole = fndesc.mangled_name in _WHOLE
    function = _declared(context, builder.module, fndesc) if whole else context.declare_function(builder.module, fndesc)
    packer = _WHOLE[fndesc.mangled_name] if whole else context.get_arg_packer(fndesc.argtypes)
    place, error = function.args[0].type, function.args[1].type
    found = room(builder, place.pointee)
    builder.call(function, [found, error(None), *packer.as_arguments(builder, args)])
    return context.get_returned_value(builder, fndesc.restype, builder.load(found))


def room(builder: Any, of: Any, name: str = "") -> Any:
    """Room on the stack, with nothing in it."""
    with builder.goto_entry_block():
        return builder.alloca(of, name=name)


def _declared(context: Any, module: Any, fndesc: Any) -> Any:
    """The function in a module, as it is called: with tuples whole."""
    function = module.globals.get(fndesc.mangled_name)
    if function is not None and function.blocks:
        _CALLING_THEMSELVES.add(fndesc.mangled_name)
    if function is None:
        from llvmlite import ir

        conv = _conv(context, fndesc)
        function = ir.Function(module, conv.get_function_type(fndesc.restype, fndesc.argtypes), fndesc.mangled_name)
        conv.decorate_function(function, fndesc.args, fndesc.argtypes, noalias=fndesc.noalias)
        if fndesc.inline:
            function.attributes.add("alwaysinline")
    return function


def _conv(context: Any, fndesc: Any) -> Any:
    """Numba's convention of calls but for how arguments are passed."""
    conv = context.call_conv  # made for this use
    conv._get_arg_packer = lambda _: _WHOLE[fndesc.mangled_name]
    return conv


class _Whole:
    """As Numba's ``ArgPacker``: arguments of Numba's types as LLVM's, tuples as one or as those members that are used.

    While a function is translated it has its tuples whole; ``parted`` says what callers hand over.
    """

    def __init__(self, context: Any, argtypes: Any) -> None:
        self.models = [context.data_model_manager[x] for x in argtypes]
        self.passed = [_is_passed(m.get_argument_type()) for m in self.models]
        given = zip(self.models, self.passed, strict=True)
        self.argument_types = tuple(m.get_value_type() for m, passed in given if passed)
        self.paths: list[Any] = [((),)] * len(self.argument_types)  # of each argument, what of it is handed over

    def as_arguments(self, builder: Any, values: Any) -> list[Any]:
        given = [x for x, passed in zip(values, self.passed, strict=True) if passed]
        out = []
        for value, paths in zip(given, self.paths, strict=True):
            for path in paths:
                x = value
                for k in path:
                    x = builder.extract_value(x, k)
                out.append(x)
        return out

    def from_arguments(self, builder: Any, args: Any) -> list[Any]:
        given = iter(args)
        for x in args:
            x.from_argument = True  # for who takes it apart
        return [
            next(given) if passed else m.from_argument(builder, m.get_argument_type())
            for m, passed in zip(self.models, self.passed, strict=True)
        ]

    def assign_names(self, args: Any, names: Any) -> None:
        if len(args) < len(self.paths) or any(x != ((),) for x in self.paths):
            return
        given = [name for passed, name in zip(self.passed, names, strict=True) if passed]
        for x, name in zip(args, given, strict=True):
            x.name = name


def _is_passed(of: Any) -> bool:
    """Whether there is anything in it."""
    return not isinstance(of, tuple) or any(_is_passed(x) for x in of)


class _Leaf:
    """An argument in place of the instruction that took it out of a tuple: under its name."""

    def __init__(self, taken: Any) -> None:
        self.type, self.taken = taken.type, taken

    def __str__(self) -> str:
        return f"{self.type} {self.taken.get_reference()}"


def parted(function: Any, uses: dict[int, int]) -> None:
    """Have a function get those members of its tuples only that it asks for, each by itself.

    ``uses``: how often a value is used, by its id.
    """
    packer = _WHOLE.get(function.name)
    if packer is None or function.name in _CALLING_THEMSELVES:
        return
    gone: set[int] = set()
    args: list[Any] = list(function.args[:2])
    for k, x in enumerate(function.args[2:]):
        leaves = list(_leaves(x, (), uses, gone))
        packer.paths[k] = tuple(path for path, _ in leaves)
        args += [y if y is x else _Leaf(y) for _, y in leaves]
    entry = function.blocks[0]
    entry.instructions[:] = [x for x in entry.instructions if id(x) not in gone]
    function.args = tuple(args)
    packer.argument_types = tuple(x.type for x in args[2:])
    function.ftype = type(function.ftype)(function.ftype.return_type, [x.type for x in args])


def _leaves(x: Any, path: tuple[int, ...], uses: dict[int, int], gone: set[int]) -> Any:
    """What is used of a value, by the ways there; what takes it out in the function is to go."""
    count = uses.get(id(x), 0)
    parts = {k: y for k, y in getattr(x, "taken", {}).items() if uses.get(id(y))}
    if path and count:
        gone.add(id(x))
    if parts and count == len(parts):
        for k in sorted(parts):
            yield from _leaves(parts[k], (*path, k), uses, gone)
    elif count:
        yield path, x
