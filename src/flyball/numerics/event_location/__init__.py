"""Location of events within a step: where a guard function passes zero, and steps that end there.

`guards` holds the guard state and guard values within a step, `root_finding` the search for sign changes and
their refinement, `event_steps` the steps that end on the first event. A guard is a number that depends on time
and state; its meaning (a stop, friction, a nonsmooth point of a law) does not matter here. The time loop
(`integrators/time_loop`) receives `event_steps.start_event_segment` and `event_steps.finish_step_with_events`
as callbacks.

Imports: NumPy, `compiler/`, `math/`, `errors`, `integrators/time_loop`.

A step is searched in subintervals with eight nodes and two check places, which are halved if they are not resolved. An
event is then located with the equations, and the step is repeated to end on it; the event time is as accurate as the
integration. A guard changes its side only beyond its rounding floor, so no event triggers twice.
"""
