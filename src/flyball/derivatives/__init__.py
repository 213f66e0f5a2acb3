"""Derivatives of the equations of motion at a state, their reduction to independent coordinates, and eigenvalues.

Statics, linear models, sensitivities and implicit integration use this package. The state is (q, v, z) with the
controller states z; `equation_derivatives` has their natural sizes, and the rounding of every equation. The package
imports the engine, tables, assembly, mobility and results. Derivatives are taken by complex steps through the compiled
formulas, so a new element type needs no code here.

Velocities that affect no common equation share a complex step: a dozen evaluations suffice for a thousand bodies.
Reduced equations use coordinates chosen by pivoting, so that states have names; coefficients within rounding are set to
0. With joint friction dr/dlam is -G^T + F, and the multipliers drop out along other directions than the free motions.
Linear analyses refuse points where a law has different slopes on two sides (`nonsmooth_points`); the stability of
equilibria is judged on every side.
"""
