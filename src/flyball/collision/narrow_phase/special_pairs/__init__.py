"""Pairs of kinds with contact formulas of their own, faster or more complete than the generic pair.

A new pair is a file with ``KINDS`` and ``collide``, found by `registry`, which says what these are: a closed form, or
a direction that is known without a search.
"""
