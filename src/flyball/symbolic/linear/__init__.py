"""Linear equations as expressions: state space, transfer functions, conditions of stability.

`operating_point` and `equilibrium` determine the state, `derivatives` differentiates the traced equations with constant
multipliers, `reduction` eliminates constraints by the functions that `linearize` uses (`derivatives/linear_reduction`).
`transfer_functions` keeps the constraints: determinants of a matrix of exact polynomials (`polynomials`) without
division. `stability` gives the Routh and Hurwitz conditions.
"""
