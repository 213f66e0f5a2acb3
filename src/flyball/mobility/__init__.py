"""Mobility: free motions, redundant constraints and their remedies, and the check of a description.

`mobility` counts and names freedoms and redundant sets, `remedies` searches for joints that remove a redundancy,
`null_spaces` has the scaled constraint Jacobian and its null spaces, `check` looks over a description as a whole.
Imports the model, tables, engine, numerics and the assembled state. A kind of joint offers itself as a
replacement by its class attributes (`replaceable`, `stand_in`).
"""
