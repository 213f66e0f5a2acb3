"""Tables of a model: integer arrays (structure) and float arrays (values). Nothing here is compiled.

`structure` decides everything that does not depend on parameter values; `element_numbers` evaluates the fields of
elements in SI units; `values` fills the tables (`System`), and refills only the rows that change. `forest` and
`coordinate_choice` decide which joints become joint coordinates. `contact_tables`, `contact_surfaces` and
`contact_places` do the same for contact.

This package uses `model` and the declarations of elements; `table_definitions` defines the tables. A new kind of
element gets a step in `structure` and its parameters in `values`.
"""
