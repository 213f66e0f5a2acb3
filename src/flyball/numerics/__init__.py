"""Solvers that know neither bodies nor joints."""
