"""Equations of motion: compiled mechanics over the tables of a mechanism.

Formulas (`@formula`) loop over the tables of `tables/table_definitions.py`: `System` holds the numbers of a mechanism,
`Work` holds the quantities computed at a state. The same source runs on floats, complex numbers and expressions.
Kernels (`@kernel`) are the compiled entry points that call formulas; `entry_point` holds the main one.

This package imports NumPy, `compiler`, `math`, `laws`, `numerics`, `tables` and the formulas of elements. It imports
nothing that simulates, analyses or reports. A new kind of element needs no change here: `element_dispatch` lists the
kinds from the registries.

One kernel holds the right-hand side, since a second copy takes as long to compile; other loops call it by address,
which costs nothing measurable. Loops are few for the same reason: frequent kinds of rows have their own, rare ones
share one. Implicit methods take the residual at given accelerations (`residual`): nothing is solved in it, so complex
steps are exact. A new kind of tree joint is a branch in each function of `kinematics` that distinguishes kinds.
"""
