"""Time stepping by impulses, for mechanisms with contact: all contacts and joints of a step in one cone problem.

`impulse_motion` is the motion from the model to its result; `setup` makes the scene and the tables; `stepper`
calls the compiled loop (`step_loop`). The formulas: `free_bodies`, `contact_constraints`, `compliant_contact`,
`restitution`, and of the jointed mechanism `mechanism_step`, `mechanism_rows`, `implicit_springs`. Cone solvers
are in `numerics/complementarity/`, contact search is in `collision/`.

Contacts that go on act along rows at the middle of the step and do no work; new ones along those of the start. Overlap
and gaps are removed by displacements that are no velocities. Restitution is over before the step begins, in rounds of
what touches. The mechanism is evaluated half a step on, at mean velocities, which makes it of second order; stiff
springs join the masses by an operator of low rank. A step is taken as a whole or has changed nothing: a full table is
enlarged and the step repeated.
"""

from __future__ import annotations
