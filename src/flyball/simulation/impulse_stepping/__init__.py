"""Time stepping by impulses, for mechanisms with contact: all contacts and joints of a step in one cone problem.

`impulse_motion` is the motion from the model to its result; `setup` makes the scene and the tables; `stepper`
calls the compiled loop (`step_loop`). The formulas: `free_bodies`, `contact_constraints`, `compliant_contact`,
`restitution`, and of the jointed mechanism `mechanism_step`, `mechanism_rows`, `implicit_springs`. Cone solvers
are in `numerics/complementarity/`, contact search is in `collision/`.
"""

from __future__ import annotations
