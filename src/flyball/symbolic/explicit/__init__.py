"""From equations with constraints to explicit ones: dependent coordinates solved for, state space.

`coordinate_partitioning` chooses independent coordinates by numbers at the start, `closed_form_loops` solves
kinematic loops in closed form, `definitions` holds formulas or the equations for Newton's method, `reduction`
eliminates constraints and multipliers. `explicit_equations.ExplicitEquations` and `state_space.StateEquations` are
what users get. Closed forms are recognised by the form of the equations, tested by values at random points
(`zero_test`), never by a mechanism's name; `linear_systems` uses Cramer's rule up to three unknowns, else
orthogonalisation without pivots. A new closed form is a rule in `closed_form_loops`.
"""

from __future__ import annotations
