"""Simplification of expressions: from nodes to shorter nodes of the same graph.

An expression is expanded into a sum of terms (`terms`, `simplify`), in which products of sines and cosines become
sines and cosines of sums of angles, so that equal expressions of a chain of joints become equal terms and cancel.
Then sums of angles are contracted again where that is shorter (`terms`), multiples of |e|^2 - 1 of quaternions are
added, and common factors are extracted (`factors`). The shortest form by `reading_cost` is taken, that of simplified
arguments among them (`simplify`). The work is counted: long sums stay as they are. `arctangents` replaces sines and
cosines of arctangents by algebraic expressions, `common_subexpressions` introduces symbols for what recurs.

Results are for reading: they can be evaluated, and tests do, but no numbers are made of them. Imports
`expression_graph` only.
"""
