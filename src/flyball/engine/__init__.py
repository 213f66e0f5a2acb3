"""The equations of motion: compiled mechanics over the tables of a mechanism.

Formulas (`@formula`) loop over the tables of `tables/table_definitions.py`: `System` holds the numbers of a mechanism, `Work`
what is computed at a state. The same source runs on floats, complex numbers and expressions. Kernels (`@kernel`)
are the compiled entry points made of them; `entry_point` holds the main one.

Imports NumPy, `compiler`, `math`, `laws`, `numerics`, `tables` and the formulas of elements; nothing that
simulates, analyses or reports. A new kind of element needs no change here: `element_dispatch` lists kinds from the
registries.
"""
