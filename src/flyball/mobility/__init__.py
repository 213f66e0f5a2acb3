"""Mobility: free motions, redundant constraints and their remedies.

`mobility` counts and names freedoms and redundant sets and explains contradictory constraints, `remedies` searches for
joints that remove a redundancy, `null_spaces` computes the scaled constraint Jacobian and its null spaces. Imports the
model, tables, engine, numerics and the assembled state. A joint class becomes a possible replacement by its class
attributes (`replaceable`, `stand_in`).
"""
