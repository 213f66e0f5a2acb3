"""Motion in time: `simulate` and everything it needs.

`method_choice` decides between an integrator and impulse time stepping, `initial_state` finds consistent initial
values and the coordinates, `simulate` runs the compiled loop, `events/` handles what happens at an instant
(impacts, stops, friction, actions of events), `implicit/` prepares implicit integrators, `impulse_stepping/` is
time stepping by impulses, `motion_result` makes the result and its health, `diagnosis` says why a motion cannot go
on.

It may import `model/`, `tables/`, `engine/`, `numerics/`, `collision/`, `codegen/`, `assembly/`, `mobility/` and
`results/`. A new integrator is a tableau or a step method in `numerics/integrators/`, with its name in
`method_choice`; a new kind of event guard is handled in `events/`.
"""
