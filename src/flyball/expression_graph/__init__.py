"""Expressions as a kind of number: one graph in which equal expressions are one node.

`graph` holds nodes and derivatives, `evaluation` computes values, `tracing` runs the engine's formulas on expressions,
`simplification` finds short forms, `printers` writes languages. The formulas of elements run on nodes as they run on
floats. Imports `math`, `laws`, `tables` and the engine; a new printer is one file in `printers`.
"""
