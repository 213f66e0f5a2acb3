"""What makes expressions short and readable: from nodes to nodes of the same graph.

An expression is multiplied out into a sum of terms (`terms.py`, `expand.py`), in which products of sines and cosines
are sines and cosines of sums of angles: so equal expressions of a chain of joints become equal terms, and cancel. Then
sums of angles are taken apart again where that is shorter (`angles.py`), common factors are pulled out (`factors.py`),
and of this and of the expression with its parts made short each by itself the shorter one is taken (`simplify.py`).
"""
