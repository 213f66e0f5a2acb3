"""Pieces of ``singularities``: the curve of positions, and what happens at its singular points."""
