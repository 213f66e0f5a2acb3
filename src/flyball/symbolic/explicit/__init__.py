"""From equations with constraints to explicit ones: dependent coordinates solved for, state space.

`coordinate_partitioning` chooses independent coordinates, `closed_form_loops` solves kinematic loops in closed
form, `definitions` holds formulas or the equations for Newton's method, `reduction` eliminates constraints and
multipliers. `explicit_equations.ExplicitEquations` and `state_space.StateEquations` are what users get.
"""

from __future__ import annotations
