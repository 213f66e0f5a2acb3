"""Vectors, rotations and scalar functions on any kind of number."""
