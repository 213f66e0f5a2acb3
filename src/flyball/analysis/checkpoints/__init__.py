"""Motions that are kept in a file on the way, and go on from it."""
