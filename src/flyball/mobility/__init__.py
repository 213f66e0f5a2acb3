"""Mobility: free motions, redundant constraints and their remedies, and why constraints contradict one another.

`mobility` counts and names freedoms and redundant sets, `remedies` searches for joints that remove a redundancy,
`null_spaces` has the scaled constraint Jacobian, its rank and null spaces, `contradictions` tells by rank conditions
why no velocities fulfil all rows. All work in absolute coordinates. Ranks of large mechanisms are found by pivots,
doubtful ones by singular values.

Imports the model, tables, engine, numerics, results and the assembled state. A kind of joint offers itself as a
replacement by its class attributes (``replaceable``, ``stand_in``, ``called``).
"""
