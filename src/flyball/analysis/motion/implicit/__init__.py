"""Motions by implicit integrators."""
