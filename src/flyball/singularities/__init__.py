"""Singular positions of driven mechanisms: lock-ups, bifurcations and self-motions.

`closure_equations` releases the driver, `continuation` follows the curve and locates singular points,
`classification` finds the branches through one and says what kind it is, `singularities` is what a user asks. May
import the model, tables, engine, assembly and results; SciPy only within functions.
"""
