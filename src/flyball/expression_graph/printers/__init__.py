"""Printers of expressions, one language a file.

Text, LaTeX and MathML share `formula_layout` (signs, fractions, powers, names, line breaks); code printers share
`routines` (functions to print, identifiers, tables, statements). A new language is a new file here, and for code a new
entry of `symbolic.export`. Imports `expression_graph.graph` and
`expression_graph.simplification`.
"""
