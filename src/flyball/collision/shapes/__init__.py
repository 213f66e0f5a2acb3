"""Collision shapes: support function, faces and rounding radius of every kind, one file per kind; see `registry`.

A kind with ``support`` has contacts with every other kind (convex shapes, planes, height fields) at the nearest points,
with ``face`` at up to four points; with ``radius`` it is rounded. Its number and parameters are in
`collision.shape_kinds`; `registry` describes the formulas. A shape of `model.shapes` refers to it by name:
``ConvexPart("CAPSULE", par, reach)`` in ``forms``.
Samples in tests: ``contact/solids.py`` (``SOLIDS``, ``SIZES``, ``farthest``, ``outside``; no test demands it), and the
support function of ``model/test_contact_forms.py``.
"""
