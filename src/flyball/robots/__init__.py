"""Robots described in the formats of other programs: URDF (`urdf`, `urdf_writer`) and MJCF (`mjcf`, with
`mjcf_tendons`; `mjcf_writer`); `robot_file` has what they share.

Imports the model and the elements that a robot is made of; nothing else of flyball imports it but `flyball.load`.
"""
