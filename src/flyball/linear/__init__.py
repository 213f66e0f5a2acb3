"""Linear equations of motion: exact derivatives, reduction to free coordinates, eigenvalues, modes, root loci.

A linearisation uses these modules in order: `operating_point` (the state), `equation_derivatives` (complex steps),
`reduced_equations` (elimination of the constraints), `eigenvalues`. Users call `linearize`, `modes` and `root_locus`.
`statics.controller_states` replaces controllers by auxiliary bodies, so that their states are velocities like any
other. `statics` and `sensitivity` use the same derivatives. This package may import the model, tables, engine,
numerics, results, assembly, mobility and the initial state of simulation; SciPy only within functions. A new analysis
of small motions is one module that calls `linearize.equations_without_inputs` and builds its own class of results.
"""
