"""Collision detection: which shapes touch, and where. Geometry only, no mechanics.

Shapes in arrays (`Geometry`) and the poses and velocities of the bodies that carry them (`Movers`) go in;
contact points with normals and gaps (`ContactTable`) come out. `ContactFinder` (`contact_finder`) is the Python
side, the kernel `search` (`contact_search`) the compiled one. `broad_phase` lists pairs of shapes that may
touch, `narrow_phase` finds the contacts of a pair, `shapes` holds one file for each kind of shape,
`convex_decomposition` prepares points and meshes.

Imports NumPy, `math`, `compiler` and `errors` only (SciPy inside functions, for convex hulls). A new shape is a
number in `shape_kinds` and a file in `shapes`; a pair with formulas of its own is a file in
`narrow_phase/special_pairs`. Two more places are optional: half edges of its bounding box in ``_HALF_EDGES`` of
`contact_finder` (otherwise those of its bounding sphere: more pairs are examined), and its curvature at a contact in
``_local_form`` of `statics.closed_contacts` (otherwise the stability of an equilibrium on it is not judged).
Everything with contact is compiled again.
"""
