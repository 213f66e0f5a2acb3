"""Constraint rows: the scalar equations that joints are made of, one kind a file, found by `registry`.

A row is a unit wrench: ``row(par, F, M, hint, data)`` takes the kinematic records of two frames and returns the value,
the force on M, the torques on M and on F, and the acceleration bias; the reverse of the force acts on F. The engine
derives the Jacobian, reactions and acceleration terms from it in any coordinates. Bias accelerations of the records
vanish in absolute coordinates and not in joint coordinates: test a row in both.

`blocks` groups rows (`Row`) for joints, after Hahn's building blocks BB1 to BB5. `switches` are the kinds of
rows that are active at times. Imports NumPy, `compiler`, `math` and `numerics` only. A new kind is a file with
``KIND``, the next number, and ``row``; `registry` lists what else it may declare.
"""
