"""Location of events within a step: where a guard function passes zero, and steps that end there.

`guards` holds the guard state and guard values within a step, `root_finding` the search for sign changes and
their refinement, `event_steps` the steps that end on the first event. A guard is a number that depends on time
and state; what it stands for (a stop, friction, a corner of a law) is unknown here. The time loop
(`integrators/time_loop`) receives `event_steps.start_event_segment` and `event_steps.finish_step_with_events`
as callbacks.

Imports: NumPy, `compiler/`, `math/`, `errors`, `integrators/time_loop`.
"""
