"""Broad phase: which pairs of shapes may touch.

Every bounded shape has an envelope, a capsule with a skin of a tenth of its radius, that holds it for up to eight
steps (`envelopes`). Envelopes stand in a hashed grid with levels by size (`cell_grid`); shapes that meet the same
groups have levels of their own. Pairs whose envelopes overlap are listed (`pair_list`); only pairs of shapes that
leave their envelope are searched again, in a pile that settles 3 % a step. All arrays are in `workspace`; a full one
is reported, enlarged, and the search repeated. Integers have 64 bits everywhere: mixtures compile every formula twice.
"""
