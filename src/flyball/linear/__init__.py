"""Linear equations of motion: operating point, linear models, modes, root loci.

Users call `linearize`, `modes` and `root_locus`. A linearisation uses an `operating_point`, and derivatives and reduced
equations from `derivatives`; the state is (q, v, z) with the controller states z. `sampling_cycle` makes
difference equations of them. `descriptor` keeps the constraints: it is sparse, in absolute coordinates, for large
mechanisms at rest. Eigenvalues of a root locus are matched from value to value. Stability changes are zeros of
functions that are smooth where eigenvalues are not.

Imports the model, tables, engine, numerics, results, `assembly`, `mobility`, `derivatives`, `statics` and the initial
state of `simulation`; SciPy only within functions. A new analysis of small motions is one module that calls
`linearize.equations_without_inputs` and returns a class of `results`.
"""
