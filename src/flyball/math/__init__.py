"""Scalars, vectors, rotations and splines as formulas on any kind of number.

The same source runs on floats, complex numbers that carry a step, arrays over time, and expressions. `scalar` has
functions that preserve a complex step where ``abs``, ``max`` or ``arctan2`` lose it; products, roots and quotients of
such numbers are of first order. `vec` sums in a fixed order, since the rounding of BLAS depends on the processor.
Decisions use the real part only. Imports NumPy and `compiler` only.
"""
