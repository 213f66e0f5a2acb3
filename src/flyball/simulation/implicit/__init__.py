"""Implicit integrators (radau, generalised-alpha, variational): sparsity of Jacobians, and workspaces.

The step methods themselves are in `engine/` and `numerics/integrators/`.
"""
