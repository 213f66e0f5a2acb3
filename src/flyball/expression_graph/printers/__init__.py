"""Printers of expressions, one language a file.

Text, LaTeX and MathML share `formula_layout` (signs, fractions, powers, names, line breaks); code printers share
`routines` (functions to print, identifiers, tables, statements). MathML is made from LaTeX, so that a formula is spelt
once. Code keeps the order and association of the graph and prints numbers that read back to the last bit: C, Numba and
`evaluation` agree bit for bit but for library functions. A new language is a new file here, and for code an entry of
`symbolic.export.code.LANGUAGES`. Imports `expression_graph` only.
"""
