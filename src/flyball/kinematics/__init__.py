"""Kinematics of driven mechanisms, inverse dynamics, and the equations of motion as functions of plain arrays.

`driven_motion` follows the drivers, `inverse_dynamics` computes driver efforts and reactions for a given motion,
`prepared` evaluates mass matrix, forces, Jacobians and accelerations at any state. Imports assembly, mobility and the
time loop of `simulation`.
"""
