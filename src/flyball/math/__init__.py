"""Scalars, vectors, rotations and splines as formulas on any kind of number.

The same source runs on floats, complex numbers that carry a step, arrays over time, and expressions. `scalar` has
functions that keep a complex step where ``abs``, ``max`` or ``arctan2`` lose it; products, roots and quotients of
such numbers are of first order. `vec` sums in a fixed order, since BLAS rounds as the processor has it. Nothing
decides by more than the real part. Imports NumPy and `compiler` only.
"""
