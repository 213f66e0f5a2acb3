"""Statics: equilibria from a guess, over a parameter, with contact or controllers; their stability.

`equilibrium` and `equilibrium_series` are what a user asks. `stability` holds the state at rest and judges it,
`equilibrium_search` holds Newton's method and the search along the forces. With contact `contact_equilibrium`
settles the mechanism, `closed_contacts` finds which forces carry it, `replacement_joints` turns closed contacts and
active stops into joints. May import what `linear` may, and the impulse stepping of simulation; SciPy only within
functions.
"""
