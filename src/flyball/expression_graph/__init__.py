"""Expressions as a kind of number: one graph in which equal expressions are one node.

`graph` defines the nodes and computes values and derivatives, `tracing` runs the engine's formulas on
expressions, `simplification` finds short forms, `printers` write languages. The formulas of elements run on nodes as on
floats. Imports `math`, `laws`, `tables` and the engine; a new printer is one file in `printers`.

Nodes are hashed and numbered in an order of evaluation; only numbers, zeros, ones, signs and equal terms are folded. A
parameter's symbol has a value on which formulas may branch. Moving expressions have none, and a formula that branches
on one raises `UndeterminedDecision`: use `math.scalar.choose`.
"""
