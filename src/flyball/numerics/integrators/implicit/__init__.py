"""Implicit integrators of equations of motion with constraints: they know neither bodies nor joints."""
