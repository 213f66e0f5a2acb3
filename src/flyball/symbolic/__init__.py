"""Equations of motion as expressions: displayed, solved, linearised, written as code.

`Mechanism.symbolic` returns `equations.Equations`. `named_equations` chooses coordinates and names the
engine's equations, traced by `expression_graph.tracing`, after the parts of the mechanism; `lagrange` derives them
from the energies, for comparison. `explicit/` eliminates constraints, `linear/` linearises, `equations_document`
writes all equations as text, LaTeX or HTML, `export` as code. The equations are those of the engine, not derived a
second time. No matrix is inverted symbolically: a solution is straight-line code.
`tests/symbolic/test_engine_agreement.py` compares with the compiled loops.

Imports `expression_graph`, the model, tables, engine, results and the analyses; `view` inside functions.
"""

from __future__ import annotations
