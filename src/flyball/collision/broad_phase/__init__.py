"""Broad phase: which pairs of shapes may touch.

Every bounded shape has an envelope that it stays in for a while (`envelopes`); envelopes stand in a hashed grid
(`cell_grid`), and pairs whose envelopes overlap are listed (`pair_list`). All arrays are in `workspace`.
"""
