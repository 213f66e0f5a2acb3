"""Pieces of ``simulate``: the start, the choices, the coordinates, and what comes out."""
