"""Robots described in the formats of other programs: URDF (`urdf`, with `robot_file`; `urdf_writer`) and MJCF (`mjcf`,
with `mjcf_tendons`; `mjcf_writer`).

Imports the model and the elements that a robot is made of; nothing else of flyball imports it but `flyball.load`.
"""
