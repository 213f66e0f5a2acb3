"""Collision shapes: support function, faces and rounding radius of every kind, one file a kind: see `registry`."""
