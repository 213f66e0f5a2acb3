"""Equations of motion as expressions: displayed, solved, linearised, written as code.

`graph` and `evaluation` are the expression graph, `simplification/` and `printers/` work on any expression.
`named_equations` traces the engine's equations in the mechanism's own names; `equations.Equations` is what
`Mechanism.symbolic` returns. `explicit/` eliminates constraints, `linear/` linearises, `document/` writes all
equations as text, LaTeX or HTML, `export/` as code. Imports the model, the tables, the engine and the analyses.
"""

from __future__ import annotations
