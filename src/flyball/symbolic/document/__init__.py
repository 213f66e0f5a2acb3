"""A mechanism's equations as a document: what stands in it, and how it is written as text, LaTeX and web page."""
