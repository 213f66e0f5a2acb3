"""Pieces of ``assemble``: closed positions, consistent velocities, and what is in the way of either."""
