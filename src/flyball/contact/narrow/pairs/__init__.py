"""Pairs of shapes that have a way of their own, faster or fuller than the one for any two: see ``registry``."""
