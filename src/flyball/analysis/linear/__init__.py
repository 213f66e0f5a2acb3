"""Exact derivatives of the equations, and what linear analyses, statics and sensitivities make of them."""
