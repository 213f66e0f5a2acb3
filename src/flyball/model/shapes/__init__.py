"""Shapes: one file each. A new shape is a new file here and a line below for editors.

Model files, pictures and inertias know it at once.

A shape has fields, ``check``, ``volume``, ``centre``, ``gyration`` (per unit mass, about the mass centre), ``size`` and
``surface``; where it touches it is made of ``forms`` in space and ``outlines`` in the plane, of the kinds in
`collision.shape_kinds`. `tables.contact_tables` turns these into arrays.
"""

import importlib
import pkgutil
from typing import TYPE_CHECKING

from .solid import ConvexSolid, Solid, Surface

for _module in pkgutil.iter_modules(__path__):
    importlib.import_module(f"{__name__}.{_module.name}")

_ALL = [c for c in Solid.registry.values() if issubclass(c, Solid) and c.__module__.startswith(f"{__name__}.")]
SHAPES = [c for c in _ALL if c not in (Solid, ConvexSolid) and not issubclass(c, Surface)]
"""Every solid that a file of this folder defines; all are public."""
SURFACES = [c for c in _ALL if c is not Surface and issubclass(c, Surface)]
"""Every shape without an inside; all are public."""

globals().update({c.__name__: c for c in (*SHAPES, *SURFACES)})

if TYPE_CHECKING:  # for editors and type checkers; nothing is imported here
    from .box import Box as Box
    from .capsule import Capsule as Capsule
    from .cone import Cone as Cone
    from .cylinder import Cylinder as Cylinder
    from .ellipsoid import Ellipsoid as Ellipsoid
    from .height_field import HeightField as HeightField
    from .hemisphere import Hemisphere as Hemisphere
    from .hull import Hull as Hull
    from .link import Link as Link
    from .mesh import Mesh as Mesh
    from .plane import Plane as Plane
    from .prism import Prism as Prism
    from .rod import Rod as Rod
    from .sphere import Sphere as Sphere
    from .torus import Torus as Torus
    from .tube import Tube as Tube
