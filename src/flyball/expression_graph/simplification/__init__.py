"""Simplification of expressions: from nodes to shorter nodes of the same graph.

An expression is expanded into a sum of terms (`terms`, `simplify`), in which products of sines and cosines become
sines and cosines of sums of angles, so that equal expressions of a chain of joints become equal terms and cancel.
Then sums of angles are contracted again where that is shorter (`angles`) and common factors are extracted
(`factors`). The shorter of this result and of the original operation on simplified arguments is taken
(`simplify`). `arctangents` replaces sines and cosines of arctangents by algebraic expressions,
`common_subexpressions` introduces symbols for what recurs. Imports `symbolic.graph` and `symbolic.evaluation`
only.
"""
