"""Linear equations as expressions: state space, transfer functions, conditions of stability.

`operating_point` determines the state and whether it is an equilibrium. `state_matrices` differentiates the traced
equations with constant multipliers and eliminates constraints by the functions that `linearize` uses
(`derivatives/linearized_equations`). `transfer_functions` keeps the constraints: determinants of a matrix of exact
polynomials (`polynomials`) without division. `stability_conditions` gives the Routh and Hurwitz conditions.
"""
