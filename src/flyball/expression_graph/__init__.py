"""Expressions as a kind of number: one graph in which equal expressions are one node.

`graph` holds nodes and derivatives, `evaluation` computes values, `tracing` runs the engine's formulas on expressions,
`simplification` finds short forms, `printers` writes languages. The formulas of elements run on nodes as they run on
floats. Imports `math`, `laws`, `tables` and the engine; a new printer is one file in `printers`.

Nodes are hashed and numbered in an order of evaluation; only numbers, zeros, ones, signs and equal terms are folded. A
parameter's symbol has a value by which formulas may decide; what moves has none, and a formula that decides by it
raises `UndeterminedDecision`: use `math.scalar.choose`.
"""
