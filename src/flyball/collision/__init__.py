"""Collision detection: which shapes touch, and where. Geometry only, no mechanics.

Shapes in arrays (`Geometry`) and the poses and velocities of the bodies that carry them (`Movers`) go in;
contact points with normals and gaps (`Contacts`) come out. `ContactFinder` (`contact_finder`) is the Python
side, the kernel `search` (`contact_search`) the compiled one. `broad_phase` lists pairs of shapes that may
touch, `narrow_phase` finds the contacts of a pair, `shapes` holds one file for each kind of shape,
`convex_decomposition` prepares points and meshes.

Imports NumPy, `math`, `compiler` and `errors` only (SciPy inside functions, for convex hulls). A new shape is a
number in `shape_kinds` and a file in `shapes`; a pair with formulas of its own is a file in
`narrow_phase/special_pairs`.
"""
