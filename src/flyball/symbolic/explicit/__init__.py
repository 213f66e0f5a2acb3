"""Explicit equations from equations with constraints: solution for dependent coordinates, state space.

`coordinate_partitioning` chooses independent coordinates by values at the initial position and eliminates constraints
and multipliers, `closed_form_loops` solves kinematic loops in closed form, `definitions` holds formulas or the
equations for Newton's method. Users get `ExplicitEquations` and `StateEquations` of `explicit_equations`. Closed forms
are recognised by the form of the equations and tested by values at random points, never by a mechanism's name.
`linear_systems` uses Cramer's rule up to three unknowns, else orthogonalisation without pivoting; with pivots chosen
by value it serves linear equations. A new closed form is a rule in `closed_form_loops`.
"""

from __future__ import annotations
