"""Robots described in the formats of other programs: `urdf` reads URDF.

Imports the model and the elements that a robot is made of; nothing else of flyball imports it but `flyball.load`.
"""
