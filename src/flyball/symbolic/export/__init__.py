"""Equations written as code: functions of a mechanism in C, Python, CasADi or Numba.

`functions` defines what can be exported, with arguments and results; `solution` writes the regularised solve as code
with a fixed number of refinements; `Mechanism.export` returns a `code.Code`. A new language is a printer in
`expression_graph.printers`, an entry of `code.LANGUAGES` and of `code.CALLING_CONVENTIONS`, and its branches there. The
docstring of `Mechanism.export`, ``docs/export.md`` and the refusal in ``tests/symbolic/test_export.py`` list the
languages by hand; no test finds a language without a sample.
"""
