"""Kinematics of driven mechanisms, inverse dynamics, and the equations of motion as functions of plain arrays.

`driven_motion` follows the drivers, `inverse_dynamics` finds the efforts of drivers and the reactions for a given
motion, `prepared` evaluates mass matrix, forces, Jacobians and accelerations at any state. Imports assembly,
mobility and the loop over time of `simulation`.
"""
