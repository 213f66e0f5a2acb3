"""Kinds of shapes that may touch, and their parameters (`PAR` of the shape table).

A convex shape is a *core* and a rounding radius: all points within that radius of its core. A sphere is a point
with a radius, a capsule a line segment with one. The core of each kind is defined in `shapes/`, one file per
kind.

====  ==========  =================================================================================================
kind  name        parameters, in the shape's axes
====  ==========  =================================================================================================
0     SPHERE      radius
1     PLANE       none: the half-space z <= 0; its normal is +z
2     BOX         three half edges
3     CAPSULE     radius, half length of the segment between its two centres, which lies along z
4     CYLINDER    radius, half length along z
5     CONE        radius, height: centre of the base at the origin, tip at +z
6     HULL        rounding radius; vertices and faces are in `Geometry.vertex` and `Geometry.face`
7     FIELD       a height field (`shapes/height_field.py`)
8     POLYGON     rounding radius; a convex polygon in z = 0, counter-clockwise about z; of two vertices: a segment
9     ELLIPSOID   three half axes
10    HEMISPHERE  radius; flat side in z = 0, dome towards +z
11    SOLID       user-defined: seven numbers for its support function, and a scale factor
====  ==========  =================================================================================================

In planar mechanisms circles are SPHERE, and polygons, segments and rectangles are POLYGON; the z axis of a
PLANE then lies in the plane of motion.
"""

from __future__ import annotations

SPHERE, PLANE, BOX, CAPSULE, CYLINDER, CONE, HULL, FIELD, POLYGON, ELLIPSOID, HEMISPHERE, SOLID = range(12)
"""Numbers of the kinds; a further kind takes the next one."""
KIND_NUMBERS = {name: value for name, value in globals().items() if name.isupper() and isinstance(value, int)}
"""Name of a kind -> its number."""
PLANAR = frozenset((SPHERE, PLANE, POLYGON))
"""Kinds of planar mechanisms."""
