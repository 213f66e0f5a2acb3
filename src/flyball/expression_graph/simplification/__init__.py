"""Simplification of expressions: from nodes to shorter nodes of the same graph.

An expression is expanded into a sum of terms (`terms`, `simplify`). Products of sines and cosines become sines and
cosines of sums of angles, so that equal expressions of a chain of joints become equal terms and cancel. Sums of angles
are then contracted where that is shorter (`terms`) and common factors are extracted (`factors`). `simplify` takes the
shorter of this result and of the original operation on simplified arguments. It also replaces sines and cosines
of arctangents by algebraic expressions and introduces symbols for common subexpressions.

Results are for reading; numerical code does not use them, but they can be evaluated (as the tests do). Imports
`expression_graph.graph` only.
"""
