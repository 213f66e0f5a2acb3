"""Event-driven simulation: integration from event to event, with velocity jumps and mode selection at each event.

`event_loop` integrates to the next event; `resolution` resolves an instant (actions, impacts, modes);
`mode_selection` decides which stops, ropes, locks and friction rows are active; `nonsmooth_laws` treats corners of
laws.
"""
