"""Impulse time stepping for mechanisms with contact: one cone problem per step for all contacts and joints.

`impulse_simulation` simulates a model and builds its result; `setup` creates contact scene and tables;
`impulse_stepper` calls the compiled loop (`step_loop`). The formulas are in `free_bodies`, `contact_constraints` and
`contact_laws`, and for the jointed mechanism in `mechanism_step` and `mechanism_rows`. Cone solvers are in
`numerics/complementarity/`, contact search is in `collision/`.
"""

from __future__ import annotations
