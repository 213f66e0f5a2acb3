"""Kinematics of driven mechanisms, inverse dynamics, and the equations of motion as functions of plain arrays.

`driven_motion` follows the drivers, `inverse_dynamics` finds the efforts of drivers and the reactions for a given
motion, `prepared` evaluates mass matrix, forces, Jacobians and accelerations at any state. Imports assembly,
mobility and `simulation.prescribed_motion`: positions are predicted by a cubic and corrected by Newton's method, steps
halved where a prediction misses by a hundredth. Forward motion of such mechanisms is computed in the same way.
"""
