"""What analyses return: motions read by name, energies, reactions, events, health, linear models, studies.

Results hold arrays and the model they belong to; they compute derived quantities when first asked for. They may
import model, tables, engine, laws, math and numerics, but no analysis; figures and pages (view) are imported
inside functions. ``results/part_views`` holds what a result says of one part: one view class per kind of element.
A new result class has ``lines()``, ``as_dict()`` and, where there is something to draw, ``plot()``.

Quantities are computed by the elements' formulas on arrays over time, so that no second implementation can differ.
Between events results keep modes, directions and tables of each phase (`events`). `diagnostics` judges a motion by its
energy, accelerations and turning; every figure is relative to the terms that cancel in it.
"""
