"""Linear equations of motion: operating point, linear models, modes, root loci.

`linearize`, `modes` and `root_locus` are what a user asks. A linearisation takes an `operating_point`, derivatives
and reduced equations from `derivatives`, and the copy of the model of `statics.controller_states` where controllers
have states. `descriptor` leaves the constraints in: for mechanisms with many velocities at rest, sparse, in absolute
coordinates. Eigenvalues on a root locus are matched from value to value; stability changes at zeros of functions that
are smooth where eigenvalues are not.

Imports the model, tables, engine, numerics, results, `assembly`, `mobility`, `derivatives`, `statics` and the initial
state of `simulation`; SciPy only within functions. A new question about small motions is one module that takes
`linearize.equations_without_inputs` and makes a class of `results` of it.
"""
