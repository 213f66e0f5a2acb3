"""Sensitivity: exact derivatives by parameters, and optimisation with these derivatives.

Derivatives come from complex steps through the formulas along the change that the linearised equations prescribe.
Imports `linear`, `statics`, `assembly` and the loop over time of `simulation`.
"""
