"""Shapes: one file each. A new shape is a new file here; model files, pictures and inertias know it at once."""

import importlib
import pkgutil
from typing import TYPE_CHECKING

from .solid import Solid

for _module in pkgutil.iter_modules(__path__):
    importlib.import_module(f"{__name__}.{_module.name}")

ALL = [c for c in Solid.registry.values() if issubclass(c, Solid) and c.__module__.startswith(f"{__name__}.")]
ALL.remove(Solid)
"""Every shape that a file of this folder defines; all are public."""

globals().update({c.__name__: c for c in ALL})

if TYPE_CHECKING:

    def __getattr__(name: str) -> type[Solid]: ...
