"""A mechanism's equations as a document: what stands in it, and how it is written as text, LaTeX and web page.

`contents` says what stands where, as traced; `document` simplifies and names what recurs; `parts` are sections,
formulas and tables; `writers` make text and LaTeX, `view.equations_page` the page.
"""
