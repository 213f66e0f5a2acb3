"""Pieces of ``mobility``: free motions, dependent constraints, cures, which reactions are determined."""
