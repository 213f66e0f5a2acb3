"""Linear equations of motion: exact derivatives, reduction to free coordinates, eigenvalues, modes, root loci.

A linearisation goes through these modules in order: `operating_point` (where), `equation_derivatives` (complex
steps), `reduced_equations` (constraints taken out), `eigenvalues`; `linearize`, `modes` and `root_locus` are what a
user asks. `controllers` replaces controllers by auxiliary bodies, so that their states are velocities like any
other. `statics` and `sensitivity` use the same derivatives. May import the model, tables, engine, numerics,
results, assembly, mobility and the initial state of simulation; SciPy only within functions. A new question about
small motions is one module that takes `linearize.equations_without_inputs` and makes a class of results of it.
"""
