"""Sensitivity: exact derivatives by parameters, and optimisation with these derivatives.

Derivatives come from complex steps through the formulas, along the change that the linearised equations prescribe:
`parameter_derivatives` of a state, `eigenvalue_derivatives` of modes, `variational_equations` of a motion, integrated
with the motion at one complex residual and one solve a stage and parameter. Imports `linear`, `statics`, `assembly`,
`derivatives` and `simulation`. A new analysis to differentiate is an entry of `sensitivity.ANALYSES`.
"""
