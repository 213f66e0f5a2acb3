"""Derivatives of the equations of motion at a state, their reduction to independent coordinates, and eigenvalues.

Statics, linear models, sensitivities and implicit integration use this package. It imports the engine, tables,
assembly, mobility and results. Derivatives are taken by complex steps through the compiled formulas, so a new element
type needs no code here.

Velocities that no equation sees together share a complex step: a dozen evaluations serve a thousand bodies. Reduced
equations are the identity in coordinates chosen by pivoting, so that states have names; coefficients that are rounding
are set to 0. With joint friction dr/dlam is -G^T and a part of its own, and multipliers drop out along other
directions than the free motions. Places with another slope on the other side (`nonsmooth_points`) are refused by
linear analyses; equilibria are judged on every side.
"""
