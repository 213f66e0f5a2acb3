"""Equations of motion as expressions: displayed, solved, linearised, written as code.

`equations.Equations` is what `Mechanism.symbolic` returns. `derivation` chooses coordinates, `named_equations` has the
engine's equations, traced by `expression_graph.tracing`, in the mechanism's own names; `lagrange` derives them from
the energies, to compare. `explicit/` eliminates constraints, `linear/` linearises, `document/` writes all equations as
text, LaTeX or HTML, `export/` as code. Nothing is derived a second time and no matrix is inverted in symbols: a solve
is straight-line code. `tests/symbolic/test_engine_agreement.py` compares with the compiled loops.

Imports `expression_graph`, the model, tables, engine, results and the analyses; `view` inside functions.
"""

from __future__ import annotations
