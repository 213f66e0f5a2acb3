"""Constraint rows: the scalar equations that joints are made of, one kind a file, found by `registry`.

A row is a unit wrench: ``row(par, F, M, hint, data)`` takes the kinematic records of two frames and returns the value,
the force on M, the torques on M and on F, and the acceleration bias; the reverse of the force acts on F. The engine
derives the Jacobian, reactions and acceleration terms from it in any coordinates. ``par`` are eight numbers: parameter
6 is to be subtracted from the value, parameter 7 is a factor that the engine applies. ``hint`` is a recent value from
which an angle counts its turns or the place on a curve is searched, ``data`` are the joint's ``curves``; other rows
ignore both. Bias accelerations of the records
vanish in absolute coordinates and not in joint coordinates: test a row in both.

`blocks` groups rows (`Row`) for joints, after Hahn's building blocks BB1 to BB5. `switches` are the kinds of rows that
are active at times. Imports NumPy, `compiler`, `math` and `numerics` only. A new kind is a file with ``KIND``, the next
number (`registry.BY_ADDRESS` before the file is there), and ``row``, a `formula`; `registry` lists what else it may
declare. A joint uses it as a `Row` of `blocks`. All compiled mechanics is then compiled again.
"""
