"""Simulation of motion in time: `simulate` and the modules that it uses.

`method_choice` selects an integrator or impulse time stepping, `initial_state` finds consistent initial values and the
coordinates, `simulate` runs the compiled loop, `events/` resolves events (impacts, stops, friction, actions),
`implicit_integrators` prepares implicit integrators, `impulse_stepping/` contains impulse time stepping,
`motion_result` builds the result and its health report, and `diagnosis` explains why an integration failed.

This package may import `model/`, `tables/`, `engine/`, `numerics/`, `collision/`, `codegen/`, `assembly/`,
`mobility/` and `results/`. A new explicit integrator is an entry of `butcher_tableaux.TABLEAUX`, a new implicit one a
step method in `numerics/integrators/` with its name in `method_choice`; the docstrings of `Mechanism.simulate` and
`Mechanism.study` and ``docs/methods.md`` list the methods by hand. A new kind of event guard is handled in `events/`.
"""
