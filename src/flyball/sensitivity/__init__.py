"""Sensitivity: exact derivatives by parameters, and optimisation with these derivatives.

Derivatives come from complex steps through the formulas, along the changes given by the linearised equations:
`parameter_derivatives` of a state, `sensitivity` of modes, `variational_equations` of a motion. The latter
are integrated with the motion, with one complex residual and one solve per stage and parameter. Imports `linear`,
`statics`, `assembly`, `derivatives` and `simulation`. A new analysis to differentiate is an entry of
`sensitivity.ANALYSES`.
"""
