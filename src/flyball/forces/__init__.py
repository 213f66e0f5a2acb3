"""Force elements: one file each. A new force is a new file here and one line in ``system/dispatch.py``."""

import importlib
import pkgutil

from ..model.force import Force

for _module in pkgutil.iter_modules(__path__):
    importlib.import_module(f"{__name__}.{_module.name}")

# every force class that a file of this folder defines is public
globals().update({k: v for k, v in Force.registry.items() if v.__module__.startswith(f"{__name__}.")})
