"""Narrow phase: contacts of one pair of shapes. No data are kept from step to step.

`dispatch` selects the formula of a pair: one of `special_pairs`, otherwise the generic algorithm of `distance` (GJK,
EPA), followed by clipping of the facing faces in `manifold`. The search calls the narrow phase by
address, so that a change of a pair does not recompile the search, and spheres alone never compile it.
"""
