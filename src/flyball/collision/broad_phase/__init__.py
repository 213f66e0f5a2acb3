"""Broad phase: which pairs of shapes may touch.

Every bounded shape has an envelope, a capsule with a skin of a tenth of its radius, that contains it for up to eight
steps (`envelopes`). Envelopes are in a hashed grid with levels by size (`cell_grid`); shapes that collide with the same
groups have separate levels. Pairs whose envelopes overlap are listed (`pair_list`). Only pairs of shapes that leave
their envelope are searched again, 3 % per step in a settling pile. All arrays are in `workspace`; if one is full, this
is reported, the array is enlarged, and the search is repeated. All integers have 64 bits, because mixed widths would
compile every formula twice.
"""
