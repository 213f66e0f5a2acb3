"""Numerical methods without mechanics: sparse factors, ranks, eigenvalues, graphs.

`sparse_factorisation` has LDL^T and LU in patterns that are found once, `graphs` elimination orders (minimum degree;
nested dissection where that is less work, as for nets) and connected sets, `rank` and `sparse_rank` decide ranks,
`eigen` finds few eigenvalues. `integrators`, `event_location` and `complementarity` are packages of their own.

Imports NumPy, `compiler`, `math` and `errors` only; SciPy inside functions. What a method evaluates is passed in, by
address or as a callback; nothing here knows bodies or joints.
"""
