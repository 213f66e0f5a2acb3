"""Force elements: one file each. A new force is a new file here and one line in ``equations/dispatch.py``."""

import importlib
import pkgutil

from ..model.force import Force

for _module in pkgutil.iter_modules(__path__):
    importlib.import_module(f"{__name__}.{_module.name}")

ALL = [c for c in Force.registry.values() if issubclass(c, Force) and c.__module__.startswith(f"{__name__}.")]
"""Every force element that a file of this folder defines; all are public."""

globals().update({c.__name__: c for c in ALL})
