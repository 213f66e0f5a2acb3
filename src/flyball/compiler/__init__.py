"""Formulas and kernels: what Numba compiles, how it is linked, and how the cache detects outdated code."""
