"""Statics: equilibria from a guess, over a parameter, with contact or controllers; their stability.

Users call `equilibrium` and `equilibrium_series`. `stability` defines the state at rest and judges its stability;
`equilibrium_search` contains Newton's method and the search along the forces. With contact, `contact_equilibrium` lets
the mechanism settle, `closed_contacts` finds the contact forces that carry it, and `replacement_joints` turns closed
contacts and active stops into joints.

Imports the model, tables, engine, numerics, results, `assembly`, `derivatives` and `simulation` with its impulse
stepping; `linear` and SciPy only within functions. A new kind of switch defines its constraint at rest in
`replacement_joints`.
"""
