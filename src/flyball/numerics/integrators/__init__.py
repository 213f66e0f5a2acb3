"""Integrators: tableaux as data, one loop."""
