"""Implicit integrators (radau, generalised-alpha, variational): sparsity of Jacobians and workspaces.

The step methods themselves are in `engine/` and `numerics/integrators/`.

Radau solves the stabilised index-2 form (Gear, Gupta and Leimkuhler 1985): on the N-four-bar index 3 fails at every
step size, index 2 at the fourth singular position. Jacobians are complex steps of each body's, force's and row's part,
which shares columns where nothing depends on both (`jacobian_pattern`). Absolute coordinates serve long chains, joint
coordinates the rest. A new method is a step in `numerics/integrators/`, a kernel as in `engine.fixed_step_methods`, and
a class in `integrators`.
"""
