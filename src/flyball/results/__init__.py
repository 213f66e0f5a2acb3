"""Motions read by name, with energies and a health report."""
