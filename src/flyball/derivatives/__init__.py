"""Derivatives of the equations of motion at a state, their reduction to independent coordinates, and eigenvalues.

Statics, linear models, sensitivities and implicit integration use this package. It imports the engine, tables,
assembly, mobility and results. Derivatives are taken by complex steps through the compiled formulas, so a new element
type needs no code here.
"""
