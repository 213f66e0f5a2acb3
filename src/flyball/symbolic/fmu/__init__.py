"""Functional mock-up units (FMI 2.0 and 3.0) from the equations in C; no Python inside.

`archive` writes the description and the connecting code, compiles everything, and packs the unit. The C files of this
folder are the same for all mechanisms: `core.c` projects onto the constraints and integrates, `fmi2.c` and `fmi3.c`
are the interfaces of the standard. It imports `export`, which calls it for the languages ``fmu2`` and ``fmu``.
"""
