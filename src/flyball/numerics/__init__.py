"""Numerical methods without mechanics: sparse factors, ranks, eigenvalues, graphs.

`sparse_factorisation` provides LDL^T and LU with patterns that are computed once, `graphs` elimination orders (minimum
degree; nested dissection where that is less work, as for nets) and connected components. `rank` determines
ranks and null spaces, `eigen` computes a few eigenvalues, `thread_team` shares compiled loops among threads.
`integrators`, `event_location` and `complementarity` are subpackages.

Imports NumPy, `compiler`, `math` and `errors` only; SciPy inside functions. The functions that a method evaluates are
passed by address or as callbacks, so these modules use no bodies or joints.
"""
