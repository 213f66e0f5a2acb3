"""Linear equations as expressions: state space, transfer functions, conditions of stability.

`operating_point` and `equilibrium` say about which state, `derivatives` differentiates the traced equations with
multipliers held, `reduction` takes constraints out. `transfer_functions` keeps them in: determinants of a matrix of
exact polynomials (`polynomials`) without a division. `stability` states Routh's and Hurwitz's conditions.
"""
