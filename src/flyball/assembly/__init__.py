"""Assembly: positions that close all loops and velocities that fulfil all constraints, near those described.

`assemble` is the entry; it adds an explanation where no velocities exist. `assembled_state` finds the state,
`positions_and_velocities` holds the numerical methods. Imports the model, tables, engine and numerics; of the
questions only `mobility`, which names what is free in an explanation. Motion, statics and the other analyses
begin with an `Assembly`.

Velocities are least squares with equality constraints, in three ranks: rows, drivers and initial rates; those given for
bodies, by kinetic energy; the least kinetic energy of the rest. Joints given by frames start from rotation-vector
residuals, which lead from anywhere to the parallel and never to the antiparallel position. What the start does not
keep of the description is data (``Assembly.departures``).
"""
