"""Impulses in cones: complementarity problems of contact with friction, and what solves them, one file each.

Nothing here knows of bodies: there is an operator from impulses to velocities (`problem.py`).
"""
