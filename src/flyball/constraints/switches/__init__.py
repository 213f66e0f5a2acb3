"""Switches: constraint rows that are active at times, such as stops, friction and locks. One kind a file.

`switch_kind.SwitchKind` is the contract. A kind declares the event functions that end its modes, the
forces that its row can carry, the rows that take part when velocities jump and when modes are decided, what it does at
a transition, and the words for it. The event machinery asks this contract only. An element refers to a kind in its
`model.force.Switch`; a new kind is an instance of one of these classes, or a class of its own, in the element's file
(pattern: ``forces/shear_pin.py``).
"""
