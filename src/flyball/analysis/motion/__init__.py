"""Pieces of ``dynamics``: the start, the choices, the coordinates, and what comes out."""
