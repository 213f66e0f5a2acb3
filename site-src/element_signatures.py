"""Griffe extension: arguments of elements, whose ``__init__`` is made at import, and units of arguments as written."""

from __future__ import annotations

import importlib
import inspect
import re
from typing import Any

import griffe

TYPE_AND_UNIT = re.compile(r"^(\s*[\w*, ]+ : [^\n\[(]*) ([\[(])", flags=re.M)  # of a field: number [m], ndarray (n,)


class ElementSignatures(griffe.Extension):
    """Give every class with the decorator ``element`` the signature that Python sees."""

    def on_object(self, *, obj: griffe.Object, **_: Any) -> None:
        """Keep a unit from being read as a subscript, a shape as a call: a no-break space makes them plain text."""
        if obj.docstring:
            obj.docstring.value = TYPE_AND_UNIT.sub("\\1\u00a0\\2", obj.docstring.value)

    def on_class(self, *, cls: griffe.Class, **_: Any) -> None:
        """Read the signature of the imported class."""
        if not any(str(d.value).split("(")[0] == "element" for d in cls.decorators):
            return
        signature = inspect.signature(getattr(importlib.import_module(cls.module.path), cls.name))
        parameters = griffe.Parameters(griffe.Parameter("self", kind=griffe.ParameterKind.positional_or_keyword))
        for p in signature.parameters.values():
            default = None if p.default is p.empty else repr(p.default)
            kind = griffe.ParameterKind(p.kind.description)
            parameters.add(griffe.Parameter(p.name, kind=kind, default=default))
        cls.set_member("__init__", griffe.Function("__init__", parameters=parameters))
