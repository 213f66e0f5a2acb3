"""The model turned into arrays: integers (structure) and floats (values). Nothing here is compiled.

`structure` decides everything that does not depend on parameter values; `element_numbers` evaluates the fields
of elements in SI units; `values` fills the tables (`System`), and refills only the rows that change. `forest`
and `coordinate_choice` decide which joints become joint coordinates. `contact_tables`, `contact_surfaces` and
`contact_places` do the same for contact.

Knows `model`, the declarations of elements, and the engine's table definitions. A new kind of element gets a
step in `structure` and its parameters in `values`.
"""
