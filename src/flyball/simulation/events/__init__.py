"""Event-driven simulation: from event to event, with jumps of velocities and selection of modes at each instant.

`event_loop` integrates to the next event; `resolution` makes an instant consistent (actions, impacts, modes);
`mode_selection` decides which stops, ropes, locks and friction rows hold; `nonsmooth_laws` treats corners of laws.
"""
