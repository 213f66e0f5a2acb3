"""Equations written as code: functions of a mechanism in C, Python, CasADi or Numba.

`functions` says what can be exported, each with arguments and results; `solution` writes the regularised solve out,
with as many refinements as declared; `code` is what `Mechanism.export` returns. A new language is a printer in
`expression_graph.printers`, an entry of `code.LANGUAGES` and its branches there.
"""
