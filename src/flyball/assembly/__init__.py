"""Assembly: positions that close all loops and velocities that satisfy all constraints, near those described.

`assemble` is the entry point; it adds an explanation where no velocities exist. `assembled_state` finds the state,
`positions_and_velocities` contains the numerical methods. This package imports the model, tables, engine and numerics;
of the analyses only `mobility`, which names free motions in an explanation. Simulation, statics and the other analyses
start from an `Assembly`.
"""
