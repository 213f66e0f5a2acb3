"""A mechanism's equations as a document: its contents, and its output as text, LaTeX and web page.

`contents` builds the sections from the traced equations; `document` simplifies and names common subexpressions;
`parts` defines sections, formulas and tables; `writers` write text and LaTeX, `view.equations_page` the web page.
"""
