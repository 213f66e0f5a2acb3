"""Expressions written out, a printer a file: text, LaTeX and MathML from one layout of signs, fractions and powers; code."""
