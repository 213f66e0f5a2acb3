"""Singular positions of driven mechanisms: lock-ups, bifurcations and self-motions.

`continuation` releases the driver, follows the curve and locates singular points, `classification`
finds the branches through a point and its kind. Users call `singularities`. Imports the model, tables, engine, assembly
and results; SciPy only within functions.
"""
