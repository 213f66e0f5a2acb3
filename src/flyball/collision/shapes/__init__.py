"""Collision shapes: support function, faces and rounding radius of every kind, one file a kind: see `registry`.

A kind with ``support`` touches every other convex kind at the nearest points, with ``face`` at up to four points; with
``radius`` it is rounded. Its number and parameters stand in `collision.shape_kinds`.
"""
