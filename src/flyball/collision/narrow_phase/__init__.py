"""Narrow phase: contacts of one pair of shapes. Nothing here is kept from step to step.

`dispatch` chooses the formula of a pair: one of `special_pairs`, else the generic way of `distance` (GJK in
`gjk`, EPA in `epa`), followed by clipping of the facing faces in `manifold`. The search calls it by address, so that
an edit of a pair leaves the search compiled, and a pile of spheres never compiles it.
"""
