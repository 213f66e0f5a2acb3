"""Printers of expressions, a language a file; text, LaTeX and MathML share a layout of signs, fractions and powers."""
