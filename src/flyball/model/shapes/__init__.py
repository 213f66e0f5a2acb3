"""Shapes: one file each. A new shape is a new file here; model files, pictures and inertias know it at once."""

import importlib
import pkgutil
from typing import TYPE_CHECKING

from .solid import Solid

for _module in pkgutil.iter_modules(__path__):
    importlib.import_module(f"{__name__}.{_module.name}")

SHAPES = [c for c in Solid.registry.values() if issubclass(c, Solid) and c.__module__.startswith(f"{__name__}.")]
SHAPES.remove(Solid)
"""Every shape that a file of this folder defines; all are public."""

globals().update({c.__name__: c for c in SHAPES})

if TYPE_CHECKING:  # for editors and type checkers; nothing is imported here
    from .box import Box as Box
    from .capsule import Capsule as Capsule
    from .cone import Cone as Cone
    from .cylinder import Cylinder as Cylinder
    from .ellipsoid import Ellipsoid as Ellipsoid
    from .hemisphere import Hemisphere as Hemisphere
    from .link import Link as Link
    from .mesh import Mesh as Mesh
    from .prism import Prism as Prism
    from .rod import Rod as Rod
    from .sphere import Sphere as Sphere
    from .torus import Torus as Torus
    from .tube import Tube as Tube
